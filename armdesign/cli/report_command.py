"""``armdesign report``: a finished run as a page to read, print or mail."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from armdesign.cli.common import announce_compiling, one_sentence_errors, refuse_existing
from armdesign.cli.section_flags import takes_sections
from armdesign.errors import RunFolderError, SettingsError
from armdesign.export.options import BodyOptions, LimitOptions, RobotOptions, SimulationOptions

if TYPE_CHECKING:
    from armdesign.export.trajectory.simulation import Tracking
    from armdesign.runs.reading import FinishedRun

DEFAULT_NAME = "report.html"
SUFFIXES = (".html", ".htm")
SECTIONS = {"limits": LimitOptions, "body": BodyOptions, "simulation": SimulationOptions}


@one_sentence_errors
@takes_sections(lambda: SECTIONS)
def report(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder with a result.")],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE.html", help="Page to write; default: report.html in RUN.")
    ] = None,
    pdf: Annotated[
        bool, typer.Option("--pdf", help="Print it as PDF beside it too; needs a Chromium browser.")
    ] = False,
    simulate: Annotated[
        bool, typer.Option("--simulate", help="Add how the arm follows the hand in MuJoCo; needs armdesign[sim].")
    ] = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace FILE.html; that in RUN is replaced anyway.")
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Do not say what was written.")] = False,
    *,
    limits: LimitOptions,
    body: BodyOptions,
    simulation: SimulationOptions,
) -> None:
    """Write the report of a run: one HTML page with the arm, its DH table, errors, joint loads and assumptions.

    The page needs no network and prints well. What it assumes beyond the design (tubes, motors, loads) is an option
    below, as in armdesign export.
    """
    targets = page_and_pdf(run, out, pdf=pdf, overwrite=overwrite)
    from armdesign.files import write_whole  # noqa: PLC0415
    from armdesign.runs.reading import read_finished  # noqa: PLC0415
    from armdesign.views.report import print_pdf, report_html  # noqa: PLC0415

    options = RobotOptions(body, limits, simulation)
    with announce_compiling(quiet):
        finished = read_finished(run)
    page = report_html(finished, options=options, tracking=simulated(finished, options) if simulate else None)
    write_whole(targets[0], page)
    if not quiet:
        typer.echo(f"Written: {targets[0]}")
    if pdf:
        print_pdf(page, targets[1])
        if not quiet:
            typer.echo(f"Written: {targets[1]}")


def simulated(run: FinishedRun, options: RobotOptions) -> Tracking:
    """The exported arm on its trajectory in a physics simulation.

    Raises:
        MissingExtraError: MuJoCo is not installed.
    """
    from armdesign.export.robot_file import finished_robot  # noqa: PLC0415
    from armdesign.export.trajectory.simulation import simulate  # noqa: PLC0415
    from armdesign.export.urdf import robot_urdf  # noqa: PLC0415

    arm = finished_robot(run.evaluation, run.prepared, options)
    return simulate(run, urdf=robot_urdf(arm))


def page_and_pdf(run: Path, out: Path | None, *, pdf: bool, overwrite: bool) -> tuple[Path, Path]:
    """The files to write, checked before any work is done.

    Raises:
        RunFolderError: There is no run folder, or an output is a folder, lies in none, or exists.
        SettingsError: The name of the page is not one of an HTML file.
    """
    if not run.is_dir():
        what = "is a file" if run.exists() else "does not exist"
        raise RunFolderError(f"the run folder {run} {what}", value=str(run), fix="Name the folder that a search wrote")
    page = run / DEFAULT_NAME if out is None else out
    if page.is_dir():
        raise RunFolderError(
            f"the output {page} is a folder", value=str(page), fix=f"Write --out {page / DEFAULT_NAME}"
        )
    if page.suffix.lower() not in SUFFIXES:
        fix = f"Write --out {page.with_suffix('.html')}" + (" --pdf" if page.suffix.lower() == ".pdf" else "")
        raise SettingsError(f"the page {page} is no HTML file", value=str(page), allowed=list(SUFFIXES), fix=fix)
    targets = (page, page.with_suffix(".pdf"))
    for target in targets if pdf else targets[:1]:
        if target.is_dir():
            raise RunFolderError(f"the output {target} is a folder", value=str(target), fix="Choose another name")
        refuse_existing(target, overwrite=overwrite or out is None)
    if not page.parent.is_dir():
        raise RunFolderError(f"the folder {page.parent} does not exist", value=str(page), fix="Create it first")
    return targets
