"""Sheets for the workshop: one for each part that is made, and an exploded overview with the parts list."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armdesign._types import Array
from armdesign.building.arm_drawing import Pose, arm_sheet, arranged, degrees, words_of_scale
from armdesign.building.build import Build, assembly_of
from armdesign.building.labels import Labels
from armdesign.building.part_dimensions import (
    BOTTOM,
    FRONT,
    PART_VIEWS,
    SIDE,
    TOP,
    crossing_point,
    outlines,
    outward,
    part_dimensions,
    sides,
)
from armdesign.building.part_holes import HOLE_HEADS, HoleGroup, datum, direction, hole_groups, hole_rows, looks_along
from armdesign.building.part_tolerances import ANGLE
from armdesign.building.parts import Part, Placed, Rod, Screws, file_name
from armdesign.building.projection import SHADES, View, draw_solids, slanted, solids_of
from armdesign.building.sheet import (
    LETTER,
    SCALES,
    Box,
    Sheet,
    block_box,
    circle,
    framed,
    number,
    svg_of,
    text_width,
)
from armdesign.building.sheet_figure import pdf_of
from armdesign.building.shop import ALUMINIUM
from armdesign.kinematics.base_pose import MOUNTINGS

COLUMN = 266.0
"""Where tables beside the views begin [mm]."""
PICTURE = (62.0, 58.0)
"""Width and height of a part's picture at an angle [mm]."""
AT_AN_ANGLE = View("at an angle", (0.77, 0.0, -0.64), (-0.27, 0.91, -0.32))
"""From the front, the right and above."""
EDGES = "Edges broken 0.3. Surfaces Ra 3.2."
PRINTING = {
    "bracket": "Print it solid, lying on what the front view shows: layers run along both plates.",
    "corner": "Print it solid, lying on what the front view shows.",
    "base plate": "Print it solid, lying flat.",
    "spacer": "Print it solid, lying flat.",
}
"""How parts are printed, by their kind: no load may part layers that need not."""
CHEEKS_PRINTED = "Support the upper cheek. Loads on cheeks bend them across layers: do not pry a housing out."
SPIGOT_PRINTED = "Print it solid, its disc on the bed. Its weak place is the spigot's root, where bending parts layers."
THREADS_PRINTED = (
    "Threads: print holes 0.3 smaller than in the STL, drill as stated, tap by hand; no inserts or forming screws."
)
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
        sheets[file_name(name)] = part_sheet(places, assembly.screws, title, f"{k} of {of}")
    if build.fault:
        for sheet in sheets.values():
            sheet.text(build.warning[:150], (27.0, 284.4), "left", 3.0, bold=True)
    return {
        "drawing/drawings.pdf": pdf_of(sheets.values()),
        **{f"drawing/{name}.svg": svg_of(sheet) for name, sheet in sheets.items()},
    }


def part_sheet(places: Sequence[Placed], screws: Sequence[Screws], arm: str, of: str) -> Sheet:
    """The sheet of a part that is made.

    Args:
        places: Where it is in the arm.
        screws: All of the arm.
        arm: Name of the arm.
        of: Number of the sheet.
    """
    part, held = places[0].part, sides(places, screws)
    tilted = [square_to(way, letter) for way, letter in zip(tilted_ways(part), "VWXY", strict=False)]
    sheet, lines = Sheet(), notes(part)
    rows = [HOLE_HEADS, *hole_rows(part, [*PART_VIEWS, *tilted])]
    table = sheet.table((COLUMN, 282.0), (9.0, 68.0, 12.0, 25.0, 12.0, 13.0), rows, 5.5)
    fields = [
        ("title", f"{arm}: {part.name}"),
        ("mark on each", marked(places)),
        ("material", f"{part.material}, {number(part.density, 0)} kg/m³"), ("quantity", str(len(places))),
        ("mass of one", f"{number(1e3 * part.mass)} g"),
        ("general tolerance", f"ISO 2768-m, angles ±{degrees(ANGLE)}°"),
        ("sheet", of),
    ]  # fmt: skip
    foot = block_box([*fields, ""])[3] + 3.0
    picture = Box((405.0 - PICTURE[0], foot, 405.0, foot + PICTURE[1]))
    rest = Box((COLUMN, picture[3] + 3.0, 405.0, table[1] - 3.0))
    besides = [*tilted, *([BOTTOM] if any(each.view == BOTTOM for each in part_dimensions(part)) else [])]
    top = TOP if outlines(part) else None
    side = SIDE if top is None or any(looks_along(SIDE, direction(hole)) for hole in part.holes) else None
    wide = max(text_width(line, 3.0) for line in lines)
    taken = [table, picture, block_box([*fields, ""]), Box((20.0, 10.0, 28.0 + wide, 19.0 + 5.0 * len(lines)))]
    spans = np.ptp(np.concatenate([solid.corners for solid in solids_of(part, np.eye(4))]), axis=0)
    least = spans[:2] + spans[2] * np.array([side is not None, top is not None])  # without any labels
    for scale in SCALES[2:]:
        if np.any(1e3 * scale * least > (378.0, 262.0)) and scale > SCALES[-1]:
            continue
        views, boxes = arranged([Sheet() if view is None else part_view(part, view, scale, tilted, held)
                                 for view in (FRONT, top, side)])  # fmt: skip
        more, above = [], rest[3]
        for view in besides:
            one = part_view(part, view, scale)
            more.append((one, np.array([COLUMN - one.extent[0], above - one.extent[3]])))
            above -= float(one.extent.size[1]) + 3.0
        column = [one.extent.moved(by) for one, by in more]
        corners = [np.array([27.0, high - views.size[1]]) for high in (282.0, table[1] - 4.0)]
        corner = next((by for by in corners if by[1] > 15.0 and not any(
            box.moved(by).overlaps(other) for box in boxes for other in (*taken, *column))), None)  # fmt: skip
        inside = all(box[2] <= rest[2] and box[1] >= rest[1] for box in column)
        if corner is not None and inside and 27.0 + views.size[0] <= 405.0:
            break
    sheet.put(views, corners[0] if corner is None else corner)
    for one, by in more:
        sheet.put(one, by)
    draw_picture(sheet, part, picture)
    for k, line in enumerate(reversed(lines)):
        sheet.text(line, (27.0, 16.0 + 5.0 * k), "left", 3.0)
    return framed(sheet, [*fields[:6], ("scale", words_of_scale(scale)), fields[6]])


def draw_picture(sheet: Sheet, part: Part, room: Box) -> None:
    """A part at an angle, with the mouths of its holes that are seen.

    Args:
        sheet: What is drawn on.
        part: The part.
        room: Where [mm].
    """
    solids, towards = solids_of(part, np.eye(4)), AT_AN_ANGLE.towards
    seen = AT_AN_ANGLE.flat(np.concatenate([solid.corners for solid in solids]))
    factor = float(np.min((room.size - 4.0) / np.ptp(seen, axis=0)))
    drawn = Sheet()
    draw_solids(drawn, solids, AT_AN_ANGLE, factor)
    for hole in part.holes:
        way = direction(hole)
        across = np.linalg.svd(way[None])[2][1:]
        for mouth, out in ((hole.start, -way), (hole.end, way)):
            sight = mouth + 1e-4 * out + np.linspace(0.0, 0.4, 400)[:, None] * towards
            if out @ towards > 0.05 and not part.holds(sight).any():
                drawn.area(
                    factor * AT_AN_ANGLE.flat(mouth + circle((0.0, 0.0), hole.radius) @ across), "thin", "#d9d9d9"
                )
    sheet.put(drawn, np.array(room[:2]) + room.size / 2.0 - np.mean(np.reshape(drawn.extent, (2, 2)), axis=0))


def notes(part: Part) -> list[str]:
    """What a mechanic has to know that is in no table, a line each."""
    tapped = any("tapped" in use for use in part.circles)
    lines = [part.note] if part.note and part.kind != "bracket" else []
    for face in part.circles.values():
        if face.maker:
            lines += [
                f"Face: not drilled. Drill it by the maker's drawing of the {face.maker}, about the axis drawn.",
                "Thread, length and greatest depth of the screws are in the same drawing.",
            ]
            if face.diameter:  # none where the holes are on no circle, for which there is room where they are
                room = f"There is room for {face.count} {face.thread} on a circle up to"
                lines.append(f"{room} ⌀{number(1e3 * face.diameter)} mm.")
            if part.note == "wedge":
                under = number(1e3 * part.sizes["under heads"], 2)
                lines.append(f"Sink their heads to {under} mm above the face, clear of the tapped holes.")
    if part.kind == "tube":
        turn = number(np.degrees(part.sizes["turn of S"]), 2)
        lines += [
            "S: scribe line 15 long at each end. A flange is in as it has to be when its line meets this one.",
            f"S of -b is {turn}° from S of -a, 0 to 360°, clockwise seen from the inner end, which is at -a.",
            "Front view: on the outer end, at -b; there it is anticlockwise.",
        ]
    elif part.scribes and part.kind == "base plate":
        lines.append("x: scribe line, over the edge, too, towards x of the base. Angles of holes are against it.")
    elif part.scribes:
        between = ", half way between two holes A" if part.kind == "spacer" else ""
        lines.append(f"S: scribe line, over edges, too{between}. It has to meet that of the flange on it.")
    if any(group.circle for group in hole_groups(part)):
        lines.append("Circles are about the datum, where the arrows x and y begin; angles from x, anticlockwise.")
    if "inner radius" in part.sizes:
        radius, but = number(1e3 * part.sizes["inner radius"], 2), ", none at cheeks" if "cheek" in part.sizes else ""
        lines.append(f"Between the plates a radius of {radius} or less{but}.")
    if tapped:
        lines.append("M × a, drill ⌀ × b: a is the depth of full thread, b that of the drill, without its tip.")
    if part.kind == "tube" or part.material == ALUMINIUM[0]:
        return [*lines, EDGES]
    cheeks = [CHEEKS_PRINTED] if "cheek" in part.sizes else []
    return [*lines, PRINTING.get(part.kind, SPIGOT_PRINTED), *cheeks, *([THREADS_PRINTED] if tapped else [])]


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


def part_view(
    part: Part, view: View, scale: float, tilted: Sequence[View] = (), held: Sequence[tuple[str, Array]] = ()
) -> Sheet:
    """A part from one side with its dimensions, holes that are looked into with their letters, others hidden.

    Args:
        part: The part.
        view: How it is looked at.
        scale: Of the drawing.
        tilted: Views whose directions are shown.
        held: What goes on which side of it, and a point of that, shape (3,) [m].
    """
    factor, labels = 1e3 * scale, Labels(Sheet())
    sheet = labels.sheet
    outside = []
    for outline in draw_solids(sheet, solids_of(part, np.eye(4)), view, factor):
        labels.keep_clear(*outline)
        outside.append(Box((*outline.min(axis=0).tolist(), *outline.max(axis=0).tolist())))
    box = sheet.extent
    scribes = draw_scribes(labels, part, view, factor)
    for hole in part.holes:
        draw_hole(labels, hole, view, factor)
    if outlines(part) and view is FRONT:
        draw_angle(labels, part, factor)
    faces = any(each.maker for each in part.circles.values()) and looks_along(view, np.array([0.0, 1.0, 0.0]))
    data = {(0.0, 0.0): 15.0} if faces else {}
    for group in hole_groups(part):
        if group.circle and looks_along(view, group.way):
            key = tuple((np.round(factor * view.flat(group.middle), 3) + 0.0).tolist())
            data[key] = min(factor * group.circle / 2.0, data.get(key, np.inf))
        elif part.kind == "bracket" and not group.circle and view is FRONT:
            data[tuple((factor * datum(part)).tolist())] = 15.0
    for place, radius in data.items():
        edges = outlines(part) and view is not FRONT
        draw_datum(labels, np.array(place), radius, box, scale if edges else None)
    if faces:  # of brackets, whose axis of the actuator is y
        labels.leader("face, to be drilled", np.zeros(2))
    for group in hole_groups(part):
        draw_group(labels, part, group, view, factor)
    for other in tilted if view is FRONT else ():
        tip = factor * view.flat(max((h.start for h in part.holes if looks_along(other, h.end - h.start)),
                                     key=lambda point: float(point @ other.towards)))  # fmt: skip
        away = view.flat(other.towards)
        sheet.line(tip + 12.0 * away, tip + 4.0 * away)
        sheet.arrow(tip + 4.0 * away, -away)
        labels.keep_clear(tip + 12.0 * away, tip + 4.0 * away)
        labels.leader(other.name[5], tip + 12.0 * away, line=False)
    for each in part_dimensions(part):
        if each.view == view:
            labels.dimension(each.text, *(factor * view.flat([each.start, each.end])), lines_only=True)
    if held and view is (FRONT if outlines(part) else SIDE):
        labels.boxes += outside
        for words, point in held:
            labels.leader(words, factor * view.flat(point))
    for words, where in scribes:
        labels.leader(words, where)
    bores = {round(2e3 * h.radius, 2): h for h in part.holes if not h.use and looks_along(view, h.end - h.start)}
    for size, hole in bores.items():
        labels.leader(f"⌀{number(size, 2)}", factor * view.flat(hole.end) + 0.35 * scale * size)
    extent = sheet.extent
    sheet.text(view.name, ((extent[0] + extent[2]) / 2.0, extent[1] - LETTER - 1.0), size=3.0)
    return sheet


def draw_scribes(labels: Labels, part: Part, view: View, factor: float) -> list[tuple[str, Array]]:
    """The scribe lines of a part that a view shows, and what to call them with a place of each, shape (2,) [mm].

    Args:
        labels: The view.
        part: The part.
        view: How it is looked at.
        factor: Millimetres on paper per metre.
    """
    found = []
    ways = outward(part) if part.kind == "corner" else [view.towards] * len(part.scribes)
    for scribe, end, way in zip(part.scribes, "ab" if part.kind == "tube" else "  ", ways, strict=False):
        if way @ view.towards < -1e-6:  # on a side of a corner that is turned away
            continue
        ends = factor * view.flat(scribe)
        if part.kind in ("tube", "spacer") and looks_along(view, scribe[1] - scribe[0]):  # a notch in the end
            ends[1] *= 1.0 - 2.0 / np.linalg.norm(ends[1])
        if np.linalg.norm(ends[1] - ends[0]) > 1.0:
            labels.sheet.line(*ends, pen="heavy")
            labels.keep_clear(*ends)
            plain = "x" if part.kind == "base plate" else "S"
            found.append((plain if end == " " else f"S at -{end}", ends.mean(axis=0)))
    return found


def draw_group(labels: Labels, part: Part, group: HoleGroup, view: View, factor: float) -> None:
    """The letter of holes that are looked into and the circle they are on; of a hole across the axis and the letter.

    Args:
        labels: The view.
        part: The part.
        group: The holes.
        view: How they are looked at.
        factor: Millimetres on paper per metre.
    """
    sheet, radius = labels.sheet, factor * group.circle / 2.0
    middle = factor * view.flat(group.middle)
    ends = factor * view.flat([hole.end for hole in group.holes])
    if group.circle:
        if not looks_along(view, group.way):
            return
        ring = circle(middle, radius)
        sheet.line(*ring, ring[0], pen="axis")
        labels.keep_clear(*ring)
        target = ends[int(np.argmax(ends.sum(axis=1)))] + 0.7 * factor * group.holes[0].radius
        labels.leader(f"{group.letter} on ⌀{number(1e3 * group.circle, 2)}", target)
    elif part.kind == "bracket":  # in cheeks
        for k, place in enumerate(group.places if view is FRONT else (), start=1):
            labels.leader(f"{group.letter}{k}", factor * place)
    elif view is SIDE:  # from beside
        across = np.array([0.0, 1.1 * factor * np.linalg.norm(group.holes[0].end[:2])])
        at = ends.mean(axis=0)
        sheet.line(at - across, at + across, pen="axis")
        labels.leader(group.letter, at)
    elif looks_along(view, np.array([0.0, 0.0, 1.0])):  # both walls, from the end
        sheet.line(*(1.1 * ends), pen="axis")
        labels.leader(group.letter, ends[0])
        turn = part.sizes.get("turn of S", 0.0)
        if group.letter != "A" and abs(turn) > 1e-4:
            half = float(np.linalg.norm(ends[0])) * 0.6
            turns = np.linspace(0.0, turn, 20)
            arc = half * np.stack([np.cos(turns), np.sin(turns)], axis=1)
            sheet.line(*arc)
            labels.leader(f"{degrees(turn)}°", arc[10])


def draw_datum(labels: Labels, middle: Array, radius: float, box: Box, scale: float | None) -> None:
    """The arrows x and y from where hole tables measure, and how far that is from the left and lower edge of a view.

    Args:
        labels: The view.
        middle: The middle of circles, shape (2,) [mm].
        radius: Of the smallest [mm].
        box: The part's outline in the view [mm].
        scale: Of the drawing; None for round parts, which have no such edges.
    """
    for k, name in enumerate("xy"):
        axis = np.eye(2)[k]
        tip = middle + min(12.0, 0.7 * radius) * axis
        labels.sheet.line(middle + (box[k] - middle[k] - 2.0) * axis, middle + (box[k + 2] - middle[k] + 2.0) * axis,
                          pen="axis")  # fmt: skip
        labels.sheet.line(middle, tip, pen="outline")
        labels.sheet.arrow(tip, axis)
        labels.keep_clear(middle, tip)
        labels.leader(name, tip, 3.0, line=False)
    if scale is not None:
        labels.dimension(number((middle[0] - box[0]) / scale, 2), (middle[0], box[1]), box[:2])
        labels.dimension(number((middle[1] - box[1]) / scale, 2), box[:2], (box[0], middle[1]))


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
        labels.keep_clear(*circle(end, radius)[::4])
        for reach in (radius + 1.0) * np.eye(2):
            labels.sheet.line(end - reach, end + reach, pen="thin" if radius < 2.0 else "axis")
    elif abs(float((hole.end - hole.start) @ view.towards)) < np.sin(ANGLE) * np.linalg.norm(hole.end - hole.start):
        way = along / np.linalg.norm(along)
        side = radius * np.array([-way[1], way[0]])
        for by in (side, -side):
            labels.sheet.line(start + by, end + by, pen="hidden")
            labels.keep_clear(start + by, end + by)
        labels.sheet.line(start - 1.5 * way, end + 1.5 * way, pen="axis")


def draw_angle(labels: Labels, part: Part, factor: float) -> None:
    """The angle between the two axes that a bracket or corner joins, with its arc.

    Args:
        labels: The front view.
        part: The part.
        factor: Millimetres on paper per metre.
    """
    angle, foot = part.sizes["angle"], factor * FRONT.flat(crossing_point(part))
    ways = [FRONT.flat(way) for way in outward(part)]
    ways = [np.array([0.0, 1.0]), *ways] if part.kind == "bracket" else ways
    first, last = (float(np.arctan2(y, x)) for x, y in ways)
    box = labels.sheet.extent
    reach = float(np.linalg.norm([max(abs(box[0]), abs(box[2])), max(abs(box[1]), abs(box[3]))])) + 4.0
    for name, way in zip(("axis of face", "axis of tube"), ways, strict=True):
        end = foot + reach * way
        if part.kind == "bracket" and angle > 1e-6:
            labels.leader(name, end, 3.0, line=False)
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
