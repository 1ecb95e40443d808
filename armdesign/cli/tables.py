"""The tables the commands print at the end, as plain text."""

from __future__ import annotations

import numpy as np

from armdesign.errors import counted, short_names
from armdesign.kinematics.dh import DHTable
from armdesign.search.evaluation import Evaluation
from armdesign.search.prepare import Prepared


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
    """DH rows, length, fitness in its parts, and the error of each point; of several demonstrations also each one's."""
    fitness, several = prepared.settings.fitness, demonstrations_table(evaluation, prepared)
    meant = f", {fitness.demonstrations} of {len(prepared.demonstrations)} demonstrations" if prepared.others else ""
    lines = [
        f"{counted(evaluation.table.dof, 'joint')}, modified DH (Craig): T = Rx(alpha) Tx(a) Tz(d) Rz(q)",
        design_table(evaluation.table),
        f"  length L {evaluation.table.length:.4f} m",
        f"  fitness r {evaluation.fitness:.4f} m = {fitness.lambda_f:g} f + {fitness.lambda_E:g} E,  "
        f"f {evaluation.path_fitness * 1e3:.2f} mm,  E {evaluation.area * 1e3:.2f} mm{meant}",
        *several,
        f"  start error {evaluation.path.start_error * 1e3:.3f} mm",
        *point_lines(evaluation, prepared, "of the first demonstration" if several else "of each point"),
    ]
    return "\n".join(lines)


def point_lines(evaluation: Evaluation, prepared: Prepared, title: str) -> list[str]:
    """Mean and largest error of each point, and of the orientation where it counts."""
    path = evaluation.path
    lines = [f"  error {title:<18} mean [mm]   max [mm]"]
    for i, name in enumerate(prepared.task.points):
        distance = path.distance[:, i] * 1e3
        lines.append(f"    {name:<20} {distance.mean():11.2f} {distance.max():10.2f}")
    if prepared.settings.fitness.orientation_weight:
        error = np.rad2deg(path.orientation_error)
        lines.append(f"    {'orientation [deg]':<20} {error.mean():11.2f} {error.max():10.2f}")
    return lines


def demonstrations_table(evaluation: Evaluation, prepared: Prepared) -> list[str]:
    """What the arm does on each of several demonstrations and on those held out; nothing where there is but one."""
    every = [*prepared.demonstrations, *prepared.holdouts]
    if len(every) == 1:
        return []
    seen = evaluation.demonstrations or (evaluation,)
    names = short_names([each.name for each in every])
    shown = [*names[: len(seen)], *(f"{name}, held out" for name in names[len(seen) :])]
    width = max(20, *map(len, shown))
    hand = f"{prepared.task.points[-1]} mean, max [mm]"
    lines = [f"  {'demonstration':<{width + 2}} {'r [m]':>8} {'f [mm]':>8} {'E [mm]':>8} {'frames':>7}  {hand}"]
    for name, each, scored in zip(shown, every, (*seen, *evaluation.holdouts), strict=True):
        lines.append(f"    {name:<{width}} {figures(scored, len(each.task.time))}")
    return lines


def figures(scored: Evaluation, frames: int) -> str:
    """What the arm does on one demonstration, or where it fails."""
    if scored.missed is not None:
        frame, distance = scored.missed
        return f"not reached: frame {frame + 1} is missed by {distance * 1e3:.2f} mm"
    hand = scored.path.distance[:, -1] * 1e3
    return (
        f"{scored.fitness:8.4f} {scored.path_fitness * 1e3:8.2f} {scored.area * 1e3:8.2f} {frames:7d}  "
        f"{hand.mean():.2f}, {hand.max():.2f}"
    )
