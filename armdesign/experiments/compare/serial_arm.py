"""One serial arm out of a robot's tree: the turning joints from the root to a tool, everything else held still."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin

from armdesign._types import Array
from armdesign.errors import DesignError, counted
from armdesign.experiments.compare.urdf_file import TURNING, UrdfJoint, UrdfTree, read_urdf
from armdesign.kinematics.kernels.skeleton import MAX_DOF

SUPPORTED = "one serial arm of 1 to 10 revolute or continuous joints from the root to the tool"
HAND = re.compile(r"finger|grip|jaw|knuckle|thumb|hand", re.IGNORECASE)
"""Joints named like this, at the end of an arm, belong to its hand."""
FINGER = re.compile(r"finger|jaw|knuckle|thumb", re.IGNORECASE)
"""Links named like this are not taken for the tool."""
LONG_ENOUGH = 3
"""Joints one behind the other that are taken for an arm rather than for part of a hand or a wheel."""
TOOLS = ("tool0", "tcp", "ee", "eef", "end_effector", "tool", "flange")
"""Names of tool frames, best first; they settle a draw."""
SHORTEST = 1e-9
"""Pieces of the skeleton up to this length are left out [m]."""


@dataclass(frozen=True, eq=False)
class SerialArm:
    """A ready-made arm; its base is where its first joint is mounted, with the root's axes."""

    name: str  # what to call it
    source: str  # the file
    tool: str  # name of the tool's link
    joints: tuple[str, ...]  # names of the n joints
    # frame of each joint in the one before, the first in the base, the tool last, shape (n + 1, 4, 4)
    placements: Array
    axes: Array  # joint axes in the joints' frames, shape (n, 3)
    limits: Array  # joint limits, shape (n, 2) [rad]; infinite for continuous joints
    speeds: Array  # limits of their speeds, shape (n,) [rad/s]; not a number where the file has none
    bodies: tuple[pin.Inertia, ...]  # what moves with each joint, in the joint's frame, n entries
    held: tuple[str, ...]  # names of other joints that move, held at 0

    @property
    def dof(self) -> int:
        """Number of joints n."""
        return len(self.joints)

    @property
    def pieces(self) -> Array:
        """Lengths of the skeleton's pieces: base to first joint, from joint to joint, to the tool, (n + 1,) [m]."""
        lengths = np.linalg.norm(self.placements[:, :3, 3], axis=1)
        lengths[lengths <= SHORTEST] = 0.0
        return np.asarray(lengths)

    @property
    def length(self) -> float:
        """Length of the polyline through the joint origins, base to tool [m]."""
        return float(self.pieces.sum())

    @property
    def moving_mass(self) -> float:
        """Mass of all that moves [kg]; 0 where the file has no inertias."""
        return float(sum(body.mass for body in self.bodies))

    def model(self, payload: float = 0.0) -> pin.Model:
        """The arm's Pinocchio model from the base, with its masses and a point mass at the tool [kg]."""
        model = pin.Model()
        for i, name in enumerate(self.joints):
            joint = pin.JointModelRevoluteUnaligned(self.axes[i])
            model.addJoint(i, joint, pin.SE3(self.placements[i]), name)
            model.appendBodyToJoint(i + 1, self.bodies[i], pin.SE3.Identity())
        load = pin.Inertia(payload, np.zeros(3), np.zeros((3, 3)))
        model.appendBodyToJoint(self.dof, load, pin.SE3(self.placements[-1]))
        return model


def read_arm(path: str | Path, *, tool: str | None = None, name: str | None = None) -> SerialArm:
    """Read a ready-made arm from a URDF.

    Args:
        path: The file.
        tool: The link whose origin is the tool; by default the last along the chain, fingers left out.
        name: What to call it; by default the robot's name.

    Raises:
        DesignError: The file cannot be read, or holds no arm of the kind that is supported; the message says why.
    """
    tree = read_urdf(path)
    if tool is not None and tool not in tree.bodies:
        links = list(tree.bodies)
        shown = [*links[:30], f"... {len(links) - 30} more"] if len(links) > 30 else links
        raise DesignError(f"{tree.source} has no link '{tool}' for the tool", value=tool, allowed=shown)
    return serial_arm(tree, tool or default_tool(tree), name)


def serial_arm(tree: UrdfTree, tool: str, name: str | None = None) -> SerialArm:
    """The arm from the root to a tool.

    Raises:
        DesignError: A joint on the way is prismatic, planar, floating or copies another, or there are too many or none.
    """
    moving = [joint for joint in tree.path_to(tool) if joint.moves]
    limits = [_limits(joint, f"{tree.source}: joint '{joint.name}', on the way to '{tool}',") for joint in moving]
    if not 1 <= len(moving) <= MAX_DOF:
        raise DesignError(
            f"{tree.source} has {counted(len(moving), 'joint')} that can turn on the way to '{tool}'",
            value=len(moving), allowed=SUPPORTED, fix="Name another tool's link with --tool",
        )  # fmt: skip
    links = [moving[0].parent, *(joint.child for joint in moving)]
    placements = [tree.pose_from(link, joint.parent) * joint.pose for link, joint in zip(links, moving, strict=False)]
    mounted = tree.pose_from(tree.root, links[0])
    placements[0] = pin.SE3(mounted.rotation, np.zeros(3)) * placements[0]
    placements.append(tree.pose_from(links[-1], tool))
    arm = SerialArm(
        name=name or tree.name,
        source=tree.source,
        tool=tool,
        joints=tuple(joint.name for joint in moving),
        placements=np.array([placement.homogeneous for placement in placements]),
        axes=np.array([joint.axis for joint in moving]),
        limits=np.array(limits),
        speeds=np.array([joint.speed for joint in moving], dtype=float),
        bodies=tuple(_body(tree, link, moving) for link in links[1:]),
        held=tuple(j.name for j in tree.joints.values() if j.moves and j not in moving),
    )
    if arm.length <= SHORTEST:
        raise DesignError(f"{tree.source}: the arm to '{tool}' has no length", value=arm.length)
    return arm


def _limits(joint: UrdfJoint, where: str) -> tuple[float, float]:
    """The range of an arm's joint.

    Raises:
        DesignError: It is of a kind that is not supported, or has no range.
    """
    if joint.kind not in TURNING or joint.mimics is not None:
        kind = f"copies joint '{joint.mimics}'" if joint.mimics is not None else f"is {joint.kind}"
        fix = "Name another tool with --tool, or take the arm out of its robot"
        raise DesignError(f"{where} {kind}", value=joint.name, allowed=SUPPORTED, fix=fix)
    if joint.limits is None:
        raise DesignError(f"{where} has no limit", fix="Give lower and upper, or make it continuous")
    if not joint.limits[0] < joint.limits[1]:
        lower, upper = joint.limits
        raise DesignError(f"{where} turns from {lower:g} to {upper:g} rad", value=joint.limits, allowed="lower < upper")
    return joint.limits


def default_tool(tree: UrdfTree) -> str:
    """The tool's link: where the chain of turning joints ends, the last of the links fixed there.

    Along the way branches shorter than an arm, such as wheels, heads and fingers, are passed by.

    Raises:
        DesignError: The chain parts into several arms.
    """
    link, passed = tree.root, 0
    while True:
        group = _fixed_to(tree, link)
        ways = [joint for place in group for joint in tree.leaving(place) if joint.moves]
        ways = [joint for joint in ways if not _is_hand(tree, joint, passed, alone=len(ways) == 1)]
        if len(ways) > 1:
            ends = ", ".join(f"'{joint.child}'" for joint in ways)
            raise DesignError(
                f"{tree.source} parts into several arms behind '{link}', with {ends}", allowed=SUPPORTED,
                fix="Name the tool's link with --tool",
            )  # fmt: skip
        if not ways:
            return max(group, key=lambda place: _rank(tree, link, place))
        link, passed = ways[0].child, passed + 1


def _is_hand(tree: UrdfTree, joint: UrdfJoint, passed: int, *, alone: bool) -> bool:
    """Whether a joint begins a hand, a wheel or the like rather than the rest of the arm."""
    if passed >= LONG_ENOUGH and (joint.kind not in TURNING or joint.mimics is not None or HAND.search(joint.name)):
        return True
    return not alone and _joints_behind(tree, joint) < LONG_ENOUGH


def _joints_behind(tree: UrdfTree, joint: UrdfJoint) -> int:
    """Most moving joints one behind the other from this one on, itself included."""
    behind = [_joints_behind(tree, other) for other in tree.leaving(joint.child)]
    return max(behind, default=0) + (1 if joint.moves else 0)


def _fixed_to(tree: UrdfTree, link: str) -> list[str]:
    """A link and all that are fixed to it."""
    group = [link]
    for place in group:
        group += [joint.child for joint in tree.leaving(place) if not joint.moves]
    return group


def _rank(tree: UrdfTree, link: str, place: str) -> tuple[bool, int, int, float]:
    """How well a fixed link serves as the tool: no finger, then its depth, then its name, then its distance."""
    depth = len(tree.path_to(place)) - len(tree.path_to(link))
    word = next((i for i, tool in enumerate(TOOLS) if place.lower().endswith(tool)), len(TOOLS))
    return FINGER.search(place) is None, depth, -word, float(np.linalg.norm(tree.pose_from(link, place).translation))


def _body(tree: UrdfTree, link: str, arm: list[UrdfJoint]) -> pin.Inertia:
    """What moves with a link of the arm: itself and all behind it, up to the arm's next joint."""
    total, group = pin.Inertia.Zero(), [link]
    for place in group:
        group += [joint.child for joint in tree.leaving(place) if joint not in arm]
        if tree.bodies[place].mass > 0.0:
            total += tree.pose_from(link, place).act(tree.bodies[place])
    return total
