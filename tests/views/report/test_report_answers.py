"""The head of the report: answers that are the verdict's, a place that is the base's, labels that keep apart."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from armdesign.building.parts_clearance import PartsGap
from armdesign.cell.obstacles import Box, Obstacle, Obstacles, Plane
from armdesign.feasibility.verdict import Spread
from armdesign.feasibility.words import conclusion
from armdesign.kinematics.base_pose import BasePose, placed_base
from armdesign.views.report.answers import answers, at_the_edge, place, plain_verdict, story, touching, worst_frame
from armdesign.views.report.cell_pictures import (
    CellScene,
    Outline,
    cell_figure,
    cell_scene,
    dimensions,
    flat_ends,
    free_spot,
    hull,
)
from armdesign.views.report.gaps import ALWAYS, Clearances, Near, clearances
from armdesign.views.report.plots import clearance_picture


def test_answers_give_the_figures_of_the_verdict(invented, numbers):
    run = invented()
    found = {answer.question: answer for answer in answers(run, worst_frame(run), ())}
    assert len(found) == 4
    error = run.verdict.hand_error
    mean, p95, _, largest = numbers(found["Does it do the job?"].words)[:4]
    assert [mean, p95, largest] == pytest.approx([1e3 * error.mean, 1e3 * error.p95, 1e3 * error.max], rel=6e-3)
    assert found["Does it do the job?"].good is None  # no tolerance is stated
    if run.verdict.speed_fraction < 1.0:
        assert numbers(found["How fast is it?"].figure)[0] <= 100.0 * run.verdict.speed_fraction


@pytest.mark.parametrize("met", [True, False])
def test_a_tolerance_is_met_or_not(invented, met):
    run = invented()
    verdict = dataclasses.replace(run.verdict, tolerance=0.005, tolerance_met=met, hand_error=Spread(0.1, 0.2, 0.3))
    settings = run.problem.settings.replace({"needs": {"hand_tolerance": 0.005}})
    problem = dataclasses.replace(run.problem, settings=settings)
    answer = answers(dataclasses.replace(run, problem=problem, known_verdict=verdict), worst_frame(run), ())[0]
    assert answer.good is met
    assert "5 mm" in answer.words


def test_a_place_is_told_in_millimetres_and_how_it_is_mounted(numbers):
    for mounted, yaw in (("floor", 0.5), ("wall", -1.2), ("ceiling", 2.0)):
        answer = place(placed_base((0.1, -0.25, 0.7), yaw, mounted), "shoulder")
        assert numbers(answer.figure) == [100.0, -250.0, 700.0]
        assert numbers(answer.words) == [round(np.rad2deg(yaw))]
    assert "shoulder" in place(BasePose(frame="base"), "shoulder").words


def test_a_thin_arm_touches_nothing_that_is_known(invented):
    run = invented()
    settings = run.problem.settings.replace({"body": {"kind": "thin"}})
    run = dataclasses.replace(run, problem=dataclasses.replace(run.problem, settings=settings))
    assert clearances(run).least == ()
    assert touching((), settings).good is None


def test_the_least_of_all_is_told_first_that_of_a_build_s_parts_too(invented, numbers):
    run = invented()
    bodies = clearances(run).least
    assert min(near.value for near in bodies) == pytest.approx(run.verdict.self_clearance.value)
    gap = PartsGap(bodies[0].value - 2e-3, ("J3-L2", "J3-L3"), np.zeros(3), 3)
    made = SimpleNamespace(gap=gap, assembly=SimpleNamespace(placed=()), told=lambda told: told)
    nearest = clearances(run, made).least
    assert nearest[0].bodies == gap.parts
    assert "joint 3" in nearest[0].words
    assert clearances(run, SimpleNamespace(gap=None, assembly=None, kit=None)).least == ()  # its parts do not fit
    assert Near(0.0, gap.parts, "at joint 3").words == "J3-L2 and J3-L3 meet, at joint 3"
    some = Near(0.004, ("bracket A", "bracket B"), "at joint 3")
    answer = touching((some,), run.problem.settings)
    assert (numbers(answer.figure), answer.good) == ([4.0], False)  # 5 mm are asked for
    assert "racket A and bracket B" in answer.words
    assert "too near (assumed: 5 mm)" in story(run, worst_frame(run), (some,), 0.01)
    part = some._replace(gap=gap._replace(value=0.004))  # parts of a build have to keep 1 mm, not what housings keep
    answer = touching((part, bodies[0]), run.problem.settings)
    assert answer.good
    assert numbers(answer.words)[-2:] == [1.0, 5.0]
    assert "too near" not in story(run, worst_frame(run), (part,), 0.01)
    assert touching((part._replace(value=0.0005, gap=gap._replace(value=0.0005)),), run.problem.settings).good is False
    asked = run.problem.settings.replace({"body": {"clearance": 0.003}})
    assert "Asked for: 3 mm" in touching((some,), asked).words


def test_the_headline_says_how_fast_and_what_was_not_checked(invented):
    run = invented()
    settings = run.problem.settings.replace({"needs": {"hand_tolerance": 0.5}})
    verdict = dataclasses.replace(run.verdict, tolerance=0.5, tolerance_met=True, speed_fraction=0.567)
    run = dataclasses.replace(run, problem=dataclasses.replace(run.problem, settings=settings), known_verdict=verdict)
    kind, said = plain_verdict(run, worst_frame(run), np.zeros(1))
    assert kind == "part"
    assert "does the job, at 56 % of the speed shown:" in said
    assert said.endswith("Where it stands has not been checked.")


def test_green_is_only_what_is_done_as_shown_where_it_stands(invented):
    run = invented()
    settings = run.problem.settings.replace({"needs": {"hand_tolerance": 0.5}})
    first = dataclasses.replace(run.problem.first, obstacles=Obstacles((Obstacle("floor", Plane(), np.eye(4)),)))
    found = []
    for shown, fraction, met in ((first, 1.0, True), (first, 0.99, True), (run.problem.first, 1.0, True),
                                 (first, 0.0, True), (first, 1.0, None), (first, 1.0, False)):  # fmt: skip
        problem = dataclasses.replace(run.problem, settings=settings, demonstrations=(shown,))
        verdict = dataclasses.replace(run.verdict, feasible=True, tolerance_met=met, speed_fraction=fraction)
        judged = dataclasses.replace(run, problem=problem, known_verdict=verdict)
        found.append(plain_verdict(judged, worst_frame(judged), np.zeros(1))[0])
    assert found == ["good", "part", "part", "bad", "open", "bad"]


def test_the_headline_says_both_errors_where_the_exported_motion_s_is_the_larger(invented, numbers):
    run = invented()
    worst = worst_frame(run)
    tolerance = 1.1 * worst.error
    settings = run.problem.settings.replace({"needs": {"hand_tolerance": tolerance}})
    shown = dataclasses.replace(run.problem.first, obstacles=Obstacles((Obstacle("floor", Plane(), np.eye(4)),)))
    problem = dataclasses.replace(run.problem, settings=settings, demonstrations=(shown,))
    verdict = dataclasses.replace(run.verdict, feasible=True, tolerance_met=True, speed_fraction=1.0)
    run = dataclasses.replace(run, problem=problem, known_verdict=verdict)
    for factor, wanted, named in ((1.0, "good", False), (1.05, "good", True), (1.2, "part", True)):
        kind, said = plain_verdict(run, worst, np.array([0.0, factor * worst.error]))
        assert (kind, "as exported it is beyond that" in said.lower()) == (wanted, wanted == "part")
        assert ("as its motion is exported" in said) is named
        assert ("exported motion" in story(run, worst, (), factor * worst.error)) is not named
        errors = numbers(said)[: 1 + named]
        assert errors == pytest.approx([1e3 * worst.error, 1e3 * factor * worst.error][: 1 + named], rel=6e-3)
        assert conclusion(verdict, run.judged) == "good"


def test_what_keeps_its_distance_is_told_so_and_not_drawn(invented):
    run = invented(4)
    found = clearances(run)
    for near in found.least:
        assert ("whole motion" in near.words) == (near.when == ALWAYS)
    assert all(np.ptp(each) > 1e-6 for each in found.series.values())
    level = Clearances((Near(0.019, ("a", "b"), ALWAYS), *found.least), found.time, found.series)
    drawn = clearance_picture(run, level)
    assert "unchanging" in drawn.svg
    assert "grey" in drawn.caption
    gap = PartsGap(0.00333, ("J4-L3", "J4-L4"), np.zeros(4), 4)
    part = clearance_picture(run, level._replace(least=(Near(gap.value, gap.parts, "at joint 4", gap), *level.least)))
    assert "required: 1" in part.svg  # the rule of parts beside theirs, that of bodies with the curves of bodies
    assert "assumed: 5" in part.svg
    assert "required" not in drawn.svg


def test_a_base_on_a_bound_of_its_region_is_said_to_be_there(invented):
    run = invented()
    cell = {"place": ["x=0.4..1.4 y=-0.2..0.2 z=0.9"]}
    settings = run.problem.settings.replace({"cell": cell})
    first = dataclasses.replace(run.problem.first, base=placed_base((0.4, 0.0, 0.9), 0.0))
    problem = dataclasses.replace(run.problem, settings=settings, demonstrations=(first,))
    run = dataclasses.replace(run, problem=problem)
    assert run.base_pose.frame == "room"
    assert "edge of where it may stand: x" in at_the_edge(run)
    assert " y " not in at_the_edge(run)
    assert " z " not in at_the_edge(run)  # it had no choice


def test_the_cell_is_drawn_in_the_room(invented):
    run = invented()
    pose = np.eye(4)
    pose[:3, 3] = 0.45, 0.2, 0.025
    room = Obstacles(
        (Obstacle("<table>", Box(np.array([0.9, 0.4, 0.05])), pose), Obstacle("floor", Plane(), np.eye(4)))
    )
    first = dataclasses.replace(run.problem.first, obstacles=room)
    run = dataclasses.replace(
        run, problem=dataclasses.replace(run.problem, demonstrations=(first,)), known_verdict=None
    )
    scene = cell_scene(run)
    assert scene.base == pytest.approx(1e3 * run.base_pose.translation)
    first = run.table.skeleton(run.evaluation.path.q[:1]) @ run.base_pose.rotation.T + run.base_pose.translation
    assert scene.corners[0] == pytest.approx(1e3 * first[0])
    cell_figure(scene, 0, 2)
    figure = cell_figure(scene, 0, 1)
    texts = [text.get_text() for text in figure.axes[0].texts]
    assert "<table>" in texts
    assert figure.axes[0].get_xlim()[1] >= 900.0


def test_labels_stand_apart():
    size, taken = np.array([3.0, 1.0]), []
    for _ in range(6):
        taken.append(free_spot(np.array([5.0, 5.0]), size, taken))
    for i, one in enumerate(taken):
        for other in taken[i + 1 :]:
            assert (one[1] <= other[0]).any() or (one[0] >= other[1]).any()


def test_the_outline_of_points_is_their_hull():
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.5]])
    assert len(hull(square)) == 4
    assert sorted(map(tuple, hull(np.array([[0.0, 0.0], [2.0, 2.0], [1.0, 1.0]])))) == [(0.0, 0.0), (2.0, 2.0)]


def test_dimensions_are_distances_from_the_origin_and_the_nearest_edge(numbers):
    corners = np.array([[x, y, z] for x in (500.0, 1000.0) for y in (-300.0, 400.0) for z in (700.0, 800.0)])
    nothing = np.zeros((1, 1, 3))
    table, far = Outline("table", corners, carries=True), Outline("far", corners + np.array([0.0, 5000.0, 0.0]))
    scene = CellScene(np.array([620.0, 150.0, 800.0]), nothing, nothing, nothing[0], (), (table, far), "room")
    for axes in ([0, 1], [0, 2]):
        for start, end, text in dimensions(scene, axes):
            assert np.count_nonzero(start != end) == 1
            assert numbers(text)[0] == pytest.approx(np.abs(start - end).sum(), abs=0.5)
    said = [text for _, _, text in dimensions(scene, [0, 1])]
    assert said == ["620", "120 from the edge of table", "150", "250 from the edge of table"]
    assert [text for _, _, text in dimensions(scene, [0, 2])] == ["620", "120 from the edge of table", "800"]
    wall = Outline("wall", np.array([[620.0, 0.0, 0.0]]), np.array([1.0, 0.0, 0.0]))
    ball = Box(np.array([9e3, 9e3, 9e3])).outline  # larger than all, and beside the base
    scene = dataclasses.replace(scene, obstacles=(table, Outline("large", ball + np.array([0.0, 0.0, 5300.0])), wall))
    assert [text for _, _, text in dimensions(scene, [0, 1])] == ["620", "150", "250 from the edge of table"]


def test_round_things_have_no_edges_to_measure_from():
    turn = np.linspace(0.0, 2.0 * np.pi, 33)
    ring = np.stack([20.0 * np.cos(turn), 20.0 * np.sin(turn), np.zeros(33)], axis=1)
    post = np.concatenate([ring, ring + np.array([0.0, 0.0, 700.0])])
    assert (flat_ends(post, 0), flat_ends(post, 2)) == ([], [0.0, 700.0])
    ball = np.random.default_rng(0).normal(size=(300, 3))
    ball *= 500.0 / np.linalg.norm(ball, axis=1, keepdims=True)
    assert [flat_ends(ball, k) for k in range(3)] == [[], [], []]


def test_what_is_written_in_the_cell_is_within_the_picture_and_apart():
    corners = Box(np.array([400.0, 300.0, 100.0])).outline
    names = ("bench with a long name", "fixture left", "fixture right", "post", "shelf")
    shifts = np.array([[300, 0, 700], [300, 0, 800], [300, 50, 800], [350, 20, 820], [280, 30, 720]], dtype=float)
    obstacles = tuple(Outline(name, corners + shift) for name, shift in zip(names, shifts, strict=True))
    arm = np.array([[[490.0, 140.0, 760.0], [0.0, 0.0, 900.0]]])
    scene = CellScene(arm[0, 0], arm, arm, arm[0], (), obstacles, "room")
    for axes in ([0, 1], [0, 2]):
        figure = cell_figure(scene, *axes)
        figure.canvas.draw()
        boxes = [text.get_window_extent() for text in figure.axes[0].texts if text.get_text()]
        assert all(each.x0 >= 0.0 and each.x1 <= figure.bbox.x1 and each.y0 >= 0.0 for each in boxes)
        named = [text for text in figure.axes[0].texts if text.get_text() and not text.get_text()[0].isdigit()]
        shown = [text.get_window_extent() for text in named]
        assert not any(a.overlaps(b) for k, a in enumerate(shown) for b in shown[:k])
    assert any(text.get_text() == "fixture left, right" for text in named)  # one hides the other from the front


def test_how_fast_it_is_names_the_largest_load(invented, numbers):
    run = invented()
    answer = answers(run, worst_frame(run), ())[3]
    assert numbers(answer.words)[-2] == pytest.approx(max(run.verdict.peak_torque), rel=6e-3)
    assert (answer.good, answer.part) == (None, run.verdict.speed_fraction < 1.0)  # no speed is stated
    slow = dataclasses.replace(run.verdict, speed_fraction=0.4)
    settings = run.problem.settings.replace({"needs": {"max_speed": [90.0]}})
    problem = dataclasses.replace(run.problem, settings=settings)
    assert answers(dataclasses.replace(run, problem=problem, known_verdict=slow), worst_frame(run), ())[3].good is False
