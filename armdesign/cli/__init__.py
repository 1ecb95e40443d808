"""The command line: a thin layer over plain functions; heavy imports happen inside the commands."""

from __future__ import annotations

from typing import Annotated

import typer

from armdesign._version import __version__
from armdesign.cli.alternatives_command import alternatives
from armdesign.cli.compare_command import compare
from armdesign.cli.evaluate_command import evaluate
from armdesign.cli.export_command import export
from armdesign.cli.preview_command import preview
from armdesign.cli.recording_command import app as recording
from armdesign.cli.report_command import report
from armdesign.cli.runs_command import runs
from armdesign.cli.search_command import search
from armdesign.cli.study_command import app as settings
from armdesign.cli.sweep_command import sweep

app = typer.Typer(
    name="armdesign",
    help="Turn a recorded human-arm demonstration into the robot arm that does the job.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
app.command()(search)
app.command()(evaluate)
app.command()(sweep)
app.command()(runs)
app.command()(alternatives)
app.command()(export)
app.command()(report)
app.command()(preview)
app.command()(compare)
app.add_typer(recording)
app.add_typer(settings)


def show_version(wanted: bool) -> None:
    """Print the version and end."""
    if wanted:
        typer.echo(f"armdesign {__version__}")
        raise typer.Exit


@app.callback()
def root(
    version: Annotated[
        bool, typer.Option("--version", callback=show_version, is_eager=True, help="Print the version and end.")
    ] = False,
) -> None:
    """Turn a recorded human-arm demonstration into the robot arm that does the job."""


def main() -> None:
    """Entry point of the ``armdesign`` command."""
    app(prog_name="armdesign")
