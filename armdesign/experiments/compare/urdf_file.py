"""Read a URDF's kinematic tree and inertias; shapes and meshes are not looked at."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin

from armdesign._types import Array
from armdesign.errors import DesignError

TURNING = ("revolute", "continuous")
MOVING = (*TURNING, "prismatic", "planar", "floating")
KINDS = (*MOVING, "fixed")


@dataclass(frozen=True, eq=False)
class UrdfJoint:
    """A joint."""

    name: str
    kind: str  # one of KINDS
    parent: str  # name of the link it is on
    child: str  # name of the link it carries
    pose: pin.SE3  # its frame in the parent link's
    axis: Array  # unit vector in its frame, shape (3,)
    # lowest and highest angle [rad]; infinite for a continuous joint, None where a revolute one has none
    limits: tuple[float, float] | None
    speed: float | None  # its limit [rad/s]; None where the file has none, or 0
    mimics: str | None  # name of the joint it copies, or None

    @property
    def moves(self) -> bool:
        """Whether it is not fixed."""
        return self.kind in MOVING


@dataclass(frozen=True, eq=False)
class UrdfTree:
    """A robot."""

    source: str
    name: str  # the robot's name
    root: str  # name of the link that carries all others
    bodies: dict[str, pin.Inertia]  # inertia of every link in its own frame; of mass 0 where the file has none
    joints: dict[str, UrdfJoint]  # the joints by the link they carry

    def leaving(self, link: str) -> list[UrdfJoint]:
        """The joints on a link, in the file's order."""
        return [joint for joint in self.joints.values() if joint.parent == link]

    def path_to(self, link: str) -> list[UrdfJoint]:
        """The joints from the root to a link."""
        path: list[UrdfJoint] = []
        while link != self.root:
            path.append(self.joints[link])
            link = path[-1].parent
        return path[::-1]

    def pose_from(self, ancestor: str, link: str) -> pin.SE3:
        """A link's frame in that of a link on the way to it, every joint between them at 0."""
        pose = pin.SE3.Identity()
        while link != ancestor:
            pose = self.joints[link].pose * pose
            link = self.joints[link].parent
        return pose


def read_urdf(path: str | Path) -> UrdfTree:
    """Read a URDF.

    Args:
        path: The file. Meshes it names are not needed.

    Raises:
        DesignError: The file is missing, or not the URDF of a tree of links; the message says where.
    """
    source = str(path)
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise DesignError(f"cannot read the URDF {source}: {error.strerror}", value=source) from error
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise DesignError(f"the URDF {source} has a document type definition", fix="Remove it")
    try:
        root = ET.fromstring(data)
    except (ET.ParseError, ValueError, LookupError) as error:  # LookupError: an unknown encoding
        raise DesignError(f"the URDF {source} is not valid XML: {error}", value=source) from error
    if root.tag != "robot":
        raise DesignError(f"{source} is no URDF: its first element is <{root.tag}>", value=source, allowed="<robot>")
    if any("xacro" in str(element.tag) for element in root.iter()):
        fix = "Write it out first: xacro FILE.xacro > FILE.urdf"
        raise DesignError(f"{source} is a xacro file, not a URDF", value=source, fix=fix)
    bodies = {_text(link, "name", f"{source}: a link"): _body(link, source) for link in root.findall("link")}
    joints: dict[str, UrdfJoint] = {}
    for element in root.findall("joint"):
        joint = _joint(element, source)
        if joint.child in joints:
            raise DesignError(
                f"{source}: link '{joint.child}' hangs on two joints, '{joints[joint.child].name}' and '{joint.name}'",
                value=joint.child,
                allowed="arms without closed loops",
            )
        for link in (joint.parent, joint.child):
            if link not in bodies:
                raise DesignError(f"{source}: joint '{joint.name}' names a link '{link}' that is not there", value=link)
        joints[joint.child] = joint
    return UrdfTree(source, root.get("name") or Path(source).stem, _root(bodies, joints, source), bodies, joints)


def _root(bodies: dict[str, pin.Inertia], joints: dict[str, UrdfJoint], source: str) -> str:
    """The link that hangs on no joint and that all others hang on."""
    if not bodies:
        raise DesignError(f"{source} holds no links", value=source, allowed="a robot of links and joints")
    roots = [link for link in bodies if link not in joints]
    if not roots:
        raise DesignError(f"{source}: every link hangs on another", allowed="arms without closed loops")
    if len(roots) > 1:
        raise DesignError(
            f"{source}: the links {', '.join(repr(link) for link in roots[:4])} hang on no joint",
            value=roots,
            allowed="one root link",
        )
    for link in bodies:
        seen = {link}
        while link in joints:
            link = joints[link].parent  # noqa: PLW2901
            if link in seen:
                raise DesignError(f"{source}: link '{link}' hangs on itself", allowed="arms without closed loops")
            seen.add(link)
    return roots[0]


def _joint(element: ET.Element, source: str) -> UrdfJoint:
    """A joint element."""
    name = _text(element, "name", f"{source}: a joint")
    where = f"{source}: joint '{name}'"
    kind = _text(element, "type", where)
    if kind not in KINDS:
        raise DesignError(f"{where} is of type '{kind}'", value=kind, allowed=list(KINDS))
    ends = [element.find(end) for end in ("parent", "child")]
    if ends[0] is None or ends[1] is None:
        raise DesignError(f"{where} names no parent or no child")
    axis = element.find("axis")
    direction = np.array([1.0, 0.0, 0.0]) if axis is None else _vector(axis, "xyz", where)
    length = float(np.linalg.norm(direction))
    if kind in TURNING and length < 1e-9:
        raise DesignError(f"{where} turns about an axis of no length", value=direction.tolist())
    mimic = element.find("mimic")
    return UrdfJoint(
        name=name,
        kind=kind,
        parent=_text(ends[0], "link", where),
        child=_text(ends[1], "link", where),
        pose=_pose(element.find("origin"), where),
        axis=direction / length if length > 0.0 else direction,
        limits=_limits(element.find("limit"), kind, where),
        speed=_speed(element.find("limit"), where),
        mimics=None if mimic is None else mimic.get("joint"),
    )


def _limits(limit: ET.Element | None, kind: str, where: str) -> tuple[float, float] | None:
    """The range of a joint's angle."""
    if kind != "revolute":
        return (-np.inf, np.inf)
    if limit is None:
        return None
    lower, upper = (_numbers(limit.get(end, "0"), 1, f"{where}: limit {end}")[0] for end in ("lower", "upper"))
    return float(lower), float(upper)


def _speed(limit: ET.Element | None, where: str) -> float | None:
    """The limit of a joint's speed."""
    text = None if limit is None else limit.get("velocity")
    value = 0.0 if text is None else float(_numbers(text, 1, f"{where}: limit velocity")[0])
    return value if value > 0.0 else None


def _body(link: ET.Element, source: str) -> pin.Inertia:
    """A link's inertial; without one a mass of 0."""
    inertial = link.find("inertial")
    if inertial is None:
        return pin.Inertia.Zero()
    where = f"{source}: link '{link.get('name')}'"
    mass, moments = inertial.find("mass"), inertial.find("inertia")
    weight = 0.0 if mass is None else float(_numbers(mass.get("value", "0"), 1, f"{where}: mass")[0])
    if weight < 0.0:
        raise DesignError(f"{where} has a mass of {weight:g} kg", value=weight, allowed="0 or more")
    matrix = np.zeros((3, 3))
    for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
        name = f"i{'xyz'[i]}{'xyz'[j]}"
        text = "0" if moments is None else moments.get(name, "0")
        matrix[i, j] = matrix[j, i] = _numbers(text, 1, f"{where}: {name}")[0]
    pose = _pose(inertial.find("origin"), where)
    return pose.act(pin.Inertia(weight, np.zeros(3), matrix)) if weight > 0.0 else pin.Inertia.Zero()


def _pose(origin: ET.Element | None, where: str) -> pin.SE3:
    """An origin element as a frame; R = Rz(yaw) Ry(pitch) Rx(roll)."""
    if origin is None:
        return pin.SE3.Identity()
    turn = pin.rpy.rpyToMatrix(*_vector(origin, "rpy", where))
    return pin.SE3(turn, _vector(origin, "xyz", where))


def _vector(element: ET.Element, name: str, where: str) -> Array:
    """Three numbers of an attribute; zeros where it is left out."""
    return _numbers(element.get(name, "0 0 0"), 3, f"{where}: {element.tag} {name}")


def _numbers(text: str, count: int, where: str) -> Array:
    """So many finite numbers."""
    try:
        values = np.array([float(part) for part in text.split()])
    except ValueError:
        values = np.zeros(0)
    if len(values) != count or not np.isfinite(values).all():
        what = "a finite number" if count == 1 else f"{count} finite numbers"
        raise DesignError(f"{where} is '{text}'", value=text, allowed=what)
    return values


def _text(element: ET.Element, name: str, where: str) -> str:
    """An attribute that has to be there."""
    text = element.get(name)
    if not text:
        raise DesignError(f"{where} has no {name}")
    return text
