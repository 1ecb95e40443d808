"""``armdesign build``: pick the parts of a finished design."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from armdesign.building import RECORD
from armdesign.building.assembly_steps import ASSEMBLY, assembly_page
from armdesign.building.build import Build
from armdesign.building.build import build as build_of
from armdesign.building.build_options import BuildOptions
from armdesign.building.part_lists import part_lists
from armdesign.building.record import build_record
from armdesign.cli.check_command import FAILED
from armdesign.cli.command_errors import one_sentence_errors
from armdesign.cli.command_options import OUTPUT, OverwriteOption, QuietOption, number_of, option
from armdesign.cli.screen import compiling, say, show_table, show_text, written_text
from armdesign.feasibility.words import sentence, summary
from armdesign.runs.checking import finished_arm
from armdesign.runs.folder import claim_folder
from armdesign.runs.writing import write_files, write_result
from armdesign.search.result import Result


@one_sentence_errors
def build(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="Run folder of a search or an evaluation.")],
    catalogue: Annotated[
        str, option("--catalogue", "NAME", "Family of actuators, see catalogue list, or a catalogue file.")
    ],
    payload: Annotated[
        float | None, option("--payload", "KG", "Point mass at the tool [kg]; default: the task's.")
    ] = None,
    least: Annotated[str, option("--for", "mass|price", "What is to be least.")] = "mass",
    margin: Annotated[float, option("--margin", "X", "Factor on the torques that are needed.")] = 1.2,
    speed: Annotated[
        str, option("--speed", "auto|X", "Share of the demonstrated speed; auto: as fast as the family can.")
    ] = "1",
    stock: Annotated[
        str | None,
        option("--stock", "FILE", "Tubes to choose from: aluminium, or a TOML file; default: the design's own."),
    ] = None,
    deflection: Annotated[
        str, option("--deflection", "MM", "How far the tool may sag under the payload, with --stock.")
    ] = "1mm",
    snap: Annotated[
        bool, option("--snap/--no-snap", None, "Lengths to what tubes are cut to, twists to 0 and 90 deg, refitted.")
    ] = True,
    printed: Annotated[bool, option("--printed", None, "Brackets of any angle: twists stay as they are.")] = False,
    known_holes: Annotated[
        bool, option("--known-holes", None, "Only actuators whose bolt holes are known: every bracket is drilled.")
    ] = False,
    out: Annotated[Path | None, option("--out", "DIR", "Run folder to write; default: build/RUN.", OUTPUT)] = None,
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
) -> None:
    """Pick the parts of a finished design.

    Actuators out of a catalogue, the lightest or cheapest that bear the demonstrated motion with their own masses;
    tubes by stiffness. The build is a run folder, with a bill of materials and a cut list in it. Ends with 0 where
    parts fit and pass each other and obstacles, and the arm is feasible and meets a stated tolerance, else with 3.
    """
    options = BuildOptions(
        catalogue, least, margin, payload,
        "auto" if speed == "auto" else number_of("--speed", speed, "auto, or a number"), stock,
        1e-3 * number_of("--deflection", deflection, "millimetres, such as 1mm", "mm"), snap, printed,
        known_holes,
    )  # fmt: skip
    design = finished_arm(run)
    with compiling(quiet=quiet, slopes=snap, bodies=snap):
        made = build_of(design, options)
    place = out or Path("build") / design.name
    claim_folder(place, overwrite=overwrite)
    written = write_result(place, made.result)
    page = {} if made.assembly is None else {ASSEMBLY: assembly_page(made)}
    written += write_files(place, {**part_lists(made), **page, RECORD: build_record(made, design)})
    if made.fault:
        words, _, command = made.remedy(run).partition("\n")
        say(f"{made.warning}. {words}".rstrip())
        if command:
            typer.echo(command, err=True)  # whole, to be copied
    if not quiet:
        show_build(made)
        typer.echo(written_text([place / name for name in written]))
    if made.fault:
        raise typer.Exit(FAILED)


def show_build(made: Build) -> None:
    """Print the actuators with what they use of their limits, and the verdict on the arm."""
    rows = []
    for j, (a, used) in enumerate(zip(made.choice.actuators, made.choice.shortfalls, strict=True), start=1):
        shares = (f"{100.0 * share:.0f}" for share in (used.rms, used.peak, used.speed))
        price = "-" if a.price is None else f"{a.price:.0f} {made.currency}"
        rows.append((f"joint {j}", a.name, *shares, f"{a.mass:.3g}", price))
    show_table(("", "actuator", "rated [%]", "peak [%]", "speed [%]", "mass [kg]", "price"), rows, left=(0, 1))
    least = "lighter" if made.options.least == "mass" else "cheaper"
    alone = max(len(made.supply.voltages), len(made.supply.buses)) < 2
    of = "one supply and bus" if alone else "several supplies or buses, and none of one,"
    show_text(
        f"No {least} choice of {of} meets the margin of {made.options.margin:g}: proven in {made.choice.nodes} steps."
        if made.choice.nodes else
        f"Each choice moves the modules so that another is better; this is the {least.replace('er', 'est')} that bears."
    )  # fmt: skip
    show_text(made.supply.words)
    if made.tube is not None:
        why = "" if made.options.stock else ", since it cannot be built with the design's thicker ones"
        sag = "" if made.sag is None else f"; the tool sags {made.sag * 1e3:.2f} mm under the payload at most"
        show_text(f"Tubes: {made.tube.name}{why}{sag}.")
    if made.before is not None:
        show_snapping(made.before, made.result)
    if made.speed < 1.0:
        say(f"The motion is slowed down to {made.speed * 100:.0f} % of the demonstrated speed.")
    if made.gap is not None and not made.gap.met:
        show_text(f"{sentence(made.told(made.gap).words)}, no parts come nearer.")
    if made.kit is None and made.assembly is None:
        say("There are no solids of its parts, and masses leave brackets out.")
    show_text(f"What moves weighs {made.result.body.moving_mass:.2f} kg.")
    result = made.result
    show_text("\n".join(summary(result.verdict, made.judged, result.base_pose)))


def show_snapping(before: Result, after: Result) -> None:
    """Print what lengths and twists of parts have cost.

    Args:
        before: The arm of the design's own lengths and twists, with its parts.
        after: That of cut tubes and brackets.
    """
    rows = []
    for name, arm in (("as designed", before), ("as built", after)):
        gap = arm.verdict.self_clearance
        error = arm.verdict.hand_error
        cells = (f"{arm.fitness:.4f}", *(f"{x * 1e3:.2f}" for x in (error.mean, error.p95, error.max)))
        rows.append((name, *cells, "-" if gap is None else f"{gap.value * 1e3:.1f}"))
    show_table(("", "r [m]", "hand mean [mm]", "95 % [mm]", "largest [mm]", "clearance [mm]"), rows)
