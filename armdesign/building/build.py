"""From a finished design to an arm of parts: lengths and twists snapped, parts settled, until they fit and pass."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from armdesign.building.build_options import BuildOptions
from armdesign.building.catalogue import find_catalogue
from armdesign.building.choice import Choice, Load
from armdesign.building.kit import Kit, KitArm, kit_arm
from armdesign.building.kit_snapping import snapped_to_kit
from armdesign.building.parts import Assembly
from armdesign.building.parts_clearance import PartsGap, parts_gap
from armdesign.building.room import leaves_room, room_flags
from armdesign.building.settling import (
    ROUNDS,
    Fitted,
    bears,
    candidates,
    changed,
    choose_tube,
    fitted_with,
    sag_with,
    settled,
)
from armdesign.building.shop import shop_of
from armdesign.building.snapping import snapped
from armdesign.building.supply import Supply, supply_of
from armdesign.building.tubes import Tube, find_stock
from armdesign.errors import CatalogueError
from armdesign.feasibility.verdict import Verdict
from armdesign.feasibility.words import Judged, headline
from armdesign.search.result import Result
from armdesign.settings.sections import Body

CUT = 1e-3
"""What tubes are cut to where no stock says it [m]."""
PEDESTAL = 0.08
"""Between a base's plate and the first module: what their brackets need, where lengths are fitted again [m]."""
MORE = (0.01, 0.02)
"""Room about every module where parts do not fit without, one after the other [m]."""
THINNER = ("aluminium tube 25 x 2", "aluminium tube 16 x 1.5")
"""Tried in place of tubes that a design only assumes, where parts do not fit or actuators do not bear these."""


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

    @cached_property
    def verdict(self) -> Verdict:
        """The arm's; not feasible where its parts do not fit together, or meet."""
        verdict, wrong = self.result.verdict, ""
        if self.kit is None and self.assembly is None:
            wrong = f"Its parts do not fit together: {self.misfit}."
        elif self.gap is not None and self.gap.met:
            wrong = self.told(self.gap).ruling
        return replace(verdict, feasible=False, reasons=(wrong, *verdict.reasons)) if wrong else verdict

    @property
    def judged(self) -> Judged:
        """What its verdict is put into words by."""
        return self.result.judged._replace(speed=self.speed)

    def told(self, gap: PartsGap) -> PartsGap:
        """A gap whose parts are called by what they are and their mark: ``tube flange L2-T1``."""
        placed = () if self.assembly is None else self.assembly.placed
        kinds = {each.mark: f"{each.part.kind} {each.mark}" for each in placed}
        first, second = (kinds.get(mark, mark) for mark in gap.parts)
        return gap._replace(parts=(first, second))

    @property
    def fault(self) -> str:
        """Why it cannot be put together and do its task as it is, worst first; empty where it can."""
        verdict = self.verdict
        wrong = (*verdict.reasons, headline(verdict, self.judged))
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
                designed[tube] = settled_parts(result, options, tube=tube)
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
    return settled_parts(snapped(spacious, cut, printed=options.printed, pedestal=pedestal), options, tube=tube)


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
        made = settled_parts(fitted, options, heights)
        if heights == tuple(a.height for a in made.choice.actuators):
            return replace(made, before=first.result)
    raise CatalogueError(
        "the heights of the actuators go in a circle: the kit's pieces for each make another the better",
        value=options.catalogue, fix="Raise or lower --margin a little",
    )  # fmt: skip


def settled_parts(
    result: Result, options: BuildOptions, heights: tuple[float, ...] = (), tube: Tube | None = None
) -> Build:  # fmt: skip
    """Actuators and tubes of a design as it is, chosen anew until what goes with them no longer changes the choice.

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
