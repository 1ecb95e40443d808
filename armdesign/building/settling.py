"""Actuators, tubes and speed of an arm as it is, and how its parts go together with them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from armdesign.bodies.loads import base_gravity
from armdesign.building.assembly import assemble
from armdesign.building.build_options import SLOWEST, BuildOptions
from armdesign.building.catalogue import Actuator, find_catalogue, shipped
from armdesign.building.choice import Choice, Duty, Load, choose, choose_alike, duty_of, weakest
from armdesign.building.parts import Assembly
from armdesign.building.parts_clearance import PartsGap, parts_gap
from armdesign.building.shop import Shop, envelope
from armdesign.building.tubes import Stock, Tube, worst_deflection
from armdesign.errors import CatalogueError
from armdesign.search.design_problem import Demonstration, DesignProblem
from armdesign.search.evaluation import motions
from armdesign.search.result import Result

ROUNDS = 8
"""Most times that actuators are chosen anew because the parts that go with them have changed the arm."""
BOUGHT = "it is made of a kit's links and brackets, which are bought"
"""Why a build of a kit has no solids."""
POSTS = (0.0, 0.02, 0.04, 0.06)
"""How much farther the plate of an arm that hangs may stand, where its brackets do not fit between [m]."""


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
    moved = [each.at_speed(speed) for each in fitted.arm.moved]
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
    """A design with {section: {entry: value}} and its speed's share changed, its modules put in place anew."""
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
    """How far the tool sags under a payload [kg] in the worst pose of the motions, with other tubes [m]."""
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

    def duty(speed: float, carried: float = payload, among: tuple[Actuator, ...] = sizes) -> Duty:
        return duty_of(
            body,
            [each.at_speed(speed) for each in result.moved],
            among,
            result.base_pose,
            load._replace(payload=carried, heights=()),
        )

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
