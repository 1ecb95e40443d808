"""The command line: one file a command, nothing but options, calls and words.

A command's module is imported when the command is called, so that the list of commands shows at once.
"""

from __future__ import annotations

import functools
import importlib
import re
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from armdesign._version import __version__

COMMANDS = {
    "studio": ("studio_command", "Go from a recording to an arm on one page in the browser."),
    "search": ("search_command", "Search the arm that follows a recorded demonstration best."),
    "evaluate": ("evaluate_command", "Score a given arm on a task."),
    "check": ("check_command", "Judge a finished arm: can it exist, and does it do its task?"),
    "sweep": ("sweep_command", "Run many searches, one for every combination of settings."),
    "runs": ("runs_command", "List the runs below a folder and their states."),
    "alternatives": ("alternatives_command", "Show the best arms of a search that really differ."),
    "export": ("export_command", "Write robot files and trajectories for other tools."),
    "report": ("report_command", "Write the report of a run as one HTML page."),
    "preview": ("preview_command", "Show arms performing their task in the browser."),
    "build": ("build_command", "Pick the parts of a finished design."),
    "tolerance": ("tolerance_command", "Say how accurate arms are whose parts deviate."),
    "importance": ("importance_command", "Say which entries of a design matter for its fitness r."),
    "catalogue": ("catalogue_command", "Show and check catalogues of actuators."),
    "compare": ("compare_command", "Compare designs and ready-made arms on the same task."),
    "recording": ("recording_command", "Look at a recording, draw it, or convert it to plain CSV."),
    "study": ("study_command", "Repeat the paper's studies on any demonstration."),
}
"""Every command: the module that holds it, under its own name or as ``app``, and its line in the list of commands."""
EXIT_CODES = (
    "Exit codes: 0 done; 1 a run of a sweep or study has failed; 2 bad input; 3 an arm is not feasible or misses its "
    "tolerance (check, build); 4 a search has found no arm; 130 stopped by Ctrl-C."
)
WITHOUT_WORKERS = re.compile(r"(^| )(-h|--help|--write-config|--cluster|--workers[ =]1)( |=|$)")
"""What on the command line of a search says that no worker processes will be wanted."""


class PanelCommand(TyperCommand):
    """A command whose help lists the options by their ``rich_help_panel``, in plain text that fits 80 columns."""

    def format_options(self, ctx: Any, formatter: Any) -> None:  # noqa: ANN401 (Click's own, which Typer brings)
        """Write the arguments and then the panels, in the order of their first options."""
        panels: dict[str, list[tuple[str, str]]] = {}
        for parameter in self.get_params(ctx):
            record, panel = parameter.get_help_record(ctx), getattr(parameter, "rich_help_panel", None)
            if record is None:
                continue
            argument = parameter.param_type_name == "argument"
            name = parameter.metavar or record[0] if argument else record[0]
            words = re.sub(r"\.?  \[default: (.*)\]$", r" (default \1).", record[1]).removesuffix("  [required]")
            panels.setdefault(panel or ("Arguments" if argument else "Options"), []).append((name, words))
        for title, records in panels.items():
            with formatter.section(title):
                formatter.write_dl(records)


class LazyGroup(TyperGroup):
    """A group that knows its commands by name and help, and imports the one that is called."""

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ANN401
        """The names, in the order in which they are declared."""
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:  # noqa: ANN401
        """A command without its options, as the list of commands shows it."""
        return TyperCommand(cmd_name, help=COMMANDS[cmd_name][1]) if cmd_name in COMMANDS else None

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:  # noqa: ANN401
        """The command that is called, imported."""
        name, _, rest = super().resolve_command(ctx, args)
        if name == "search" and not WITHOUT_WORKERS.search(" ".join(rest)):
            from armdesign.search.backends.processes import available_cores, worker_context  # noqa: PLC0415 (NumPy)

            if available_cores() > 1:
                worker_context()  # what else a search imports takes seconds: here, and beside it for the workers
        return name, load_command(str(name)), rest


@functools.cache
def load_command(name: str) -> Any:  # noqa: ANN401 (Click's command, which Typer brings)
    """Import a command, or a group of commands.

    Args:
        name: One of ``COMMANDS``.
    """
    module = importlib.import_module(f"armdesign.cli.{COMMANDS[name][0]}")
    group = getattr(module, "app", None)
    if group is None:
        group = typer.Typer(add_completion=False, rich_markup_mode=None)
        group.command(name, cls=PanelCommand, epilog=EXIT_CODES)(getattr(module, name))
    command = typer.main.get_command(group)
    command.name = name
    return command


app = typer.Typer(
    name="armdesign",
    cls=LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=EXIT_CODES,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


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
