"""``armdesign alternatives``: the best arms of a search that are really different, side by side."""

from __future__ import annotations

from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from armdesign.cli.common import announce_compiling, one_sentence_errors

if TYPE_CHECKING:
    from armdesign.runs.alternatives import Alternative


@one_sentence_errors
def alternatives(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="The run folder of a search.")],
    count: Annotated[int, typer.Option("--count", help="Number of arms.")] = 5,
    distance: Annotated[
        float,
        typer.Option("--distance", help="How different they have to be, in terms of the width of the bounds."),
    ] = 0.3,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing.")] = False,
) -> None:
    """Show the best arms of a search that are really different, and write each as a run folder.

    They lie in RUN/alternatives/1, 2, ...: armdesign export, preview, report and compare take each of them.
    """
    from armdesign.fitness.block import compile_kernels  # noqa: PLC0415
    from armdesign.runs.alternatives import check_options, read_designs, write_alternatives  # noqa: PLC0415
    from armdesign.runs.resumable import open_run  # noqa: PLC0415

    check_options(count, distance)
    prepared = open_run(run)
    read_designs(run, prepared.space())
    with announce_compiling(quiet):
        compile_kernels(prepared.problem())
    found = write_alternatives(run, prepared, count=count, distance=distance)
    if quiet:
        return
    typer.echo(side_by_side(found))
    if len(found) < count:
        typer.echo(f"There are no more that differ by {distance:g}; --distance sets how much they have to.")


def side_by_side(found: list[Alternative]) -> str:
    """The arms as columns: fitness and its parts, length, and the DH rows."""
    tables = [each.evaluation.table for each in found]
    lines: list[tuple[str, list[str]]] = [
        ("", [f"no. {each.rank}" for each in found]),
        ("fitness r [m]", [f"{each.evaluation.fitness:.4f}" for each in found]),
        ("path f [mm]", [f"{each.evaluation.path_fitness * 1e3:.2f}" for each in found]),
        ("area E [mm]", [f"{each.evaluation.area * 1e3:.2f}" for each in found]),
        ("length L [mm]", [f"{table.length * 1e3:.1f}" for table in tables]),
    ]
    for i in range(tables[0].dof + 1 if tables else 0):
        label = "tool" if i == tables[0].dof else f"row {i}"
        lines.append((f"{label} alpha [deg]", [f"{degrees(table.alpha[i]):.1f}" for table in tables]))
        lines.append((f"{label} a, d [mm]", [f"{table.a[i] * 1e3:.0f}, {table.d[i] * 1e3:.0f}" for table in tables]))
    width = max(len(cell) for _, cells in lines for cell in cells) + 2
    rows = [f"  {label:<17}" + "".join(cell.rjust(width) for cell in cells) for label, cells in lines]
    return "\n".join([*(row.rstrip() for row in rows), "Written:", *(f"  {each.folder}" for each in found)])
