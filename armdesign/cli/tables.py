"""The tables the commands print at the end, as plain text."""

from __future__ import annotations

import numpy as np

from armdesign.evaluation import Evaluation
from armdesign.kinematics.dh import DHTable
from armdesign.study import Prepared
from armdesign.wording import counted


def design_table(table: DHTable) -> str:
    """DH rows in degrees and millimetres; the tool row last."""
    lines = ["  row    alpha [deg]     a [mm]     d [mm]"]
    for i in range(table.dof + 1):
        label = "tool" if i == table.dof else str(i)
        lines.append(
            f"  {label:>4}  {np.rad2deg(table.alpha[i]):12.3f} {table.a[i] * 1e3:10.2f} {table.d[i] * 1e3:10.2f}"
        )
    if table.base_yaw != 0.0:
        lines.append(f"  base yaw {np.rad2deg(table.base_yaw):.3f} deg")
    return "\n".join(lines)


def evaluation_table(evaluation: Evaluation, prepared: Prepared) -> str:
    """DH rows, length, fitness in its parts, and the error of each point."""
    path = evaluation.path
    lines = [
        f"{counted(evaluation.table.dof, 'joint')}, modified DH (Craig): T = Rx(alpha) Tx(a) Tz(d) Rz(q)",
        design_table(evaluation.table),
        f"  length L {evaluation.table.length:.4f} m",
        f"  fitness r {evaluation.fitness:.4f} m = {prepared.study.fitness.lambda_f:g} f + "
        f"{prepared.study.fitness.lambda_E:g} E,  f {evaluation.path_fitness * 1e3:.2f} mm,  "
        f"E {evaluation.area * 1e3:.2f} mm",
        f"  start error {path.start_error * 1e3:.3f} mm",
        "  error of each point      mean [mm]   max [mm]",
    ]
    for i, name in enumerate(prepared.task.points):
        distance = path.distance[:, i] * 1e3
        lines.append(f"    {name:<20} {distance.mean():11.2f} {distance.max():10.2f}")
    if prepared.study.fitness.orientation_weight:
        error = np.rad2deg(path.orientation_error)
        lines.append(f"    {'orientation [deg]':<20} {error.mean():11.2f} {error.max():10.2f}")
    return "\n".join(lines)
