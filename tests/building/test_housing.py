"""Housings that are boxes: nothing of ours is in them at any angle, cheeks hold them, their horn is met."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from armdesign.bodies.arm_body import arm_body
from armdesign.building import clocking
from armdesign.building.assembly import assemble
from armdesign.building.brackets import HELD, bracket
from armdesign.building.catalogue import find_catalogue
from armdesign.building.part_drawing import notes
from armdesign.building.part_lists import screw_length
from armdesign.building.parts import SCREWS, Prism
from armdesign.building.shop import ALUMINIUM, CHEEK, CHEEK_PLAY, PRINTED, Face, Shop, circle_of, envelope, housing_of
from armdesign.errors import CatalogueError
from armdesign.kinematics.dh import DHTable, rot_z
from armdesign.settings import Body

SIZES = {a.name: a for a in find_catalogue("dynamixel-x").actuators}
PICKS = ("XM540-W270", "XM430-W350", "XL430-W250", "XC330-T288", "XW540-T260")


def arm(rows, actuators, shop):
    modules = [(*envelope(a, shop), a.mass) for a in actuators]
    body = Body(tube_diameter=shop.diameter, tube_wall=shop.wall, modules=modules)
    return arm_body(DHTable.from_rows(rows), body, placed=True)


@pytest.fixture(scope="module")
def at_random():
    """Arms put together of box actuators: tables, actuators and parts."""
    rng, found = np.random.default_rng(3), []
    while len(found) < 12:
        rows = rng.uniform([-1.6, 0.0, 0.0], [1.6, 0.4, 0.35], (4, 3))
        made, thick = (ALUMINIUM, PRINTED)[len(found) % 2], float(rng.choice([0.016, 0.025, 0.03]))
        shop = Shop(thick, 0.0015, ("tube", 2700.0), made)
        chosen = [SIZES[name] for name in rng.choice(PICKS, 3)]
        try:
            found.append((DHTable.from_rows(rows), chosen, assemble(arm(rows, chosen, shop), chosen, shop)))
        except CatalogueError:
            continue
    return found


def in_parts(part, points, within=1e-6):
    """Whether points, shape (k, 3), are in a part's forms by more than a little, its holes filled."""
    found = np.zeros(len(points), bool)
    for form in part.solids:
        if isinstance(form, Prism):
            edges = np.roll(form.polygon, -1, axis=0) - form.polygon
            way = edges / np.linalg.norm(edges, axis=1)[:, None]
            off = points[:, None, :2] - form.polygon[None]
            side = way[:, 0] * off[..., 1] - way[:, 1] * off[..., 0]
            found |= (side > within).all(axis=1) & (np.abs(points[:, 2] - form.z) < form.width / 2 - within)
        else:
            long = np.linalg.norm(form.end - form.start)
            u = (form.end - form.start) / long
            high = (points - form.start) @ u
            away = np.linalg.norm(points - form.start - high[:, None] * u, axis=1)
            found |= (high > within) & (high < long - within) & (away < form.radius - within)
    return found


def grid(actuator):
    """Points of an actuator's box in its own frame, its faces included, shape (k, 3) [m]."""
    near, far, width = actuator.box
    low, high = actuator.horn - actuator.length / 2, actuator.length / 2
    axes = np.linspace(-far, near, 24), np.linspace(-width / 2, width / 2, 14), np.linspace(low, high, 16)
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def test_box_is_in_the_cylinder_that_it_sweeps():
    for actuator in SIZES.values():
        points = grid(actuator)
        assert np.linalg.norm(points[:, :2], axis=1).max() == pytest.approx(actuator.diameter / 2)
        assert np.abs(points[:, 2]).max() == pytest.approx(actuator.length / 2)


def test_nothing_of_ours_is_in_a_housing_at_any_angle(at_random):
    for _, chosen, made in at_random:
        placed = {each.mark: each for each in made.placed}
        for j, actuator in enumerate(chosen, start=1):
            box = placed[f"J{j}"]
            own = grid(actuator) @ box.pose[:3, :3].T + box.pose[:3, 3]
            for each in made.of_link(j):
                if each is not box:
                    points = (own - each.pose[:3, 3]) @ each.pose[:3, :3]
                    assert not in_parts(each.part, points).any(), (actuator.name, each.mark, each.part.note)


@pytest.mark.parametrize("turn", np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False))
def test_the_bracket_on_the_output_is_clear_of_housing_and_cheeks_at_any_angle(at_random, turn):
    for _, chosen, made in at_random:
        placed = {each.mark: each for each in made.placed}
        for j, actuator in enumerate(chosen, start=1):
            box, before, held = (placed.get(mark) for mark in (f"J{j}", f"J{j}-L{j - 1}", f"J{j}-L{j}"))
            if before is None:
                continue
            face = before.part.sizes["face above middle"]
            assert face == pytest.approx(actuator.length / 2)
            corners = [grid(actuator)]
            if held is not None:  # its cheeks, in the actuator's frame
                relative = np.linalg.inv(box.pose) @ held.pose
                cheeks = [form for form in held.part.solids if isinstance(form, Prism) and form.z]
                corners += [f.ends.reshape(-1, 3) @ relative[:3, :3].T + relative[:3, 3] for f in cheeks]
            points = np.concatenate(corners) @ rot_z(turn)[:3, :3].T
            in_bracket = points[:, [0, 2, 1]] * [1.0, -1.0, 1.0]  # its y is the output's normal, -z of the actuator
            assert not in_parts(before.part, in_bracket).any(), (actuator.name, before.part.note)


def test_cheeks_have_the_holes_of_the_sides_and_their_screws_are_no_longer_than_these(at_random):
    seen = 0
    for _, chosen, made in at_random:
        for j, actuator in enumerate(chosen, start=1):
            held = next(each for each in made.placed if each.mark == f"J{j}-L{j}")
            box, screws = housing_of(actuator), next(s for s in made.screws if s.joins == (f"J{j}", f"J{j}-L{j}"))
            holes = [hole for hole in held.part.holes if hole.use == "housing"]
            assert len(holes) == 2 * len(box.holes)
            if not holes:
                assert screws.maker
                continue
            seen += 1
            assert (screws.maker, screws.count) == ("", 8)
            assert CHEEK < screws.length <= screws.most == pytest.approx(CHEEK + actuator.side_holes["depth"] - 4e-4)
            assert 1e-3 * screw_length(screws) <= screws.most
            for hole in holes:
                assert any(np.allclose(hole.start[:2], place) for place in box.holes)
                assert abs(hole.start[2]) == pytest.approx(actuator.box[2] / 2 + CHEEK_PLAY)
                assert hole.radius == pytest.approx(SCREWS["M2.5"][0] / 2)
                middle = (hole.start + hole.end) / 2
                rim = middle + 3.9e-3 * np.array([[1.0, 0, 0], [-1, 0, 0], [0, -1, 0]])
                assert in_parts(held.part, rim).all()
    assert seen > 5


def test_screws_into_a_horn_are_no_longer_than_it_is_deep(at_random):
    for _, _, made in at_random:
        for screws in made.screws:
            actuator = SIZES.get(next((e.part.name for e in made.placed if e.mark == screws.joins[0]), ""))
            if (
                actuator is not None
                and actuator.output_depth
                and screws.joins[1].endswith(f"L{int(screws.joins[0][1:]) - 1}")
            ):
                assert screws.count == 8
                assert screws.length < screws.most < 0.03


@pytest.mark.parametrize("thick", [0.012, 0.016, 0.02, 0.025, 0.04])
def test_known_holes_of_what_is_not_drilled_leave_room_for_their_heads_beside_tapped_ones(thick):
    actuator = SIZES["XC330-T181"]
    box, shop = housing_of(actuator), Shop(thick, 0.0015, ("tube", 2700.0), ALUMINIUM)
    holes = np.array([[7.5, 8], [7.5, -8], [-22.5, 8], [-22.5, -8]]) * 1e-3  # of the drawing
    assert sorted(box.back.tolist()) == pytest.approx(np.array(sorted(holes.tolist())))
    _, tap, _ = SCREWS[shop.circle.thread]
    face = Face("J1", np.zeros(3), np.array([0.0, 0, 1]), actuator.length / 2, box.near, circle_of(actuator, "housing"),
                housing=box, holds=True)  # fmt: skip
    for theta in np.radians(np.arange(0.0, 65.0, 4.0)):
        part = bracket(face, "wedge", np.array([np.sin(theta), 0.0, np.cos(theta)]), 1, shop)[0].part
        for hole in part.holes:
            if "tapped" in hole.use:
                plan = np.linspace(hole.start, hole.end, 30)[:, [0, 2]]
                gap = np.linalg.norm(plan[:, None] - holes, axis=2).min() - tap / 2 - SCREWS["M2"][2] / 2
                assert gap > 1e-3, (np.degrees(theta), gap)
        assert not any("up to" in line for line in notes(part))
    out = face._replace(circle=circle_of(actuator, "output"), radius=actuator.diameter / 2, housing=box, holds=False)
    assert (out.circle.diameter, out.circle.maker) == (0.012, "output of XC330-T181")
    for theta in np.radians([40.0, 90.0, 140.0]):
        part = bracket(out, "angle", np.array([np.sin(theta), 0.0, np.cos(theta)]), 1, shop)[0].part
        assert "There is room for 4 M2 on a circle up to ⌀12 mm." in notes(part)
        rim = 6e-3 + SCREWS["M2"][2] / 2
        assert in_parts(part, np.array([[-rim, out.height + 1e-4, 0.0], [0.0, out.height + 1e-4, rim]])).all()


def test_brackets_with_no_room_for_known_holes_are_refused():
    actuator, shop = SIZES["XC330-T181"], Shop(0.012, 0.0015, ("tube", 2700.0), ALUMINIUM)
    box, middle, up = housing_of(actuator), np.zeros(3), np.array([0.0, 0, 1])
    out = Face("J1", middle, up, actuator.length / 2, actuator.diameter / 2, circle_of(actuator, "output"))
    with pytest.raises(CatalogueError, match="no room"):
        bracket(out, "wedge", np.array([np.sin(0.7), 0.0, np.cos(0.7)]), 1, shop)
    held = out._replace(circle=circle_of(actuator, "housing"), radius=box.near, housing=box, holds=True)
    part = bracket(held, "angle", np.array([np.sin(0.75), 0.0, np.cos(0.75)]), 1, shop)[0].part
    leaning = part.solids[1].polygon
    above = leaning[leaning[:, 1] > held.height + part.sizes["plate"] + 1e-9]
    assert above[:, 0].min() - box.back[:, 0].max() - SCREWS["M2"][2] / 2 > 1e-3 - 1e-9


def test_masses_are_those_of_the_actuators(at_random):
    for _, chosen, made in at_random:
        for j, actuator in enumerate(chosen, start=1):
            box = next(each for each in made.placed if each.mark == f"J{j}")
            assert box.part.mass == pytest.approx(actuator.mass)
            com = box.part.inertial.com
            near, far, _ = actuator.box
            assert com[0] == pytest.approx((near - far) / 2, rel=0.05)


def test_long_ends_point_where_the_words_say_and_what_is_in_front_of_them_is_found(at_random, monkeypatch):
    rng, fronts = np.random.default_rng(1), 0
    for table, chosen, made in at_random[:6]:
        task = rng.uniform(-1.5, 1.5, (8, 3))
        monkeypatch.setattr(clocking, "motions", lambda *_, task=task: [(np.arange(8.0), task)])
        build = SimpleNamespace(
            result=SimpleNamespace(table=table, evaluation=None, problem=None), assembly=made, misfit="",
            choice=SimpleNamespace(actuators=chosen),
        )  # fmt: skip
        placed = {each.mark: each for each in made.placed}
        for j, actuator in enumerate(chosen, start=1):
            clock, before = clocking.clock_of(build, j), placed.get(f"J{j}-L{j - 1}")
            assert np.array([clock.reading(q, np.pi) for q in task[:, j - 1]]).min() > clock.spare(2 * np.pi) - 1e-9
            if before is None:
                continue
            q = np.zeros(3)
            q[j - 1] = clock.middle
            at = {each.mark: pose for each, pose in made.posed(table, q)}
            end = (at[f"J{j}"] @ [-actuator.box[1], 0.0, 0.0, 1.0])[:3] - at[f"J{j}"][:3, 3]
            mark, out = at[before.mark][:3, :3] @ clocking.mark_of(before)[1], -at[f"J{j}"][:3, 2]
            mark = mark - (mark @ out) * out
            turned = np.cos(clock.between) * mark + np.sin(clock.between) * np.cross(out, mark)
            assert turned @ end == pytest.approx(np.linalg.norm(mark) * actuator.box[1])
            assert f"J{j}-L{j}" not in clocking.in_front(build, j)
            fronts += bool(clocking.in_front(build, j))
    assert fronts


def test_a_prism_beside_the_middle_has_its_moments_by_the_parallel_axis_theorem():
    polygon = np.array([[0.0, 0.0], [0.05, 0.01], [0.04, 0.06], [-0.01, 0.03]])
    about, beside = Prism(polygon, 0.03).moments(), Prism(polygon, 0.03, 0.02).moments()
    assert beside[0] == about[0]
    shift = np.array([0.0, 0.0, 0.02])
    assert beside[1] == pytest.approx(about[1] + about[0] * shift)
    cross = np.outer(about[1], shift)
    assert beside[2] == pytest.approx(about[2] + cross + cross.T + about[0] * np.outer(shift, shift))


def test_an_arm_of_round_actuators_has_no_cheeks():
    plain = [dataclasses.replace(a, box=None) for a in (SIZES["XM540-W270"], SIZES["XM430-W350"])]
    shop = Shop(0.025, 0.002, ("tube", 2700.0), ALUMINIUM)
    made = assemble(arm([[0.0, 0.0, 0.3], [1.5708, 0.1, 0.2], [0.0, 0.4, 0.0]], plain, shop), plain, shop)
    assert not any(hole.use == "housing" for each in made.placed for hole in each.part.holes)


def test_brackets_with_cheeks_are_one_solid_each_in_step_too(at_random, tmp_path):
    control = pytest.importorskip("OCP.STEPControl")
    from armdesign.building import solids  # noqa: PLC0415

    cheeked = [e.part for _, _, made in at_random for e in made.placed if HELD in e.part.circles]
    for note in ("wedge", "angle"):
        part = next(each for each in cheeked if each.note == note)
        shape = solids.solid(part)
        assert solids.count(shape) == 1
        (tmp_path / "part.step").write_bytes(solids.step_file([(part.name, shape, part.name, np.eye(4))]))
        reader = control.STEPControl_Reader()
        reader.ReadFile(str(tmp_path / "part.step"))
        reader.TransferRoots()
        assert solids.count(reader.OneShape()) == 1
        assert solids.volume(reader.OneShape()) * 1e-9 == pytest.approx(part.volume, rel=1e-3)
