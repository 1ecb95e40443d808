"""``armdesign alternatives``: the best arms of a search that are really different, side by side."""

from __future__ import annotations

from math import degrees
from pathlib import Path
from typing import Annotated

import typer

from armdesign.cli.command_errors import one_sentence_errors
from armdesign.cli.command_options import option
from armdesign.cli.screen import compiling, show_table, written_text
from armdesign.fitness.block import compile_kernels
from armdesign.runs.alternatives import Alternative, check_options, read_designs, write_alternatives
from armdesign.runs.reading import read_problem


@one_sentence_errors
def alternatives(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="The run folder of a search.")],
    count: Annotated[int, option("--count", "N", "Number of arms to show.")] = 5,
    distance: Annotated[
        float, option("--distance", "X", "Least difference between two arms, as a share of the width of the bounds.")
    ] = 0.3,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing.")] = False,
) -> None:
    """Show the best arms of a search that really differ.

    Each is written as a run folder, RUN/alternatives/1, 2, ..., for export, preview, report and compare.
    """
    check_options(count, distance)
    problem = read_problem(run)
    read_designs(run, problem.space)
    with compiling(quiet=quiet):
        compile_kernels(problem.path_problem)
    found = write_alternatives(run, problem, count=count, distance=distance)
    if quiet:
        return
    show_side_by_side(found)
    typer.echo(written_text([each.folder for each in found]))
    if len(found) < count:
        typer.echo(f"There are no more that differ by {distance:g}; --distance sets how much they have to.")


def show_side_by_side(found: list[Alternative]) -> None:
    """Print the arms as columns: the hand's error, whether feasible, fitness and its parts, length, the DH rows."""
    tables, verdicts = [each.evaluation.table for each in found], [each.result.verdict for each in found]
    lines: list[tuple[str, list[str]]] = [
        ("hand mean [mm]", [f"{verdict.hand_error.mean * 1e3:.1f}" for verdict in verdicts]),
        ("hand 95 % [mm]", [f"{verdict.hand_error.p95 * 1e3:.1f}" for verdict in verdicts]),
        ("hand largest [mm]", [f"{verdict.hand_error.max * 1e3:.1f}" for verdict in verdicts]),
        ("feasible", ["yes" if verdict.feasible else "no" for verdict in verdicts]),
        ("fitness r [m]", [f"{each.evaluation.fitness:.4f}" for each in found]),
        ("path f [mm]", [f"{each.evaluation.path_fitness * 1e3:.2f}" for each in found]),
        ("area E [mm]", [f"{each.evaluation.area * 1e3:.2f}" for each in found]),
        ("length L [mm]", [f"{table.length * 1e3:.1f}" for table in tables]),
    ]
    for i in range(tables[0].dof + 1 if tables else 0):
        label = "tool" if i == tables[0].dof else f"row {i}"
        lines.append((f"{label} alpha [deg]", [f"{degrees(table.alpha[i]):.1f}" for table in tables]))
        lines.append((f"{label} a, d [mm]", [f"{table.a[i] * 1e3:.0f}, {table.d[i] * 1e3:.0f}" for table in tables]))
    show_table(("", *(f"no. {each.rank}" for each in found)), [(label, *cells) for label, cells in lines])
