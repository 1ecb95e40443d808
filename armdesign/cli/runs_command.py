"""``armdesign runs``: where the runs below a folder stand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from armdesign.cli.common import one_sentence_errors

if TYPE_CHECKING:
    from armdesign.runs.listing import RunStatus

HEADINGS = ("folder", "state", "best r [m]", "progress", "age", "algorithm", "dof", "seed")
LEFT_ALIGNED = ("folder", "state", "algorithm")
UNITS = ((86400, "d"), (3600, "h"), (60, "min"), (1, "s"))


@one_sentence_errors
def runs(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder to look below.")] = Path("runs"),
) -> None:
    """List the runs below a folder: state, best fitness so far, progress and time since the last change.

    States: finished; interrupted or stopped (go on with --resume); running; failed (nothing found); evaluated (a given
    arm, not a search); broken.
    """
    from armdesign.runs.listing import read_runs  # noqa: PLC0415

    found = read_runs(folder)
    if not found:
        typer.echo(f"No runs below {folder}.")
        return
    typer.echo(table([cells(run, folder) for run in found]))
    for run in found:
        if run.state == "broken":
            typer.echo(f"{run.folder}: {run.detail}")


def cells(run: RunStatus, root: Path) -> tuple[str, ...]:
    """A run as a row of text."""
    name = run.folder.relative_to(root)
    return (
        str(run.folder if name == Path() else name),
        f"running by {run.detail}" if run.state == "running" else run.state,
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


def table(rows: list[tuple[str, ...]]) -> str:
    """Rows under the headings, words to the left and numbers to the right."""
    widths = [max(len(row[k]) for row in (HEADINGS, *rows)) for k in range(len(HEADINGS))]
    lines = []
    for row in (HEADINGS, *rows):
        aligned = (
            text.ljust(width) if heading in LEFT_ALIGNED else text.rjust(width)
            for heading, text, width in zip(HEADINGS, row, widths, strict=True)
        )
        lines.append("  ".join(aligned).rstrip())
    return "\n".join(lines)
