"""The arm as a URDF text: links base_link, link_1..link_n, tool0; joints joint_1..joint_n, tool0_fixed.

The frames are those of the DH table (eq. 2): the frame of link_i is that of joint_i, tool0 is the tool row's. Nothing
is rounded: every number is the shortest text that reads back as the same double.
"""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from armdesign.errors import DesignError
from armdesign.export.solids import BodyOptions, Cylinder, Inertial, LinkBody, link_bodies
from armdesign.export.templates import render
from armdesign.kinematics.dh import Array, DHTable

TEMPLATE = "arm.urdf.j2"
BASE_LINK = "base_link"
TOOL_LINK = "tool0"
DEFAULT_NAME = "arm"
DEFAULT_RANGE = float(np.pi)
"""Joints without limits turn this far either way [rad]."""
DEFAULT_VELOCITY = float(np.pi)
"""Speed limit of joints without one [rad/s]."""
DEFAULT_EFFORT = 100.0
"""Torque limit of joints without one [N m]."""
MATERIALS = {"base": (0.25, 0.25, 0.28, 1.0), "joint": (0.9, 0.45, 0.1, 1.0), "tube": (0.75, 0.77, 0.8, 1.0)}
"""Colours, red green blue alpha."""


@dataclass(frozen=True)
class JointLimits:
    """Limits of the n joints, checked.

    Attributes:
        position: Lowest and highest angle, shape (n, 2) [rad]; each range holds 0.
        velocity: Speed limits, shape (n,) [rad/s], above 0.
        effort: Torque limits, shape (n,) [N m], above 0.
    """

    position: Array
    velocity: Array
    effort: Array

    def __post_init__(self) -> None:
        """Check what URDF readers insist on.

        Raises:
            DesignError: A limit is missing or not finite, a range is empty or leaves out 0, or a speed or torque limit
                is not positive.
        """
        n = len(self.velocity)
        for name, shape in (("position", (n, 2)), ("velocity", (n,)), ("effort", (n,))):
            array = getattr(self, name)
            if array.shape != shape or not np.isfinite(array).all():
                raise DesignError(f"{name} limits are not finite numbers of shape {shape}", value=array.tolist())
        for i, (lower, upper) in enumerate(self.position.tolist(), start=1):
            if not (lower <= 0.0 <= upper and lower < upper):
                raise DesignError(
                    f"joint_{i} turns from {lower!r} to {upper!r} rad",
                    value=(lower, upper),
                    allowed="lower <= 0 <= upper, lower < upper",
                    fix="Where the range leaves out 0, move the zero pose with the joint's theta.",
                )
        for name, unit in (("velocity", "rad/s"), ("effort", "N m")):
            for i, value in enumerate(getattr(self, name).tolist(), start=1):
                if value <= 0.0:
                    raise DesignError(f"joint_{i} has a {name} limit of {value!r} {unit}", value=value, allowed="> 0")


def joint_limits(
    dof: int,
    position: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
    effort: ArrayLike | None = None,
) -> JointLimits:
    """Limits of n joints; what is not given is +-pi rad, pi rad/s and 100 N m.

    Args:
        dof: Number of joints n.
        position: Shape (n, 2) [rad].
        velocity: Shape (n,) [rad/s].
        effort: Shape (n,) [N m].

    Raises:
        DesignError: As ``JointLimits``, or the shape does not fit n joints.
    """
    defaults = (np.tile([-DEFAULT_RANGE, DEFAULT_RANGE], (dof, 1)), DEFAULT_VELOCITY, DEFAULT_EFFORT)
    arrays = []
    for name, given, default in zip(
        ("joint", "velocity", "effort"), (position, velocity, effort), defaults, strict=True
    ):
        shape = (dof, 2) if name == "joint" else (dof,)
        array = np.full(shape, default) if given is None else np.array(given, dtype=float)
        if array.shape != shape:
            raise DesignError(
                f"{name} limits have shape {array.shape}, but the arm has {dof} joints", allowed=f"{shape}"
            )
        arrays.append(array)
    return JointLimits(*arrays)


def urdf_text(
    table: DHTable,
    *,
    name: str = DEFAULT_NAME,
    limits: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
    effort: ArrayLike | None = None,
    body: BodyOptions | None = None,
    world: bool = False,
) -> str:
    """Write an arm as a URDF; a pure function of its arguments.

    The body is described in ``armdesign.export.solids``: tubes along the skeleton belong to the link before the joint
    they lead to, a joint's housing to the link that turns with it. Every link's inertial is that of its solids.

    Args:
        table: The arm, n joints.
        name: Robot name; made safe by ``safe_name``.
        limits: Joint ranges, shape (n, 2) [rad], each holding 0; +-pi by default.
        velocity: Speed limits, shape (n,) [rad/s]; pi by default.
        effort: Torque limits, shape (n,) [N m]; 100 by default.
        body: What the arm is built of.
        world: Put a link ``world`` and a fixed joint before base_link, for readers that let any other root float.

    Returns:
        The text of the file, ASCII only.

    Raises:
        DesignError: Limits do not fit the arm, or are none that a joint can have.
    """
    options = body or BodyOptions()
    checked = joint_limits(table.dof, limits, velocity, effort)
    bodies = link_bodies(table, options)
    names = [BASE_LINK, *(f"link_{i + 1}" for i in range(table.dof))]
    joints = [_origin_joint("world_fixed", "world", np.eye(4)) if world else None]
    for i, placement in enumerate(table.placements()[:-1]):
        joints.append({**_origin_joint(f"joint_{i + 1}", names[i], placement), "limit": _limit(checked, i)})
    links = [_link(*parts) for parts in zip(names, bodies, joints, strict=True)]
    hand = _origin_joint(f"{TOOL_LINK}_fixed", names[-1], table.placements()[-1])
    links.append(_bare_link(TOOL_LINK, options.tool, hand))
    if world:
        links.insert(0, _bare_link("world", None, None))
    materials = {material: _numbers(rgba) for material, rgba in MATERIALS.items()}
    return render(TEMPLATE, {"name": safe_name(name), "materials": materials, "links": links})


def safe_name(name: str) -> str:
    """A robot name every reader takes: ASCII letters, digits and underscores, starting with a letter.

    Accents are dropped, any other run of characters becomes one underscore; nothing left gives "arm".
    """
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode("ascii")
    plain = re.sub(r"[^A-Za-z0-9]+", "_", plain).strip("_")
    if not plain:
        return DEFAULT_NAME
    return plain if plain[0].isalpha() else f"{DEFAULT_NAME}_{plain}"


def rpy(rotation: Array) -> Array:
    """Roll, pitch and yaw about fixed axes, R = Rz(yaw) Ry(pitch) Rx(roll), as URDF has it.

    Yaw is read off first; pitch and roll are those of what is left after undoing it. So at and near gimbal lock
    (pitch = +-90 deg), where roll and yaw are not defined one by one, the three still rebuild R to rounding.

    Args:
        rotation: Shape (3, 3).

    Returns:
        Shape (3,) [rad].
    """
    R = rotation
    yaw = np.arctan2(R[1, 0], R[0, 0])
    c, s = np.cos(yaw), np.sin(yaw)
    pitch = np.arctan2(-R[2, 0], c * R[0, 0] + s * R[1, 0])
    roll = np.arctan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
    return np.array([roll, pitch, yaw])


def _number(value: float) -> str:
    """The shortest text that reads back as the same double; no negative zero."""
    return repr(float(value) + 0.0)


def _numbers(values: ArrayLike) -> str:
    """Numbers on one line."""
    return " ".join(_number(value) for value in np.asarray(values, dtype=float))


def _origin(pose: Array) -> dict[str, str]:
    """A frame's xyz [m] and rpy [rad]."""
    return {"xyz": _numbers(pose[:3, 3]), "rpy": _numbers(rpy(pose[:3, :3]))}


def _origin_joint(name: str, parent: str, pose: Array) -> dict[str, Any]:
    """A joint to a parent at a pose in the parent's frame; fixed unless given a limit."""
    return {"name": name, "parent": parent, **_origin(pose), "limit": None}


def _limit(limits: JointLimits, i: int) -> dict[str, str]:
    """The attributes of joint i's limit."""
    lower, upper = limits.position[i]
    values = {"lower": lower, "upper": upper, "effort": limits.effort[i], "velocity": limits.velocity[i]}
    return {key: _number(value) for key, value in values.items()}


def _inertial(inertial: Inertial) -> dict[str, Any]:
    """The attributes of an inertial, given at the centre of mass along the link's axes."""
    entries = {f"i{'xyz'[r]}{'xyz'[c]}": _number(inertial.inertia[r, c]) for r in range(3) for c in range(r, 3)}
    return {"mass": _number(inertial.mass), "com": _numbers(inertial.com), "moments": entries}


def _part(part: Cylinder) -> dict[str, str]:
    """The attributes of a cylinder."""
    size = {"radius": _number(part.radius), "length": _number(part.length), "material": part.material}
    return {**_origin(part.pose), **size}


def _bare_link(name: str, inertial: Inertial | None, joint: dict[str, Any] | None) -> dict[str, Any]:
    """A link without solids."""
    mass = None if inertial is None else _inertial(inertial)
    return {"name": name, "inertial": mass, "visual": [], "collision": [], "joint": joint}


def _link(name: str, body: LinkBody, joint: dict[str, Any] | None) -> dict[str, Any]:
    """A link with its solids, and the joint that carries it."""
    solids = {"visual": [_part(part) for part in body.visual], "collision": [_part(part) for part in body.collision]}
    return {**_bare_link(name, body.inertial, joint), **solids}
