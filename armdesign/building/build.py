"""From a finished design to an arm of parts: tubes by stiffness, actuators by torque and speed, to a fixed point."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from armdesign.bodies.loads import base_gravity
from armdesign.building.assembly import assemble
from armdesign.building.catalogue import Actuator, find_catalogue, shipped
from armdesign.building.choice import Choice, Duty, Load, choose, choose_alike, duty_of, weakest
from armdesign.building.kit import Kit, KitArm, kit_arm
from armdesign.building.kit_snapping import snapped_to_kit
from armdesign.building.parts import Assembly
from armdesign.building.parts_clearance import APART, PartsGap, parts_gap
from armdesign.building.room import leaves_room, room_flags
from armdesign.building.shop import Shop, envelope, shop_of
from armdesign.building.snapping import snapped
from armdesign.building.supply import Supply, supply_of
from armdesign.building.tubes import Stock, Tube, find_stock, worst_deflection
from armdesign.errors import CatalogueError, SettingsError
from armdesign.feasibility.words import headline
from armdesign.kinematics.motion import smooth_motion
from armdesign.search.design_problem import Demonstration, DesignProblem
from armdesign.search.evaluation import motions
from armdesign.search.result import Result
from armdesign.settings.sections import Body

ROUNDS = 8
"""Most times that actuators are chosen anew because the parts that go with them have changed the arm."""
BOUGHT = "it is made of a kit's links and brackets, which are bought"
"""Why a build of a kit has no solids."""
CUT = 1e-3
"""What tubes are cut to where no stock says it [m]."""
PEDESTAL = 0.08
"""Between a base's plate and the first module: what their brackets need, where lengths are fitted again [m]."""
MORE = (0.01, 0.02)
"""Room about every module where parts do not fit without, one after the other [m]."""
POSTS = (0.0, 0.02, 0.04, 0.06)
"""How much farther the plate of an arm that hangs may stand, where its brackets do not fit between [m]."""
THINNER = ("aluminium tube 25 x 2", "aluminium tube 16 x 1.5")
"""Tried in place of tubes that a design only assumes, where parts do not fit or actuators do not bear these."""
SLOWEST = 0.02
"""Share of the demonstrated speed below which an arm counts as too weak to move."""


@dataclass(frozen=True)
class BuildOptions:
    """What an arm is built of, and how well.

    Attributes:
        catalogue: A family or a catalogue file.
        least: What is minimised: ``mass`` or ``price``.
        margin: Factor on the torques that are needed.
        payload: Point mass at the tool [kg]; None for the task's.
        speed: Share of the demonstrated speed; ``auto`` for the largest at which there is a choice.
        stock: Tubes to choose from, ``aluminium`` or a file; None to keep those of the design.
        deflection: How far the tool may sag under the payload [m].
        snap: Whether lengths become what tubes are cut to, and twists those of brackets.
        printed: Whether brackets of any angle can be had.
        known_holes: Whether only actuators are taken whose bolt holes the catalogue knows, which drills every bracket.
    """

    catalogue: str
    least: str = "mass"
    margin: float = 1.2
    payload: float | None = None
    speed: float | str = 1.0
    stock: str | None = None
    deflection: float = 1e-3
    snap: bool = True
    printed: bool = False
    known_holes: bool = False

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            SettingsError: A value is not allowed.
        """
        if self.least not in ("mass", "price"):
            raise SettingsError(f"--for is {self.least!r}", value=self.least, allowed=["mass", "price"])
        if isinstance(self.speed, str) and self.speed != "auto":
            raise SettingsError(f"--speed is {self.speed!r}", value=self.speed, allowed="auto, or a number")
        for name, number, low, high in (
            ("--margin", self.margin, 1.0, 100.0),
            ("--payload", self.payload or 0.0, 0.0, 1000.0),
            ("--deflection", self.deflection, 1e-6, 1.0),
            ("--speed", 1.0 if isinstance(self.speed, str) else self.speed, SLOWEST, 1.0),
        ):
            if not low <= number <= high:
                raise SettingsError(f"{name} is {number:g}", value=number, allowed=f"{low:g} to {high:g}")


@dataclass(frozen=True, eq=False)
class Build:
    """An arm of parts.

    Attributes:
        result: The arm with the bodies, masses and limits of its parts, slowed down where it had to be.
        choice: Its actuators.
        tube: Its tubes; None where they are those that the design had assumed.
        sag: How far its tool sags under the payload at worst [m]; None without a tube of known stiffness.
        speed: Share of the demonstrated speed.
        options: What was asked for.
        currency: Of the actuators' prices.
        before: The same before lengths and twists were snapped; None where they were not.
        assembly: All its parts as solids; None where they do not fit.
        misfit: What does not fit then, in a sentence.
        measured: The gap of its parts, where it has been measured already.
        kit: The links and brackets of the family, where it is built of them; None where of tubes.
    """

    result: Result
    choice: Choice
    tube: Tube | None
    sag: float | None
    speed: float
    options: BuildOptions
    currency: str
    before: Result | None = None
    assembly: Assembly | None = None
    misfit: str = ""
    measured: tuple[PartsGap | None] | None = None
    kit: Kit | None = None

    @cached_property
    def gap(self) -> PartsGap | None:
        """Where its parts come nearest to each other and to obstacles on the motion; None where nowhere near."""
        if self.measured is not None or self.assembly is None:
            return self.measured[0] if self.measured else None
        return parts_gap(self.assembly, self.result)

    @cached_property
    def supply(self) -> Supply:
        """What its actuators need besides."""
        return supply_of(self.choice.actuators)

    @property
    def warning(self) -> str:
        """The fault as all that is written or said of it begins; empty where there is none."""
        return f"NOT TO BE MADE: {self.fault}" if self.fault else ""

    @property
    def fault(self) -> str:
        """Why it cannot be put together and do its task as it is, in a clause; empty where it can."""
        if self.kit is None and self.assembly is None:
            return f"its parts do not fit together: {self.misfit}"
        if self.gap is not None and self.gap.met:
            return f"{self.gap.words}, and parts have to keep {APART * 1e3:g} mm apart"
        verdict = self.result.verdict
        wrong = (*verdict.reasons, headline(verdict, self.result.problem.settings))
        return "" if verdict.passed else wrong[0].rstrip(".")

    def remedy(self, run: str | Path) -> str:
        """What helps where the parts are what is wrong, a sentence and the command below it; empty elsewhere.

        They are where they do not fit or meet, and where the arm has done its task before it was built of them.

        Args:
            run: Folder of the search.
        """
        done_before = self.before is not None and self.before.verdict.passed
        if self.kit is not None or not self.fault or (self.fits == 2 and not done_before):
            return ""
        settings = self.result.problem.settings
        command = f"armdesign search --config {Path(run) / 'settings.toml'}"
        if self.before is not None and leaves_room(self.before.problem.settings.body, settings.body):
            words, rest = "Its search has left that room already: take another family, or another arm:", "again"
            command += f" --seed {settings.search.seed + 1}"
        else:
            words, rest = "Take an arm that is searched with the room of these parts:", "room"
            command += f" {room_flags(settings.body)}"
        return f"{words}\n  {command} --out {run}-{rest}"

    @property
    def fits(self) -> int:
        """How far its parts go together: 2 where on the whole motion, 1 where as they are bolted, 0 where not."""
        return 0 if self.assembly is None else 1 if self.gap is not None and self.gap.met else 2

    @cached_property
    def pieces(self) -> KitArm | None:
        """The pieces of the kit that it is made of; None where it is built of tubes."""
        if self.kit is None:
            return None
        return kit_arm(self.result.table, [a.height for a in self.choice.actuators], self.kit)


def assembly_of(build: Build) -> Assembly:
    """The parts of a build.

    Raises:
        CatalogueError: They do not fit together.
    """
    if build.assembly is None:
        raise CatalogueError(f"the parts of this build do not fit together: {build.misfit}", value=build.result.name)
    return build.assembly


def build(result: Result, options: BuildOptions) -> Build:
    """Pick the parts of a finished design.

    Snapping is done with the bodies of a first choice, modules within their links so that brackets fit, and the parts
    are chosen anew for what it gives; of a kit, whose pieces fit actuators of one height, until those stay the same.

    Args:
        result: The design with its paths.
        options: What it is built of.

    Raises:
        CatalogueError: No choice of actuators or tubes meets what is asked; which joint, by how much, and what would.
    """
    cut = CUT if options.stock is None else find_stock(options.stock).cut
    thin = thinner(result, options)
    tries: list[tuple[float, Tube | None]] = [(0.0, None), *((0.0, tube) for tube in thin)]
    tries += [(more, thin[-1] if thin else None) for more in MORE if options.snap]
    designed: dict[Tube | None, Build] = {}
    made, fault = None, None
    for more, tube in tries:  # until the parts fit and pass each other
        try:
            if tube not in designed:
                designed[tube] = chosen_parts(result, options, tube=tube)
            first = designed[tube]
            if first.kit is not None and options.snap:
                return built_of_kit(result, first, first.kit, options)
            tried = first if not options.snap else replace(snapped_build(result, first, more, cut), before=first.result)
        except CatalogueError as error:
            fault = fault or error
            continue
        made = tried if made is None or tried.fits > made.fits else made
        if made.fits == 2:
            break
    if made is None:
        raise fault or CatalogueError("there is nothing to build of", value=options.catalogue)
    return made


def snapped_build(result: Result, first: Build, more: float, cut: float) -> Build:
    """An arm of cut lengths and brackets' twists.

    Args:
        result: The design.
        first: It with its actuators, before it is snapped.
        more: Room about every module beyond that of its parts [m].
        cut: Lengths become multiples of it [m].

    Raises:
        CatalogueError: No such arm does the task, or no choice of actuators or tubes meets what is asked.
    """
    body = vars(first.result.problem.settings.body) | {"module_slide": 0.0, "inertials": None}
    room = tuple((across + more, along + more, mass) for across, along, mass in body["modules"])
    pedestal = body["base_height"] + room[0][1] / 2.0 + PEDESTAL + more if result.placed else 0.0
    spacious = changed(result, {"body": body | {"modules": room}})
    options = first.options
    tube = first.tube if options.stock is None else None
    return chosen_parts(snapped(spacious, cut, printed=options.printed, pedestal=pedestal), options, tube=tube)


def thinner(result: Result, options: BuildOptions) -> list[Tube]:
    """Tubes of ``THINNER`` that bear the payload, to try where the design's are only assumed; thickest first.

    Args:
        result: The design.
        options: What is asked for; where it names tubes, or a kit's links are taken, there are none to try.
    """
    body = result.problem.settings.body
    of_kit = find_catalogue(options.catalogue).kit is not None and not options.printed
    if options.stock is not None or of_kit or body.tube_diameter != Body().tube_diameter:
        return []
    payload = result.problem.settings.needs.payload if options.payload is None else options.payload
    return [
        tube for tube in find_stock("aluminium").tubes[::-1]
        if tube.name in THINNER and sag_with(result, payload, tube) <= options.deflection
    ]  # fmt: skip


def built_of_kit(result: Result, first: Build, kit: Kit, options: BuildOptions) -> Build:
    """An arm of a kit's links and brackets.

    Args:
        result: The design.
        first: Its actuators before it was snapped.
        kit: The kit.
        options: What it is built of.

    Raises:
        CatalogueError: No arm of the kit does the task, or no choice of actuators meets what is asked.
    """
    made = first
    for _ in range(ROUNDS):
        heights = tuple(a.height for a in made.choice.actuators)
        body = {"body": vars(made.result.problem.settings.body)}
        fitted = snapped_to_kit(changed(result, body), heights, kit)
        made = chosen_parts(fitted, options, heights)
        if heights == tuple(a.height for a in made.choice.actuators):
            return replace(made, before=first.result)
    raise CatalogueError(
        "the heights of the actuators go in a circle: the kit's pieces for each make another the better",
        value=options.catalogue, fix="Raise or lower --margin a little",
    )  # fmt: skip


def chosen_parts(
    result: Result, options: BuildOptions, heights: tuple[float, ...] = (), tube: Tube | None = None
) -> Build:  # fmt: skip
    """Pick the parts of a design as it is.

    Args:
        result: The design with its paths.
        options: What it is built of.
        heights: What the actuators' heights should be, n of them [m]; others are chosen only where none will do.
        tube: In place of the design's tubes, where none are chosen out of stock; None for those.

    Raises:
        CatalogueError: No choice of actuators or tubes meets what is asked; which joint, by how much, and what would.
    """
    catalogue = find_catalogue(options.catalogue)
    kit = catalogue.kit if options.stock is None and not options.printed else None
    sizes = candidates(catalogue.actuators, options)
    payload = result.problem.settings.needs.payload if options.payload is None else options.payload
    changes: dict[str, dict[str, Any]] = {"body": {"kind": "tube", "inertials": None}, "needs": {"payload": payload}}
    changes["needs"] |= {"max_torque": None, "max_speed": None}
    plain = changed(result, changes)
    sag = None
    if options.stock is not None:
        tube, sag = choose_tube(plain, find_stock(options.stock), options, payload)
    elif tube is not None and payload > 0.0:
        sag = sag_with(plain, payload, tube)
    if tube is not None:
        changes["body"] |= {"tube_diameter": tube.diameter, "tube_wall": tube.wall, "tube_density": tube.density}
    if kit is not None:
        changes["body"] |= kit.body
        sizes = tuple(replace(a, mass=a.mass + kit.fittings) for a in sizes)
    bare = changed(result, changes)
    shop = None if kit is not None else shop_of(bare.problem.settings.body, tube, printed=options.printed)
    speed, found = settled(bare, sizes, options, Load(payload, options.margin, (), heights))
    tried: list[Fitted] = []
    while len(tried) < ROUNDS:
        tried.append(fitted_with(bare, found, shop))
        load = Load(payload, options.margin, () if tried[-1].assembly is None else found.actuators, heights)
        speed, found = settled(tried[-1].arm, sizes, options, load)
        if found.actuators in [each.choice.actuators for each in tried]:
            break
    last = tried[-1]
    if found.actuators != last.choice.actuators:  # in a circle: each moves the modules so that another is better
        bearing = [(each, bears(each, speed, options, payload)) for each in tried]
        met = [(each, choice) for each, choice in bearing if choice is not None]
        if not met:
            raise CatalogueError(
                "the choice of actuators goes in a circle: each moves the modules so that another is better",
                value=options.catalogue, fix="Raise or lower --margin a little",
            )  # fmt: skip
        last, found = min(met, key=lambda each: (each[0].assembly is None, each[1].cost))
    changes["body"] |= {
        name: getattr(last.arm.problem.settings.body, name) for name in ("modules", "inertials", "post")
    }
    changes["needs"] |= {
        "max_torque": tuple(a.peak_torque for a in found.actuators),
        "max_speed": tuple(float(np.degrees(a.no_load_speed)) for a in found.actuators),
    }
    final = changed(result, changes, speed)
    own = {a.name: a for a in catalogue.actuators}
    found = replace(found, actuators=tuple(own[a.name] for a in found.actuators))
    return Build(
        final, found, tube, sag, speed, options, catalogue.currency, assembly=last.assembly, misfit=last.misfit,
        measured=(last.gap,), kit=kit,
    )  # fmt: skip


class Fitted(NamedTuple):
    """An arm with actuators in it.

    Attributes:
        choice: The actuators.
        arm: The arm with their sizes, and the mass properties of its parts where they fit.
        assembly: Its parts; None where they do not fit.
        misfit: What does not, in a sentence.
        gap: Where parts come nearest on the motion; None where nowhere near.
    """

    choice: Choice
    arm: Result
    assembly: Assembly | None
    misfit: str
    gap: PartsGap | None = None


def fitted_with(bare: Result, choice: Choice, shop: Shop | None) -> Fitted:
    """An arm with actuators in it.

    Args:
        bare: The arm.
        choice: The actuators.
        shop: What its other parts are made for; None where a kit's are bought.
    """
    sizes = [(a.diameter, a.length) if shop is None else envelope(a, shop) for a in choice.actuators]
    modules = tuple((*size, a.mass) for size, a in zip(sizes, choice.actuators, strict=True))
    misfit = ""
    for post in (0.0,) if bare.placed or shop is None else POSTS:
        arm = changed(bare, {"body": {"modules": modules, "inertials": None, "post": post}})
        if shop is None:
            return Fitted(choice, arm, None, BOUGHT)
        try:
            assembly, gap = passing(arm, choice.actuators, shop)
        except CatalogueError as error:
            misfit = misfit or error.what
            continue
        arm = changed(arm, {"body": {"inertials": assembly.inertials(arm.table.dof)}})
        return Fitted(choice, arm, assembly, "", gap)
    return Fitted(choice, changed(bare, {"body": {"modules": modules, "inertials": None}}), None, misfit)


def passing(arm: Result, actuators: Sequence[Actuator], shop: Shop) -> tuple[Assembly, PartsGap | None]:
    """The parts of an arm and where they come nearest on its motion; where a joint's meet, they keep to their sides.

    Args:
        arm: The arm.
        actuators: Its actuators, n of them.
        shop: What its other parts are made for.

    Raises:
        CatalogueError: They do not fit together.
    """
    apart: set[int] = set()
    assembly = assemble(arm.body, actuators, shop)
    gap = parts_gap(assembly, arm)
    while gap is not None and gap.met and gap.joint is not None and gap.joint not in apart:
        apart.add(gap.joint)
        try:
            other = assemble(arm.body, actuators, shop, apart)
        except CatalogueError:
            break
        assembly, gap = other, parts_gap(other, arm)
    return assembly, gap


def bears(fitted: Fitted, speed: float, options: BuildOptions, payload: float) -> Choice | None:
    """The actuators of an arm with what they use of their limits in it; None where it is too much.

    Args:
        fitted: The arm.
        speed: Share of the demonstrated speed.
        options: What was asked for.
        payload: Point mass at the tool [kg].
    """
    actuators = fitted.choice.actuators
    load = Load(payload, options.margin, () if fitted.assembly is None else actuators)
    paths = motions(fitted.arm.evaluation, fitted.arm.problem)
    moved = [smooth_motion(time / speed, q) for time, q in paths]
    duty = duty_of(fitted.arm.body, moved, actuators, fitted.arm.base_pose, load)
    torque = duty.torque(range(len(actuators)))
    used = tuple(duty.shortfall(j, j, torque[:, j]) for j in range(len(actuators)))
    return replace(fitted.choice, shortfalls=used, nodes=0) if all(each.met for each in used) else None


def candidates(actuators: Sequence[Actuator], options: BuildOptions) -> tuple[Actuator, ...]:
    """The actuators whose cost is known, and whose holes are where these have to be.

    Raises:
        CatalogueError: None has a price, where the cheapest choice is asked for, or holes that are known.
    """
    if options.known_holes:
        actuators = [a for a in actuators if a.drilled]
        if not actuators:
            raise CatalogueError(
                f"of no actuator in '{options.catalogue}' both bolt patterns are known", value=options.catalogue,
                allowed="dynamixel-x, or a catalogue of your own with them", fix="Leave --known-holes out",
            )  # fmt: skip
    sizes = tuple(a for a in actuators if options.least == "mass" or a.price is not None)
    if not sizes:
        raise CatalogueError(
            f"no price is known of any actuator in '{options.catalogue}'", value=options.least,
            fix="Choose by --for mass, or add prices to a catalogue of your own",
        )  # fmt: skip
    return sizes


def changed(result: Result, changes: dict[str, dict[str, Any]], speed: float = 1.0) -> Result:
    """A design under other settings of body and needs, with its modules put in their places anew.

    Args:
        result: The design.
        changes: {section: {entry: value}}.
        speed: Share of the demonstrated speed.
    """
    problem = slowed(result.problem.with_settings(changes), speed)
    return Result(problem, result.evaluation, name=result.name)


def slowed(problem: DesignProblem, share: float) -> DesignProblem:
    """Demonstrations slowed down; the frames and what counts from frame to frame stay.

    Args:
        problem: The demonstrations.
        share: Of their speed.
    """
    if share == 1.0:
        return problem
    limit = problem.settings.fitness.continuity_speed
    if limit is not None:
        problem = problem.with_settings({"fitness": {"continuity_speed": limit * share}})

    def slow(each: Demonstration) -> Demonstration:
        time = each.task.time[0] + (each.task.time - each.task.time[0]) / share
        room = None if each.room is None else slow(each.room)
        return replace(each, task=replace(each.task, time=time), room=room)

    seen, unseen = (tuple(map(slow, part)) for part in (problem.demonstrations, problem.holdouts))
    return DesignProblem(problem.settings, seen, unseen)


def sag_with(result: Result, payload: float, tube: Tube) -> float:
    """How far the tool sags under a payload in the worst pose of the motions, with other tubes [m].

    Args:
        result: The arm.
        payload: Point mass at the tool [kg].
        tube: What its tubes are of.
    """
    paths = [q for _, q in motions(result.evaluation, result.problem)]
    return worst_deflection(result.body, paths, payload * base_gravity(result.base_pose), tube)


def choose_tube(result: Result, stock: Stock, options: BuildOptions, payload: float) -> tuple[Tube, float]:
    """The lightest or cheapest tube with which the tool sags little enough, and how far it does.

    Raises:
        CatalogueError: None does, there is no payload, or no price is known.
    """
    if payload <= 0.0:
        raise CatalogueError(
            "tubes are chosen by how far the payload bends them, and there is none", value=payload,
            fix="Give --payload, or leave --stock out",
        )  # fmt: skip
    tubes = [each for each in stock.tubes if options.least == "mass" or each.price is not None]
    if not tubes:
        raise CatalogueError(f"no price is known of any tube in '{options.stock}'", fix="Choose by --for mass")
    sags = {}
    for each in sorted(tubes, key=lambda t: t.area * t.density if options.least == "mass" else float(t.price or 0.0)):
        sags[each.name] = sag_with(result, payload, each)
        if sags[each.name] <= options.deflection:
            return each, sags[each.name]
    name = min(sags, key=lambda name: sags[name])
    raise CatalogueError(
        f"under {payload:g} kg the tool sags {sags[name] * 1e3:.3g} mm even with {name}", value=sags[name],
        allowed=f"at most {options.deflection * 1e3:g} mm (--deflection)",
        fix="Take thicker tubes, a smaller payload, or a shorter arm",
    )  # fmt: skip


def settled(result: Result, sizes: tuple[Actuator, ...], options: BuildOptions, load: Load) -> tuple[float, Choice]:
    """Speed and actuators of an arm.

    Args:
        result: The arm.
        sizes: Actuators to choose from.
        options: What was asked for.
        load: What it carries.

    Raises:
        CatalogueError: There is no choice; it says which joint lacks how much, and what would help.
    """
    costs = [a.mass if options.least == "mass" else float(a.price or 0.0) for a in sizes]
    body, payload = result.body, load.payload
    paths = motions(result.evaluation, result.problem)

    def duty(speed: float, carried: float = payload, among: tuple[Actuator, ...] = sizes) -> Duty:
        moved = [smooth_motion(time / speed, q) for time, q in paths]
        return duty_of(body, moved, among, result.base_pose, load._replace(payload=carried, heights=()))

    wanted = 1.0 if isinstance(options.speed, str) else options.speed
    plain = duty(wanted)
    for heights in (load.heights, ()) if load.heights else ((),):
        found = choose_alike(replace(plain, heights=heights), costs)
        if found is not None:
            return wanted, found
    slower = largest(lambda speed: choose(duty(speed), costs) is not None, wanted)
    if slower is not None and options.speed == "auto":
        choice = choose_alike(duty(slower), costs)
        if choice is not None:
            return slower, choice
    even = slower is None and options.speed == "auto"
    joint, short, best = weakest(duty(SLOWEST) if even else plain)
    helps = [] if slower is None else [f"{slower * 100:.0f} % of the speed (--speed {slower:g})"]
    carried = largest(lambda share: choose(duty(wanted, share * payload), costs) is not None, 1.0) if payload else None
    helps += [] if carried is None else [f"a payload of {carried * payload:.3g} kg"]
    for name in shipped():
        among = find_catalogue(name).actuators
        if name != options.catalogue and choose(duty(wanted, payload, among), [a.mass for a in among]) is not None:
            helps.append(f"--catalogue {name}")
    raise CatalogueError(
        f"no actuator of '{options.catalogue}' is enough for joint {joint + 1}"
        f"{f', even at {SLOWEST * 100:g} % of the demonstrated speed' if even else ''}: the best, {best.name}, would "
        f"need {short.most:.3g} times its {short.worst}, the margin of {options.margin:g} included", value=short.most,
        allowed="at most 1",
        fix=f"What would do: {'; '.join(helps)}" if helps else "A shorter or lighter arm, or another family, would do",
    )  # fmt: skip


def largest(holds: Callable[[float], bool], most: float) -> float | None:
    """The largest share below ``most`` at which something holds, in hundredths, by bisection; None for none.

    Args:
        holds: Whether it does; where it does, it does at smaller shares, too.
        most: A share at which it does not.
    """
    low, high = round(SLOWEST * 100), round(most * 100)
    if not holds(low / 100):
        return None
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if holds(middle / 100) else (low, middle)
    return low / 100
