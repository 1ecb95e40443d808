"""Catalogues of actuators: one TOML file a family, every figure with its unit and its source.

    family = "mine"                      # what it is called
    maker = "Somebody"
    units = { torque = "N m", speed = "rpm", mass = "g", length = "mm" }    # what the figures below are in
    [[source]]                           # where figures come from; each needs one
    document = "data sheet AB-12"
    date = "2026-03"
    figures = ["peak_torque", "no_load_speed", "rated_torque", "mass", "diameter", "length"]
    [[actuator]]
    name = "A1"
    ...

``FIGURES`` has all figures of an actuator; ``building/kit.py`` says what a [kit] of links and brackets is. A housing is
round, by diameter and length, or a box, by width, height and depth with the ``axis`` that its output turns about. Of a
box, ``axis_from_end`` is how far that axis is from the near end of the longer side across it (the middle where it is
left out), ``horn`` how far the output's face stands out of the box, and ``side_holes`` are the tapped holes in either
side that is across the shorter one, for the screws that hold it:

    side_holes = { along = [14.0, 30.0], across = [6.0, 38.0], thread = "M2.5", depth = 4.0 }

in the family's lengths, ``along`` the axis from the face that the output is on, ``across`` from the axis towards the
far end, a hole for each pair of both. Where holes are not for metric screws, brackets are not drilled, but leave room
for them: ``output_room`` is the diameter of a circle of four in the output, and in the back of a box there are

    back_holes = { across = [-7.5, 22.5], beside = 8.0, thread = "M2" }

``beside`` the axis, to either side, with heads as those of ``thread``. At least one of rated and peak torque is there;
the other is taken to be the same, or by the family's ``rated_share`` of the peak. A family's ``position`` is what its
actuators read of their own position, ``{ range = 360.0, middle = 180.0 }`` in degrees, counterclockwise as the output
is looked at.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any

from armdesign.building.kit import Kit, kit_faults, kit_of
from armdesign.building.motor_table import motor_table
from armdesign.building.parts import SCREWS
from armdesign.errors import CatalogueError
from armdesign.files import is_number

UNITS: Mapping[str, Mapping[str, float]] = {
    "torque": {"N m": 1.0, "mN m": 1e-3, "kgf cm": 0.0980665, "ozf in": 0.00706155},
    "speed": {"rad/s": 1.0, "rpm": math.pi / 30.0, "deg/s": math.pi / 180.0},
    "mass": {"kg": 1.0, "g": 1e-3},
    "length": {"m": 1.0, "mm": 1e-3},
}
"""Units that a family may be given in, with their size in SI units."""
FIGURES: Mapping[str, str] = {
    "rated_torque": "torque", "peak_torque": "torque", "rated_speed": "speed", "no_load_speed": "speed", "mass": "mass",
    "diameter": "length", "length": "length", "width": "length", "height": "length", "depth": "length",
    "axis_from_end": "length", "horn": "length", "output_offset": "length", "rotor_inertia": "kg m^2", "ratio": "",
    "angle_range": "deg", "voltage": "V", "max_voltage": "V", "peak_current": "A", "price": "",
    "output_circle": "length", "output_screws": "", "output_depth": "length", "output_room": "length",
    "housing_circle": "length", "housing_screws": "",
}  # fmt: skip
"""Numbers that an actuator may have, and what they measure; the first ones by the family's units."""
PUBLISHED = ("rated_speed", "rotor_inertia", "ratio", "angle_range", "voltage", "max_voltage", "peak_current", "price",
             "output_offset", "output_depth", "output_room")  # fmt: skip
"""Of these the figures of an actuator that are None where they are not published."""
OPTIONAL = ("currency", "rated_share", "kit", "order", "position")
WORDS = ("name", "axis", "interface", "sheet", "note", "output_thread", "housing_thread")
CIRCLES = ("output", "housing")
"""Ends of an actuator with a bolt circle: '_circle' is its diameter, '_screws' how many, '_thread' such as M3."""
BOX = ("width", "height", "depth")
SIDES, BACK = "side_holes", "back_holes"
STRONGEST, WEAKEST = 150.0, 0.1
"""Peak torque over mass of actuators, at most and at least [N m / kg]: harmonic drives reach some 140."""
DENSEST, LIGHTEST = 12000.0, 200.0
"""Mass over the volume of the housing, at most and at least [kg/m^3]: between solid copper and foam."""
FASTEST = 300.0
"""No-load speed at most [rad/s]; a joint's gear leaves some tens."""


@dataclass(frozen=True)
class Source:
    """Where figures come from.

    Attributes:
        document: What was published.
        date: When, or in which version.
        figures: The figures that are from there.
    """

    document: str
    date: str
    figures: tuple[str, ...]


@dataclass(frozen=True)
class Actuator:
    """A motor with its gear in one housing, in SI units.

    Attributes:
        family: The family it belongs to.
        name: What it is sold as.
        rated_torque: What it bears as root mean square [N m].
        peak_torque: What it gives at most [N m].
        no_load_speed: Its speed without load [rad/s].
        rated_speed: Its speed at the rated torque [rad/s]; None where it is not published.
        mass: Its mass [kg].
        diameter: Diameter of the cylinder about its axis that its housing is in, wherever that is turned to [m].
        length: Its length along the axis, from the end of its housing to the face of its output [m].
        rotor_inertia: Of the rotor, before the gear [kg m^2]; None where it is not published.
        ratio: Of the gear; None where it is not published.
        angle_range: How far it turns in all [rad]; None where without end.
        voltage: What the figures hold at [V]; None where it is not published.
        max_voltage: The highest that it may be fed with [V]; None where only that of the figures.
        peak_current: What it takes at its peak torque [A]; None where it is not published.
        price: In the family's currency; None where it is not known.
        interface: How it is talked to.
        sheet: Address of its data sheet.
        circles: Bolt circles of its output and of its housing's other end, by ``CIRCLES``: diameter [m], number and
            thread; without those that are not published.
        output_offset: From the face it is mounted with to that of its output, along the axis [m]; None where it is not
            published.
        order: What is added to its name in an order, by the bus; without those that nothing is added for.
        maker: Who makes it; empty where that is not recorded.
        box: Of a box whose axis' place is known: from the axis to its near end, to its far end, and its width across
            both [m]; None for other housings, which count as round.
        horn: How far the output's face stands out of a box [m].
        output_depth: How deep screws may go into its output [m]; None where that is not known.
        side_holes: Tapped holes in either side of a box: ``along`` the axis from its front [m], ``across`` from the
            axis to the far end [m], ``thread`` and ``depth`` [m]; empty where they are not known.
        output_room: Diameter of a circle of four holes in its output that are not for metric screws, so that what is
            on it is not drilled, but leaves room for them [m]; None where that is not known.
        back_holes: Such holes in the back of a box, for the same: ``across`` from the axis to the far end and
            ``beside`` it, to either side [m], and ``thread``, the nearest; empty where they are not known.
        note: What a mechanic has to know of it.
        position: ``range`` of what it reads of its own position, from 0 on, counterclockwise as its output is looked
            at, and the ``middle`` of it [rad]; empty where that is not known.
    """

    family: str
    name: str
    rated_torque: float
    peak_torque: float
    no_load_speed: float
    rated_speed: float | None
    mass: float
    diameter: float
    length: float
    rotor_inertia: float | None = None
    ratio: float | None = None
    angle_range: float | None = None
    voltage: float | None = None
    max_voltage: float | None = None
    peak_current: float | None = None
    price: float | None = None
    interface: str = ""
    sheet: str = ""
    circles: Mapping[str, tuple[float, int, str]] = field(default_factory=dict)
    output_offset: float | None = None
    order: Mapping[str, str] = field(default_factory=dict)
    maker: str = ""
    box: tuple[float, float, float] | None = None
    horn: float = 0.0
    output_depth: float | None = None
    side_holes: Mapping[str, Any] = field(default_factory=dict)
    output_room: float | None = None
    back_holes: Mapping[str, Any] = field(default_factory=dict)
    position: Mapping[str, float] = field(default_factory=dict)
    note: str = ""

    @property
    def drilled(self) -> bool:
        """Whether it is known where it is screwed to at both ends, so that its brackets can be drilled."""
        return "output" in self.circles and ("housing" in self.circles or bool(self.side_holes))

    @property
    def volume(self) -> float:
        """Of its housing [m^3]."""
        if self.box is None:
            return math.pi * self.diameter**2 / 4.0 * self.length
        near, far, width = self.box
        return (near + far) * width * (self.length - self.horn)

    @property
    def buses(self) -> tuple[str, ...]:
        """What it can be talked to by: its interfaces one by one."""
        return tuple(self.interface.split(" or ")) if self.interface else ()

    @property
    def most_voltage(self) -> float:
        """The highest voltage that it may be fed with [V]; infinite where none is published."""
        highest = self.voltage if self.max_voltage is None else self.max_voltage
        return math.inf if highest is None else highest

    @property
    def height(self) -> float:
        """From the face it is mounted with to that of its output [m]: its length, where that is not published."""
        return self.length if self.output_offset is None else self.output_offset

    @property
    def slope(self) -> float:
        """How much speed it loses by torque [rad/s per N m]: through its rated point, or down to a stop at the peak."""
        if self.rated_speed is None:
            return self.no_load_speed / self.peak_torque
        return (self.no_load_speed - self.rated_speed) / self.rated_torque

    @property
    def reflected_inertia(self) -> float:
        """Inertia of the rotor as its output feels it, J i^2 [kg m^2]; 0 where it is not published."""
        return 0.0 if self.rotor_inertia is None or self.ratio is None else self.rotor_inertia * self.ratio**2


@dataclass(frozen=True)
class Catalogue:
    """A family of actuators.

    Attributes:
        family: What it is called.
        maker: Who makes them.
        currency: Of the prices; empty where there are none.
        sources: Where the figures come from.
        actuators: Its sizes, in the order of the file.
        kit: Its links and brackets; None where it has none.
    """

    family: str
    maker: str
    currency: str
    sources: tuple[Source, ...]
    actuators: tuple[Actuator, ...]
    kit: Kit | None = None

    def source(self, figure: str) -> Source | None:
        """Where a figure comes from."""
        return next((source for source in self.sources if figure in source.figures), None)


def shipped() -> dict[str, Path]:
    """The catalogues that come with the package, by family."""
    folder = Path(str(resources.files("armdesign.building"))) / "catalogues"
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def find_catalogue(name: str) -> Catalogue:
    """A catalogue by the name of its family, or a file of one's own.

    Args:
        name: A family that is shipped, or the path of a TOML file or a table of motors.

    Raises:
        CatalogueError: There is none, or it is faulty.
    """
    if name in shipped():
        return read_catalogue(shipped()[name])
    if not Path(name).is_file():
        raise CatalogueError(
            f"there is no catalogue '{name}'", value=name, allowed=[*shipped(), "a TOML file", "a table *_motors.csv"],
            fix="'armdesign catalogue list' shows what there is",
        )  # fmt: skip
    return read_catalogue(Path(name))


def read_catalogue(path: Path) -> Catalogue:
    """Read and check a catalogue.

    Raises:
        CatalogueError: The first fault.
    """
    catalogue, faults = examine(path)
    if faults or catalogue is None:
        raise CatalogueError(faults[0], value=str(path), fix=f"'armdesign catalogue check {path}' lists every fault")
    return catalogue


def examine(path: Path) -> tuple[Catalogue | None, list[str]]:
    """Read a catalogue and find everything that is wrong with it.

    Args:
        path: A TOML file, or a table of motors as ``motor_table.py`` describes.

    Returns:
        The catalogue, None where it is faulty, and the faults, in sentences.

    Raises:
        CatalogueError: The file cannot be read, or is not TOML or such a table.
    """
    content = motor_table(path) if path.suffix.lower() == ".csv" else read_toml(path, "the catalogue")
    faults = [f"{path.name}: {fault}" for fault in family_faults(content)]
    if faults:
        return None, faults
    scales = {kind: UNITS[kind][unit] for kind, unit in content["units"].items()}
    sources = tuple(Source(e["document"], e["date"], tuple(e["figures"])) for e in content["source"])
    sourced = {figure for source in sources for figure in source.figures}
    share, actuators = content.get("rated_share"), []
    faults += [f"{path.name}: figure '{name}' has no source" for name in ("rated_share", "kit", "order", "position")
               if name in content and name not in sourced]  # fmt: skip
    for k, entry in enumerate(content["actuator"], start=1):
        name = entry.get("name", f"number {k}")
        figures = [f for f in entry if f in (*FIGURES, SIDES, BACK)]
        wrong = [*entry_faults(entry, share), *(f"figure '{f}' has no source" for f in figures if f not in sourced)]
        if not wrong:
            actuator = made(entry, content, scales, share)
            wrong = list(implausible(actuator, content["units"]))
            actuators.append(actuator)
        faults += [f"{path.name}: actuator '{name}': {fault}" for fault in wrong]
    doubled = sorted({a.name for i, a in enumerate(actuators) if a.name in {b.name for b in actuators[:i]}})
    faults += [f"{path.name}: there is more than one actuator '{name}'" for name in doubled]
    currency = content.get("currency", "")
    if not currency and any(actuator.price is not None for actuator in actuators):
        faults.append(f"{path.name}: there are prices, but no 'currency'")
    if faults:
        return None, faults
    kit = kit_of(content["kit"], scales) if "kit" in content else None
    return Catalogue(content["family"], content["maker"], currency, sources, tuple(actuators), kit), []


def read_toml(path: Path, what: str, allowed: str | None = None) -> dict[str, Any]:
    """What a TOML file of parts holds.

    Args:
        path: The file.
        what: What it is called in messages.
        allowed: What else could be given.

    Raises:
        CatalogueError: It cannot be read, or is not TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        message = f"cannot read {what} {path}: {error.strerror}"
        raise CatalogueError(message, value=str(path), allowed=allowed) from error
    except (ValueError, RecursionError) as error:
        raise CatalogueError(f"{what} {path} is not valid TOML: {error}", value=str(path)) from error


def family_faults(content: Mapping[str, Any]) -> Iterator[str]:
    """What is wrong with the head of a catalogue."""
    known = {"family": str, "maker": str, "units": dict, "source": list, "actuator": list}
    for name, wanted in known.items():
        if name not in content:
            yield f"'{name}' is missing"
        elif not isinstance(content[name], wanted) or not content[name]:
            yield f"'{name}' is {content[name]!r}, not {'a text' if wanted is str else 'filled in'}"
    for name in content:
        if name not in (*known, *OPTIONAL):
            yield f"unknown entry '{name}'; allowed: {', '.join((*known, *OPTIONAL))}"
    if "kit" in content:
        yield from kit_faults(content["kit"])
    share = content.get("rated_share", 1.0)
    if not is_number(share) or not 0.0 < share <= 1.0:
        yield f"'rated_share' is {share!r}; allowed: above 0, at most 1"
    order: Any = content.get("order", {})
    if not isinstance(order, dict) or not all(isinstance(text, str) for text in order.values()):
        yield f"'order' is {order!r}, not texts by the interface, such as {{ TTL = '-T' }}"
    position: Any = content.get("position", {"range": 360.0, "middle": 180.0})
    whole = (
        isinstance(position, dict) and set(position) == {"range", "middle"} and all(map(is_number, position.values()))
    )
    if not whole or not 0.0 < position["middle"] < position["range"]:
        yield f"'position' is {position!r}, not such as {{ range = 360.0, middle = 180.0 }}, in degrees"
    if not isinstance(content.get("currency", ""), str):
        yield f"'currency' is {content['currency']!r}, not a text"
    units: Any = content.get("units")
    for kind, allowed in UNITS.items() if isinstance(units, dict) else ():
        if units.get(kind) not in allowed:
            given = f"is {units[kind]!r}" if kind in units else "is missing"
            yield f"'units.{kind}' {given}; allowed: {', '.join(allowed)}"
    for entry in content["source"] if isinstance(content.get("source"), list) else ():
        fields = entry if isinstance(entry, dict) else {}
        named = isinstance(fields.get("figures"), list) and all(isinstance(x, str) for x in fields["figures"])
        if not named or not all(isinstance(fields.get(name), str) and fields[name] for name in ("document", "date")):
            yield "a [[source]] needs 'document', 'date' and 'figures', a list of names"
            continue
        for name in fields["figures"]:
            if name not in (*FIGURES, *WORDS, SIDES, BACK, *OPTIONAL[1:]):
                yield f"a [[source]] names the unknown figure '{name}'"
    for entry in content["actuator"] if isinstance(content.get("actuator"), list) else ():
        if not isinstance(entry, dict):
            yield f"'actuator' holds {entry!r}, not tables [[actuator]]"


def entry_faults(entry: Mapping[str, Any], share: float | None) -> Iterator[str]:
    """What is wrong with the fields of an actuator.

    Args:
        entry: Its table.
        share: The family's rated share of peak torques.
    """
    for name, value in entry.items():
        if name in WORDS:
            if not isinstance(value, str) or not value:
                yield f"'{name}' is {value!r}, not a text"
        elif name == SIDES:
            yield from side_faults(value)
        elif name == BACK:
            yield from back_faults(value)
        elif name not in FIGURES:
            yield f"unknown figure '{name}'; allowed: {', '.join((*WORDS, *FIGURES, SIDES, BACK))}"
        elif not is_number(value) or value < 0.0 or (value == 0.0 and name != "output_offset"):
            yield f"'{name}' is {value!r}; allowed: a number above 0"
    for name in ("name", "mass", "no_load_speed"):
        if name not in entry:
            yield f"'{name}' is missing"
    for end in CIRCLES:
        given = [name for name in (f"{end}_circle", f"{end}_screws", f"{end}_thread") if name in entry]
        if given and len(given) < 3:
            yield f"the bolt circle of the {end} has only {' and '.join(given)}; it needs _circle, _screws and _thread"
        if str(entry.get(f"{end}_thread", "M3")) not in SCREWS:
            yield f"'{end}_thread' is {entry[f'{end}_thread']!r}; allowed: {', '.join(SCREWS)}"
        if is_number(entry.get(f"{end}_screws", 4)) and entry.get(f"{end}_screws", 4) not in range(2, 25):
            yield f"'{end}_screws' is {entry[f'{end}_screws']!r}; allowed: whole numbers from 2 to 24"
    if "rated_torque" not in entry and "peak_torque" not in entry:
        yield "'rated_torque' and 'peak_torque' are missing; one of them is needed"
    elif "rated_torque" not in entry and share is None:
        yield "'rated_torque' is missing, and the family has no 'rated_share' of the peak"
    rows, box = ("diameter" in entry, "length" in entry), [name in entry for name in BOX]
    if any(rows) and any(box):
        yield "the housing is given twice, as a round one and as a box"
    elif not (all(rows) or all(box)):
        yield "the housing is missing: 'diameter' and 'length', or 'width', 'height', 'depth' and 'axis'"
    elif any(box) and entry.get("axis") not in BOX:
        yield f"'axis' is {entry.get('axis')!r}; allowed: {', '.join(BOX)}, the one along which the output turns"
    elif all(box) and is_number(entry.get("axis_from_end")):
        half = max(entry[name] for name in BOX if name != entry["axis"] and is_number(entry[name])) / 2.0
        if entry["axis_from_end"] > half:
            yield (
                f"'axis_from_end' is {entry['axis_from_end']}; allowed: at most {half:g}, half of the longer side "
                "across the axis, since it is from the near end"
            )
    box_alone = [name for name in ("axis_from_end", "horn", SIDES, BACK) if name in entry]
    if box_alone and not all(box):
        yield f"'{box_alone[0]}' is of a housing that is a box, by 'width', 'height', 'depth' and 'axis'"
    if "axis_from_end" not in entry and box_alone and all(box):
        yield f"'{box_alone[0]}' needs 'axis_from_end', too"


def side_faults(holes: object) -> Iterator[str]:
    """What is wrong with the holes in the sides of a box."""
    table: dict[str, Any] = holes if isinstance(holes, dict) else {}
    rows = [table.get(name) for name in ("along", "across")]
    right = all(isinstance(row, list) and row and all(is_number(x) and x > 0.0 for x in row) for row in rows)
    depth: Any = table.get("depth")
    if not right or not is_number(depth) or depth <= 0.0 or str(table.get("thread")) not in SCREWS or len(table) != 4:
        yield (
            f"'{SIDES}' is {holes!r}; it has 'along' and 'across', lists of numbers above 0, 'depth' above 0, and "
            f"'thread', one of {', '.join(SCREWS)}"
        )


def back_faults(holes: object) -> Iterator[str]:
    """What is wrong with the holes in the back of a box."""
    table: dict[str, Any] = holes if isinstance(holes, dict) else {}
    across, beside = table.get("across"), table.get("beside")
    right = isinstance(across, list) and across and all(is_number(x) for x in (*across, beside))
    if not right or float(beside or 0.0) < 0.0 or str(table.get("thread")) not in SCREWS or len(table) != 3:
        yield (
            f"'{BACK}' is {holes!r}; it has 'across', a list of numbers, 'beside', a number not below 0, and 'thread', "
            f"one of {', '.join(SCREWS)}"
        )


def made(
    entry: Mapping[str, Any], content: Mapping[str, Any], scales: Mapping[str, float], share: float | None
) -> Actuator:  # fmt: skip
    """An actuator of a checked table.

    Args:
        entry: Its table.
        content: That of the family it belongs to.
        scales: Sizes of the family's units.
        share: The family's rated share of peak torques.
    """
    si = {name: float(entry[name]) * scales.get(kind, 1.0) for name, kind in FIGURES.items() if name in entry}
    peak = si.get("peak_torque", si.get("rated_torque", 0.0))
    size, sides, back, box = scales["length"], entry.get(SIDES, {}), entry.get(BACK, {}), None
    if "axis" in entry:
        width, height = sorted(si[name] for name in BOX if name != entry["axis"])
        near = si.get("axis_from_end", height / 2.0)
        box = (near, height - near, width) if "axis_from_end" in si else None
        si |= {"diameter": 2.0 * math.hypot(height - near, width / 2.0),
               "length": si[entry["axis"]] + si.get("horn", 0.0)}  # fmt: skip
    if "angle_range" in si:
        si["angle_range"] = math.radians(si["angle_range"])
    known: dict[str, Any] = {name: si.get(name) for name in PUBLISHED}
    words = {name: entry.get(name, "") for name in ("interface", "sheet", "note")}
    return Actuator(
        content["family"], entry["name"], si.get("rated_torque", peak * (share or 1.0)), peak, si["no_load_speed"],
        mass=si["mass"], diameter=si["diameter"], length=si["length"], **known, **words,
        circles={
            end: (si[f"{end}_circle"], int(si[f"{end}_screws"]), entry[f"{end}_thread"])
            for end in CIRCLES if f"{end}_circle" in entry
        },
        order=dict(content.get("order", {})),
        position={name: math.radians(value) for name, value in content.get("position", {}).items()},
        maker=content["maker"],
        box=box,
        horn=si.get("horn", 0.0),
        back_holes={} if not back else dict(
            back, across=[size * x for x in back["across"]], beside=size * back["beside"]
        ),
        side_holes={} if not sides else dict(
            sides, along=[size * x for x in sides["along"]], across=[size * x for x in sides["across"]],
            depth=size * sides["depth"],
        ),
    )  # fmt: skip


def implausible(actuator: Actuator, units: Mapping[str, str]) -> Iterator[str]:
    """Figures of an actuator that no actuator has, and the unit that they look like.

    Args:
        actuator: The actuator.
        units: The units that its figures were taken in.
    """
    if actuator.rated_torque > actuator.peak_torque:
        yield f"its rated torque of {actuator.rated_torque:.4g} N m is above its peak of {actuator.peak_torque:.4g} N m"
    if actuator.voltage is not None and actuator.voltage > actuator.most_voltage:
        yield f"its max_voltage of {actuator.most_voltage:g} V is below the {actuator.voltage:g} V of its figures"
    if actuator.rated_speed is not None and actuator.rated_speed > actuator.no_load_speed:
        yield f"its rated speed of {actuator.rated_speed:.4g} rad/s is above that without load"
    volume = actuator.volume
    density = actuator.mass / volume
    if not LIGHTEST <= density <= DENSEST:
        yield (
            f"{actuator.mass:.4g} kg in a housing of {volume * 1e6:.4g} cm^3 are {density:.3g} kg/m^3: it looks as if "
            f"its mass were not in {units['mass']}, or its size not in {units['length']}"
        )
        return
    strength = actuator.peak_torque / actuator.mass
    if strength > STRONGEST:
        unit = "kgf cm" if strength * UNITS["torque"]["kgf cm"] <= STRONGEST else "mN m"
        yield (
            f"{actuator.peak_torque:.4g} N m of {actuator.mass:.4g} kg are more than any actuator gives: it looks as "
            f"if its torque were in {unit}, not in {units['torque']}"
        )
    elif strength < WEAKEST:
        yield (
            f"{actuator.peak_torque:.4g} N m of {actuator.mass:.4g} kg are next to nothing: it looks as if its torque "
            f"were not in {units['torque']}"
        )
    if actuator.no_load_speed > FASTEST:
        yield (
            f"{actuator.no_load_speed:.4g} rad/s are more than any joint turns: it looks as if its speed were in rpm, "
            f"not in {units['speed']}, or that of the motor before the gear"
        )
