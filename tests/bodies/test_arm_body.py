"""The body of an arm: which piece belongs to which link, what is cut, and which pairs have to stay clear."""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np
import pytest

from armdesign.bodies.arm_body import SIDES, arm_body
from armdesign.bodies.cylinder import SHORTEST
from armdesign.errors import DesignError, SettingsError
from armdesign.kinematics.dh import DHTable
from armdesign.settings import Body

OPTIONS = Body()
WRIST = DHTable.from_rows([(0, 0, 0.3), (np.pi / 2, 0, 0), (-np.pi / 2, 0, 0), (0, 0, 0.1)])
ELBOW = DHTable.from_rows([(0.5, 0, 0), (-1.57, 0.11, 0), (-0.27, 0.4, -0.2), (1.2, -0.15, 0.02), (-1.57, 0, 0.1)])


def random_tables(count, seed=0):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        rows = rng.uniform(-1, 1, (rng.integers(2, 8), 4)) * (np.pi, 0.4, 0.4, np.pi)
        rows *= rng.random(rows.shape) > 0.3
        yield DHTable.from_rows(rows, base_yaw=rng.uniform(-3, 3))


def random_slides(table, rng):
    """Slides over their whole range, some at its ends and some where they are by default."""
    low, high = np.minimum(0, table.d[:-1]) - 0.1, np.maximum(0, table.d[:-1]) + 0.1
    s = rng.uniform(low, high)
    kind = rng.integers(0, 4, table.dof)
    return np.choose(kind, [s, low, high, table.d[:-1]])


def distance_to(part, point):
    """Distance of a point from a solid cylinder, 0 inside."""
    local = part.pose[:3, :3].T @ (point - part.pose[:3, 3])
    beyond = max(np.hypot(local[0], local[1]) - part.radius, 0.0), max(abs(local[2]) - part.length / 2, 0.0)
    return np.hypot(*beyond)


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf, "0.04", True, None])
@pytest.mark.parametrize("name", ["tube_diameter", "joint_mass", "clearance"])
def test_options_are_positive_numbers(name, bad):
    with pytest.raises(SettingsError, match=name):
        Body(**{name: bad})


def test_a_wall_fits_its_tube_and_tool0_is_heavy_enough():
    assert Body(tube_wall=0.02).tube_wall == 0.02
    with pytest.raises(SettingsError, match="tube_wall"):
        Body(tube_wall=0.0201)
    with pytest.raises(SettingsError, match="tool_mass"):
        Body(tool_mass=1e-6)


def links_of(table, slides=None, **base):
    return arm_body(table, OPTIONS, slides, **base).links


def tubes_of(body):
    return [part for part in body.visual if part.material == "tube"]


@pytest.mark.parametrize("table", [WRIST, ELBOW, *random_tables(5)])
def test_tubes_lead_from_each_frame_to_the_next(table):
    placements = table.placements()
    for i, body in enumerate(links_of(table, side=None)):
        goal, corner = placements[i][:3, 3], np.eye(4)
        corner[0, 3] = table.a[i]
        path = [np.zeros(3), ((table.base() if i == 0 else np.eye(4)) @ corner)[:3, 3], goal]
        legs = [leg for leg in pairwise(path) if np.linalg.norm(leg[1] - leg[0]) > SHORTEST]
        for leg, tube in zip(legs, tubes_of(body), strict=True):
            found = sorted(tube.ends, key=lambda end: np.linalg.norm(end - leg[0]))
            np.testing.assert_allclose(found, leg, atol=1e-15)


def test_tubes_are_as_long_as_the_arm():
    for table in random_tables(5):
        tubes = [tube for body in links_of(table) for tube in tubes_of(body)]
        assert sum(tube.length for tube in tubes) == pytest.approx(table.length + OPTIONS.reach)  # post and arm
        area = np.pi * (0.02**2 - 0.017**2)
        assert sum(tube.mass for tube in tubes) == pytest.approx(2700.0 * area * (table.length + OPTIONS.reach))


@pytest.mark.parametrize("table", [WRIST, ELBOW, *random_tables(20)])
def test_tubes_lead_from_module_to_module_wherever_those_slide(table):
    rng = np.random.default_rng(table.dof)
    q, s = rng.uniform(-3, 3, table.dof), random_slides(table, rng)
    body, frames = arm_body(table, OPTIONS, s, side=None), [np.eye(4), *table.frames(q)]
    modules = {part.module: part for part in body.parts if part.module}
    centres = [np.zeros(3)]
    for j in range(1, table.dof + 1):
        origin, axis = frames[j][:3, 3], frames[j][:3, 2]
        centres.append(origin + (s[j - 1] - table.d[j - 1]) * axis)
        np.testing.assert_allclose((frames[j] @ modules[j].solid.pose)[:3, 3], centres[-1], atol=1e-15)
        np.testing.assert_allclose((frames[j] @ modules[j].solid.pose)[:3, 2], axis, atol=1e-15)
    centres.append(frames[-1][:3, 3])
    for link in range(table.dof + 1):
        own = [part.solid.ends for part in body.parts if part.link == link and not part.module]
        chain = [frames[link][:3, :3] @ end + frames[link][:3, 3] for ends in own for end in ends]
        if not chain:
            assert np.linalg.norm(centres[link + 1] - centres[link]) < 3 * SHORTEST
            continue
        for point in (centres[link], centres[link + 1]):  # it starts and ends at the modules, and holds together
            assert min(np.linalg.norm(end - point) for end in chain) < 3 * SHORTEST
        for point in chain:
            others = [np.linalg.norm(end - point) for end in (*chain, *centres[link : link + 2]) if end is not point]
            assert min(others) < 3 * SHORTEST


@pytest.mark.parametrize("d", [0.3, -0.3, 0.0])
def test_a_module_beyond_the_origin_is_reached_straight(d):
    table = DHTable.from_rows([(0.0, 0.2, d), (0.0, 0.4, 0.0), (0.0, 0.0, 0.1)])
    onward = -1.0 if d < 0 else 1.0
    for beyond in (0.05, -0.05):  # past the origin of the joint's frame; before the corner
        s = d + beyond * onward if beyond > 0 else beyond * onward
        base, first, _ = links_of(table, [s, 0.0], side=None)
        lengths = [tube.length for tube in tubes_of(base)], [tube.length for tube in tubes_of(first)]
        straight = np.hypot(0.05, 0.4), np.hypot(0.05, 0.2)
        past = [0.2, abs(d) + 0.05], [straight[0]]
        expected = past if beyond > 0 else ([straight[1]], [abs(d) + 0.05, 0.4])
        np.testing.assert_allclose(lengths[0], expected[0])
        np.testing.assert_allclose(lengths[1], expected[1])


def test_pieces_of_no_length_are_left_out():
    table = DHTable.from_rows([(0.3, 0, 0), (0.2, SHORTEST / 2, -SHORTEST / 2), (0, 2 * SHORTEST, 0.1)])
    base, first, last = links_of(table)
    assert [part.material for part in base.visual] == ["base", "tube"]
    assert [part.material for part in first.visual] == ["joint"]
    assert [part.material for part in last.visual] == ["joint", "tube", "tube"]


def test_every_link_of_an_arm_without_tubes_has_its_housing():
    bare = DHTable.from_rows([(0, 0, 0), (1, 0, 0), (0, 0, 0)])
    for body in links_of(bare)[1:]:
        assert body.inertial.mass == OPTIONS.joint_mass


def test_a_rod_is_a_tube_whose_wall_fills_it():
    rod = arm_body(WRIST, Body(tube_wall=0.02)).links[0].visual[-1]
    assert rod.inner_radius == 0.0
    assert rod.mass == pytest.approx(2700.0 * np.pi * 0.02**2 * 0.3)


def test_turning_the_base_turns_the_base_alone():
    still, yaw = ELBOW, 0.7
    table = DHTable.from_rows(np.stack([still.alpha, still.a + 0.1, still.d + 0.1], axis=1))
    turned = DHTable(table.alpha, table.a, table.d, base_yaw=yaw)
    before, after = links_of(table), links_of(turned)
    expected = before[0].inertial.moved(turned.base())
    np.testing.assert_allclose(after[0].inertial.com, expected.com, atol=1e-15)
    np.testing.assert_allclose(after[0].inertial.inertia, expected.inertia, atol=1e-15)
    for one, other in zip(before[1:], after[1:], strict=True):
        np.testing.assert_array_equal(one.inertial.inertia, other.inertial.inertia)


def test_mirrored_offsets_mirror_the_body():
    up = links_of(DHTable.from_rows([(0, 0, 0.2), (0, 0.3, 0.2), (0, 0, 0.1)]))[1].inertial
    down = links_of(DHTable.from_rows([(0, 0, 0.2), (0, -0.3, -0.2), (0, 0, 0.1)]))[1].inertial
    mirror = np.diag([-1.0, 1.0, -1.0])
    np.testing.assert_allclose(down.com, mirror @ up.com, atol=1e-16)
    np.testing.assert_allclose(down.inertia, mirror @ up.inertia @ mirror, atol=1e-16)


@pytest.mark.parametrize("table", [WRIST, ELBOW, *random_tables(20)])
def test_every_link_has_a_collision_shape_and_tubes_end_outside_both_spheres(table):
    body = arm_body(table, OPTIONS, random_slides(table, np.random.default_rng(table.dof)))
    for i, link in enumerate(body.links):
        assert link.collision
        for joint in (i, i + 1):
            for part in link.collision if 1 <= joint <= table.dof else ():
                if part.material == "tube":
                    assert distance_to(part, body.sphere(joint, i)) >= OPTIONS.reach - 1e-12


def test_spheres_are_at_the_modules_from_both_sides():
    for table in random_tables(5):
        body = arm_body(table, OPTIONS, random_slides(table, np.random.default_rng(0)))
        frames = [np.eye(4), *table.frames(np.linspace(-2, 2, table.dof))]
        for j in range(1, table.dof + 1):
            seen = [frames[i][:3, :3] @ body.sphere(j, i) + frames[i][:3, 3] for i in (j - 1, j)]
            np.testing.assert_allclose(*seen, atol=1e-14)


def test_the_plate_of_a_placed_arm_stands_on_its_face():
    plate = links_of(WRIST, placed=True)[0].visual[0]
    np.testing.assert_allclose(plate.ends, [[0, 0, 0], [0, 0, OPTIONS.base_height]], atol=1e-17)
    assert len(links_of(WRIST, placed=True)[0].visual) == 2  # no post


@pytest.mark.parametrize("side", SIDES)
def test_the_plate_of_another_arm_stands_on_the_side_asked_for(side):
    plate, post, _ = links_of(WRIST, side=side)[0].visual
    towards = {"below": -np.eye(3)[2], "above": np.eye(3)[2], "behind": -np.eye(3)[0], "front": np.eye(3)[0],
               "left": np.eye(3)[1], "right": -np.eye(3)[1]}[side]  # fmt: skip
    np.testing.assert_allclose(sorted(plate.ends @ towards), [OPTIONS.reach, OPTIONS.reach + OPTIONS.base_height])
    np.testing.assert_allclose(sorted(post.ends @ towards), [0.0, OPTIONS.reach], atol=1e-16)


def test_without_a_side_there_is_no_plate():
    assert [part.name for part in arm_body(WRIST, OPTIONS, side=None).parts][:2] == [
        "tube of base_link",
        "module of joint_1",
    ]


def rule(first, second):
    """Whether two parts count, word for word."""
    homes = [{part.module - 1, part.module} if part.module else {part.link} for part in (first, second)]
    if first.module and second.module:
        return True
    if first.module or second.module:
        return not homes[0] & homes[1]
    return first.link != second.link


@pytest.mark.parametrize("table", [WRIST, ELBOW, *random_tables(10)])
def test_pairs_are_those_of_the_rule(table):
    body = arm_body(table, OPTIONS, random_slides(table, np.random.default_rng(1)))
    whole = {(i, j) for i, j in body.pairs.tolist() if max(i, j) < len(body.parts)}
    for (i, first), (j, second) in combinations(enumerate(body.parts), 2):
        apart = abs(first.link - second.link)
        if (i, j) in whole:
            assert rule(first, second)
        elif rule(first, second):  # then cut pieces of both stand in, or nothing is left of one
            assert apart == 1
            assert not first.module
            assert not second.module
    for i, j in body.pairs.tolist():
        first, second = body.shapes[i], body.shapes[j]
        assert rule(first, second)
        for part, other in ((first, second), (second, first)):
            if abs(part.link - other.link) == 1 and not (part.fixed or other.module):
                centre = body.sphere(max(part.link, other.link), part.link)
                assert distance_to(part.solid, centre) >= OPTIONS.reach - 1e-12


def test_all_modules_count_against_each_other():
    body = arm_body(ELBOW, OPTIONS)
    numbers = {(body.shapes[i].module, body.shapes[j].module) for i, j in body.pairs.tolist()}
    assert {(1, 2), (2, 3), (3, 4), (1, 3), (2, 4), (1, 4)} <= numbers


def test_a_joint_that_slides_has_its_carriage_on_a_rail():
    table = DHTable.from_rows([(0.0, 0.0, 0.2), (np.pi / 2.0, 0.3, 0.1), (0.0, 0.0, 0.05)], joints="RP")
    limits = [[-1.0, 1.0], [-0.4, 0.25]]
    body = arm_body(table, OPTIONS, [0.2, 0.7], limits, side=None)  # a carriage has no slide of its own
    parts = {part.name: part for part in body.parts}
    assert list(parts) == [
        "tube of base_link", "module of joint_1", "tube of link_1", "rail of joint_2", "module of joint_2",
        "tube of link_2",
    ]  # fmt: skip
    rail, tube = parts["rail of joint_2"], parts["tube of link_1"]
    assert (rail.link, rail.fixed, body.slides[1]) == (1, True, 0.1)
    np.testing.assert_allclose(tube.solid.ends, [[0, 0, 0], [0.3, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(rail.solid.ends, [[0.3, 0.3, 0], [0.3, -0.35, 0]], atol=1e-15)  # z of joint 2 is -y
    for q in (-0.4, 0.25):  # at both ends of its travel the carriage is on the rail
        place = table.frames([0.0, q])[1] @ parts["module of joint_2"].solid.pose
        joint = table.frames([0.0, q])[0]
        local = np.linalg.solve(joint, place)[:3, 3]
        np.testing.assert_allclose(local, [0.3, -0.1 - q, 0.0], atol=1e-15)
    assert all(link.collision for link in body.links)
    names = {frozenset((body.shapes[i].name, body.shapes[j].name)) for i, j in body.pairs.tolist()}
    assert frozenset(("rail of joint_2", "module of joint_2")) not in names  # it rides on it
    assert frozenset(("tube of base_link", "rail of joint_2")) in names


@pytest.mark.parametrize("slides", [[0.1], [0.1, np.nan, 0.1], np.zeros((3, 1))])
def test_slides_that_do_not_fit_are_refused(slides):
    with pytest.raises(DesignError, match="slides"):
        arm_body(WRIST, OPTIONS, slides)


def test_every_joint_may_have_its_own_module():
    table = DHTable.from_rows([(0, 0, 0.2), (np.pi / 2, 0.3, 0), (0, 0, 0.1)])
    body = Body(modules=[(0.1, 0.05, 2.0), (0.04, 0.03, 0.3)])
    arm = arm_body(table, body)
    modules = [part.solid for part in arm.parts if part.module]
    assert [(m.radius, m.length, m.mass) for m in modules] == [(0.05, 0.05, 2.0), (0.02, 0.03, 0.3)]
    assert arm.reaches == pytest.approx((np.hypot(0.1, 0.05) / 2 + 0.005, np.hypot(0.04, 0.03) / 2 + 0.005))
    assert body.reach == arm.reaches[0]
    with pytest.raises(SettingsError, match="2 modules for 1 joint"):
        arm_body(DHTable.from_rows([(0, 0, 0.2), (0, 0, 0.1)]), body)
