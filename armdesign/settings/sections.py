"""Every parameter of the method, with its published value as default (method sections 1 to 8).

Angles stand here in degrees, lengths in metres: this is the edge the user sees. The code inside takes radians.
"""

from __future__ import annotations

import dataclasses
import difflib
import functools
import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeVar

from armdesign import plugins
from armdesign.errors import SettingsError, counted
from armdesign.settings.kinds import (
    Choice,
    Either,
    Interval,
    Number,
    Section,
    Several,
    Switch,
    Table,
    Text,
    parameter,
    section_toml,
)
from armdesign.settings.place import sites

S = TypeVar("S")
LIGHTEST = 1e-6
"""Gazebo drops links of this mass and below [kg]."""
DEGREES = Number(-360.0, 360.0, "deg")
METRES = Number(0.0, 10.0, "m")
SIGNED_METRES = Number(-10.0, 10.0, "m")
RECORDING, POINTS, CLEANING, ARM, CELL, BODY, NEEDS, FITNESS, SEARCH, STOP = (
    "Recording", "Points", "Cleaning", "Arm", "Where it stands", "What the arm is built of", "What it must do",
    "Fitness", "Search", "When to stop",
)  # fmt: skip
"""Panels of the command line's help."""


@dataclass(frozen=True, repr=False)
class Task(Section):
    """From the recording to the task (method section 1)."""

    recording: str | None = parameter(
        None, Text("a path"), "The recording; relative paths count from this file's folder.", optional=True
    )
    files: dict[str, str] = parameter(
        {}, Table(Text("a path")),
        "Instead of recording: several files as one recording, a point or body each.\n"
        'Example: files = { "elbow" = "elbow.csv", "hand" = "hand.csv" }',
    )  # fmt: skip
    file_rate: float | None = parameter(
        None,
        Number(0.0, 1e5, "Hz", above=True),
        "Frames per second of files that hold no times [Hz]; not set: rate.",
        optional=True,
    )
    more_recordings: tuple[str, ...] | None = parameter(
        None, Several(Text("a path"), 0, 100),
        "Further demonstrations of the same task, with the same points; the arm is searched for all of them.",
        optional=True,
    )  # fmt: skip
    holdouts: tuple[str, ...] | None = parameter(
        None, Several(Text("a path"), 0, 100),
        "Demonstrations of the same task that the search does not see; the finished arm is scored on them.",
        optional=True,
    )  # fmt: skip
    units: str | None = parameter(
        None, Text("m, cm, mm, in, or metres per unit as a number in quotes", "m|cm|mm|in|X"),
        "Unit of length of the recording; not set: what its file says.", optional=True, panel=RECORDING,
    )  # fmt: skip
    up: str | None = parameter(
        None, Choice(("x", "y", "z", "-x", "-y", "-z")),
        "Axis of the recording that points up, with a minus one that points down; not set: what its file says.",
        optional=True, panel=RECORDING,
    )  # fmt: skip
    mirror: bool = parameter(
        False, Switch(), "Exchange left and right, to make a right arm of a left one.", panel=RECORDING
    )
    time_unit: str | None = parameter(
        None, Choice(("s", "ms", "us", "ns")),
        "Unit of time of the recording; not set: what its file says, or seconds.", optional=True, panel=RECORDING,
    )  # fmt: skip
    quaternions: str | None = parameter(
        None, Choice(("xyzw", "wxyz")), "Order of quaternions whose columns do not tell it.", optional=True,
        panel=RECORDING,
    )  # fmt: skip
    confidence: float = parameter(
        0.5, Number(0.0, 1.0), "Confidence or visibility, where a file has it, below which a point is not seen.",
        panel=RECORDING,
    )  # fmt: skip
    base: str | None = parameter(
        None, Text("a point's name", "NAME"), "Point the robot's base stands at, the shoulder; see points.",
        optional=True, panel=POINTS,
        short="Point the base stands at, the shoulder. 'origin': points count from it already.",
    )  # fmt: skip
    points: tuple[str, ...] = parameter(
        (), Several(Text("a point's name", "NAME"), 0, 12),
        "Points to follow, from the shoulder to the hand, the hand last: names of the recording, or made of such, as\n"
        '["elbow=EPICl+EPICm", "hand=0.5*INDEX+0.5*LASTC"]. Empty: in plain CSV all but the base (by default the\n'
        "first) in their order, elsewhere a guess from the names.",
        panel=POINTS, short="Points to follow, shoulder to hand: elbow,wrist,hand or elbow=EPICl+EPICm,...",
    )  # fmt: skip
    orientation: str | None = parameter(
        None, Text("a point's name", "NAME"),
        "Point whose orientation the end-effector follows; where not set, the hand's if orientation_weight > 0.",
        optional=True, panel=POINTS, short="Point whose orientation the end-effector follows.",
    )  # fmt: skip
    base_mode: str = parameter(
        "shoulder", Choice(("shoulder", "fixed")),
        "shoulder: every frame minus the base point in that frame (the paper).\n"
        "fixed: minus its mean, so that hand paths stay where they are in the world.", panel=POINTS,
    )  # fmt: skip
    outliers: bool | None = parameter(
        None, Switch(), "Whether outliers become gaps (Hampel); not set: where the file is a capture system's.",
        optional=True, panel=CLEANING,
    )  # fmt: skip
    max_gap: float = parameter(0.2, Number(0.0, 60.0, "s"), "Longest gap that is filled [s].", panel=CLEANING)
    repeats: bool | None = parameter(
        None, Switch(),
        "Whether frames that repeat the one before are interpolated, up to max_gap; not set: as with outliers.",
        optional=True, panel=CLEANING,
    )  # fmt: skip
    low_pass: float | Literal["off"] | None = parameter(
        None, Either(Number(0.0, 1e4, "Hz", above=True), "off"),
        "Cut-off of the zero-phase low-pass [Hz]; not set: 6 Hz where the file is a capture system's, else off.",
        optional=True, panel=CLEANING,
    )  # fmt: skip
    start: float | None = parameter(
        None, Number(unit="s"), "First time to use [s]; not set: the first.", optional=True, panel=CLEANING,
        flag="--from",
    )  # fmt: skip
    stop: float | None = parameter(
        None, Number(unit="s"), "Last time to use [s]; not set: the last.", optional=True, panel=CLEANING, flag="--to"
    )
    cut: tuple[tuple[float, float], ...] = parameter(
        (), Several(Interval(Number(unit="s")), 0, 20),
        "Bad stretches to cut out, as pairs of times [s]; only where the hand stands still.\n"
        "Example: cut = [[2.5, 3.1]]",
        panel=CLEANING, short="Cut out the time from A to B [s], where the hand stands still. Repeatable.",
    )  # fmt: skip
    rate: float | None = parameter(
        None, Number(0.0, 1e5, "Hz", above=True),
        "Rate to resample to [Hz], and that of a file without times where file_rate is not set; not set: as recorded.",
        optional=True, panel=CLEANING, short="Rate to resample to, or that of a file without times [Hz].",
    )  # fmt: skip
    scale: float = parameter(
        1.0, Number(0.0, 1e4, above=True), "Factor on all lengths, for a mock-up recorded at another size.",
        panel=CLEANING,
    )  # fmt: skip


def with_dof(entries: Mapping[str, Any]) -> dict[str, Any]:
    """Entries of the arm with the number of joints that their kinds mean, where they name none.

    Args:
        entries: Values by name; None stands for not set.
    """
    joints = entries.get("joints")
    if isinstance(joints, str) and joints:
        return {"dof": min(len(joints), 10), **entries, "joints": joints.upper()}
    return dict(entries)


@dataclass(frozen=True, repr=False)
class Design(Section):
    """Freedom and limits of the arm (method sections 2 and 6)."""

    dof: int = parameter(3, Number(1, 10, integer=True), "Number of joints n.", panel=ARM)
    alpha: tuple[float, float] = parameter(
        (-90.0, 90.0), Interval(DEGREES), "Bounds of every twist alpha [deg].", panel=ARM
    )
    a: tuple[float, float] = parameter(
        (0.0, 0.5), Interval(SIGNED_METRES), "Bounds of every link length a_1..a_{n-1} [m]; L counts |a|.", panel=ARM
    )
    d: tuple[float, float] = parameter(
        (0.0, 0.5), Interval(SIGNED_METRES), "Bounds of every link offset d_1..d_{n-1} [m]; L counts |d|.", panel=ARM
    )
    tool_length: float = parameter(0.1, METRES, "Offset d of the tool row [m]; its a is 0.", panel=ARM)
    base_yaw: tuple[float, float] = parameter(
        (0.0, 0.0), Interval(DEGREES), "Bounds of the turn about z before the first row [deg]; equal ends fix it.",
        panel=ARM,
    )  # fmt: skip
    bounds: dict[str, tuple[float, float]] = parameter(
        {}, Table(Interval(Number(-360.0, 360.0))),
        "Bounds of single entries, over those above; equal ends fix an entry.\n"
        "Names: alpha_i, a_i, d_i with i = 0..n-1 or tool, and base_yaw [deg, m].\n"
        'Example: bounds = { "alpha_0" = [-90, 0], "d_tool" = [0.15, 0.15] }', panel=ARM,
        short="Bounds of a single entry: alpha_i, a_i, d_i (i from 0, or tool), base_yaw [deg, m]. Repeatable.",
    )  # fmt: skip
    length: tuple[float, float] = parameter(
        (0.6, 1.2), Interval(METRES), "L_min, L_max: bounds of the total length, tool included [m].", panel=ARM
    )
    joint_limits: tuple[tuple[float, float], ...] = parameter(
        ((-180.0, 180.0),), Several(Interval(Number(-720.0, 720.0, "deg")), 1, 10),
        "q_min, q_max [deg]: one pair for all joints, or one per joint, those of prismatic joints in metres.",
        panel=ARM, short="q_min, q_max [deg]: given once for all joints, or once per joint (prismatic ones: [m]).",
    )  # fmt: skip
    joints: str | None = parameter(
        None, Text("letters R and P, one per joint, such as RRPR", "RRPR"),
        "Kinds of the joints from the base on: R turns (revolute), P slides (prismatic); not set: all R.",
        optional=True, panel=ARM,
    )  # fmt: skip
    travel: tuple[float, float] = parameter(
        (0.0, 0.3), Interval(Number(-10.0, 10.0, "m")),
        "Range of every prismatic joint [m]; where joint_limits has one pair per joint, that pair counts, in metres.",
        panel=ARM,
    )  # fmt: skip
    coaxial_twist: float = parameter(
        1.0, Number(0.0, 90.0, "deg"), "Two joints count as on one axis below this twist [deg] ..."
    )
    coaxial_offset: float = parameter(0.001, METRES, "... and below this link length [m].")
    auto_dof: tuple[int, int] | None = parameter(
        None, Interval(Number(1, 10, integer=True)),
        "Fewest and most joints that --dof auto tries; not set: [2, 7].", optional=True,
    )  # fmt: skip

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            SettingsError: A value is not allowed, or ``joints`` is not one letter R or P for each joint.
        """
        super().__post_init__()
        if self.joints is not None and not (len(self.joints) == self.dof and set(self.joints) <= {"R", "P"}):
            raise SettingsError(
                f"setting 'design.joints' is '{self.joints}' for {counted(self.dof, 'joint')}", value=self.joints,
                allowed=f"{counted(self.dof, 'letter')} R or P",
                fix="Leave --dof out, or make the two agree",
            )  # fmt: skip

    @property
    def prismatic(self) -> tuple[bool, ...]:
        """Which joints slide, n of them."""
        return tuple(kind == "P" for kind in self.joints or "R" * self.dof)


@dataclass(frozen=True, repr=False)
class Cell(Section):
    """Where the arm may stand, and what stands around it; room coordinates of the recording, z up."""

    place: tuple[str, ...] = parameter(
        (), Several(Text("a region", "REGION"), 0, 50, repeated=True, commas=False),
        "Regions the base may stand in, searched together with the arm: x, y, z [m] and yaw [deg], each a number or\n"
        'from..to; what is left out is 0, yaw free. Example: place = ["x=-0.2..0.6 y=0.3..0.9 z=0"]', panel=CELL,
        short="Region the base may stand in: 'x=-0.2..0.6 y=0.3..0.9 z=0 yaw=-90..90' [m, deg]. Repeatable.",
    )  # fmt: skip
    base_at: tuple[float, ...] | None = parameter(
        None, Several(Number(-100.0, 100.0, "m"), 3, 3), "Where the base stands: x, y, z in the room [m].",
        optional=True, panel=CELL,
    )  # fmt: skip
    stand: str | None = parameter(
        None, Choice(("floor", "wall", "ceiling")),
        "The base stands on the room's floor, a wall or the ceiling: mounted so, and nothing but the base itself may\n"
        "reach behind that surface. Without a place on the floor: anywhere near the task, z = 0.", optional=True,
        panel=CELL,
    )  # fmt: skip
    mounted: str | None = parameter(
        None, Choice(("floor", "wall", "ceiling", "any")),
        "How the base is mounted: z axis up (floor), level (wall), down (ceiling), or any of them, whichever is best;\n"
        "not set: as it stands, else floor.", optional=True, panel=CELL,
    )  # fmt: skip
    obstacles: tuple[str, ...] = parameter(
        (), Several(Text("a path", "FILE"), 0, 50, repeated=True),
        "What stands in the room: a cell file (TOML), meshes (STL, OBJ, PLY) or URDF scenes.", panel=CELL,
    )  # fmt: skip
    obstacle_units: str | None = parameter(
        None, Choice(("m", "cm", "mm", "in")), "Unit of length of meshes; not set: metres.", optional=True, panel=CELL
    )
    stay_within: float | None = parameter(
        None, Number(0.0, 10.0, "m", above=True),
        "How far the arm's bodies may leave the volume that the demonstrator's arm has swept [m]; not set: no matter.",
        optional=True, panel=CELL,
    )  # fmt: skip

    def __post_init__(self) -> None:
        """Check the values and that the places can be read.

        Raises:
            SettingsError: A value is not allowed, a region cannot be read or is empty, or two entries contradict.
        """
        super().__post_init__()
        sites(self)


def size_parameter(default: float, doc: str) -> Any:  # noqa: ANN401 (a dataclass field)
    """A length of the body."""
    return parameter(default, Number(0.0, 10.0, "m", above=True), f"{doc} [m].")


def mass_parameter(default: float, doc: str) -> Any:  # noqa: ANN401 (a dataclass field)
    """A mass of the body, more than simulators drop."""
    return parameter(default, Number(LIGHTEST, 1000.0, "kg", above=True), f"{doc} [kg].")


class Module(NamedTuple):
    """The module of a joint, motor and gear in a cylinder about its axis."""

    diameter: float  # its diameter [m]
    length: float  # its length along the axis [m]
    mass: float  # its mass [kg]


@dataclass(frozen=True, repr=False)
class Body(Section):
    """What the arm is built of: assumptions, since the design is but lines; lengths in metres, masses in kilograms.

    Each field says what it is, what it allows and its default; the command line and the report read it from there.
    """

    panel = BODY

    kind: str = parameter(
        "tube", Choice(("tube", "thin")),
        "tube: the arm is made of tubes and joint modules, which have to stay clear of each other and of obstacles;\n"
        "thin: the arm is but lines (the paper).", flag="--body",
    )  # fmt: skip
    tube_diameter: float = size_parameter(0.04, "Outer diameter of the tubes")
    tube_wall: float = size_parameter(0.003, "Wall of the tubes; half the diameter makes a solid rod")
    tube_density: float = parameter(
        2700.0, Number(0.0, 1e5, "kg/m^3", above=True), "Density of the tubes [kg/m^3]; the default is aluminium."
    )
    joint_mass: float = mass_parameter(0.6, "Mass of a joint module, motor and gear")
    joint_diameter: float = size_parameter(0.06, "Diameter of a joint's housing")
    joint_length: float = size_parameter(0.06, "Length of a joint's housing along its axis")
    base_diameter: float = size_parameter(0.1, "Diameter of the base plate")
    base_height: float = size_parameter(0.02, "Height of the base plate")
    base_mass: float = mass_parameter(1.0, "Mass of the base plate")
    tool_mass: float = mass_parameter(
        1e-4, "Mass of the empty link tool0, small, yet enough that no simulator drops or fills it"
    )
    tool_inertia: float = parameter(
        1e-7, Number(0.0, 1000.0, "kg m^2", above=True), "Each principal moment of tool0 [kg m^2]."
    )
    module_slide: float = parameter(
        0.1, Number(0.0, 10.0, "m"),
        "How far a joint module may be shifted along its joint's axis, beyond the piece of the arm that runs along it\n"
        "[m]: the bracket allows as much.",
    )  # fmt: skip
    clearance: float = size_parameter(5e-3, "Least gap between bodies that are not neighbours, and to obstacles")
    modules: tuple[tuple[float, float, float], ...] | None = parameter(
        None, Several(Several(Number(0.0, 1000.0, above=True), 3, 3), 1, 10),
        "Modules of every joint from the base on, each with diameter [m], length [m] and mass [kg], over the\n"
        "joint_... above, as armdesign build chooses them; not set: all alike.", optional=True, panel="",
    )  # fmt: skip
    inertials: tuple[tuple[float, ...], ...] | None = parameter(
        None, Several(Several(Number(), 10, 10), 2, 11),
        "Mass properties of every link in its frame, base_link first: mass [kg], centre of mass x, y, z [m],\n"
        "Ixx, Iyy, Izz, Ixy, Ixz, Iyz about it [kg m^2]: those of the parts of a build; not set: of tubes and modules.",
        optional=True, panel="",
    )  # fmt: skip

    post: float = parameter(
        0.0, Number(0.0, 10.0, "m"),
        "How much farther than its modules reach the plate of an arm that hangs stands [m]: armdesign build chooses\n"
        "it for its brackets.", panel="",
    )  # fmt: skip

    @classmethod
    def title(cls) -> str:
        """See Section.title."""
        return "body"

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            SettingsError: A value is not a number above 0, out of range, or a wall is thicker than its tube.
        """
        super().__post_init__()
        if self.tube_wall > self.tube_diameter / 2.0:
            allowed = f"at most half of tube_diameter, {self.tube_diameter / 2.0!r} m"
            raise SettingsError(
                f"setting 'body.tube_wall' is {self.tube_wall!r} m", value=self.tube_wall, allowed=allowed
            )

    def modules_of(self, dof: int) -> tuple[Module, ...]:
        """The modules of an arm's n joints.

        Raises:
            SettingsError: ``modules`` are those of another number of joints.
        """
        if self.modules is None:
            return (Module(self.joint_diameter, self.joint_length, self.joint_mass),) * dof
        if len(self.modules) != dof:
            raise SettingsError(
                f"setting 'body.modules' has {counted(len(self.modules), 'module')} for {counted(dof, 'joint')}",
                value=self.modules, allowed=f"{counted(dof, 'module')}, one per joint", fix="Leave body.modules out",
            )  # fmt: skip
        return tuple(Module(*module) for module in self.modules)

    def reach_about(self, module: Module) -> float:
        """Radius of the sphere about a joint that its housing stays within and the link before it stays out of [m]."""
        housing = math.hypot(module.diameter, module.length) / 2.0
        return max(housing, self.tube_diameter / 2.0) + self.clearance

    @property
    def reach(self) -> float:
        """How far away the plate of an arm that hangs stands: the largest ``reach_about``, and ``post`` beyond [m]."""
        return self.post + max(self.reach_about(module) for module in self.modules_of(len(self.modules or (None,))))


@dataclass(frozen=True, repr=False)
class Needs(Section):
    """What the arm must be able to do; what is not set is reported, but does not count in the search."""

    hand_tolerance: float | None = parameter(
        None, Number(0.0, 10.0, "m", above=True), "How near the hand must stay to the demonstrated one [m].",
        optional=True, panel=NEEDS, flag="--tolerance",
    )  # fmt: skip
    tolerance_percentile: float = parameter(
        100.0, Number(50.0, 100.0, "%"), "Share of the frames in which it must [%]; 100: in all.", panel=NEEDS
    )
    tolerance_angle: float | None = parameter(
        None, Number(0.0, 180.0, "deg", above=True), "How near its orientation must stay to the hand's [deg].",
        optional=True, panel=NEEDS,
    )  # fmt: skip
    max_speed: tuple[float, ...] | None = parameter(
        None, Several(Number(0.0, 1e5, above=True), 1, 10),
        "Largest joint speeds: one for all joints or one per joint [deg/s; m/s of prismatic joints].", optional=True,
        panel=NEEDS,
    )  # fmt: skip
    max_acceleration: tuple[float, ...] | None = parameter(
        None, Several(Number(0.0, 1e7, above=True), 1, 10),
        "Largest joint accelerations: one for all joints or one per joint [deg/s^2; m/s^2 of prismatic joints].",
        optional=True, panel=NEEDS,
    )  # fmt: skip
    max_torque: tuple[float, ...] | None = parameter(
        None, Several(Number(0.0, 1e6, above=True), 1, 10),
        "Largest joint torques: one for all joints or one per joint [N m; N of prismatic joints].", optional=True,
        panel=NEEDS,
    )  # fmt: skip
    payload: float = parameter(0.0, Number(0.0, 1000.0, "kg"), "Point mass carried at tool0 [kg].", panel=NEEDS)


@dataclass(frozen=True, repr=False)
class Fitness(Section):
    """What a good arm is (method sections 3 to 5)."""

    scenario: str = parameter(
        "packaging", Choice(("packaging", "welding")),
        "Published weights: packaging (position only) or welding (with orientation); weights below go over them.",
        panel=FITNESS, short="Published weights: packaging, or welding with the orientation; --weights go over them.",
    )  # fmt: skip
    weights: tuple[float, ...] = parameter(
        (), Several(Number(0.0, 1.0), 0, 12), "w_1..w_m, one per point; empty: those of the scenario.", panel=FITNESS,
        short="w_1,...,w_m, or w_0,w_1,...,w_m with the orientation's first; fractions allowed.",
    )  # fmt: skip
    orientation_weight: float | None = parameter(
        None, Number(0.0, 1.0), "w_0; not set: that of the scenario. w_0 + w_1 + ... + w_m = 1.", optional=True
    )
    orientation_metric: str = parameter(
        "geodesic", Choice(("geodesic", "euler", "axis")),
        "geodesic: angle between the frames; euler: norm of the roll-pitch-yaw differences (the paper);\n"
        "axis: angle between the z axes, for a tool that is round about its axis.",
    )  # fmt: skip
    mount: str = parameter(
        "start", Choice(("start", "identity")),
        "start: the tool is bolted on so that the orientation fits at the first frame; identity (the paper).",
    )  # fmt: skip
    lambda_f: float = parameter(15.0, Number(0.0, 1e6), "lambda_f, factor of the path fitness f.")
    lambda_E: float = parameter(5.0, Number(0.0, 1e6), "lambda_E, factor of the area E.")
    delta: float = parameter(
        0.01, Number(0.0, 1.0, "m", above=True), "Length of the pieces the arm is cut into for E [m]."
    )
    continuity: float = parameter(
        10.0, Number(0.0, 3600.0, "deg", above=True), "eps: largest |q_t - q_{t-1}| from frame to frame [deg]."
    )
    continuity_speed: float | None = parameter(
        None, Number(0.0, 1e6, "deg/s", above=True),
        "eps as a speed [deg/s], times the time between frames; goes over continuity.", optional=True,
    )  # fmt: skip
    reach_tolerance: float = parameter(
        0.001, Number(0.0, 1.0, "m", above=True), "How near the end-effector must come to the hand at the start [m]."
    )
    reach_frames: str = parameter(
        "start", Choice(("start", "all")),
        "start: an arm is valid if its end-effector comes so near to the hand at the start (the paper);\n"
        "all: only if it does in every frame. The path does not hold the hand to its point, so allow centimetres.",
        panel=FITNESS,
    )  # fmt: skip
    tie_hand: bool = parameter(True, Switch(), "sigma_m = 1: the hand belongs to the end-effector.")
    demonstrations: str | None = parameter(
        None, Choice(("mean", "worst")),
        "What counts of several demonstrations: the mean of their fitness, each counting the same, or the worst;\n"
        "not set: the mean.", optional=True, panel=FITNESS,
        short="What counts of several demonstrations: their mean fitness, or the worst; not set: the mean.",
    )  # fmt: skip


@dataclass(frozen=True, repr=False)
class Solver(Section):
    """Damped least squares along the path (method sections 3 and 4)."""

    starts: int | None = parameter(
        None, Number(1, 4096, integer=True),
        "Start poses that are looked at for the first frame, the same for every arm; not set: by the joints.",
        optional=True,
    )  # fmt: skip
    descents: int | None = parameter(
        None, Number(1, 256, integer=True),
        "How many of them, the best by their error, are roughly solved from; not set: by the joints.", optional=True,
    )  # fmt: skip
    finalists: int | None = parameter(
        None, Number(1, 16, integer=True),
        "How many of the outcomes, the best that differ, are solved to the end; not set: by the joints.",
        optional=True,
    )  # fmt: skip
    start_paths: int = parameter(
        1, Number(1, 16, integer=True),
        "Start poses that are carried along the whole path, the best that reach and differ; the path with the\n"
        "smallest r counts. At most as many as finalists.",
    )  # fmt: skip
    tolerance: float = parameter(
        1e-5, Number(0.0, 0.1, above=True),
        "A frame is solved when the model promises less than this relative decrease of g.",
    )  # fmt: skip
    floor: float = parameter(
        1e-9, Number(0.0, 0.1, "m"), "A frame is solved, too, when the model promises less than this decrease of g [m]."
    )
    max_steps: int = parameter(50, Number(2, 10000, integer=True), "Most steps spent on one frame.")
    second_order: bool = parameter(
        True, Switch(), "Use the full second derivative where it is convex, not only its Gauss-Newton part."
    )


SWARM = ("particles", "iterations", "inertia", "c1", "c2")
SIZES = {"budget": ("up to ", "candidate"), "particles": ("", "particle"), "iterations": ("", "iteration")}
"""Settings whose product is the number of candidates, and the words around them."""


def settings_of_plugin(kind: Any) -> tuple[str, ...]:  # noqa: ANN401 (a class of armdesign.swarm.Algorithm)
    """The settings that a plug-in's search algorithm has: its parameters that are called as one here.

    Raises:
        TypeError: None of them says how long it goes on.
    """
    names = tuple(entry.name for entry in dataclasses.fields(kind.Parameters) if entry.name in Search.names())
    if not set(names) & set(SIZES):
        raise TypeError(f"its Parameters have none of {', '.join(SIZES)}, which say how long a search goes on")
    return names


ALGORITHM_SETTINGS: Mapping[str, tuple[str, ...]] = plugins.Plugged(
    {
        "rapso": (*SWARM, "c_range", "range", "angle_interval"),
        "pso": SWARM,
        "multibasin": ("budget", "effort", "coarse"),
    },
    plugins.ALGORITHMS,
    lambda kind, _: settings_of_plugin(kind),
)
"""The search algorithms, and the settings that only some of them have."""


def with_algorithm(entries: Mapping[str, Any], algorithm: str = "multibasin") -> dict[str, Any]:
    """Entries of the search with the algorithm they mean: RA-PSO where they set a swarm's parameters and name none.

    Args:
        entries: Values by name; None stands for not set.
        algorithm: The algorithm so far.
    """
    named = entries.get("algorithm") is not None
    asks_for_swarm = any(entries.get(name) is not None for name in ALGORITHM_SETTINGS["rapso"])
    if asks_for_swarm and not named and not set(SWARM) & set(ALGORITHM_SETTINGS[algorithm]):
        return {**entries, "algorithm": "rapso"}
    return {"algorithm": algorithm, **entries}


def means_algorithm(section: type[S]) -> type[S]:
    """Make a section of the search with the algorithm that its entries mean, as a file of settings does."""
    made = section.__init__

    @functools.wraps(made)
    def initialise(self: S, *values: Any, **entries: Any) -> None:  # noqa: ANN401 (whatever the section takes)
        made(self, *values, **(entries if values else with_algorithm(entries)))

    section.__init__ = initialise  # type: ignore[assignment]
    return section


@means_algorithm
@dataclass(frozen=True, repr=False)
class Search(Section):
    """The search: many basins, or the paper's swarms (method section 7).

    ``Search(particles=100)`` is a search by RA-PSO: what only a swarm has asks for one, where no algorithm is named.
    """

    algorithm: str = parameter(
        "multibasin", Choice(tuple(ALGORITHM_SETTINGS)),
        "multibasin: descents by gradients in many basins, within the budget; rapso: the paper's RA-PSO; pso: both\n"
        "take particles and iterations. Where those are set and no algorithm is, it is rapso.", panel=SEARCH,
    )  # fmt: skip
    budget: int = parameter(
        50000, Number(100, 10**9, integer=True), "Candidates that multibasin evaluates at most.", panel=SEARCH
    )
    effort: str = parameter(
        "normal", Choice(("quick", "normal", "thorough", "budget")),
        "How sure multibasin has to be of the best arm to stop before its budget is spent, by beginnings that\n"
        "know nothing of each other agree: quick p < 0.25, normal 0.1, thorough 0.01 for a better one; budget: never.",
        panel=SEARCH,
    )  # fmt: skip
    coarse: int | None = parameter(
        None, Number(0, 10**6, integer=True),
        "Frames of each demonstration on which multibasin looks at candidates that only lead the way; what counts is\n"
        "the fitness on all frames. 0: all frames; not set: by the joints.", optional=True,
    )  # fmt: skip
    particles: int = parameter(
        400, Number(1, 10**6, integer=True), "N, number of particles.", panel=SEARCH,
        short="Number of particles N of a swarm; where given and no algorithm is, that is rapso.",
    )  # fmt: skip
    iterations: int = parameter(
        200, Number(1, 10**6, integer=True), "M, number of iterations.", panel=SEARCH,
        short="Number of iterations M of a swarm; where given and no algorithm is, that is rapso.",
    )  # fmt: skip
    seed: int = parameter(0, Number(0, 2**63 - 1, integer=True), "Seed of the random numbers.", panel=SEARCH)
    inertia: float = parameter(0.8, Number(0.0, 1.0), "w of eq. 7.")
    c1: float = parameter(0.4, Number(0.0, 10.0), "c_1 of eq. 7, pull to the particle's own best.")
    c2: float = parameter(0.6, Number(0.0, 10.0), "c_2 of eq. 7, pull to the swarm's best.")
    c_range: tuple[float, float] = parameter(
        (-0.5, 0.5), Interval(Number(-10.0, 10.0)), "c_min, c_max of eq. 8 (RA-PSO)."
    )
    range: str = parameter(
        "valid", Choice(("valid", "box")), "Range of eq. 8: extent over the valid particles, or width of the box."
    )
    angle_interval: int = parameter(
        2, Number(1, 10**6, integer=True), "D: angular entries move only in every D-th iteration (RA-PSO)."
    )
    patience: int | None = parameter(
        None, Number(1, 10**6, integer=True),
        "Stop after this many iterations without a gain of 0.1 %; not set: never. Of multibasin 400 candidates count\n"
        "as an iteration.", optional=True, panel=STOP,
    )  # fmt: skip
    target: float | None = parameter(
        None, Number(0.0, 1e6, "m"), "Stop once the fitness r is this low [m]; not set: never.", optional=True,
        panel=STOP,
    )  # fmt: skip
    time_limit: float | None = parameter(
        None, Number(0.0, 1e9, "s", above=True),
        "Stop after this time [s], the iteration at hand finished; not set: never.", optional=True, panel=STOP,
        short="Stop after this time, the iteration at hand finished: 90s, 30m, 2h or 1d; not set: never.",
    )  # fmt: skip
    prune: bool = parameter(
        True, Switch(), "Drop a candidate once its partial sum passes its own best; changes nothing but the time."
    )
    first: tuple[tuple[float, ...], ...] | None = parameter(
        None, Several(Several(Number(), 1, 40), 0, 10**6),
        "Designs that the first generation begins with, the rest of it is drawn: for each the free entries of the DH\n"
        "table in their order, alpha, a, d row by row [rad, m], then the base yaw; not set: none.", optional=True,
    )  # fmt: skip

    def changed(self) -> dict[str, Any]:
        """The entries that differ from their defaults, with the algorithm where the others would mean another."""
        entries = super().changed()
        algorithm = {name: getattr(self, name) for name in ("algorithm",)}
        return entries if with_algorithm(entries)["algorithm"] == self.algorithm else algorithm | entries

    def has(self, name: str) -> bool:
        """Whether the algorithm uses the setting of that name, one that only some algorithms have."""
        return name in ALGORITHM_SETTINGS[self.algorithm]

    @property
    def candidates(self) -> int:
        """Candidates that are evaluated at most."""
        return math.prod(getattr(self, name) for name in SIZES if self.has(name))

    @property
    def size(self) -> str:
        """How large the search is, in words."""
        sizes = {name: words for name, words in SIZES.items() if self.has(name)}
        return ", ".join(f"{before}{counted(getattr(self, name), noun)}" for name, (before, noun) in sizes.items())


SECTIONS: tuple[type[Section], ...] = (Task, Design, Cell, Body, Needs, Fitness, Solver, Search)


@dataclass(frozen=True, repr=False)
class Settings:
    """All settings of one search; its attributes are the sections, see ``help(Design)`` and so on for their entries."""

    task: Task = dataclasses.field(default_factory=Task)
    design: Design = dataclasses.field(default_factory=Design)
    cell: Cell = dataclasses.field(default_factory=Cell)
    body: Body = dataclasses.field(default_factory=Body)
    needs: Needs = dataclasses.field(default_factory=Needs)
    fitness: Fitness = dataclasses.field(default_factory=Fitness)
    solver: Solver = dataclasses.field(default_factory=Solver)
    search: Search = dataclasses.field(default_factory=Search)

    def __post_init__(self) -> None:
        """Check that every section is one.

        Raises:
            SettingsError: A section is of another type.
        """
        for kind in SECTIONS:
            value = getattr(self, kind.title())
            if not isinstance(value, kind):
                what = f"the section '{kind.title()}' is {value!r}"
                raise SettingsError(what, value=value, fix=f"Write {kind.title()}={kind.__name__}(...)")

    def __repr__(self) -> str:
        """What differs from the defaults, as one would write it."""
        sections = {kind.title(): getattr(self, kind.title()) for kind in SECTIONS}
        return f"Settings({', '.join(f'{title}={each!r}' for title, each in sections.items() if each.changed())})"

    def replace(self, changes: Mapping[str, Mapping[str, Any]]) -> Settings:
        """A copy with other values, given as {section: {entry: value}}.

        Raises:
            SettingsError: Unknown section or entry, or a value that is not allowed.
        """
        by_title = {kind.title(): kind for kind in SECTIONS}
        sections = {}
        for title, entries in changes.items():
            home = next((kind.title() for kind in SECTIONS if title in kind.names()), None)
            if title not in by_title and home is not None:
                raise SettingsError(
                    f"'{title}' stands outside of any section",
                    value=title,
                    allowed=list(by_title),
                    fix=f"Move it below [{home}]",
                )
            if title not in by_title:
                raise SettingsError(f"unknown section [{title}]", value=title, allowed=list(by_title))
            if not isinstance(entries, Mapping):
                raise SettingsError(f"'{title}' is a section, not a value", value=entries, fix=f"Write [{title}]")
            names = by_title[title].names()
            for name in entries:
                if name not in names:
                    raise SettingsError(f"unknown setting '{title}.{name}'", value=name, allowed=list(names))
            meant = with_algorithm(entries, self.search.algorithm) if title == Search.title() else entries
            meant = with_dof(entries) if title == Design.title() else meant
            sections[title] = dataclasses.replace(getattr(self, title), **meant)
        return dataclasses.replace(self, **sections)

    def with_entries(self, **entries: Any) -> Settings:  # noqa: ANN401 (any setting)
        """A copy with other sections or entries, each by its name: ``with_entries(dof=4, search=Search(budget=500))``.

        Args:
            entries: Whole sections by their titles, and entries of any section; no two sections have one of a name.

        Raises:
            SettingsError: A name is unknown, or a value is not allowed.
        """
        homes = {name: kind.title() for kind in SECTIONS for name in kind.names()}
        sections = {title: entries.pop(title) for title in self.to_dict() if title in entries}
        changes: dict[str, dict[str, Any]] = {}
        for name, value in entries.items():
            if name not in homes:
                close = difflib.get_close_matches(name, [*homes, *self.to_dict()], n=3)
                raise SettingsError(f"unknown setting '{name}'", value=name, allowed=close or sorted(homes))
            changes.setdefault(homes[name], {})[name] = value
        return dataclasses.replace(self, **sections).replace(changes)

    def to_dict(self) -> dict[str, dict[str, Any]]:
        """All values as plain {section: {entry: value}}, without those not set."""
        tables = {kind.title(): dataclasses.asdict(getattr(self, kind.title())) for kind in SECTIONS}
        return {title: {k: v for k, v in table.items() if v is not None} for title, table in tables.items()}

    def to_toml(self, *, comments: bool = False) -> str:
        """All values as TOML, optionally with their documentation."""
        return "\n".join(section_toml(getattr(self, kind.title()), comments=comments) for kind in SECTIONS)


def read_settings(path: str | Path) -> Settings:
    """Read a TOML file of settings; entries left out keep their defaults.

    Args:
        path: The file. Relative paths of recordings count from its folder.

    Raises:
        SettingsError: The file is missing or not TOML, or holds an unknown or disallowed entry.
    """
    path = Path(path)
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise SettingsError(f"cannot read the settings {path}: {error.strerror}", value=str(path)) from error
    except UnicodeDecodeError as error:
        raise SettingsError(f"the settings {path} are not UTF-8 text", value=str(path)) from error
    except (ValueError, RecursionError) as error:  # TOMLDecodeError, or numbers and nesting beyond all bounds
        raise SettingsError(
            f"the settings {path} are not valid TOML: {error}",
            fix="'armdesign search --write-config' prints a file to start from",
        ) from error
    try:
        settings = Settings().replace(tables)
    except SettingsError as error:
        raise SettingsError(f"{path}: {error}", value=error.value) from error
    return beside(settings, path.parent)


def beside(settings: Settings, folder: Path) -> Settings:
    """Settings with the paths of their recordings and obstacles counted from a folder."""
    task = settings.task
    files = {name: str(folder / file) for name, file in task.files.items()}
    recording = None if task.recording is None else str(folder / task.recording)
    given = {name: getattr(task, name) for name in ("more_recordings", "holdouts")}
    lists = {name: [str(folder / path) for path in paths] for name, paths in given.items() if paths}
    obstacles = [str(folder / path) for path in settings.cell.obstacles]
    return settings.replace(
        {"task": {"recording": recording, "files": files, **lists}, "cell": {"obstacles": obstacles}}
    )
