"""``armdesign check``: the verdict on a finished arm."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated

import typer

from armdesign.building import RECORD
from armdesign.building.build import Build
from armdesign.building.record import recorded_build
from armdesign.cli.command_errors import one_sentence_errors
from armdesign.cli.command_options import OUTPUT, option, with_flags
from armdesign.cli.screen import compiling, show_text
from armdesign.cli.setting_flags import Given, takes_settings
from armdesign.errors import counted
from armdesign.feasibility.words import summary
from armdesign.runs.checking import finished_arm, judged_by
from armdesign.search.result import Result
from armdesign.settings.sections import Body, Cell, Needs

FAILED = 3


@one_sentence_errors
@takes_settings(Cell, Body, Needs)
def check(
    run: Annotated[
        Path, typer.Argument(metavar="RUN", help="Run folder of a search or an evaluation, or its result.json.")
    ],
    *,
    given: Given,
    as_json: Annotated[
        bool, option("--json", None, "Print the verdict as JSON, as in result.json: metres, radians.", OUTPUT)
    ] = False,
) -> None:
    """Judge a finished arm: can it exist, and does it do its task?

    Measured on the exact shapes, along the arm's own path: the hand's error, gaps between bodies and to obstacles,
    speeds and torques. Flags go over the settings of the run, so that any arm can be judged by any cell; a thin one
    gets a body by --body tube. Of a build its parts are measured, too. Ends with 0 where the arm is feasible, the
    stated tolerance is met and a build's parts keep apart, else with 3.
    """
    result = finished_arm(run)
    settings = with_flags(result.problem.settings, given)
    with compiling(quiet=as_json):
        judged = judged_by(result, {title: vars(getattr(settings, title)) for title in given})
        verdict, made = judged.verdict, built(result, judged)
        fault = made.fault if made else ""
    if as_json:
        gap = made.gap.value if made and made.gap else None
        parts = {"parts": {"gap": gap, "fault": fault}} if made else {}
        typer.echo(json.dumps(asdict(verdict) | parts, indent=2, allow_nan=False))
    else:
        typer.echo(f"{result.name}: arm of {counted(result.table.dof, 'joint')}, {result.table.length:.3f} m long")
        lines = [f"{made.warning}."] if made and fault else []
        lines += [*summary(verdict, settings, result.base_pose), *([made.gap_words] if made and made.gap_words else [])]
        show_text("\n".join(lines))
    if fault or not verdict.passed:
        raise typer.Exit(FAILED)


def built(result: Result, judged: Result) -> Build | None:
    """The parts of a build under the settings that it is judged by now; None where the arm is no build.

    Args:
        result: The build as it was made.
        judged: The same arm, judged anew.
    """
    if result.folder is None or not (result.folder / RECORD).is_file():
        return None
    return replace(recorded_build(result), result=judged)
