"""Everything a robot file assumes beyond the design and its motion, for the files, the command line and the report.

Each field says what it is, what it allows and its default.
"""

from __future__ import annotations

import dataclasses
import re
from dataclasses import dataclass, field
from typing import Any

from armdesign.bodies.arm_body import SIDES
from armdesign.errors import SettingsError
from armdesign.settings import Body
from armdesign.settings.kinds import Choice, Number, Section, Switch, Text, flag_name, parameter

DEFAULT_NAME = "arm"
AUTO = "auto"
PLUGIN = re.compile(r"[A-Za-z_][A-Za-z0-9_:/.-]*")
"""Names that plugins may have."""


@dataclass(frozen=True, repr=False)
class LimitOptions(Section):
    """How the joints' limits come about."""

    panel = "Limits of the joints"

    payload: float | None = parameter(
        None, Number(0.0, 1000.0, "kg"), "Point mass carried at tool0, for the torques [kg]; not set: the task's.",
        optional=True,
    )  # fmt: skip
    actuator_speed: float = parameter(
        180.0, Number(0.0, 1e5, "deg/s", above=True),
        "Speed limit of joints that turn, that of an assumed actuator [deg/s]; a --max-speed of the task goes over it.",
    )  # fmt: skip
    actuator_torque: float = parameter(
        50.0, Number(0.0, 1e6, "N m", above=True),
        "Torque limit of joints that turn, that of an assumed actuator [N m]; a --max-torque of the task goes over it.",
    )  # fmt: skip
    slide_speed: float = parameter(
        0.5, Number(0.0, 100.0, "m/s", above=True), "Speed limit of joints that slide [m/s], likewise."
    )
    slide_force: float = parameter(
        500.0, Number(0.0, 1e6, "N", above=True), "Force limit of joints that slide [N], likewise."
    )
    margin: float | None = parameter(
        None, Number(1.0, 100.0),
        "Limits by the motion, not by an actuator: this factor on its peak speeds and torques; not set: an actuator's.",
        optional=True,
    )  # fmt: skip
    velocity_floor: float | None = parameter(
        None, Number(0.0, 1000.0, "rad/s", above=True),
        "Least speed limit [rad/s; m/s of joints that slide]; not set: 1 with a margin, else none.", optional=True,
    )  # fmt: skip
    effort_floor: float | None = parameter(
        None, Number(0.0, 1e5, "N m", above=True),
        "Least torque limit [N m; N of joints that slide]; not set: 1 with a margin, else none.", optional=True,
    )  # fmt: skip
    narrow_limits: float | None = parameter(
        None, Number(0.0, 360.0, "deg", above=True),
        "Narrow the joints' ranges to what the motion uses and this angle on both sides [deg; as many mm of joints "
        "that slide]; they go on holding 0. Not set: as searched.",
        optional=True,
    )  # fmt: skip

    @classmethod
    def title(cls) -> str:
        """See Section.title."""
        return "limits"


@dataclass(frozen=True, repr=False)
class SimulationOptions(Section):
    """What simulators ask for beyond the solids: the drives, in MJCF and SDF."""

    panel = "Drives, for simulators"

    joint_damping: float = parameter(
        0.1, Number(0.0, 1e4, "N m s/rad"), "Viscous friction of a joint [N m s/rad]; MJCF and SDF."
    )
    joint_friction: float = parameter(0.0, Number(0.0, 1e4, "N m"), "Dry friction of a joint [N m]; MJCF and SDF.")
    joint_armature: float = parameter(
        0.01, Number(0.0, 1e3, "kg m^2"), "Rotor inertia of a motor behind its gear [kg m^2]; MJCF."
    )
    bandwidth: float | None = parameter(
        None, Number(0.1, 200.0, "Hz"),
        "Natural frequency of the position actuators, critically damped [Hz]; MJCF. Each gain follows from it and the "
        "inertia its joint moves. Not set: by the task, so that the tool lags by no more than 1 mm, within 20 to "
        "100 Hz.",
        optional=True,
    )  # fmt: skip
    kp: float | None = parameter(
        None, Number(0.0, 1e9, "N m/rad", above=True),
        "Position gain of every actuator [N m/rad]; MJCF; not set: by the bandwidth.", optional=True,
    )  # fmt: skip
    kv: float | None = parameter(
        None, Number(0.0, 1e9, "N m s/rad"), "Velocity gain of every actuator [N m s/rad]; MJCF; not set: critical.",
        optional=True,
    )  # fmt: skip
    gravity_compensation: bool = parameter(
        False, Switch(), "Take gravity off the links, as a controller that knows their weight does; MJCF."
    )

    @classmethod
    def title(cls) -> str:
        """See Section.title."""
        return "simulation"


@dataclass(frozen=True, repr=False)
class TagOptions(Section):
    """What the files say around the arm itself."""

    panel = "Names and tags"

    name: str = parameter(DEFAULT_NAME, Text("a name"), "Name of the robot; made safe: letters, digits, underscores.")
    base_side: str = parameter(
        AUTO, Choice((AUTO, *SIDES)),
        "Side of the base its plate stands on: below, above, behind (-x), front (+x), left (+y) or right (-y); auto: "
        "below where it is not in the way of the motion, else where most room is left. An arm with a place in the room "
        "stands on its mounting face.",
    )  # fmt: skip
    world: bool = parameter(
        False,
        Switch(),
        "The room's frame as root, with the base where it stands in it: a link 'world' before base_link in URDF and "
        "xacro, where it also helps readers that let any other root float; the model's frame in MJCF and SDF.",
    )
    ros2_control: str | None = parameter(
        None, Text("mock, gazebo, or the name of a hardware plugin"),
        "URDF and xacro: add a ros2_control tag with this hardware: mock, gazebo, or a plugin's name.", optional=True,
    )  # fmt: skip
    transmissions: bool = parameter(
        False, Switch(),
        "URDF and xacro: add a simple transmission to every joint. Drake makes actuators of these alone: without them "
        "it reads none.",
    )  # fmt: skip
    flavour: str = parameter(
        "mujoco", Choice(("mujoco", "portable")),
        "MJCF: mujoco, with default classes, sites and a start keyframe; portable: without them, for the MJCF readers "
        "of PyBullet, DART, Drake and Pinocchio.",
    )  # fmt: skip

    @classmethod
    def title(cls) -> str:
        """See Section.title."""
        return "tags"

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            SettingsError: A value is not allowed.
        """
        super().__post_init__()
        if self.ros2_control is not None and not PLUGIN.fullmatch(self.ros2_control):
            allowed = "mock, gazebo, or a name such as my_package/MyHardware"
            message = f"setting 'tags.ros2_control' is {self.ros2_control!r}"
            raise SettingsError(message, value=self.ros2_control, allowed=allowed)


@dataclass(frozen=True)
class RobotOptions:
    """Everything a robot file assumes beyond the design and its motion.

    Attributes:
        body: What the arm is built of; None for what the settings of its search say.
        limits: How the joints' limits come about.
        simulation: What simulators ask for.
        tags: What the files say around the arm.
    """

    body: Body | None = None
    limits: LimitOptions = field(default_factory=LimitOptions)
    simulation: SimulationOptions = field(default_factory=SimulationOptions)
    tags: TagOptions = field(default_factory=TagOptions)


@dataclass(frozen=True)
class Assumption:
    """One option with its value, for people.

    Attributes:
        name: Its name, as in ``Body``.
        value: Its value; None where it is not set.
        doc: What it is, with the unit.
        flag: How the command line calls it.
    """

    name: str
    value: Any
    doc: str
    flag: str


def assumptions(options: RobotOptions | None = None) -> tuple[Assumption, ...]:
    """Every assumption in the robot files: body, limits, simulation."""
    chosen = options or RobotOptions()
    body = chosen.body or Body()
    sections = (body, chosen.limits, chosen.simulation)
    left_out = ["kind", "modules", "inertials"]  # of parts that were chosen, and instead of those assumed
    left_out += [] if body.modules is None else ["joint_mass", "joint_diameter", "joint_length"]
    return tuple(
        Assumption(entry.name, getattr(section, entry.name), str(entry.metadata["doc"]), flag_name(entry))
        for section in sections
        for entry in dataclasses.fields(section)
        if entry.name not in left_out
    )
