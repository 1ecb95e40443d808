"""Make the README's picture: an arm that tracks the demonstration, from a run folder.

``python docs/make_picture.py RUN [PICTURE]`` with a folder that ``armdesign search`` has written; needs matplotlib.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

from armdesign import DHTable, read_design
from armdesign.demonstration import read_recording

mpl.use("Agg")
import matplotlib.pyplot as plt

Array = NDArray[np.float64]
ROBOT, HUMAN, HAND = "#1f4e79", "#d97706", "#b91c1c"
SNAPSHOTS = (0.0, 0.36, 0.66, 1.0)


def arm_corners(table: DHTable, q: Array) -> Array:
    """Corners of the arm skeleton from the base to the tool, shape (2 n + 3, 3) [m]."""
    corners = [np.zeros(3)]
    axes = table.base()
    for frame, a in zip(table.frames(q), table.a, strict=True):
        corners += [corners[-1] + a * axes[:3, 0], frame[:3, 3]]
        axes = frame
    return np.array(corners)


def draw_scene(axes: Any, table: DHTable, q: Array, points: Array) -> None:  # noqa: ANN401 (a 3D Axes)
    """The arm over the demonstrator's points at a few instants, and the two hand paths."""
    tips = np.array([table.frames(row)[-1, :3, 3] for row in q])
    axes.plot(*points[:, -1].T, color=HAND, lw=1.2, ls="--", label="hand, demonstrated")
    axes.plot(*tips.T, color=ROBOT, lw=1.2, label="end-effector")
    for share in SNAPSHOTS:
        t = round(share * (len(q) - 1))
        strength = 0.35 + 0.65 * share
        corners = arm_corners(table, q[t])
        joints = np.vstack([np.zeros(3), table.frames(q[t])[:-1, :3, 3]])
        human = np.vstack([np.zeros(3), points[t]])
        last = share == SNAPSHOTS[-1]
        axes.plot(
            *corners.T, color=ROBOT, lw=4.5, alpha=strength, solid_capstyle="round", label="arm" if last else None
        )
        axes.plot(*joints.T, "o", color="white", mec=ROBOT, ms=6, alpha=strength)
        axes.plot(*human.T, "o--", color=HUMAN, lw=1.4, ms=5, alpha=strength, label="human arm" if last else None)
    axes.plot([0], [0], [0], "s", color="black", ms=8)
    axes.set_box_aspect([1, 1, 1])
    everything = np.vstack([points.reshape(-1, 3), tips, np.zeros((1, 3))])
    middle, reach = (everything.max(0) + everything.min(0)) / 2, (everything.max(0) - everything.min(0)).max() / 2
    for setter, centre in zip((axes.set_xlim, axes.set_ylim, axes.set_zlim), middle, strict=True):
        setter(centre - 1.05 * reach, centre + 1.05 * reach)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.set_zlabel("z [m]")
    axes.locator_params(nbins=5)
    axes.view_init(elev=18, azim=-62)
    axes.legend(loc="upper left", frameon=False, fontsize=9)


def draw_joints(axes: Any, time: Array, q: Array) -> None:  # noqa: ANN401 (an Axes)
    """Joint angles over time."""
    for i, style in zip(range(q.shape[1]), ("-", "--", ":", "-.", (0, (5, 1, 1, 1)), (0, (1, 1))) * 2, strict=False):
        axes.plot(time, np.rad2deg(q[:, i]), ls=style, color=ROBOT, lw=1.6, label=f"joint {i + 1}")
    axes.set_xlabel("time [s]")
    axes.set_ylabel("joint angle [deg]")
    axes.legend(frameon=False, fontsize=9)
    axes.spines[["top", "right"]].set_visible(False)


def main() -> None:
    """Read the run and write the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path)
    parser.add_argument("picture", type=Path, nargs="?", default=Path(__file__).parent / "packaging.png")
    arguments = parser.parse_args()
    result = json.loads((arguments.run / "result.json").read_text())
    task = read_recording(arguments.run / "task.csv")
    points = np.stack([task.points[name] for name in result["points"]], axis=1)
    trajectory = np.loadtxt(arguments.run / "trajectory.csv", delimiter=",", skiprows=1)
    table = read_design(arguments.run)
    figure = plt.figure(figsize=(10, 4.8))
    draw_scene(figure.add_axes((0.0, 0.0, 0.58, 1.0), projection="3d"), table, trajectory[:, 1:], points)
    draw_joints(figure.add_axes((0.67, 0.14, 0.31, 0.68)), trajectory[:, 0], trajectory[:, 1:])
    figure.text(
        0.67, 0.88,
        f"{result['dof']} joints, {result['length']:.2f} m long,\n"
        f"f = {result['path_fitness'] * 1e3:.1f} mm, E = {result['area'] * 1e3:.1f} mm",
    )  # fmt: skip
    figure.savefig(arguments.picture, dpi=130)
    print(arguments.picture)


if __name__ == "__main__":
    main()
