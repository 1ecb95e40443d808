"""Plan and elevation of the cell: the room with the person, the obstacles, the base with its distances, and the arm."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from armdesign._types import Array
from armdesign.bodies.exact import carriers
from armdesign.cell.obstacles import Plane
from armdesign.feasibility.verdict import exact_obstacles
from armdesign.search.result import Result
from armdesign.settings.place import Site
from armdesign.views.report.drawing import GREY, HUMAN, WIDTH, Picture, picture, short
from armdesign.views.report.report_scene import SHADES, box, framed

INSTANTS = 3
PATH_POINTS = 250
ASIDE = 0.4
"""So much of what is drawn is left beside it for a place where the base might stand, which may be the whole floor."""
VIEWS = (("plan", "Plan", 0, 1), ("elevation", "Elevation", 0, 2))
FACE, EDGE = "#e6e6e6", "#555555"
SMALL = 9.0
"""Size of names and dimensions, which are printed at three quarters of it [points]."""
LETTER = 0.082
"""Width of a small letter [inch]."""
LINE = 0.17
"""Height of a line of small letters [inch]."""
LEFT, RIGHT = 0.72, 0.2
"""Room beside the axes [inch]."""
ROW = 0.09
"""From one row of dimensions to the next, by the extent of what is drawn."""
ALIKE = 3
"""So many obstacles whose names begin with one word have that word written once."""
FLAT = 0.9
"""A face is as long, by its obstacle, in both directions at least: a ball has none, a post but its ends."""
SHORTEST, NEXT_TO = 1.0, 2.0
"""Shorter distances are not written; what an obstacle may be off and still be beside the base [mm]."""


class Outline(NamedTuple):
    """An obstacle as a picture shows it.

    Attributes:
        name: Its name.
        points: Points whose convex hull is drawn, in the room, shape (K, 3) [mm]; of a half space one on its surface.
        normal: Of a half space, where its free side is, shape (3,); None for all others.
        carries: Whether the base stands on it.
    """

    name: str
    points: Array
    normal: Array | None = None
    carries: bool = False


@dataclass(frozen=True)
class CellScene:
    """What is drawn, in the room, in millimetres.

    Attributes:
        base: Where the base stands, shape (3,).
        corners: Arm skeleton at the instants, shape (k, c, 3).
        human: The demonstrator's arm at the instants, shape (k, p, 3).
        hand: Path of the hand, shape (P, 3).
        sites: Where the base might have stood: lower and upper corners, shape (2, 3) each.
        obstacles: What stands around.
        frame: ``room``, or ``base`` where there is no room.
    """

    base: Array
    corners: Array
    human: Array
    hand: Array
    sites: tuple[Array, ...]
    obstacles: tuple[Outline, ...]
    frame: str

    def projected(self, axes: list[int]) -> Array:
        """Everything that has an end, shape (P, 2); half spaces have none, and wide sites are seen in part."""
        parts = [self.base, np.zeros(3), self.corners, self.human, self.hand]
        parts += [outline.points for outline in self.obstacles if outline.normal is None]
        seen = np.concatenate([np.reshape(part, (-1, 3)) for part in parts])[:, axes]
        low, high = seen.min(axis=0), seen.max(axis=0)
        room = ASIDE * float((high - low).max())
        return np.concatenate([seen, *(np.clip(site[:, axes], low - room, high + room) for site in self.sites)])


def outlines(run: Result, frames: NDArray[np.intp]) -> list[Outline]:
    """What stands around a run, and what moves at some frames."""
    found, obstacles = [], run.problem.first.obstacles
    for one, carries in zip(obstacles.each, carriers(exact_obstacles(obstacles), run.base_pose.matrix), strict=True):
        poses, normal = one.poses if len(one.poses) == 1 else one.poses[frames], None
        points = one.shape.outline
        if isinstance(one.shape, Plane):
            points, normal = np.zeros((1, 3)), poses[0, :3, 2]
        for pose in poses:
            found.append(Outline(one.name, 1e3 * (points @ pose[:3, :3].T + pose[:3, 3]), normal, carries))
    return found


def cell_scene(run: Result) -> CellScene:
    """The cell of a run."""
    problem, q, base = run.problem.in_room, run.evaluation.path.q, run.base_pose
    origin = problem.shift
    chosen = np.unique(np.linspace(0, len(q) - 1, INSTANTS).astype(int))
    drawn = np.unique(np.linspace(0, len(q) - 1, PATH_POINTS).astype(int))
    sites: Sequence[Site] = problem.space.sites
    return CellScene(
        base=1e3 * base.translation,
        corners=1e3 * (run.table.skeleton(q[chosen]) @ base.rotation.T + base.translation),
        human=1e3 * (problem.task.arm[chosen] + origin),
        hand=1e3 * (problem.task.P[drawn, -1] + origin),
        sites=tuple(1e3 * (site.box + origin) for site in sites),
        obstacles=tuple(outlines(run, chosen)),
        frame=base.frame,
    )


def cell_pictures(run: Result) -> list[Picture]:
    """Plan and elevation of the cell."""
    scene = cell_scene(run)
    where = "in the recording's room" if scene.frame == "room" else "from the moving base, as there is no fixed room"
    names = ", ".join(dict.fromkeys(each.name for each in scene.obstacles))
    pictures = []
    for key, title, across, up in VIEWS:

        def build(across: int = across, up: int = up) -> Figure:
            return cell_figure(scene, across, up)

        x, y = (f"{'xyz'[k]} {scene.base[k]:.0f} mm" for k in (across, up))
        alt = f"{title} of the cell, {where}: the base at {x}, {y}; obstacles: {names or 'none'}."
        sized = dimensions(scene, [across, up])
        caption = f"{title}, millimetres {where}. Square: the base"
        caption += ", with its distances from the origin (cross)" if sized else ""
        caption += " and from an edge of what is beside it. " if any("edge" in text for *_, text in sized) else ". "
        caption += "Blue: the arm, light to dark; dashed: the person's arm; dotted: the hand's path"
        caption += "; dashed box: where the base might stand, perhaps seen in part." if scene.sites else "."
        pictures.append(picture(key, build, alt, caption))
    return pictures


def cell_figure(scene: CellScene, across: int, up: int) -> Figure:
    """The cell along one of its axes.

    Args:
        scene: What is drawn.
        across: The coordinate to the right.
        up: The coordinate upwards.
    """
    axes = [across, up]
    low, high = box(scene.projected(axes))
    sized, extent = dimensions(scene, axes), float((high - low).max())
    rows = [sum(np.argmax(np.abs(end - start)) == k for start, end, _ in sized) for k in range(2)]
    # for the dimensions: those across below, those upwards to the right
    room = ROW * extent * (np.array(rows) + 0.3 * (np.array(rows) > 0))
    room_x, room_y = np.array([room[1], 0.0]), np.array([0.0, room[0]])
    figure = framed(low - room_y, high + room_x, left=LEFT, right=RIGHT, bottom=0.45, top=0.08)
    axis = figure.axes[0]
    dimension_lines(axis, sized, (np.array([high[0], low[1]]), ROW * extent))
    for outline in scene.obstacles:
        if outline.normal is not None:
            draw_edge(axis, outline, axes)
            continue
        axis.add_patch(Polygon(hull(outline.points[:, axes]), facecolor=FACE, edgecolor=EDGE, hatch="///", zorder=1))
    for site in scene.sites:
        corner, size = site[0][axes], np.maximum(np.diff(site[:, axes], axis=0)[0], 1e-6)
        style: dict[str, Any] = {"facecolor": "none", "edgecolor": "black", "linestyle": (0, (5, 3)), "linewidth": 0.9}
        axis.add_patch(
            Rectangle((float(corner[0]), float(corner[1])), float(size[0]), float(size[1]), zorder=2, **style)
        )
    axis.plot(*scene.hand[:, axes].T, color=HUMAN, linestyle=":", linewidth=1.5, zorder=3)
    for k, (arm, human) in enumerate(zip(scene.corners, scene.human, strict=True)):
        axis.plot(*human[:, axes].T, color=HUMAN, linestyle="--", marker="^", markersize=4, linewidth=0.9, zorder=3)
        shade = SHADES[-len(scene.corners) :][k]
        axis.plot(*arm[:, axes].T, color=shade, linewidth=3.2, solid_capstyle="round", zorder=4 + 0.1 * k)
    axis.plot([0.0], [0.0], "+", color="black", markersize=11, zorder=6)
    axis.plot(*scene.base[axes], "s", color="black", markersize=8, zorder=6)
    labels(axis, scene, axes)
    axis.set(xlabel=f"{'xyz'[across]} [mm]", ylabel=f"{'xyz'[up]} [mm]")
    axis.locator_params(nbins=6)
    return figure


def draw_edge(axis: Axes, outline: Outline, axes: list[int]) -> None:
    """Draw the surface of a half space where it is seen edge on, with strokes on the side that is not free.

    Args:
        axis: Where.
        outline: The half space.
        axes: The two coordinates of the picture.
    """
    normal = np.zeros(3) if outline.normal is None else outline.normal
    across = normal[axes]
    if np.linalg.norm(across) < 1.0 - 1e-6:
        return
    at, along = outline.points[0, axes], np.array([-across[1], across[0]])
    limits = np.array([axis.get_xlim(), axis.get_ylim()]).T
    reach = float(np.abs(limits - at).max()) * 2.0
    depth = 0.03 * float(np.ptp(limits, axis=0).max())
    ends = np.array([at - reach * along, at + reach * along])
    strip = np.concatenate([ends, ends[::-1] - depth * across])
    axis.add_patch(Polygon(strip, facecolor=FACE, edgecolor=EDGE, hatch="///", linewidth=0.9, zorder=1))
    axis.set(xlim=tuple(limits[:, 0]), ylim=tuple(limits[:, 1]))


def dimension_lines(axis: Axes, sized: Sequence[tuple[Array, Array, str]], place: tuple[Array, float]) -> None:
    """Draw dimensions beside what is drawn: those across below it, those upwards to the right of it.

    Args:
        axis: Where.
        sized: See ``dimensions``.
        place: The lower right corner of what is drawn, shape (2,) [mm], and from row to row [mm].
    """
    (corner, row), rows = place, [0, 0]
    per_inch = np.ptp(axis.get_xlim()) / (WIDTH - LEFT - RIGHT)
    for start, end, text in sized:
        k = int(np.argmax(np.abs(end - start)))
        level = corner[1 - k] + (row if k else -row) * (rows[k] + 0.4)
        rows[k] += 1
        ends = np.array([start, end])
        ends[:, 1 - k] = level
        for point, foot in zip((start, end), ends, strict=True):
            axis.plot(*np.array([point, foot]).T, color=GREY, linewidth=0.5, zorder=2.5)
        axis.annotate("", ends[1], ends[0], arrowprops={"arrowstyle": "<->", "color": GREY, "lw": 0.9, "shrinkA": 0,
                                                        "shrinkB": 0}, zorder=5)  # fmt: skip
        spot, long = ends.mean(axis=0), (len(text) + 1) * LETTER * per_inch
        if float(np.ptp(ends[:, k])) < long:  # too short to be written on, so beside it, and within the picture
            low, high = axis.get_ylim() if k else axis.get_xlim()
            spot[k] = np.clip(spot[k], low + long / 2.0, high - long / 2.0)
            spot[1 - k] += (0.8 if k else -0.8) * LINE * per_inch
        style: dict[str, Any] = {"facecolor": "white", "edgecolor": "none", "pad": 0.4}
        axis.text(spot[0], spot[1], text, ha="center", va="center", rotation=90 * k, fontsize=SMALL, zorder=7,
                  bbox=style)  # fmt: skip


def labels(axis: Axes, scene: CellScene, axes: list[int]) -> None:
    """Names of the obstacles, each where no other stands.

    Args:
        axis: Where they are written.
        scene: What is drawn.
        axes: The two coordinates of the picture.
    """
    per_inch = np.ptp(axis.get_xlim()) / (WIDTH - LEFT - RIGHT)
    view = np.array([axis.get_xlim(), axis.get_ylim()]).T
    solid = grouped({each.name: each.points[:, axes] for each in scene.obstacles if each.normal is None})
    boxes = {name: np.stack([points.min(axis=0), points.max(axis=0)]) for name, points in solid.items()}
    half = 0.09 * per_inch
    taken: list[Array] = [np.stack([scene.base[axes] - half, scene.base[axes] + half])]
    for name in sorted(
        boxes, key=lambda each: float(np.prod(np.ptp(boxes[each], axis=0)))
    ):  # the small have least room
        text, inside = short(name, 24).strip(), boxes[name]
        size = per_inch * np.array([LETTER * len(text) + 0.06, LINE])
        at, spot = inside.mean(axis=0), label_spot(name, boxes, size, taken, view)
        style: dict[str, Any] = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.6}
        middle = spot.mean(axis=0)
        if ((middle < inside[0]) | (middle > inside[1])).any():  # moved off, so a line says where it belongs
            axis.plot([at[0], middle[0]], [at[1], middle[1]], color=GREY, linewidth=0.5, zorder=6)
        axis.text(middle[0], middle[1], text, ha="center", va="center", fontsize=SMALL, zorder=7, bbox=style)
        taken.append(spot)


def label_spot(name: str, boxes: dict[str, Array], size: Array, taken: Sequence[Array], view: Array) -> Array:
    """A box for the name of an obstacle: on it, if may be where no other is and near its middle; else near it.

    Args:
        name: Its name.
        boxes: Lower and upper corners of all obstacles in the picture, by name, shape (2, 2) each [mm].
        size: Width and height of the label, shape (2,) [mm].
        taken: Boxes of what must not be covered.
        view: Lower and upper corner of the picture, shape (2, 2) [mm].

    Returns:
        Lower and upper corner, shape (2, 2) [mm].
    """
    low, high = boxes[name]
    middle, best = (low + high) / 2.0, None
    for share in np.ndindex(9, 9):
        at = low + (high - low) * (np.array(share) + 0.5) / 9.0
        spot = np.stack([at - size / 2.0, at + size / 2.0])
        if (spot[0] < view[0]).any() or (spot[1] > view[1]).any() or any(meet(spot, other) for other in taken):
            continue
        on = sum(meet(spot, other) for key, other in boxes.items() if key != name)
        rank = on, float(np.linalg.norm((at - middle) / (high - low + 1e-9)))
        if best is None or rank < best[0]:
            best = rank, spot
    return free_spot(middle, size, taken) if best is None else best[1]


def meet(first: Array, second: Array) -> bool:
    """Whether two boxes, lower and upper corner of shape (2, 2) each, have more than an edge in common."""
    return bool((first[1] > second[0]).all() and (first[0] < second[1]).all())


def grouped(solids: dict[str, Array]) -> dict[str, Array]:
    """Obstacles by the name that is written on them: of three or more whose names begin alike, that beginning once.

    What hides one another in the picture has its names side by side.

    Args:
        solids: Points in the picture by name, shape (K, 2) each [mm]; of what moves those of the last place.
    """
    first = {name: name.split()[0] if name.split() else name for name in solids}
    counts = Counter(first.values())
    found: dict[str, Array] = {}
    for name, points in solids.items():
        label = first[name] if counts[first[name]] >= ALIKE else name
        found[label] = np.concatenate([found[label], points]) if label in found else points
    same: dict[tuple[float, ...], list[str]] = {}
    for label, points in found.items():
        same.setdefault(tuple(np.round([*points.min(axis=0), *points.max(axis=0)], 0)), []).append(label)
    return {
        ", ".join([labels[0], *(each.removeprefix(f"{first.get(labels[0], '')} ") for each in labels[1:])]): found[
            labels[0]
        ]
        for labels in same.values()
    }


def dimensions(scene: CellScene, axes: list[int]) -> list[tuple[Array, Array, str]]:
    """Distances of the base from the origin, and from an edge beside it: of what it stands on, else of the largest.

    Args:
        scene: What is drawn.
        axes: The two coordinates of the picture.

    Returns:
        Both ends of each, shape (2,) [mm], along one of the coordinates, and what is written on it.
    """
    base, found = scene.base[axes], []
    solid = [each for each in scene.obstacles if each.normal is None]
    for k in range(2):
        ends = [(0.0, f"{abs(base[k]):.0f}")]
        beside = [
            (one.carries, float(np.ptp(one.points, axis=0).prod()), -abs(edge - base[k]), edge, one.name)
            for one in solid
            if one.points[:, axes[1 - k]].min() - NEXT_TO <= base[1 - k] <= one.points[:, axes[1 - k]].max() + NEXT_TO
            for edge in flat_ends(one.points, axes[k])
            if min(abs(edge - base[k]), abs(edge)) > SHORTEST
        ]
        standing = axes[k] == 2 and any(one.carries for one in solid)  # its thickness says nothing
        against = any(
            each.normal is not None
            and abs(each.normal[axes[k]]) > 1.0 - 1e-6
            and abs(each.points[0, axes[k]] - base[k]) <= SHORTEST
            for each in scene.obstacles
        )  # it is on that wall, from which it is measured
        if beside and not standing and not against:
            *_, edge, name = max(beside)
            ends.append((edge, f"{abs(edge - base[k]):.0f} from the edge of {short(name, 14).strip()}"))
        for at, text in ends:
            if abs(at - base[k]) > SHORTEST:
                start = base.copy()
                start[k] = at
                found.append((start, base, text))
    return found


def flat_ends(points: Array, k: int) -> list[float]:
    """Where an obstacle has a flat face across a coordinate, at its lower and its upper end [mm].

    Args:
        points: Points whose convex hull it is, shape (K, 3) [mm].
        k: The coordinate.
    """
    other, found = [j for j in range(3) if j != k], []
    for edge in (float(points[:, k].min()), float(points[:, k].max())):
        face = points[np.abs(points[:, k] - edge) < SHORTEST]
        if (np.ptp(face[:, other], axis=0) >= FLAT * np.ptp(points[:, other], axis=0)).all():
            found.append(edge)
    return found


def free_spot(at: Array, size: Array, taken: Sequence[Array]) -> Array:
    """A box for a label near a point that no other label's box meets, shape (2, 2): lower and upper corner.

    Args:
        at: Where it would stand best, shape (2,).
        size: Width and height, shape (2,).
        taken: Boxes of the labels so far.
    """
    for step in range(40):
        for side in (1.0, -1.0):
            middle = at + np.array([0.0, side * step * size[1] * 0.6])
            spot = np.stack([middle - size / 2.0, middle + size / 2.0])
            if not any(meet(spot, other) for other in taken):
                return spot
    return spot


def hull(points: Array) -> Array:
    """Corners of the convex hull in order, shape (K, 2); of points on a line the two ends."""
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except QhullError:
        along = points @ np.ptp(points, axis=0)
        return np.asarray(points[[along.argmin(), along.argmax()]])
