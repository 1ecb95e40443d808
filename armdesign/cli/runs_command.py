"""``armdesign runs``: the runs below a folder and their states."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from armdesign.cli.command_errors import one_sentence_errors
from armdesign.cli.screen import show_table
from armdesign.runs.listing import RunStatus, read_runs

HEADINGS = ("folder", "state", "r [m]", "progress", "age", "algorithm", "n", "seed")
UNITS = ((86400, "d"), (3600, "h"), (60, "min"), (1, "s"))


@one_sentence_errors
def runs(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder to search for runs.")] = Path("runs"),
) -> None:
    """List the runs below a folder and their states.

    With the best robot fitness r so far, progress and time since the last change. States: finished; interrupted or
    stopped (go on with search --resume); running; failed (ended without a valid arm); evaluated (a given arm, not a
    search); broken (files missing or damaged).
    """
    found = read_runs(folder)
    if not found:
        typer.echo(f"No runs below {folder}.")
        return
    show_table(HEADINGS, [cells(run, folder) for run in found], left=(0, 1, 5))
    for run in found:
        if run.state in ("broken", "running"):
            typer.echo(f"{run.folder}: {'running by ' if run.state == 'running' else ''}{run.detail}")


def cells(run: RunStatus, root: Path) -> tuple[str, ...]:
    """A run as a row of text."""
    name = run.folder.relative_to(root)
    return (
        str(run.folder if name == Path() else name),
        run.state,
        shown(run.best, ".4f"),
        "-" if run.iterations is None or run.planned is None else f"{run.iterations}/{run.planned}",
        age(run.age),
        run.algorithm or "-",
        shown(run.dof),
        shown(run.seed),
    )


def shown(value: float | None, form: str = "") -> str:
    """A number, or a dash where there is none."""
    return "-" if value is None else format(value, form)


def age(seconds: float) -> str:
    """A time in its largest fitting unit."""
    size, unit = next(((size, unit) for size, unit in UNITS if seconds >= size), UNITS[-1])
    return f"{int(seconds / size)} {unit}"
