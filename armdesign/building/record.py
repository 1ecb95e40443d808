"""What a build was made of, in its run folder, so that its parts can be made again from it."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

from armdesign.building import RECORD
from armdesign.building.assembly import assemble
from armdesign.building.build import Build
from armdesign.building.build_options import BuildOptions
from armdesign.building.catalogue import Actuator
from armdesign.building.choice import Choice, Shortfall
from armdesign.building.kit import Kit, Piece
from armdesign.building.settling import BOUGHT
from armdesign.building.shop import shop_of
from armdesign.building.tubes import Tube
from armdesign.errors import CatalogueError, RunFolderError
from armdesign.files import read_json
from armdesign.search.result import Result


class Origin(NamedTuple):
    """The design that a build is after.

    Attributes:
        run: Its run folder, or its name.
        error: Largest distance of its tool from the hand [m].
        sure: How sure its search is that there is no better arm, in a sentence; empty where that is not known.
    """

    run: str
    error: float
    sure: str = ""


def build_record(build: Build, design: Result | None) -> str:
    """A build's choice and options, and where it is from, as JSON.

    Args:
        build: The build.
        design: The arm that it is after; None where that is not known.
    """
    choice = build.choice
    origin = None
    if design is not None:
        sure = "" if design.facts is None else design.facts.found
        origin = Origin(str(design.folder or design.name), design.verdict.hand_error.max, sure)._asdict()
    record: dict[str, Any] = {
        "design": origin,
        "options": asdict(build.options),
        "actuators": [asdict(a) for a in choice.actuators],
        "cost": choice.cost,
        "nodes": choice.nodes,
        "shortfalls": [list(used) for used in choice.shortfalls],
        "tube": None if build.tube is None else asdict(build.tube),
        "sag": build.sag,
        "speed": build.speed,
        "currency": build.currency,
        "kit": None if build.kit is None else asdict(build.kit),
        "apart": [] if build.assembly is None else build.assembly.apart,
    }
    return json.dumps(record, indent=2) + "\n"


def recorded_build(result: Result) -> Build:
    """The build that a result was read from.

    Args:
        result: What a build's run folder gave.

    Raises:
        RunFolderError: It is no build, or its record cannot be read.
        CatalogueError: Its parts do not fit.
    """
    path = None if result.folder is None else result.folder / RECORD
    if path is None or not path.is_file():
        raise RunFolderError(
            f"{result.folder or result.name} is no build, and parts are chosen in a build",
            value=str(result.folder or result.name),
            fix=f"'armdesign build {result.folder or 'RUN'} --catalogue NAME' makes one",
        )  # fmt: skip
    record = read_json(path)
    try:
        options = BuildOptions(**record["options"])
        actuators = tuple(Actuator(**each) for each in record["actuators"])
        used = tuple(Shortfall(*each) for each in record["shortfalls"])
        tube = None if record["tube"] is None else Tube(**record["tube"])
        choice = Choice(actuators, float(record["cost"]), used, int(record["nodes"]))
        kit = record.get("kit")
        kit = None if kit is None else Kit(**kit | {"pieces": tuple(Piece(*each) for each in kit["pieces"])})
        apart = tuple(map(int, record.get("apart", ())))
        rest = record["sag"], float(record["speed"]), options, str(record["currency"])
    except (KeyError, TypeError, ValueError) as error:
        raise RunFolderError(f"{path} is no record of a build: {error!r}", value=str(path)) from error
    if kit is not None:
        return Build(result, choice, tube, *rest, misfit=BOUGHT, kit=kit)
    shop = shop_of(result.problem.settings.body, tube, printed=options.printed)
    try:
        assembly = assemble(result.body, actuators, shop, apart)
    except CatalogueError as error:
        return Build(result, choice, tube, *rest, misfit=error.what)
    return Build(result, choice, tube, *rest, assembly=assembly)


def recorded_origin(result: Result) -> Origin | None:
    """The design that a build is after; None where its record, of an earlier version, does not say.

    Args:
        result: What a build's run folder gave.

    Raises:
        RunFolderError: The record cannot be read.
    """
    path = Path(result.folder or ".") / RECORD
    design = read_json(path).get("design")
    try:
        return None if design is None else Origin(str(design["run"]), float(design["error"]), str(design["sure"]))
    except (KeyError, TypeError, ValueError) as error:
        raise RunFolderError(f"{path} is no record of a build: {error!r}", value=str(path)) from error
