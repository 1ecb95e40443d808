"""``armdesign tolerance``: what deviations of an arm's dimensions do to the hand's error and to clearance."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from math import degrees, radians
from pathlib import Path
from typing import Annotated

import typer

from armdesign.building import RECORD
from armdesign.building.part_tolerances import link_deviations
from armdesign.building.record import recorded_build
from armdesign.building.tolerance import Band, ClearanceBand, Tolerances
from armdesign.building.tolerance import tolerance as tolerance_of
from armdesign.cli.command_errors import one_sentence_errors
from armdesign.cli.command_options import OUTPUT, number_of, option
from armdesign.cli.screen import compiling, show_table, show_text
from armdesign.errors import counted
from armdesign.runs.checking import finished_arm
from armdesign.search.result import Result

SHOWN = 8
"""Dimensions of the budget that are shown."""


@one_sentence_errors
def tolerance(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="Run folder of a search, an evaluation or a build.")],
    length: Annotated[
        str | None,
        option(
            "--length", "MM", "Tolerance of lengths a and d; default: of a build what its drawings allow, else 0.5mm."
        ),
    ] = None,
    twist: Annotated[
        str | None,
        option(
            "--twist", "DEG", "Tolerance of twists alpha; default: of a build what its drawings allow, else 0.2deg."
        ),
    ] = None,
    zero: Annotated[str, option("--zero", "DEG", "Tolerance of the joints' zeros.")] = "0.1deg",
    samples: Annotated[int, option("--samples", "N", "Arms that are drawn.")] = 10000,
    uniform: Annotated[
        bool,
        option(
            "--uniform",
            None,
            "Deviations spread evenly up to the tolerance, not Gaussian with 95 % in it; "
            "of some alone by the word, such as --length '0.5mm uniform'.",
        ),
    ] = False,
    seed: Annotated[int, option("--seed", "N", "Seed of the random numbers.")] = 0,
    as_json: Annotated[bool, option("--json", None, "Print the same as JSON: metres.", OUTPUT)] = False,
) -> None:
    """Say how accurate arms are whose parts deviate.

    Many arms are drawn, with and without calibration; beside it the budget in first order, which dimension costs what.
    """
    given = {"length": (length or "0.5mm", "mm"), "twist": (twist or "0.2deg", "deg"), "zero": (zero, "deg")}
    values = {
        name: number_of(f"--{name}", text.removesuffix("uniform").strip(), f"a number, such as 0.5{unit}", unit)
        for name, (text, unit) in given.items()
    }
    chosen = Tolerances(
        1e-3 * values["length"], radians(values["twist"]), radians(values["zero"]), samples,
        uniform or tuple(name for name, (text, _) in given.items() if text.endswith("uniform")), seed,
    )  # fmt: skip
    result = finished_arm(run)
    links = part_deviations(result) if length is None and twist is None else ()
    with compiling(quiet=as_json):
        report = tolerance_of(result, replace(chosen, links=links))
    if as_json:
        typer.echo(json.dumps(asdict(report), indent=2))
        return
    if links:
        off, turned = max(length for length, _ in links), max(twist for _, twist in links)
        show_text(f"By its parts' drawings lengths of links are off by up to {off * 1e3:.2f} mm, twists by "
                  f"{degrees(turned):.2f} deg.")  # fmt: skip
    rows = [cells("as built", report.band)]
    if report.calibrated is not None:
        rows.append(cells("calibrated", report.calibrated))
    show_table(("largest hand error", "designed [mm]", "median [mm]", "95 % keep [mm]"), rows)
    words = f"95 % of arms built like this meet {report.band.p95 * 1e3:.2f} mm"
    words += f"; {report.budget[0].name} matters most"
    if report.calibrated is not None:
        words += f"; after calibration {report.calibrated.p95 * 1e3:.2f} mm"
    show_text(f"{words}. Drawn: {counted(report.arms[0], 'arm')}, {report.arms[1]} of them calibrated.")
    gaps = [(name, each) for name, each in (("as built", report.clearance), ("calibrated", report.calibrated_clearance))
            if each is not None]  # fmt: skip
    if gaps:
        heads = ("clearance", "designed [mm]", "median [mm]", "95 % keep [mm]", "deviates by [mm]")
        show_table(heads, [gap_cells(*each) for each in gaps])
    show_table(
        ("dimension", "moves the tool by [mm]"),
        [(share.name, f"{share.moved * 1e3:.3f}") for share in report.budget[:SHOWN]],
    )
    show_text(
        f"All together {report.first_order * 1e3:.3f} mm root mean square in first order, "
        f"{report.moved * 1e3:.3f} mm by the arms drawn."
    )


def part_deviations(result: Result) -> tuple[tuple[float, float], ...]:
    """What the links of a build may be off by its parts' drawings; nothing of an arm that is no build of made parts."""
    if result.folder is None or not (result.folder / RECORD).is_file():
        return ()
    assembly = recorded_build(result).assembly
    return () if assembly is None else link_deviations(assembly, result.table.dof)


def cells(name: str, band: Band) -> tuple[str, ...]:
    """A band as a row of text."""
    return (name, *(f"{value * 1e3:.2f}" for value in (band.nominal, band.median, band.p95)))


def gap_cells(name: str, band: ClearanceBand) -> tuple[str, ...]:
    """A band of clearances as a row of text."""
    return (name, *(f"{value * 1e3:.2f}" for value in (band.nominal, band.median, band.p5, band.sigma)))
