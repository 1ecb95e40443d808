"""``armdesign check``: the verdict on a finished arm."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from armdesign.building.parts_clearance import FRAMES
from armdesign.cli.command_errors import one_sentence_errors
from armdesign.cli.command_options import OUTPUT, option, with_flags
from armdesign.cli.screen import compiling, show_text
from armdesign.cli.setting_flags import Given, takes_settings
from armdesign.errors import counted
from armdesign.feasibility.words import summary
from armdesign.runs.checking import finished_arm, judged_by, parts_of
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
        made = parts_of(result, judged)
        verdict = judged.verdict if made is None else made.verdict
    gap = None if made is None else made.gap
    if as_json:
        parts = {"parts": {"gap": gap and gap.value, "fault": made.fault}} if made else {}
        typer.echo(json.dumps(asdict(verdict) | parts, indent=2, allow_nan=False))
    else:
        typer.echo(f"{result.name}: arm of {counted(result.table.dof, 'joint')}, {result.table.length:.3f} m long")
        lines = [f"{made.warning}."] if made and made.warning else []
        nearest = None
        if made and gap and not gap.met:  # else it is among the reasons
            looked = f"About {FRAMES} frames of each demonstration are looked at; marks are those of assembly.html."
            nearest = gap.value, f"{made.told(gap).ruling} {looked}"
        lines += summary(verdict, (made or judged).judged, result.base_pose, nearest)
        show_text("\n".join(lines))
    if not verdict.passed:
        raise typer.Exit(FAILED)
