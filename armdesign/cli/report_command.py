"""``armdesign report``: a finished run as a page to read, print or mail."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from armdesign import views
from armdesign.cli.command_errors import one_sentence_errors, refuse_existing
from armdesign.cli.command_options import option
from armdesign.cli.screen import compiling
from armdesign.cli.setting_flags import Given, takes_settings
from armdesign.errors import RunFolderError, SettingsError
from armdesign.export.options import LimitOptions, RobotOptions, SimulationOptions
from armdesign.runs.reading import read_result
from armdesign.settings import Body

DEFAULT_NAME = "report.html"
SUFFIXES = (".html", ".htm")


@one_sentence_errors
@takes_settings(LimitOptions, Body, SimulationOptions, without={"kind", "module_slide"})
def report(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder with a result.")],
    out: Annotated[Path | None, option("--out", "FILE.html", "Page to write (default RUN/report.html).")] = None,
    pdf: Annotated[
        bool, option("--pdf", None, "Also write the page as PDF beside it; needs a Chromium browser.")
    ] = False,
    simulate: Annotated[
        bool,
        option("--simulate", None, "Add a simulation of the arm following the hand in MuJoCo; needs armdesign[sim]."),
    ] = False,
    overwrite: Annotated[
        bool, option("--overwrite", None, "Replace the page of --out; that in RUN is replaced in any case.")
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing.")] = False,
    *,
    given: Given,
) -> None:
    """Write the report of a run as one HTML page.

    It shows the arm, its DH table, errors, joint loads and assumptions. The page needs no network and prints well. What
    it assumes beyond the design (tubes, motors, loads) is an option below, as in armdesign export.
    """
    targets = page_and_pdf(run, out, pdf=pdf, overwrite=overwrite)
    limits, simulation = LimitOptions(**given["limits"]), SimulationOptions(**given["simulation"])
    with compiling(quiet=quiet):
        finished = read_result(run)
    options = RobotOptions(replace(finished.problem.settings.body, **given["body"]), limits, simulation)
    written = views.writing.report(finished, targets[0], options=options, simulate=simulate, pdf=pdf, overwrite=True)
    if not quiet:
        for target in written:
            typer.echo(f"Written: {target}")


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
