"""Parts as solids: what they weigh, where their holes are, that they hold together, and what CAD makes of them."""

import dataclasses
import re
import xml.etree.ElementTree as ET
from itertools import combinations, product
from pathlib import Path
from types import SimpleNamespace

import coal
import numpy as np
import pytest

from armdesign.bodies.arm_body import arm_body
from armdesign.bodies.cylinder import along
from armdesign.building.assembly import assemble
from armdesign.building.brackets import Knot, anchor, bracket, corner
from armdesign.building.catalogue import find_catalogue
from armdesign.building.part_dimensions import PART_VIEWS, part_dimensions
from armdesign.building.part_drawing import marked, notes, part_sheet, part_view, square_to, tilted_ways
from armdesign.building.part_holes import hole_rows, looks_along
from armdesign.building.part_lists import screw_length, tightening, torque
from armdesign.building.part_tolerances import link_deviations
from armdesign.building.parts import SCREWS, Assembly, BoltCircle, Placed, Prism, Rod, Screws
from armdesign.building.parts_clearance import parts_gap
from armdesign.building.sheet import number
from armdesign.building.shop import (
    ALUMINIUM,
    FLOOR,
    GAP,
    PRINTED,
    TOOL,
    Face,
    Shop,
    envelope,
    frame,
    generic_circle,
    unit,
)
from armdesign.building.tolerance import Tolerances
from armdesign.building.tube_joints import flange, tool_plate, tube
from armdesign.cell.obstacles import Box, Obstacle, Obstacles, Sphere
from armdesign.errors import CatalogueError
from armdesign.kinematics.dh import DHTable
from armdesign.settings import Body

SHOP = Shop(0.03, 0.002, ("aluminium tube 30 x 2", 2700.0), ALUMINIUM)
SIZES = {a.name: a for a in find_catalogue("rmd").actuators}
CHOSEN = [SIZES["X6-60"], SIZES["X4-36"], SIZES["X4-10"]]
TABLE = DHTable.from_rows(
    [[0.1, 0.0, 0.3], [-1.2, 0.06, 0.16], [0.4, 0.35, 0.0], [0.7, 0.2, 0.12]]
)  # fmt: skip


def arm_of(table=TABLE, actuators=CHOSEN, shop=SHOP, **placed):
    modules = [(*envelope(a, shop), a.mass) for a in actuators]
    body = Body(tube_diameter=shop.diameter, tube_wall=shop.wall, modules=modules)
    return arm_body(table, body, **(placed or {"placed": True}))


@pytest.fixture(scope="module")
def assembly():
    return assemble(arm_of(), CHOSEN, SHOP)


def face_of(diameter=0.06, length=0.05, maker="its maker"):
    circle = dataclasses.replace(generic_circle(diameter), maker=maker)
    return Face("J1", np.zeros(3), np.array([0.0, 0, 1]), length / 2, diameter / 2, circle)


def test_forms_have_the_moments_of_points_in_them():
    rng = np.random.default_rng(0)
    prism = Prism(np.array([[0.0, 0.0], [0.05, 0.01], [0.04, 0.06], [-0.01, 0.03]]), 0.03)
    rod = Rod(np.array([0.01, 0.02, 0.0]), np.array([0.04, -0.01, 0.05]), 0.015)
    x = rng.uniform(-0.08, 0.08, (400_000, 3))
    edges = np.roll(prism.polygon, -1, axis=0) - prism.polygon
    beside = x[:, None, :2] - prism.polygon
    in_prism = (edges[:, 0] * beside[..., 1] - edges[:, 1] * beside[..., 0] > 0).all(axis=1) & (np.abs(x[:, 2]) < 0.015)
    u = (rod.end - rod.start) / np.linalg.norm(rod.end - rod.start)
    along = (x - rod.start) @ u
    away = np.linalg.norm(x - rod.start - along[:, None] * u, axis=1)
    in_rod = (along > 0) & (along < np.linalg.norm(rod.end - rod.start)) & (away < rod.radius)
    for form, inside in ((prism, in_prism), (rod, in_rod)):
        each, points = 0.16**3 / len(x), x[inside]
        volume, first, second = form.moments()
        assert volume == pytest.approx(each * len(points), rel=0.02)
        assert first == pytest.approx(each * points.sum(axis=0), abs=0.03 * volume * 0.05)
        assert second == pytest.approx(each * points.T @ points, abs=0.03 * volume * 0.05**2)


def test_masses_by_hand():
    length = 0.2
    holes = 4 * np.pi * (4e-3 / 2) ** 2 * 2e-3
    by_hand = 2700 * (np.pi / 4 * (0.03**2 - 0.026**2) * length - holes)
    assert tube(length, 0.015, 0.3, SHOP).mass == pytest.approx(by_hand, rel=1e-12)
    # a disc of 49 mm, 6 mm thick, with four holes for M4, and a hollow spigot of 25.9 mm with a wall of 4 mm, pinned
    disc = np.pi / 4 * (0.049**2 - 0.0179**2) * 6e-3 - 4 * np.pi / 4 * 4.5e-3**2 * 6e-3
    spigot = np.pi / 4 * (0.0259**2 - 0.0179**2) * 0.03 - 2 * np.pi / 4 * 4e-3**2 * 4e-3
    assert flange(0.03, SHOP).mass == pytest.approx(2700 * (disc + spigot), rel=1e-9)
    made, _, _ = bracket(face_of(), "angle", np.array([1.0, 0, 0]), 1, SHOP)
    t, wide = 8e-3, 0.049  # beside a housing of 60 x 50 mm, 3 mm away from it
    back = generic_circle(0.06).edge
    pad, leg = (back + 0.03 + GAP) * t * wide, t * (0.025 + t + 0.0245) * wide
    bolts = 4 * np.pi / 4 * 3.3e-3**2 * t  # the face is not drilled
    assert made.part.mass == pytest.approx(2700 * (pad + leg - bolts), rel=1e-9)


def test_bolt_circles():
    circle = BoltCircle(0.04, 4, "M4")
    assert circle.places() == pytest.approx(np.array([[0.02, 0], [0, 0.02], [-0.02, 0], [0, -0.02]]), abs=1e-15)
    six = BoltCircle(0.03, 6, "M3").places(0.2)
    assert np.linalg.norm(six, axis=1) == pytest.approx(0.015)
    assert np.linalg.norm(six[1] - six[0]) == pytest.approx(0.015)  # the chord of 60 deg
    assert circle.edge == pytest.approx(0.02 + 0.0035 + 0.0015)


@pytest.mark.parametrize("kind", ["wedge", "angle"])
@pytest.mark.parametrize("shop", [SHOP, dataclasses.replace(SHOP, diameter=0.016, wall=0.0015, made=PRINTED)])
def test_holes_are_in_the_material_and_apart(kind, shop):
    for a in find_catalogue("rmd").actuators:
        for theta in np.radians([0.0, 20.0, 50.0] if kind == "wedge" else [60.0, 90.0, 120.0]):
            face = face_of(a.diameter, a.length, maker="")
            made, seat, _ = bracket(face, kind, np.array([np.sin(theta), 0.0, np.cos(theta)]), 1, shop)
            taps = [hole for hole in made.part.holes if hole.radius == SCREWS[shop.circle.thread][1] / 2]
            others = [hole for hole in made.part.holes if hole not in taps]
            assert len(taps) == 4
            for tap in taps:
                line = np.linspace(tap.start, tap.end, 30)
                for other in others:
                    u = (other.end - other.start) / np.linalg.norm(other.end - other.start)
                    along = np.clip((line - other.start) @ u, 0.0, np.linalg.norm(other.end - other.start))
                    gap = np.linalg.norm(line - other.start - along[:, None] * u, axis=1).min()
                    assert gap > tap.radius + other.radius, (a.name, theta)
            pose = made.pose
            starts = np.stack([tap.start for tap in taps]) @ pose[:3, :3].T + pose[:3, 3]
            assert (starts - seat.point) @ seat.along == pytest.approx(np.zeros(4), abs=1e-12)
            first = seat.point + shop.circle.diameter / 2 * seat.across
            assert np.linalg.norm(starts - first, axis=1).min() == pytest.approx(0.0, abs=1e-12)


def screws_in(part, shop):
    """The screws in a part in its own frame, each as cylinders: shank and head, or what the head is sunk in."""
    sizes = {round(1e6 * clear): (float(thread[1:]) * 1e-3, head) for thread, (clear, _, head) in SCREWS.items()}
    sizes |= {round(1e6 * tap): (float(thread[1:]) * 1e-3, 0.0) for thread, (_, tap, _) in SCREWS.items()}
    sizes[round(1e6 * shop.pin_hole)] = (shop.pin_hole, SCREWS[shop.pin][2])
    for hole in part.holes:
        thread, head = sizes.get(round(2e6 * hole.radius), (0.0, 0.0))
        if not thread or any(np.linalg.norm(h.end - hole.start) < 1e-9 for h in part.holes):
            continue
        way = (hole.end - hole.start) / np.linalg.norm(hole.end - hole.start)
        across = part.kind in ("tube flange", "tool plate") and hole.oblique
        outside = hole.end + (shop.wall + 0.05e-3 if across else 0.0) * way
        sunk = [(h.start, h.end, h.radius) for h in part.holes if np.linalg.norm(h.start - hole.end) < 1e-9]
        on_top = [(outside, outside + thread * way, head / 2.0)] if head and part.kind != "spacer" else []
        yield [(hole.start, outside, thread / 2.0), *(sunk or on_top)]


def between(first, second):
    """Distance of two cylinders (start, end, radius)."""
    forms = [coal.Cylinder(r, float(np.linalg.norm(end - start))) for start, end, r in (first, second)]
    poses = [along(start, end) for start, end, _ in (first, second)]
    ways = [coal.Transform3s(pose[:3, :3], pose[:3, 3]) for pose in poses]
    return coal.distance(forms[0], ways[0], forms[1], ways[1], coal.DistanceRequest(), coal.DistanceResult())


@pytest.mark.parametrize("diameter", [0.012, 0.016, 0.02, 0.025, 0.03, 0.04, 0.06])
def test_no_screw_of_a_part_meets_another(diameter, assembly):
    shop = dataclasses.replace(SHOP, diameter=diameter)
    parts = [make(deep, shop) for make in (flange, tool_plate) for deep in (0.011, 0.02)]
    parts += [each.part for each in assembly.placed if not each.part.bought] if diameter == SHOP.diameter else []
    for part in parts:
        for one, other in combinations(list(screws_in(part, shop)), 2):
            gap = min(between(a, b) for a in one for b in other)
            assert gap > 0.5e-3, (part.name, part.note, gap)


def corners_of(part):
    """Points of the surface of a part's convex forms, in its own frame."""
    for form in part.solids:
        if isinstance(form, Prism):
            yield np.array([[x, y, z] for x, y in form.polygon for z in (-form.width / 2, form.width / 2)])
        else:
            u = (form.end - form.start) / np.linalg.norm(form.end - form.start)
            across = np.linalg.svd(u[None])[2][1:]
            turns = np.linspace(0, 2 * np.pi, 24, endpoint=False)
            ring = form.radius * (np.cos(turns)[:, None] * across[0] + np.sin(turns)[:, None] * across[1])
            yield np.concatenate([form.start + ring, form.end + ring])


def test_what_is_joined_touches_and_its_screws_meet(assembly):
    at_zero = [np.eye(4), *TABLE.frames(np.zeros(3))]
    pose = {each.mark: at_zero[each.link] @ each.pose for each in assembly.placed}
    part = {each.mark: each.part for each in assembly.placed}

    def axes(mark):
        """Starts, ends and radii of the holes of a part in the base's frame."""
        turn, place = pose[mark][:3, :3], pose[mark][:3, 3]
        return [(turn @ h.start + place, turn @ h.end + place, h.radius) for h in part[mark].holes]

    met = 0
    for screws in assembly.screws:
        first, second = screws.joins
        if second in (FLOOR, TOOL) or part[first].kind == "actuator":
            continue
        clear, tap, _ = SCREWS[screws.thread]
        for start, end, radius in axes(first):
            for other, _, size in axes(second):
                if min(np.linalg.norm(start - other), np.linalg.norm(end - other)) < 1e-9 and {radius, size} <= {
                    clear / 2,
                    tap / 2,
                }:
                    met += 1
        assert met or part[first].kind == "base plate"
    tubes = [each for each in assembly.placed if each.part.kind == "tube"]
    assert met >= 4 * len(tubes)
    for each in tubes:  # pinned at both ends: the holes of tube and flange are on one line
        for letter in "ab":
            spigot = [h for h in axes(f"{each.mark}-{letter}") if h[2] == 4e-3 / 2][:2]
            own = [h for h in axes(each.mark) if h[2] == 4e-3 / 2]
            middle = (spigot[0][0] + spigot[1][0]) / 2
            way = (spigot[0][1] - middle) / np.linalg.norm(spigot[0][1] - middle)
            away = [np.linalg.norm(np.cross(h[1] - middle, way)) for h in own]
            assert sorted(away)[1] == pytest.approx(0.0, abs=1e-9)


@pytest.fixture(scope="module")
def at_random():
    """Arms put together of several tubes, materials and actuators: tables, parts, and what they are made for."""
    rng, found = np.random.default_rng(7), []
    small = [SIZES["X4-36"], SIZES["X4-10"], SIZES["X4-10"]]
    known = [dataclasses.replace(a, circles={"output": (0.025, 4, "M3"), "housing": (0.03, 6, "M3")}) for a in small]
    while len(found) < 10:
        rows = rng.uniform([-1.5, 0.0, 0.0], [1.5, 0.3, 0.3], (4, 3))
        rows[0, 1] *= rng.integers(2)
        made = ALUMINIUM if len(found) % 2 else PRINTED
        shop, chosen = (
            dataclasses.replace(SHOP, diameter=float(rng.choice([0.02, 0.03])), made=made),
            [CHOSEN, small, known][rng.integers(3)],
        )
        table = DHTable.from_rows(rows)
        try:
            found.append((table, assemble(arm_of(table, chosen, shop), chosen, shop), shop))
        except CatalogueError:
            continue
    return found


def lines_of(each, sizes):
    """Ends of the axes of a part's holes of some diameters, in its link's frame, shape (k, 2, 3)."""
    held = [h for h in each.part.holes if any(abs(2.0 * h.radius - size) < 1e-9 for size in sizes)]
    ends = np.array([(h.start, h.end) for h in held]).reshape(-1, 2, 3)
    return ends @ each.pose[:3, :3].T + each.pose[:3, 3]


def test_holes_that_screws_join_lie_on_the_same_axes(at_random):
    seen = set()
    for _, made, shop in at_random:
        parts = {each.mark: each for each in made.placed}
        for screws in made.screws:
            names = [mark for mark in (*screws.joins, screws.spacer) if mark]
            if screws.maker or not set(names) <= set(parts) or any(parts[mark].part.bought for mark in names):
                continue
            sizes = (shop.pin_hole,) if screws.nut else SCREWS[screws.thread][:2]
            first, *others = (lines_of(parts[mark], sizes) for mark in names)
            for other in others:
                meet = 0
                for start, end in first:
                    way = (end - start) / np.linalg.norm(end - start)
                    meet += any(np.linalg.norm(np.cross(line - start, way), axis=1).max() < 5e-5 for line in other)
                assert meet >= screws.count * (1 + screws.nut), (names, meet)
            seen.add((parts[names[0]].part.kind, parts[names[1]].part.kind))
    assert {("base plate", "bracket"), ("tube flange", "bracket"), ("tube", "tube flange")} <= seen


def test_heads_are_clear_of_all_that_stands_beside_them(at_random):
    for _, made, _shop in at_random:
        for screws in made.screws:
            across = screws.nut or screws.maker or screws.joins[1] == TOOL
            if across or not (screws.joins[1] == FLOOR or screws.joins[0].startswith("L")):
                continue
            owner = next(each for each in made.placed if each.mark == screws.joins[0])
            radius, high = SCREWS[screws.thread][2] / 2.0, 1e-3 * float(screws.thread[1:])
            up = owner.pose[:3, 2]  # of flanges and plates away from what they are screwed to
            level = owner.part.sizes.get("thickness", 0.0) / (2.0 if screws.joins[1] == FLOOR else 1.0)
            for line in lines_of(owner, SCREWS[screws.thread][:1]):
                foot = line[0] + ((owner.pose[:3, 3] + level * up - line[0]) @ up) * up
                head = (foot + 1e-5 * up, foot + high * up, radius)
                for each in made.of_link(owner.link):
                    for form in each.part.solids if owner.part.kind != "spacer" else ():
                        gap = head_gap(head, form, each.pose)
                        assert gap > 0.0, (screws.joins, each.mark, gap)


def thin_walls(part, least):
    """Places beside and below the tapped holes of a part that have less wall than they should."""
    for hole in part.holes:
        if "tapped" in hole.use:
            way = (hole.end - hole.start) / np.linalg.norm(hole.end - hole.start)
            across = np.linalg.svd(way[None])[2][1:]
            turns = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
            ring = np.cos(turns)[:, None] * across[0] + np.sin(turns)[:, None] * across[1]
            depths = np.linspace(hole.start, hole.end, 9)
            points = (depths[:, None] + (hole.radius + least) * ring).reshape(-1, 3)
            yield from points[~part.holds(points)]


def test_tapped_holes_keep_their_walls_along_their_depth(at_random):
    for _, made, shop in at_random:
        least = 1.5e-3 if shop.made == ALUMINIUM else 2e-3
        for each in made.placed:
            assert not list(thin_walls(each.part, least)), (each.mark, each.part.note)


@pytest.mark.parametrize("made", [ALUMINIUM, PRINTED])
def test_wedges_and_corners_of_every_angle_keep_walls(made):
    least = 1.5e-3 if made == ALUMINIUM else 2e-3
    for diameter, wide, maker in product((0.016, 0.025, 0.03, 0.06), (0.04, 0.1), ("", "its maker")):
        shop = dataclasses.replace(SHOP, diameter=diameter, made=made)
        for theta in np.radians([0.0, 10.0, 22.7, 40.0, 64.0]):
            way = np.array([np.sin(theta), 0.0, np.cos(theta)])
            wedge = bracket(face_of(wide, maker=maker), "wedge", way, 1, shop)[0].part
            assert not list(thin_walls(wedge, least)), (diameter, wide, theta)
        for opening in np.radians([40.0, 90.0, 120.0, 150.0, 170.0]):
            ways = np.array([1.0, 0.0, 0.0]), np.array([np.cos(opening), np.sin(opening), 0.0])
            assert not list(thin_walls(corner("L1-C1", np.zeros(3), ways, 1, shop)[0].part, least)), opening


def head_gap(cylinder, form, pose):
    """Distance of a cylinder (start, end, radius) to a convex form at a pose."""
    if isinstance(form, Rod):
        ends = [pose[:3, :3] @ x + pose[:3, 3] for x in (form.start, form.end)]
        return between(cylinder, (*ends, form.radius))
    points = form.ends.reshape(-1, 3) @ pose[:3, :3].T + pose[:3, 3]
    corners = coal.StdVec_Vec3s()
    corners.extend(list(points))
    hull = coal.Convex.convexHull(corners, False, "")
    at = along(*cylinder[:2])
    rod = coal.Cylinder(cylinder[2], float(np.linalg.norm(cylinder[1] - cylinder[0])))
    ways = coal.Transform3s(at[:3, :3], at[:3, 3]), coal.Transform3s(np.eye(3), np.zeros(3))
    return coal.distance(rod, ways[0], hull, ways[1], coal.DistanceRequest(), coal.DistanceResult())


SPACED = DHTable.from_rows([[0.1, 0.0, 0.3], [-1.2, 0.11, 0.0], [0.4, 0.35, 0.0], [0.7, 0.2, 0.12]])
"""An arm with a spacer between its first two actuators."""
SHORT = DHTable.from_rows([[0.1, 0.0, 0.3], [-1.2, 0.06, 0.16], [0.4, 0.35, 0.0], [0.7, 0.075, 0.0]])
"""An arm with one at the tool."""


@pytest.mark.parametrize("table", [SPACED, SHORT])
def test_a_spacer_can_be_screwed(table):
    made = assemble(arm_of(table), CHOSEN, SHOP)
    spacers = [each for each in made.placed if each.part.kind == "spacer"]
    assert len(spacers) == 1
    mark, link = spacers[0].mark, spacers[0].link
    parts = {each.mark: each for each in made.of_link(link)}
    screws = next(each for each in made.screws if mark in (each.spacer, each.joins[0]) and each.joins[1] != TOOL)
    clear, tap, head = SCREWS[screws.thread]
    through = [mark] if not screws.spacer else [screws.joins[0], mark]
    first = parts[screws.joins[0]]
    heads = [hole for hole in first.part.holes if hole.radius == head / 2 + 0.25e-3]
    assert len(heads) == screws.count == 4
    for hole in heads:  # along each screw: head, clearance holes through all but the last part, then a tapped one
        start, end = (first.pose[:3, :3] @ x + first.pose[:3, 3] for x in (hole.start, hole.end))
        way = (start - end) / np.linalg.norm(start - end)
        line = start + np.linspace(0.1e-3, screws.length - 0.1e-3, 200)[:, None] * way
        radii = []
        for x in line:
            at = [
                h.radius for each in (*(parts[m] for m in through), parts[screws.joins[1]]) for h in each.part.holes
                if inside(h, each.pose[:3, :3].T @ (x - each.pose[:3, 3]))
            ]  # fmt: skip
            radii.append(min(at, default=0.0))
        assert set(radii) == {clear / 2, tap / 2}
        depth = np.mean(np.array(radii) == tap / 2) * screws.length
        assert depth == pytest.approx(1.5e-3 * float(screws.thread[1:]), abs=0.2e-3)
    assert screws.length < screws.most
    assert sum(s.count for s in made.screws if s.joins[1] == TOOL) == 4


def inside(hole, x):
    """Whether a point is on the axis of a hole."""
    u = (hole.end - hole.start) / np.linalg.norm(hole.end - hole.start)
    along = (x - hole.start) @ u
    return (
        -1e-9 <= along <= np.linalg.norm(hole.end - hole.start) + 1e-9
        and np.linalg.norm(x - hole.start - along * u) < 1e-9
    )


def test_brackets_that_keep_aside_pass_each_other_at_any_angle():
    for a in find_catalogue("rmd").actuators:
        for theta in np.radians([42.0, 65.0, 90.0, 110.0]):
            face = face_of(a.diameter, a.length)._replace(aside=True)
            made, seat, _ = bracket(face, "side", np.array([np.sin(theta), 0.0, np.cos(theta)]), 1, SHOP)
            lowest = min(points[:, 1].min() for points in corners_of(made.part))
            on = seat.point + np.cross(seat.along, [0.0, 1.0, 0.0]) * SHOP.half + SHOP.flange * seat.along
            assert min(lowest, on[2]) >= GAP / 2 - 1e-12, (a.name, theta)


def test_joints_whose_brackets_meet_get_others():
    apart = assemble(arm_of(), CHOSEN, SHOP, (2, 3))
    for joint in (2, 3):
        here = [each for each in apart.placed if each.mark.startswith(f"J{joint}-") and each.part.note == "angle"]
        for each in here:
            assert min(points[:, 1].min() for points in corners_of(each.part)) >= GAP / 2 - 1e-12
    plate = next(each for each in apart.placed if each.part.kind == "tool plate")
    assert plate.pose[:3, 3] == pytest.approx(TABLE.placements()[-1][:3, 3], abs=1e-12)


def test_brackets_sit_on_the_ends_of_their_actuators(assembly):
    by_mark = {each.mark: each for each in assembly.placed}
    at_zero = [np.eye(4), *TABLE.frames(np.zeros(3))]
    for joint, actuator in enumerate(CHOSEN, start=1):
        own = at_zero[joint] @ by_mark[f"J{joint}"].pose
        for link, sign in ((joint - 1, -1.0), (joint, 1.0)):  # z of the actuator from its output to its housing's face
            placed = by_mark[f"J{joint}-L{link}"]
            normal = (at_zero[link] @ placed.pose)[:3, 1]
            assert normal == pytest.approx(sign * own[:3, 2], abs=1e-9)
            assert (at_zero[link] @ placed.pose)[:3, 3] == pytest.approx(own[:3, 3], abs=1e-9)
            lowest = min(points[:, 1].min() for points in corners_of(placed.part) if points[:, 1].max() > 0.0)
            pad = placed.part.solids[0]
            assert pad.polygon[:, 1].min() == pytest.approx(actuator.length / 2)
            assert lowest <= pad.polygon[:, 1].min() + 1e-12


def test_the_tool_is_where_the_table_has_it(assembly):
    plate = next(each for each in assembly.placed if each.part.kind == "tool plate")
    assert plate.pose[:3, 3] == pytest.approx(TABLE.placements()[-1][:3, 3], abs=1e-12)


def test_mass_and_inertia_of_links_are_those_of_their_parts(assembly):
    arm = arm_of()
    entries = assembly.inertials(3)
    built = arm_body(TABLE, dataclasses.replace(arm.options, inertials=entries), placed=True)
    for link in range(4):
        parts = [each for each in assembly.placed if each.link == link]
        mass = sum(each.part.mass for each in parts)
        known = built.links[link].inertial
        assert known.mass == pytest.approx(mass)
        centre = sum(p.part.mass * (p.pose[:3, :3] @ p.part.inertial.com + p.pose[:3, 3]) for p in parts) / mass
        assert known.com == pytest.approx(centre)
        assert known.entries == pytest.approx(entries[link])
    assert sum(e.part.mass for e in assembly.placed if e.part.bought) == pytest.approx(sum(a.mass for a in CHOSEN))


def test_what_parts_may_be_off_adds_up_along_a_link(assembly):
    found = link_deviations(assembly, 3)
    for link, (length, twist) in enumerate(found):
        parts = [each.part for each in assembly.of_link(link)]
        angles = sum(name.startswith(("angle", "turn")) for part in parts for name in part.sizes)
        angles += sum(bool(circle.maker) for part in parts if not part.bought for circle in part.circles.values())
        assert twist == pytest.approx(np.radians(0.2) * np.sqrt(angles))
        tubes = [part.sizes["length"] for part in parts if part.kind == "tube"]
        assert length > max((0.5e-3 if 0.12 < x <= 0.4 else 0.0 for x in tubes), default=0.0)
    tube_alone = Assembly((Placed(tube(0.2, 0.015, 0.3, SHOP), "L0-T1", 0, np.eye(4)),), ())
    flanged = Assembly((*tube_alone.placed, Placed(flange(0.03, SHOP), "L0-T1-a", 0, np.eye(4))), ())
    assert link_deviations(tube_alone, 0) == pytest.approx(np.array([[0.5e-3, np.radians(0.2)]]))
    assert link_deviations(flanged, 0)[0][0] == pytest.approx(np.hypot(0.5e-3, 0.1e-3))  # 6 mm thick: 0.1 mm
    sigmas = Tolerances(links=found, uniform=("length",)).sigmas(3)
    assert pytest.approx(np.tile([length / np.sqrt(3) for length, _ in found], (2, 1))) == sigmas[:, 1:3].T
    assert sigmas[:, 0] == pytest.approx([twist / 2 for _, twist in found])
    texts = [d.text for part, _ in assembly.counted().values() if not part.bought for d in part_dimensions(part)]
    assert any("(bore −0.05 / −0.1)" in text for text in texts)
    tubes = [part for part, _ in assembly.counted().values() if part.kind == "tube"]
    assert all(
        f"{number(1e3 * part.sizes['length'], 2)} ±0.5" in texts for part in tubes if part.sizes["length"] > 0.12
    )


def test_marks_of_alike_parts_are_short():
    at = [Placed(None, mark, 0, None) for mark in ("L0-T1-a", "L0-T1-b", "L1-T1-a", "L1-T1-b", "L4-T1-a")]
    assert marked(at) == "L0, L1: -T1-a/b, L4-T1-a"
    assert marked([Placed(None, mark, 0, None) for mark in ("J1-L1", "J2-L1", "L2-T1")]) == "J1-L1, J2-L1, L2-T1"


def test_alike_parts_share_a_name_and_others_do_not(assembly):
    for name, (part, places) in assembly.counted().items():
        assert all(each.part.volume == pytest.approx(part.volume) for each in places), name
    marks = [each.mark for each in assembly.placed]
    assert len(set(marks)) == len(marks)


def test_what_does_not_fit_is_refused():
    near = DHTable.from_rows([[0.0, 0.0, 0.3], [1.2, 0.05, 0.0], [0.4, 0.3, 0.0], [0.7, 0.2, 0.1]])
    with pytest.raises(CatalogueError) as error:
        assemble(arm_of(near), CHOSEN, SHOP)
    assert "L1" in str(error.value) or "link 1" in str(error.value)
    with pytest.raises(CatalogueError, match="bore"):
        assemble(arm_of(), CHOSEN, dataclasses.replace(SHOP, wall=0.013))


def gap_of(first, second, pose, *, placed=False, around=()):
    """The gap of two parts, one on link 0, one on link 1 at a pose, of an arm that stands still."""
    parts = tuple(Placed(part, f"P{k}", k, pose if k else np.eye(4)) for k, part in enumerate((first, second)))
    table = DHTable.from_rows([[0.0, 0, 0], [0.0, 0, 0.1]])
    shown = SimpleNamespace(obstacles=Obstacles(tuple(around)))
    still = SimpleNamespace(demonstrations=(SimpleNamespace(path=SimpleNamespace(q=np.zeros((2, 1)))),))
    result = SimpleNamespace(
        table=table, placed=placed, evaluation=still, problem=SimpleNamespace(demonstrations=(shown,)),
        base_pose=SimpleNamespace(matrix=np.eye(4)),
    )  # fmt: skip
    return parts_gap(Assembly(parts, ()), result)


def test_gaps_of_parts_by_hand():
    square = np.array([[0.0, 0], [0.02, 0], [0.02, 0.02], [0, 0.02]])
    block = SHOP.part("bracket", [Prism(square, 0.02)], [])
    rod = SHOP.part("spacer", [Rod(np.zeros(3), np.array([0.0, 0.0, 0.05]), 0.01)], [])
    pose = np.eye(4)
    pose[:3, 3] = [0.035, 0.01, 0.0]  # the round side is 0.035 - 0.01 - 0.02 from the block
    gap = gap_of(block, rod, pose)
    assert (gap.value, gap.joint, gap.met) == (pytest.approx(0.005, abs=1e-6), 1, False)
    pose[0, 3] = 0.025
    assert (gap_of(block, rod, pose).value, gap_of(block, rod, pose).met) == (0.0, True)
    pose[:3, 3] = [0.4, 0.0, 0.0]
    assert gap_of(block, rod, pose) is None
    tilted = np.eye(4)
    tilted[:3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]  # lies along y, 12 mm above the face
    tilted[:3, 3] = [0.4, 0.0, 0.022]
    lifted = SHOP.part("spacer", [Rod(np.array([0.0, 0, 0.1]), np.array([0.0, 0, 0.15]), 0.01)], [])
    assert gap_of(lifted, rod, tilted, placed=True).value == pytest.approx(0.012, abs=1e-9)
    # a ball 7 mm beside the round side; a table under the base, against which what stands on it does not count
    at, below = np.eye(4), np.eye(4)
    below[2, 3] = -0.05
    at[:3, 3] = [0.4 + 0.01 + 0.007 + 0.03, -0.02, 0.022]
    ball = Obstacle("ball", Sphere(0.03), at)
    table = Obstacle("table", Box(np.array([2.0, 2.0, 0.1])), below)
    found = gap_of(block, rod, tilted, around=(ball,))
    assert (found.value, found.parts) == (pytest.approx(0.007, abs=1e-6), ("P1", "ball"))
    found = gap_of(block, rod, tilted, placed=True, around=(table,))
    assert (found.value, found.parts) == (pytest.approx(0.012, abs=1e-6), ("P1", "table"))


def test_published_bolt_circles_are_taken():
    a = dataclasses.replace(CHOSEN[1], circles={"output": (0.025, 6, "M3")})
    placed = assemble(arm_of(), [CHOSEN[0], a, CHOSEN[2]], SHOP).placed
    by_mark = {each.mark: each.part for each in placed}
    held, own = by_mark["J2-L1"].circles["face"], by_mark["J2-L2"].circles["face"]
    assert (held.diameter, held.count, held.maker) == (0.025, 6, "")
    assert own == generic_circle(a.diameter, f"housing of {a.name}")
    assert "maker's drawing" in next(each.part.note for each in placed if each.mark == "J2")


def test_what_no_catalogue_knows_is_not_drilled():
    known = dataclasses.replace(CHOSEN[1], circles={"output": (0.025, 6, "M3")})
    made = assemble(arm_of(), [CHOSEN[0], known, CHOSEN[2]], SHOP)
    held = {each.joins[1]: each for each in made.screws if each.joins[0].startswith("J")}
    for each in made.placed:
        if each.mark.startswith("J") and not each.part.bought:
            drilled = [hole for hole in each.part.holes if hole.use == "face"]
            screws, lines = held[each.mark], notes(each.part)
            if each.mark == "J2-L1":
                assert (len(drilled), screws.count, screws.maker) == (12 if each.part.note == "wedge" else 6, 6, "")
            else:
                assert (drilled, screws.count, screws.thread) == ([], 0, "")
                assert any("not drilled" in line and screws.maker in line for line in lines)
    makers = [tuple(c.maker for c in part.circles.values()) for part, _ in made.counted().values() if not part.bought]
    assert sum(any(each) for each in makers) == 5  # none of them is taken for another's


@pytest.mark.parametrize("theta", np.radians([45.0, 75.0, 90.0, 105.0]))
def test_heads_have_room_before_the_second_plate_of_a_standing_bracket(theta):
    for diameter in (0.016, 0.03, 0.06):
        shop = dataclasses.replace(SHOP, diameter=diameter)
        face = Face("B", np.zeros(3), np.array([0.0, 0, 1]), 0.0, 0.05, BoltCircle(2.0 * shop.half, 4, "M5"))
        made, seat, _ = bracket(face, "standing", np.array([np.sin(theta), 0.0, np.cos(theta)]), 0, shop)
        foot = made.part.solids[1].polygon
        before = min(x for x, y in foot if y < foot[:, 1].min() + 1e-9)
        heads = max(hole.end[0] for hole in made.part.holes if hole.use == "face") + SCREWS["M5"][2] / 2.0
        assert before - heads >= made.part.sizes["inner radius"] - 1e-12
        assert foot[:, 0].min() - heads >= 1e-3 - 1e-12  # straight above them is nothing, where it leans over, too
        point = anchor(Knot(np.zeros(3), face), "standing", np.array([np.sin(theta), 0.0, np.cos(theta)]), shop)
        assert np.cross(point - seat.point, seat.along) == pytest.approx(np.zeros(3), abs=1e-12)
        upright = anchor(Knot(np.zeros(3), face), "standing", face.normal, shop)  # tried on the way to an angle
        assert np.isfinite(upright).all()


@pytest.mark.parametrize("kind", ["wedge", "angle", "side", "standing"])
def test_screws_of_a_face_are_reached_on_every_bracket_or_it_is_refused(kind):
    turns, made, refused = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False), 0, 0
    ring = np.stack([np.cos(turns), 0.0 * turns, np.sin(turns)], axis=1)
    for thick, across, degrees in product((0.016, 0.03, 0.06), (0.016, 0.03), (10.0, 42.0, 58.0, 75.0, 100.0)):
        shop = dataclasses.replace(SHOP, diameter=thick)
        circle = BoltCircle(2.0 * shop.half, 4, "M5") if kind == "standing" else BoltCircle(across, 8, "M2.5")
        face = Face("J1", np.zeros(3), np.array([0.0, 0, 1]), 0.02, 0.02, circle, kind == "side")
        theta = np.radians(degrees)
        try:
            part = bracket(face, kind, np.array([np.sin(theta), 0.0, np.cos(theta)]), 1, shop)[0].part
        except CatalogueError as error:
            refused += "reaches" in str(error)
            continue
        own, head = part.sizes["turn of the face's circle"], SCREWS[circle.thread][2] / 2.0
        key = np.insert(circle.places(own), 1, 0.0, axis=1)[:, None] + head * ring
        seat = face.height + (part.sizes["under heads"] if kind == "wedge" else part.sizes["plate"])
        up = np.arange(seat + 1e-4, seat + 0.12, 1e-3)[:, None, None, None] * [0.0, 1.0, 0.0]
        met = [hole for hole in part.holes if "tapped" in hole.use] if kind == "wedge" else part.solids
        assert not any(form.holds((key + up).reshape(-1, 3)).any() for form in met), (thick, across, degrees)
        made += 1
    assert made
    assert bool(refused) == (kind == "wedge")  # plates of others stand as far off as their screws need


def test_scribe_lines_of_a_flange_and_its_seat_meet_in_one_of_four_positions():
    made = assemble(arm_of(), CHOSEN, SHOP)
    parts = {each.mark: each for each in made.placed}
    met = 0
    for screws in made.screws:
        if "scribe" not in screws.note:
            continue
        lines = [[part.pose[:3, :3] @ end + part.pose[:3, 3] for line in part.part.scribes for end in line]
                 for part in (parts[mark] for mark in screws.joins)]  # fmt: skip
        nearest = min(np.linalg.norm(a - b) for a in lines[0] for b in lines[1])
        middle = parts[screws.joins[0]].pose[:3, 3]
        own = [point - middle for point in lines[0]]
        assert nearest < 4e-3 + 1e-9  # at the rim, the seat's goes on
        along = parts[screws.joins[0]].pose[:3, 2]
        rim = next(point for point in own if abs(point @ along) < 1e-9)
        seat = next(p for p in (point - middle for point in lines[1]) if abs(p @ along) < 1e-9)
        assert rim @ seat == pytest.approx(np.linalg.norm(rim) * np.linalg.norm(seat))
        met += 1
    assert met == 2 * sum(each.part.kind == "tube" for each in made.placed) - 1  # the tool's end has a plate


def test_hole_tables_say_what_to_drill():
    assert list(hole_rows(flange(0.03, SHOP), [PART_VIEWS[0]])) == [
        ("A", "⌀4 +0.1 / 0 across, both walls, at S", "", "", "", ""),
        ("B", "4 × ⌀4.5 through, for M4: bracket", "39", "13.79, 13.79", "45°", "front"),
    ]
    up = np.array([0.0, 0.0, 1.0])
    flat = bracket(face_of(), "wedge", up, 1, SHOP)[0].part  # 10 mm thick: no room for a drill's run-out
    assert next(hole_rows(flat, []))[1] == "4 × M4 × 8, drill ⌀3.3 through: tube"
    thin = dataclasses.replace(SHOP, diameter=0.02)
    flat = bracket(face_of(), "wedge", up, 1, thin)[0].part
    assert next(hole_rows(flat, []))[1] == "4 × M3 × 6, drill ⌀2.5 × 7.5: tube"
    beside = bracket(face_of(), "angle", np.array([1.0, 0.0, 0.0]), 1, SHOP)[0].part
    assert "Between the plates a radius of 3 or less." in notes(beside)
    assert next(hole_rows(beside, []))[1] == "4 × M4 through, drill ⌀3.3: tube"


def test_lines_on_tubes_meet_those_of_both_flanges_in_one_way_only(at_random):
    over = set()
    for _, made, _shop in at_random:
        parts = {each.mark: each for each in made.placed}
        for each in made.placed:
            if each.part.kind != "tube":
                continue
            u, ways = each.pose[:3, 2], []
            for scribe, letter in zip(each.part.scribes, "ab", strict=True):
                other = parts[f"{each.mark}-{letter}"]
                own = each.pose[:3, :3] @ scribe[0] + each.pose[:3, 3]
                held = [other.pose[:3, :3] @ x + other.pose[:3, 3] for x in np.concatenate(other.part.scribes)]
                assert min(np.linalg.norm(own - x) for x in held) < 2e-5
                ways.append(other.pose[:3, 0])
            turn = each.part.sizes["turn of S"]  # seen from the inner end, along u: clockwise
            turned = np.cos(turn) * ways[0] + np.sin(turn) * np.cross(u, ways[0])
            assert turned == pytest.approx(ways[1], abs=2e-3)
            assert 0.0 <= turn < 2.0 * np.pi
            over.add(turn > np.pi)
    assert over == {True, False}


@pytest.mark.parametrize("theta", [0.02, 0.05, 0.08, 0.11, 30.0])
def test_every_circle_is_seen_and_wedges_less_tilted_than_sheets_tell_are_flat(theta):
    for kind, turned in (("wedge", theta), ("angle", 90.0 - theta), ("angle", 90.0 + theta)):
        way = np.array([np.sin(np.radians(turned)), 0.0, np.cos(np.radians(turned))])
        part = bracket(face_of(), kind, way, 1, SHOP)[0].part
        if kind == "wedge":
            assert (part.sizes["low side"] == part.sizes["high side"]) == (part.sizes["angle"] == 0.0) == (theta < 0.1)
        views = [*PART_VIEWS, *(square_to(way, "V") for way in tilted_ways(part))]
        assert all(row[3] and row[5] for row in hole_rows(part, views))
        for view in views:
            if any(looks_along(view, hole.end - hole.start) for hole in part.holes):
                shown = {m.points.shape[0] for m in part_view(part, view, 1.0).marks if hasattr(m, "points")}
                assert max(shown) > 20  # circles


def test_screws_with_a_nut_reach_through_it_where_they_are_short(at_random):
    across = [screws for _, made, _ in at_random for screws in made.screws if screws.nut]
    assert across
    assert all(screw_length(screws) >= 1e3 * screws.length + 0.5 for screws in across)
    assert screw_length(Screws("M3", 29.8e-3, 1, ("a", "b"), nut=True)) == 35  # one of 30 can be 29.58 long
    assert screw_length(Screws("M3", 29.8e-3, 1, ("a", "b"))) == 30


def test_corner_holds_its_tubes_on_their_axes():
    rng = np.random.default_rng(3)
    for _ in range(20):
        back, onward = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
        if not -0.9 < back @ onward < 0.5:
            continue
        placed, seats = corner("L1-C1", np.array([0.1, 0.2, 0.3]), (back, onward), 1, SHOP)
        for seat, way in zip(seats, (back, onward), strict=True):
            assert np.cross(seat.point - [0.1, 0.2, 0.3], way) == pytest.approx(np.zeros(3), abs=1e-12)
            assert seat.along == pytest.approx(way)
            assert seat.across @ way == pytest.approx(0.0, abs=1e-12)
        assert np.linalg.det(placed.pose[:3, :3]) == pytest.approx(1.0)


def test_faces_of_a_corner_are_square_to_its_tubes_with_the_mouths_of_their_holes_on_them():
    rng, obtuse = np.random.default_rng(5), 0
    for _ in range(60):
        shop = dataclasses.replace(
            SHOP, diameter=float(rng.uniform(0.012, 0.06)), made=(ALUMINIUM, PRINTED)[rng.integers(2)]
        )
        opening = np.radians(rng.uniform(40.0, 170.0))
        obtuse += opening > np.pi / 2.0
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        ways = turn[0], np.cos(opening) * turn[0] + np.sin(opening) * turn[1]
        placed, seats = corner("L1-C1", np.zeros(3), ways, 1, shop)
        polygon, away = placed.part.solids[0].polygon, placed.part.sizes["tube's side from corner"]
        edges = np.roll(polygon, -1, axis=0) - polygon
        normals = np.stack([edges[:, 1], -edges[:, 0]], axis=1) / np.linalg.norm(edges, axis=1)[:, None]
        mouths = np.array([hole.start for hole in placed.part.holes])
        for way, seat in zip(ways, seats, strict=True):
            own = (placed.pose[:3, :3].T @ way)[:2]
            face = int(np.argmax(normals @ own))
            assert normals[face] == pytest.approx(own, abs=1e-9)
            assert np.linalg.norm(edges[face]) == pytest.approx(2.0 * shop.half)
            assert polygon[[face, (face + 1) % len(polygon)]] @ own == pytest.approx(np.full(2, away), abs=1e-12)
            assert (polygon @ own).max() == pytest.approx(away, abs=1e-12)
            assert (np.abs(mouths[:, :2] @ own - away) < 1e-12).sum() == shop.circle.count
            assert seat.point == pytest.approx(away * way)
        first, second = seats  # the rims are nearest where the discs touch the faces, at the inner tip
        tips = [s.point + shop.half * unit(o.along - (o.along @ s.along) * s.along)
                for s, o in ((first, second), (second, first))]  # fmt: skip
        assert np.linalg.norm(tips[0] - tips[1]) > 0.5e-3 - 1e-9
        assert not list(thin_walls(placed.part, shop.web))
    assert obtuse > 20


@pytest.fixture(scope="module")
def solids():
    pytest.importorskip("OCP")
    from armdesign.building import solids as module  # noqa: PLC0415

    return module


def test_solids_have_the_volumes_of_their_parts_and_closed_meshes(assembly, solids, tmp_path):
    from OCP.STEPControl import STEPControl_Reader  # noqa: PLC0415

    for name, (part, _) in assembly.counted().items():
        shape = solids.solid(part)
        assert solids.count(shape) == 1, name
        assert solids.volume(shape) * 1e-9 == pytest.approx(part.volume, rel=1e-3), name
        closed = solids.mesh(shape)
        assert closed.is_watertight, name
        assert closed.volume * 1e-9 == pytest.approx(part.volume, rel=1e-2)
        if name.startswith(("bracket", "tube flange")):
            own = closed.copy().apply_scale(1e-3)
            assert own.center_mass == pytest.approx(part.inertial.com, abs=2e-4)
            assert own.moment_inertia * part.density == pytest.approx(part.inertial.inertia, rel=2e-2, abs=1e-7)
    shapes = {name: solids.solid(part) for name, (part, _) in assembly.counted().items()}
    pieces = [(e.mark, shapes[e.part.name], e.part.name, pose) for e, pose in assembly.posed(TABLE, np.zeros(3))]
    text = solids.step_file(pieces)
    path = Path(tmp_path) / "arm.step"
    path.write_bytes(text)
    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    whole = sum(e.part.volume for e in assembly.placed)
    assert solids.volume(reader.OneShape()) * 1e-9 == pytest.approx(whole, rel=1e-3)
    assert all(e.mark in text.decode() for e in assembly.placed)


def test_no_part_overlaps_another_of_its_link_or_the_next(assembly, solids):
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Common  # noqa: PLC0415
    from OCP.TopLoc import TopLoc_Location  # noqa: PLC0415

    placed = [
        (each, solids.solid(each.part).Moved(TopLoc_Location(solids.transformation(pose))), pose)
        for each, pose in assembly.posed(TABLE, np.zeros(3))
    ]
    for i, (first, shape, _) in enumerate(placed):
        for second, other, _ in placed[i + 1 :]:
            if abs(first.link - second.link) <= 1:
                shared = solids.volume(BRepAlgoAPI_Common(shape, other).Shape())
                assert shared < 1.0, (first.mark, second.mark)  # mm^3


@pytest.mark.parametrize("opening", [60.0, 93.5, 130.0])
def test_flanges_do_not_cut_into_their_corner_which_is_one_body(opening, solids):
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Common  # noqa: PLC0415
    from OCP.TopLoc import TopLoc_Location  # noqa: PLC0415

    ways = np.array([1.0, 0, 0]), np.array([np.cos(np.radians(opening)), np.sin(np.radians(opening)), 0.0])
    placed, seats = corner("L1-C1", np.zeros(3), ways, 1, SHOP)
    block = solids.solid(placed.part)
    assert solids.mesh(block).body_count == 1
    block = block.Moved(TopLoc_Location(solids.transformation(placed.pose)))
    discs = [solids.solid(flange(0.02, SHOP)).Moved(TopLoc_Location(solids.transformation(
        frame(seat.along, seat.between(SHOP.circle), seat.point)))) for seat in seats]  # fmt: skip
    for one, other in combinations([block, *discs], 2):
        assert solids.volume(BRepAlgoAPI_Common(one, other).Shape()) < 1.0  # mm^3


@pytest.mark.slow
def test_urdf_of_a_build_shows_its_meshes(tmp_path, solids):
    from typer.testing import CliRunner  # noqa: PLC0415

    import armdesign  # noqa: PLC0415
    from armdesign.building import RECORD  # noqa: PLC0415
    from armdesign.building.build import build  # noqa: PLC0415
    from armdesign.building.build_options import BuildOptions  # noqa: PLC0415
    from armdesign.building.record import build_record  # noqa: PLC0415
    from armdesign.cli import app  # noqa: PLC0415
    from armdesign.runs.writing import write_files, write_result  # noqa: PLC0415

    design = armdesign.design(Path(__file__).parents[2] / "examples" / "packaging.csv", dof=3, budget=300)
    made = build(design, BuildOptions("rmd", payload=0.5, printed=True))
    assert made.assembly is not None, made.misfit
    write_result(tmp_path / "arm", made.result)
    write_files(tmp_path / "arm", {RECORD: build_record(made, design)})
    call = ["export", str(tmp_path / "arm"), "--format", "urdf,step,stl", "--meshes", "--printer", "50x60x400"]
    outcome = CliRunner().invoke(app, call)
    assert outcome.exit_code == 0, outcome.output
    assert "base plate" in outcome.output
    root = ET.parse(tmp_path / "arm" / "export" / "arm.urdf").getroot()
    meshes = [mesh.get("filename") for mesh in root.iter("mesh")]
    assert len(meshes) == len(made.assembly.placed)
    assert all((tmp_path / "arm" / "export" / name).is_file() for name in meshes)
    masses = [float(link.find("inertial/mass").get("value")) for link in root.iter("link") if link.find("inertial")]
    whole = sum(each.part.mass for each in made.assembly.placed)
    assert sum(masses) == pytest.approx(whole + made.result.body.options.tool_mass, rel=1e-9)
    heavier = CliRunner().invoke(
        app, ["export", str(tmp_path / "arm"), "--joint-mass", "2", "--out", str(tmp_path / "x")]
    )
    assert (heavier.exit_code, "--joint-mass" in heavier.output) == (2, True)
    write_result(tmp_path / "plain", design)
    plain = CliRunner().invoke(app, ["export", str(tmp_path / "plain"), "--format", "step"])
    assert (plain.exit_code, "armdesign build" in plain.output) == (2, True)


def test_spacers_and_their_brackets_have_lines_in_line(at_random):
    met = 0
    for _, made, _shop in at_random:
        parts = {each.mark: each for each in made.placed}
        for screws in (each for each in made.screws if each.spacer):
            ways = []
            for mark in screws.joins:
                line = parts[mark].pose[:3, :3] @ (parts[mark].part.scribes[0][1] - parts[mark].part.scribes[0][0])
                ways.append(line / np.linalg.norm(line))
            assert ways[0] == pytest.approx(ways[1], abs=1e-9)
            scribe = parts[screws.spacer].part.scribes[0]
            assert scribe[0][:2] == pytest.approx(scribe[1][:2])  # along it
            met += 1
    assert met


@pytest.mark.parametrize("kind", ["corner", "wedge", "angle", "standing", "tube flange", "spacer"])
def test_sheets_have_every_dimension_and_no_text_on_another(kind, at_random):
    for _, made, _shop in at_random:
        for part, places in made.counted().values():
            if kind in (part.kind, part.note):
                sheet = part_sheet(places, made.screws, "arm", "1 of 1")
                texts = [words.text for words in sheet.words]
                assert {each.text for each in part_dimensions(part)} <= set(texts)
                boxes = [(words.text, words.box) for words in sheet.words]
                assert not [(a[0], b[0]) for a, b in combinations(boxes, 2) if a[1].overlaps(b[1])]
                return
    raise AssertionError(f"no {kind} among the arms")


def test_a_flange_can_be_made_from_its_sheet_alone(assembly):
    part, places = next(each for each in assembly.counted().values() if each[0].kind == "tube flange")
    texts = [words.text for words in part_sheet(places, assembly.screws, "arm", "1 of 1").words]

    def read(pattern):
        found = {float(match[1]) for text in texts if (match := re.fullmatch(pattern, text))}
        assert len(found) == 1, (pattern, found)
        return found.pop()

    spigot, thick = read(r"⌀([\d.]+) \(bore .*"), read(r"([\d.]+) ±0.1")
    plain = sorted(float(text[1:]) for text in texts if re.fullmatch(r"⌀[\d.]+", text))
    bore, disc = plain  # those of the front view
    on = read(r"B on ⌀([\d.]+)")  # in the table, too
    long = max(float(text) for text in texts if re.fullmatch(r"[\d.]+", text) and float(text) != on) - thick
    screw, across = read(r"4 × ⌀([\d.]+) through, for .*"), read(r"⌀([\d.]+) \+0.1 / 0 across.*")
    holes = across**2 * (spigot - bore) + 4.0 * screw**2 * thick + bore**2 * (long + thick)
    volume = np.pi / 4.0 * (disc**2 * thick + spigot**2 * long - holes)
    assert volume == pytest.approx(1e9 * part.volume, rel=2e-3)


def test_torques_are_those_of_the_standard():
    for thread, table in {"M4": 3.0, "M5": 5.9, "M6": 10.1, "M8": 24.6}.items():  # VDI 2230-1, 8.8, friction 0.12
        assert torque(thread) == pytest.approx(table, rel=0.06)
    across = Screws("M3", 0.03, 1, ("L1-T1", "L1-T1-a"), nut=True)
    on_servo, on_bracket = Screws("M3", 0.01, 4, ("J1", "J1-L1")), Screws("M4", 0.01, 4, ("L1-T1-a", "J1-L1"))
    assert "nut locks itself" in tightening(across)
    assert tightening(on_bracket) == "2.5 N m, with medium thread lock"
    assert tightening(on_bracket, printed=True) == "0.62 N m, no thread lock"
    assert "tip alone" in tightening(on_servo, printed=True)
