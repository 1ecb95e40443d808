"""HRDF 1.6: an arm as HEBI's robot configuration files describe it, by their actuators, links and brackets.

The published format (FORMAT.md of the repository hebi-hrdf): elements of a <robot> follow one another from the base to
the tool. With h, the height of an actuator, and c, the offset of a link,

    actuator                        Rz(q) Tz(h)
    link, both ends RightAngle      Tz(c) Tx(extension) Rx(twist) Tz(c)
    link, input Inline              Tz(extension) Rz(twist - 90 deg) Rx(90 deg) Rz(90 deg) Tz(c)
    link, output Inline             Tz(c) Rz(90 deg) Rx(90 deg) Tz(extension) Rz(twist - 90 deg)
    bracket Right, Left             Tz(u) Rx(+-90 deg) Tz(w)

so that ``kit_arm`` finds them in a DH table. What the kit does not have is a <rigid-body>, to be made: a part between
two actuators, a spacer, and without mass, where a piece turns the flange, the turn back, so that angles are the run's.
"""

from __future__ import annotations

from collections.abc import Sequence
from xml.sax.saxutils import quoteattr

import numpy as np

from armdesign._types import Array
from armdesign.bodies.arm_body import ArmBody
from armdesign.building.catalogue import Actuator
from armdesign.building.kit import EXACT, INLINE, Kit, Placed, kit_arm
from armdesign.errors import CatalogueError
from armdesign.kinematics.dh import rot_x, rot_z, translation

VERSION = "1.6.0"
PREAMBLE = """<?xml version="1.0" encoding="UTF-8"?>
<!-- HEBI Robot Configuration, format {version}: https://github.com/HebiRobotics/hebi-hrdf -->
"""


def hrdf(arm: ArmBody, actuators: Sequence[Actuator], kit: Kit, name: str = "arm") -> str:
    """An arm as an HRDF file, its tool as the end effector.

    The angle of a joint is that of the run, or minus that where its comment says so.

    Args:
        arm: The arm, n joints that turn.
        actuators: Of its joints, HEBI's, n of them.
        kit: The links and brackets.
        name: Of the arm.

    Raises:
        CatalogueError: A joint slides, or an actuator is not one of the format's.
    """
    table, n = arm.table, arm.table.dof
    if any(table.prismatic):
        raise CatalogueError("HEBI has no actuators that slide, so that HRDF cannot hold the arm", value=table.joints,
                             allowed="arms whose joints all turn")  # fmt: skip
    heights = [each.height for each in actuators]
    made = kit_arm(table, heights, kit)
    base = table.base() @ rot_x(table.alpha[0]) @ translation(table.a[0], 0.0, made.first)
    steps: list[tuple[str, str]] = []  # elements, and comments above them
    for j, actuator in enumerate(actuators):
        turned = "" if made.signs[j] > 0 else ": turns the other way, its angle is minus that of the run"
        zero = made.signs[j] * float(table.theta[j])
        if zero:
            steps.append((rigid(rot_z(zero), 0.0, f"zero of joint_{j + 1}"), ""))
        steps.append((f"actuator type={quoteattr(actuator.name)} tag={quoteattr(f'joint_{j + 1}')}",
                      f"joint_{j + 1}{turned}"))  # fmt: skip
        if j < n - 1:
            steps += between(made.placed[j], kit)
    tool = rot_x(table.alpha[n]) @ translation(table.a[n], 0.0, 0.0) @ translation(0.0, 0.0, table.d[n])
    tool = translation(0.0, 0.0, made.last) @ tool @ rot_z(table.theta[n])
    steps.append((f"end-effector {carried(arm, made.last, tool)} {frame(tool)}", "what the last actuator carries"))
    head = f'<robot version="{VERSION}" {frame(base, "")} description={quoteattr(name)}>'
    lines = [PREAMBLE.format(version=VERSION) + head]
    for element, comment in steps:
        lines += [f"  <!-- {comment} -->"] if comment else []
        lines.append(f"  <{element}/>")
    return "\n".join([*lines, "</robot>", ""])


def between(placed: Placed, kit: Kit) -> list[tuple[str, str]]:
    """The elements from one actuator's flange to the next one's housing.

    Args:
        placed: The piece.
        kit: The kit.
    """
    steps = []
    if abs(placed.spacer) > EXACT:
        mass = kit.mass_per_metre * abs(placed.spacer)
        steps.append((rigid(translation(0.0, 0.0, placed.spacer), mass), "spacer, to be made"))
    if placed.piece is None:
        pose = translation(0.0, 0.0, placed.u) @ rot_x(placed.alpha) @ translation(placed.a, 0.0, placed.w)
        return [*steps, (rigid(pose, placed.mass(kit)), "part to be made")]
    right = placed.alpha > 0.0
    if not placed.piece.extends:
        side = "Right" if right else "Left"
        return [*steps, (f'bracket type="{placed.piece.type}{side}{placed.piece.variant}"', "")]
    kind = f'type={quoteattr(placed.piece.type)} extension="{placed.extension!r}"'
    if placed.piece.extends == "a":
        return [*steps, (f'link {kind} twist="{placed.alpha!r}"', "")]
    twist, back = ("pi/2", "-pi/2") if right else ("-pi/2", "pi/2")
    turn = (f'rigid-body mass="0.0" output_rot="Rz({back})"', "no part: turns the flange back")
    if placed.piece.extends == "u":
        return [*steps, (f'link {kind} twist="{twist}" input="{INLINE[1]}"', ""), turn]
    return [*steps, turn, (f'link {kind} twist="{twist}" output="{INLINE[1]}"', "")]


def rigid(pose: Array, mass: float, tag: str = "") -> str:
    """A <rigid-body> by its output's pose, shape (4, 4) [m], its mass [kg] half way, and its tag; empty for none."""
    label = f" tag={quoteattr(tag)}" if tag else ""
    return f'rigid-body mass="{mass!r}" com_trans="{words(pose[:3, 3] / 2.0)}" {frame(pose)}{label}'


def carried(arm: ArmBody, last: float, tool: Array) -> str:
    """Mass and centre of mass of what the last actuator carries, as attributes, in the frame of its flange.

    Args:
        arm: The arm.
        last: From the flange to the origin of the last joint's frame [m].
        tool: Pose of the tool in the flange's frame, shape (4, 4) [m].
    """
    solids = [part.solid.inertial for part in arm.parts if part.link == arm.table.dof and not part.module]
    masses = [each.mass for each in solids] + [arm.options.tool_mass]
    places = [each.com + np.array([0.0, 0.0, last]) for each in solids] + [tool[:3, 3]]
    total = float(sum(masses))
    centre = np.average(places, axis=0, weights=masses) if total > 0.0 else np.zeros(3)
    return f'type="Custom" mass="{total!r}" com_trans="{words(centre)}"'


def frame(pose: Array, prefix: str = "output_") -> str:
    """A pose, shape (4, 4) [m], as attributes of a prefix: the rotation row by row, then the translation."""
    return f'{prefix}rot="{words(pose[:3, :3])}" {prefix}trans="{words(pose[:3, 3])}"'


def words(values: Array) -> str:
    """Numbers on one line, each the shortest text that reads back as the same double."""
    return " ".join(repr(float(value) + 0.0) for value in np.asarray(values, dtype=float).ravel())
