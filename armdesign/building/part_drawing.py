"""Sheets for the workshop: one for each part that is made, and an exploded overview with the parts list."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from armdesign._types import Array
from armdesign.building.arm_drawing import Pose, arm_sheet, arranged, degrees, words_of_scale
from armdesign.building.build import Build, assembly_of
from armdesign.building.labels import Labels
from armdesign.building.part_holes import HoleGroup, direction, hole_groups, hole_rows, looks_along
from armdesign.building.part_tolerances import ANGLE, ANGLES, deviation
from armdesign.building.parts import Part, Placed, Rod, file_name
from armdesign.building.projection import SHADES, View, draw_solids, slanted, solids_of
from armdesign.building.sheet import LETTER, SCALES, Box, Sheet, block_box, circle, framed, number, pdf_of, svg_of
from armdesign.kinematics.base_pose import MOUNTINGS

PART_VIEWS = (
    View("front view", (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    View("top view", (1.0, 0.0, 0.0), (0.0, 0.0, -1.0)),
    View("right side view", (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
)
"""Of a part in its own frame, in third angle; z is what brackets are drawn out along, and the axis of round parts."""
ROOM = (235.0, 235.0)
"""For front, top and side view of a part [mm]."""
COLUMN = 266.0
"""Where tables beside the views begin [mm]."""
NEXT = 0.07
"""By how much each part is drawn away from the one before in the exploded view [m]."""


def drawing_files(build: Build) -> dict[str, str | bytes]:
    """The arm, the overview and every part that is made, on A3: each as SVG, all as one PDF."""
    assembly = assembly_of(build)
    kinds = assembly.counted()
    made = {name: places for name, (part, places) in kinds.items() if not part.bought}
    pose = Pose(build.result.body, np.zeros(build.result.table.dof), MOUNTINGS[build.result.base_pose.mounted])
    title, of = build.result.name, len(made) + 2
    sheets = {
        "arm": arm_sheet(pose, f"{title}: dimensions", [("sheet", f"1 of {of}"), ("projection", "third angle")]),
        "overview": overview(build, f"2 of {of}"),
    }
    for k, (name, places) in enumerate(made.items(), start=3):
        sheets[file_name(name)] = part_sheet(places, title, f"{k} of {of}")
    if build.fault:
        for sheet in sheets.values():
            sheet.text(build.warning[:150], (27.0, 284.4), "left", 3.0, bold=True)
    return {
        "drawing/drawings.pdf": pdf_of(sheets.values()),
        **{f"drawing/{name}.svg": svg_of(sheet) for name, sheet in sheets.items()},
    }


def part_sheet(places: Sequence[Placed], arm: str, of: str) -> Sheet:
    """The sheet of a part that is made.

    Args:
        places: Where it is in the arm.
        arm: Name of the arm.
        of: Number of the sheet.
    """
    part = places[0].part
    rows = [("dimension", "value", "tolerance"), *dimension_rows(part)]
    tilted = [square_to(way, letter) for way, letter in zip(tilted_ways(part), "VWXY", strict=False)]
    holes = [("hole", "drill", "where"), *hole_rows(part, [*PART_VIEWS, *tilted])]
    sheet = Sheet()
    table = sheet.table((COLUMN, 282.0), (70.0, 35.0, 34.0), rows, 5.5)
    if len(holes) > 1:
        table = sheet.table((COLUMN, table[1] - 3.0), (9.0, 68.0, 62.0), holes, 5.5)
    fields = [
        ("title", f"{arm}: {part.name}"),
        ("mark on each", marked(places)),
        ("material", f"{part.material}, {number(part.density, 0)} kg/m³"), ("quantity", str(len(places))),
        ("mass of one", f"{number(1e3 * part.mass)} g"),
        ("general tolerance", f"ISO 2768-m, angles ±{degrees(ANGLE)}°"),
        ("sheet", of),
    ]  # fmt: skip
    rest = Box((COLUMN, block_box([*fields, ""])[3] + 3.0, 405.0, table[1] - 3.0))
    for scale in SCALES[2:]:
        front = part_view(part, PART_VIEWS[0], scale, tilted)
        views, _ = arranged([front, *(part_view(part, view, scale) for view in PART_VIEWS[1:])])
        more = [part_view(part, view, scale) for view in tilted]
        high = sum(float(view.extent.size[1]) + 3.0 for view in more)
        wide = max((float(view.extent.size[0]) for view in more), default=0.0)
        if np.all(np.array(views.size) <= ROOM) and high <= rest.size[1] and wide <= rest.size[0]:
            break
    sheet.put(views, (27.0, 282.0 - views.size[1]))
    top = rest[3]
    for view in more:
        sheet.put(view, (COLUMN - view.extent[0], top - view.extent[3]))
        top -= float(view.extent.size[1]) + 3.0
    for k, line in enumerate(reversed(notes(part))):
        sheet.text(line, (27.0, 16.0 + 5.0 * k), "left", 3.0)
    return framed(sheet, [*fields[:6], ("scale", words_of_scale(scale)), fields[6]])


def notes(part: Part) -> list[str]:
    """What a mechanic has to know that is in no table, a line each."""
    lines = [part.note] if part.note and part.kind != "bracket" else []
    for face in part.circles.values():
        if face.maker:
            lines += [
                f"Face: not drilled. Drill it by the maker's drawing of the {face.maker}, about the axis drawn.",
                "Thread, length and greatest depth of the screws are in the same drawing.",
                f"There is room for a circle up to ⌀{number(1e3 * face.diameter)} mm with {face.thread}.",
            ]
            if part.note == "wedge":
                under = number(1e3 * part.sizes["under heads"], 2)
                lines.append(f"Sink their heads to {under} mm above the face, clear of the tapped holes.")
    if part.note == "wedge":
        lines.append("Depths of tapped holes are those of the thread; the drill may come out at the face.")
    if part.kind == "tube":
        turn = number(np.degrees(part.sizes["turn of S"]), 2)
        lines += [
            "S: scribe line at each end. A flange is in as it has to be when its line meets this one.",
            f"S of -b is {turn}° from S of -a, 0 to 360°, clockwise seen from the inner end, which is at -a.",
            "Front view: on the outer end, at -b; there it is anticlockwise.",
        ]
    elif part.scribes and part.kind == "base plate":
        lines.append("x: scribe line, over the edge, too, towards x of the base. Angles of holes are against it.")
    elif part.scribes:
        lines.append("S: scribe line, over the edge, too. A flange is on as it has to be when its line meets this one.")
    return lines


def marked(places: Sequence[Placed]) -> str:
    """The marks of parts that are alike; those of links' ends together, as ``L0, L1: -T1-a/b``."""
    ends: dict[str, list[str]] = {}
    for each in places:
        ends.setdefault(each.mark[:-2] if each.mark.endswith(("-a", "-b")) else each.mark, []).append(each.mark[-1])
    names = [mark + (f"-{'/'.join(letters)}" if mark not in {e.mark for e in places} else "")
             for mark, letters in ends.items()]  # fmt: skip
    links: dict[str, list[str]] = {}
    for name in names:
        head, _, tail = name.partition("-")
        links.setdefault(tail if head.startswith("L") else name, []).append(head)
    return ", ".join(
        tail if tail in names else f"{heads[0]}-{tail}" if len(heads) == 1 else f"{', '.join(heads)}: -{tail}"
        for tail, heads in links.items()
    )


def dimension_rows(part: Part) -> Iterator[tuple[str, str, str]]:
    """Every dimension of a part by name with what it may be off, lengths in millimetres."""
    for name, value in part.sizes.items():
        off = deviation(name, value)
        if name.startswith(ANGLES):
            yield name, f"{degrees(value)}°", f"±{degrees(off)}°"
        elif name == "spigot":  # tubes' bores are off by more than it may be
            yield name, f"{number(1e3 * value, 2)} mm", "bore −0.05 / −0.1"
        elif name == "inner radius":
            yield name, f"{number(1e3 * value, 2)} mm", "or less"
        elif name == "hole":
            yield name, f"{number(1e3 * value, 2)} mm", "+0.1 / 0 mm"
        else:
            yield name, f"{number(1e3 * value, 2)} mm", f"±{number(1e3 * off)} mm"


def tilted_ways(part: Part) -> list[Array]:
    """Outward directions of holes that no principal view looks along, shape (3,) each."""
    middle = part.inertial.com
    found: list[Array] = []
    for hole in part.holes:
        way = direction(hole)
        way = way if (hole.start + hole.end - 2.0 * middle) @ way > 0.0 else -way
        square = any(looks_along(view, way) for view in PART_VIEWS)
        known = any(way @ other > 1.0 - 1e-6 for other in found)
        if part.kind != "tube" and not square and not known:
            found.append(way)
    return found


def square_to(way: Array, letter: str) -> View:
    """A view along a direction in the x-y plane of a part, that it looks from, shape (3,)."""
    right = np.cross([0.0, 0.0, 1.0], way)
    x, y, z = (right / np.linalg.norm(right)).tolist()
    return View(f"view {letter}, square to its holes", (x, y, z), (0.0, 0.0, 1.0))


def part_view(part: Part, view: View, scale: float, tilted: Sequence[View] = ()) -> Sheet:
    """A part from one side with its size, holes that are looked into with their letters, others hidden.

    Args:
        part: The part.
        view: How it is looked at.
        scale: Of the drawing.
        tilted: Views whose directions are shown.
    """
    factor, labels = 1e3 * scale, Labels(Sheet())
    sheet = labels.sheet
    for outline in draw_solids(sheet, solids_of(part, np.eye(4)), view, factor):
        labels.keep_clear(*outline)
    box = sheet.extent
    left, bottom, right, top = box
    for hole in part.holes:
        draw_hole(labels, hole, view, factor)
    if part.kind in ("bracket", "corner") and view is PART_VIEWS[0]:
        draw_angle(labels, part, factor)
    for other in tilted:
        tip = factor * view.flat(max((h.start for h in part.holes if looks_along(other, h.end - h.start)),
                                     key=lambda point: float(point @ other.towards)))  # fmt: skip
        away = view.flat(other.towards)
        sheet.line(tip + 12.0 * away, tip + 4.0 * away)
        sheet.arrow(tip + 4.0 * away, -away)
        labels.keep_clear(tip + 12.0 * away, tip + 4.0 * away)
        labels.leader(other.name[5], tip + 12.0 * away, line=False)
    width, height = number((right - left) / scale), number((top - bottom) / scale)
    outer = max((s.radius for s in part.solids if isinstance(s, Rod)), default=0.0)
    round_ = abs(right - left - 2.0 * factor * outer) < 0.1 and abs(top - bottom - 2.0 * factor * outer) < 0.1
    labels.dimension(f"⌀{width}" if round_ else width, (right, bottom), (left, bottom))
    if not round_:
        labels.dimension(height, (left, bottom), (left, top))
    faces = [name for name, held in part.circles.items() if held.maker]
    if faces and looks_along(view, np.array([0.0, 1.0, 0.0])):  # of brackets, whose axis of the actuator is y
        for reach in 5.0 * np.eye(2):
            sheet.line(-reach, reach, pen="thin")
        labels.leader("face, to be drilled", np.zeros(2))
        draw_middle(labels, np.zeros(2), box, scale)
    for group in hole_groups(part):
        draw_group(labels, part, group, view, scale, box)
    for scribe, end in zip(part.scribes, "ab" if part.kind == "tube" else "  ", strict=False):
        ends = factor * view.flat(scribe)
        if part.kind == "tube" and looks_along(view, scribe[1] - scribe[0]):  # a notch in the end
            ends[1] *= 1.0 - 2.0 / np.linalg.norm(ends[1])
        if np.linalg.norm(ends[1] - ends[0]) > 1.0:
            sheet.line(*ends, pen="heavy")
            plain = "x" if part.kind == "base plate" else "S"
            labels.leader(plain if end == " " else f"S at -{end}", ends.mean(axis=0))
    bores = {round(2e3 * h.radius, 2): h for h in part.holes if not h.use and looks_along(view, h.end - h.start)}
    for size, hole in bores.items():
        labels.leader(f"⌀{number(size, 2)}", factor * view.flat(hole.end) + 0.35 * scale * size)
    extent = sheet.extent
    sheet.text(view.name, ((extent[0] + extent[2]) / 2.0, extent[1] - LETTER - 1.0), size=3.0)
    return sheet


def draw_group(labels: Labels, part: Part, group: HoleGroup, view: View, scale: float, box: Box) -> None:
    """The letter of holes that are looked into, the circle they are on, and how far its middle is from the edges.

    Of what is drilled across, which has no circle, the distance from an end where it is seen from beside.

    Args:
        labels: The view.
        part: The part.
        group: The holes.
        view: How they are looked at.
        scale: Of the drawing.
        box: The part's outline in the view [mm].
    """
    factor, sheet = 1e3 * scale, labels.sheet
    middle = factor * view.flat(group.middle)
    if group.circle and looks_along(view, group.way):
        ring = circle(middle, factor * group.circle / 2.0)
        sheet.line(*ring, ring[0], pen="axis")
        labels.keep_clear(*ring)
        ends = np.array([factor * view.flat(hole.end) for hole in group.holes])
        target = ends[int(np.argmax(ends.sum(axis=1)))] + 0.7 * factor * group.holes[0].radius
        labels.leader(group.letter, target)
        draw_middle(labels, middle, box, scale)
    elif part.kind == "bracket":  # in cheeks, by the hole table
        if looks_along(view, group.way) and group.way @ view.towards > 0.0:
            labels.leader(group.letter, factor * view.flat(group.holes[0].end))
    elif not group.circle and looks_along(view, np.array([0.0, 0.0, 1.0])):  # both walls, from the end
        ends = np.array([factor * view.flat(hole.end) for hole in group.holes])
        sheet.line(*(1.1 * ends), pen="axis")
        labels.leader(group.letter, ends[0])
        turn = part.sizes.get("turn of S", 0.0)
        if group.letter != "A" and abs(turn) > 1e-4:
            half = float(np.linalg.norm(ends[0])) * 0.6
            turns = np.linspace(0.0, turn, 20)
            arc = half * np.stack([np.cos(turns), np.sin(turns)], axis=1)
            sheet.line(*arc)
            labels.leader(f"{degrees(turn)}°", arc[10])
    elif not group.circle and looks_along(view, group.way):
        labels.leader(group.letter, middle)
    elif not group.circle and abs(view.flat([0.0, 0.0, 1.0])).max() > 0.5:  # from beside
        along = view.flat([0.0, 0.0, 1.0])
        low, high = sorted(float(x) for x in (np.array(box[:2]) @ along, np.array(box[2:]) @ along))
        at = float(factor * group.middle[2])
        start = low if part.kind != "tube" or at - low < high - at else high
        start = factor * part.sizes["thickness"] if part.kind != "tube" else start
        labels.dimension(number(abs(at - start) / scale, 2), start * along, at * along)
        labels.leader(group.letter, at * along)


def draw_middle(labels: Labels, middle: Array, box: Box, scale: float) -> None:
    """How far the middle of a circle is from the left and lower edge of a view, where it is not in the middle of that.

    Args:
        labels: The view.
        middle: The middle, shape (2,) [mm].
        box: The part's outline in the view [mm].
        scale: Of the drawing.
    """
    for k, edge in enumerate(((box[0], middle[1]), (middle[0], box[1]))):
        if abs(2.0 * middle[k] - box[k] - box[k + 2]) > 0.1 * scale:
            labels.dimension(number(abs(float(middle[k]) - box[k]) / scale), edge, middle)


def draw_hole(labels: Labels, hole: Rod, view: View, factor: float) -> None:
    """A hole as a circle with its centre, or hidden from the side with its axis.

    Args:
        labels: What is drawn on.
        hole: The hole.
        view: How it is looked at.
        factor: Millimetres on paper per metre.
    """
    start, end = factor * view.flat([hole.start, hole.end])
    along, radius = end - start, factor * hole.radius
    if looks_along(view, hole.end - hole.start):
        labels.sheet.area(circle(end, radius), "thin", "none")
        for reach in (radius + 1.0) * np.eye(2):
            labels.sheet.line(end - reach, end + reach, pen="thin" if radius < 2.0 else "axis")
    elif abs(float((hole.end - hole.start) @ view.towards)) < np.sin(ANGLE) * np.linalg.norm(hole.end - hole.start):
        way = along / np.linalg.norm(along)
        side = radius * np.array([-way[1], way[0]])
        for by in (side, -side):
            labels.sheet.line(start + by, end + by, pen="hidden")
        labels.sheet.line(start - 1.5 * way, end + 1.5 * way, pen="axis")


def draw_angle(labels: Labels, part: Part, factor: float) -> None:
    """The angle between the two axes that a bracket or corner joins, with its arc.

    Args:
        labels: The front view.
        part: The part.
        factor: Millimetres on paper per metre.
    """
    angle = part.sizes["angle"]
    first, last = (np.pi / 2.0, np.pi / 2.0 - angle) if part.kind == "bracket" else (angle / 2.0, -angle / 2.0)
    foot = np.zeros(2)
    if part.note in ("wedge", "standing"):
        foot[1] = factor * min(float(s.polygon[:, 1].min()) for s in part.solids if not isinstance(s, Rod))
    foot[1] += factor * part.sizes.get("tube above middle", 0.0) / np.sin(angle) if angle > 1e-6 else 0.0
    box = labels.sheet.extent
    reach = float(np.linalg.norm([max(abs(box[0]), abs(box[2])), max(abs(box[1]), abs(box[3]))])) + 4.0
    for turn in (first, last):
        end = foot + reach * np.array([np.cos(turn), np.sin(turn)])
        labels.sheet.line(foot, end, pen="axis")
        labels.keep_clear(foot, end)
    turns = np.linspace(first, last, 40)
    arc = foot + (reach - 2.0) * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    if angle > 1e-6:
        labels.sheet.line(*arc)
        labels.keep_clear(*arc)
        labels.leader(f"{degrees(angle)}°", arc[20])


def overview(build: Build, of: str) -> Sheet:
    """The arm pulled apart, its kinds of part numbered, with the parts list.

    Args:
        build: The build.
        of: Number of the sheet.
    """
    assembly, view = assembly_of(build), slanted()
    turned = np.eye(4)
    turned[:3, :3] = MOUNTINGS[build.result.base_pose.mounted]
    zero = np.zeros(build.result.table.dof)
    placed = [(each, turned @ pose) for each, pose in assembly.posed(build.result.table, zero)]
    centres = [pose[:3, :3] @ each.part.inertial.com + pose[:3, 3] for each, pose in placed]
    away, drawn = np.zeros(3), []
    for k, (each, pose) in enumerate(placed):
        step = centres[k] - centres[k - 1] if k else np.zeros(3)
        away = away + NEXT * step / max(float(np.linalg.norm(step)), 1e-6)
        moved = pose.copy()
        moved[:3, 3] += away
        drawn.append((each, solids_of(each.part, moved, each.link, SHADES[each.part.look])))
    kinds = assembly.counted()
    rows = [("no.", "part", "qty", "material", "mass [g]", "marks")]
    for k, (name, (part, places)) in enumerate(kinds.items(), start=1):
        marks = marked(places)
        mass = number(1e3 * part.mass)
        rows.append((str(k), name, str(len(places)), "bought" if part.bought else part.material, mass, marks))
    widths = (8.0, 36.0, 8.0, 36.0, 16.0, 66.0)
    sheet = Sheet()
    table = sheet.table((405.0 - sum(widths), 282.0), widths, rows, min(6.0, 220.0 / len(rows)))
    under = Box((25.0, block_box(4 * [""])[3] + 4.0, 405.0, table[1] - 4.0))
    solids = [solid for _, several in drawn for solid in several]
    seen = view.flat(np.concatenate([solid.corners for solid in solids]))
    beside = Box((25.0, 15.0, table[0] - 4.0, 282.0))
    factor, space = max((float(np.min((room.size - 40.0) / np.ptp(seen, axis=0))), room) for room in (under, beside))
    labels = Labels(Sheet())
    for outline in draw_solids(labels.sheet, solids, view, factor):
        labels.keep_clear(*outline)
    numbers = {name: str(k) for k, name in enumerate(kinds, start=1)}
    for each, several in drawn:
        labels.leader(numbers[each.part.name], factor * view.flat(several[0].middle))
    extent = labels.sheet.extent
    sheet.put(labels.sheet, np.array(space[:2]) + (space.size - extent.size) / 2.0 - extent[:2])
    total = sum(part.mass * len(places) for part, places in kinds.values())
    fields = [
        ("title", f"{build.result.name}: parts"), ("sheet", of), ("mass of all", f"{number(total, 2)} kg"),
        ("drawn", "with every joint at zero, not to scale"),
    ]  # fmt: skip
    return framed(sheet, fields)
