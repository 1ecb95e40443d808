"""What is printed of an arm: the hand's error and the verdict, its DH rows, its fitness, its errors on every point."""

from __future__ import annotations

import numpy as np
import typer

from armdesign.cli.screen import show_table, show_text
from armdesign.errors import counted, short_names
from armdesign.feasibility.words import MEANINGS, summary
from armdesign.kinematics.dh import DHTable
from armdesign.search.design_problem import DesignProblem
from armdesign.search.evaluation import Evaluation
from armdesign.search.result import Result


def show_design(table: DHTable) -> None:
    """Print the DH rows in degrees and millimetres; the tool row last."""
    rows = [
        (
            "tool" if i == table.dof else str(i),
            f"{np.rad2deg(table.alpha[i]):.3f}",
            f"{table.a[i] * 1e3:.2f}",
            f"{table.d[i] * 1e3:.2f}",
            *(["slides" if kind == "P" else "turns" if kind == "R" else ""] if any(table.prismatic) else []),
        )
        for i, kind in enumerate(f"{table.joints} ")
    ]
    columns = ("row", "alpha [deg]", "a [mm]", "d [mm]", *(["joint"] if any(table.prismatic) else []))
    show_table(columns, rows)
    if table.base_yaw != 0.0:
        typer.echo(f"base yaw {np.rad2deg(table.base_yaw):.3f} deg")


def show_arm(result: Result) -> None:
    """Print the hand's error and the verdict, then DH rows, fitness, and the errors of each point and demonstration."""
    evaluation, problem = result.evaluation, result.problem
    fitness, several = problem.settings.fitness, len(problem.every) > 1
    meant = (
        f", {fitness.demonstrations} of {len(problem.demonstrations)} demonstrations"
        if len(problem.demonstrations) > 1
        else ""
    )
    show_text("\n".join(summary(result.verdict, result.judged, result.base_pose)))
    typer.echo(f"\n{counted(evaluation.table.dof, 'joint')}, modified DH (Craig): T = Rx(alpha) Tx(a) Tz(d) Rz(q)\n")
    show_design(evaluation.table)
    typer.echo(f"\nlength L {evaluation.table.length:.4f} m")
    figures = {
        "r": f"fitness r {evaluation.fitness:.4f} m = {fitness.lambda_f:g} f + {fitness.lambda_E:g} E{meant}",
        "f": f"f {evaluation.path_fitness * 1e3:.2f} mm",
        "E": f"E {evaluation.area * 1e3:.2f} mm",
    }
    show_text("\n".join(f"{figure}: {MEANINGS[name]}" for name, figure in figures.items()))
    typer.echo(f"start error {evaluation.path.start_error * 1e3:.3f} mm\n")
    if several:
        show_demonstrations(evaluation, problem)
    show_points(evaluation, problem, "error of the first demonstration" if several else "error of each point")


def show_points(evaluation: Evaluation, problem: DesignProblem, title: str) -> None:
    """Print the mean and largest error of each point, and of the orientation where it counts."""
    path, oriented = evaluation.path, problem.settings.fitness.orientation_weight
    series = [(name, path.distance[:, i] * 1e3) for i, name in enumerate(problem.task.points)]
    if oriented:
        series.append(("orientation [deg]", np.rad2deg(path.orientation_error)))
    rows = [(name, f"{error.mean():.2f}", f"{error.max():.2f}") for name, error in series]
    show_table((title, "mean [mm]", "max [mm]"), rows)


def show_demonstrations(evaluation: Evaluation, problem: DesignProblem) -> None:
    """Print what the arm does on each of several demonstrations and on those held out."""
    every, seen = problem.every, evaluation.demonstrations
    names = short_names([each.name for each in every])
    shown = [*names[: len(seen)], *(f"{name}, held out" for name in names[len(seen) :])]
    rows, missed = [], []
    for name, each, scored in zip(shown, every, (*seen, *evaluation.holdouts), strict=True):
        figures = ["-"] * 5
        if scored.missed is None:
            hand = scored.path.distance[:, -1] * 1e3
            values = (scored.path_fitness * 1e3, scored.area * 1e3, hand.mean(), hand.max())
            figures = [f"{scored.fitness:.4f}", *(f"{value:.2f}" for value in values)]
        else:
            frame, distance = scored.missed
            missed.append(f"{name}: not reached, frame {frame + 1} is missed by {distance * 1e3:.2f} mm")
        rows.append((name, *figures[:3], str(len(each.task.time)), *figures[3:]))
    hand_name = problem.task.points[-1]
    headings = ("demonstration", "r [m]", "f [mm]", "E [mm]", "frames", f"{hand_name} [mm]", "max [mm]")
    show_table(headings, rows)
    typer.echo("\n".join([*missed, ""]))
