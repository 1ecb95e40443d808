"""What the figures rest on: parts that add up, peaks that stay, labels that keep apart, scales that hold."""

import dataclasses
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from armdesign.export.options import RobotOptions
from armdesign.kinematics.base_pose import MOUNTINGS, placed_base
from armdesign.kinematics.dh import DHTable
from armdesign.views.report.answers import worst_frame
from armdesign.views.report.drawing import inlined, legend_above, legend_lines, line_style, new_figure, short, thinned
from armdesign.views.report.facts import fitness_parts, joint_loads
from armdesign.views.report.plots import convergence_picture, error_picture, joint_pictures
from armdesign.views.report.report_scene import box, framed, view
from armdesign.views.report.words import assumptions, limit_sentences


def some_table(rng, dof):
    rows = rng.uniform([-1.5, 0.0, 0.0], [1.5, 0.4, 0.4], (dof + 1, 3))
    rows[:, 1:] *= rng.random((dof + 1, 2)) < 0.6
    rows[-1, 2] = 0.1
    return DHTable.from_rows(rows)


@pytest.mark.parametrize("scenario", ["packaging", "welding"])
def test_the_parts_of_the_fitness_add_up(invented, scenario):
    run = invented(4, scenario)
    parts = fitness_parts(run)
    assert parts.path == pytest.approx(run.evaluation.path_fitness, rel=1e-12)
    assert parts.total == pytest.approx(run.evaluation.fitness, rel=1e-12)
    weights = run.problem.settings.fitness.weights
    assert all((part > 0.0) == (weight > 0.0) for part, weight in zip(parts.points, weights, strict=True))


def test_corners_are_as_far_apart_as_the_links_are_long():
    rng = np.random.default_rng(1)
    for dof in (1, 3, 8):
        table = some_table(rng, dof)
        corners = table.skeleton(rng.uniform(-3, 3, (1, dof)))[0]
        lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
        assert lengths == pytest.approx(np.stack([table.a, table.d], axis=1).ravel(), abs=1e-12)


def test_a_thinned_series_keeps_its_ends_and_peaks():
    rng = np.random.default_rng(2)
    time = np.linspace(0.0, 1.0, 10_001)
    values = rng.normal(size=len(time))
    values[[123, 9876]] = 50.0, -50.0
    t, x = thinned(time, values, 300)
    assert len(t) <= 302
    assert (np.diff(t) > 0).all()
    assert (x[0], x[-1], x.max(), x.min()) == (values[0], values[-1], 50.0, -50.0)
    assert len(thinned(time[:300], values[:300], 300)[0]) == 300


def test_twelve_lines_differ_without_their_colours_for_neighbours_and_with_them_for_all():
    styles = [line_style(i) for i in range(12)]
    assert len({(style["color"], str(style["linestyle"])) for style in styles}) == 12
    assert all(a["linestyle"] != b["linestyle"] for a, b in pairwise(styles))


def test_views_keep_lengths_and_right_angles():
    for azimuth in np.linspace(-3, 3, 7):
        turn = view(azimuth)
        assert turn @ turn.T == pytest.approx(np.eye(2))


@pytest.mark.parametrize("size", [(1.0, 1.0), (3.0, 0.01), (0.01, 3.0)])
def test_both_directions_of_a_view_have_one_scale(size):
    points = np.array([[0.0, 0.0], size])
    figure = framed(*box(points), left=0.7, right=0.1, bottom=0.4, top=0.1)
    axis = figure.axes[0]
    inches = np.array(axis.get_position().size) * figure.get_size_inches()
    (left, right), (low, high) = axis.get_xlim(), axis.get_ylim()
    assert inches[0] / (right - left) == pytest.approx(inches[1] / (high - low))
    assert left < 0.0
    assert right > size[0]
    assert low < 0.0
    assert high > size[1]


def test_identifiers_of_a_picture_are_its_own_and_text_stays_as_it_is():
    svg = (
        '<?xml version="1.0"?><svg xmlns="http://www.w3.org/2000/svg" width="1pt" viewBox="0 0 1 1">'
        '<metadata>x</metadata><defs><style type="text/css">*{}</style></defs><!-- c --><g id="a"><use xlink:href="#b" '
        'clip-path="url(#c)"/></g><text>id="a" url(#c)</text></svg>'
    )
    made = '<g id="k-a"><use href="#k-b" clip-path="url(#k-c)"/></g><text>id="a" url(#c)</text>'
    assert inlined(svg, "k") == f'<svg viewBox="0 0 1 1">{made}</svg>'


def test_names_are_shortened_and_legends_fit():
    assert short("x" * 100) == "x" * 12 + "..." + "x" * 12
    assert short("_hidden").startswith(" ")
    assert short("a\nb") == "a b"
    assert legend_lines(["joint 1"] * 4) == (4, 1)
    assert legend_lines(["joint 1"] * 5) == (3, 2)  # none alone in the last line
    assert legend_lines(["y" * 60]) == (1, 1)


def test_a_legend_is_read_line_by_line():
    figure = new_figure(2.0)
    axis = figure.subplots()
    for i in range(5):
        axis.plot([0.0, 1.0], [0.0, i], label=f"joint {i + 1}")
    legend_above(figure, axis)
    columns = [text.get_text()[-1] for text in figure.legends[0].get_texts()]
    assert columns == ["1", "4", "2", "5", "3"]  # Matplotlib fills three columns of 2, 2 and 1 from above


def test_a_joint_on_its_limit_is_said_to_be_there_and_when(invented):
    run = invented()
    loads = joint_loads(run, RobotOptions())
    q, time = loads.motion.q.copy(), loads.time
    bounds = loads.limits.position.copy()
    bounds[0] = -0.5, 0.5
    q[:, 0] = 0.0
    q[3:6, 0], q[8, 0] = 0.5, -0.5
    moved = dataclasses.replace(
        loads,
        motion=dataclasses.replace(loads.motion, q=q),
        limits=dataclasses.replace(loads.limits, position=bounds),
    )
    said = limit_sentences(run, moved)[0]
    assert f"at its limit of −28.6479 deg, at {time[8]:.2f} s and 28.6479 deg, from {time[3]:.2f} to" in said
    assert f"to {time[5]:.2f} s" in said


def test_gravity_is_told_as_the_base_is_mounted():
    told = {m: assumptions(RobotOptions(), placed_base((0.0, 0.0, 0.0), 0.7, m))[-2] for m in MOUNTINGS}
    assert (told["floor"].name[-1], told["floor"].value) == ("z", "−9.81 m/s^2")
    assert (told["wall"].name[-1], told["wall"].value) == ("x", "9.81 m/s^2")
    assert (told["ceiling"].name[-1], told["ceiling"].value) == ("z", "9.81 m/s^2")


def test_an_orientation_that_is_followed_exactly_is_said_and_not_drawn(invented):
    run = invented()
    settings = run.problem.settings.replace({"fitness": {"orientation_weight": 0.1}})
    for angle, drawn in ((1e-5, False), (0.1, True)):
        path = dataclasses.replace(run.evaluation.path, orientation_error=np.full(len(run.problem.task.time), angle))
        scored = dataclasses.replace(run.evaluation.demonstrations[0], path=path)
        evaluation = dataclasses.replace(run.evaluation, demonstrations=(scored,))
        first = dataclasses.replace(run.problem.first, settings=settings)
        problem = dataclasses.replace(run.problem, settings=settings, demonstrations=(first,))
        oriented = dataclasses.replace(run, problem=problem, evaluation=evaluation)
        shown = error_picture(oriented, worst_frame(oriented))
        assert ("turn [deg]" in shown.svg, "followed exactly" in shown.caption) == (drawn, not drawn)


def test_a_leap_from_the_hand_in_the_first_frame_is_said(invented):
    run = invented()
    for first, said in ((0.0, True), (0.0119, False)):
        distance = np.full_like(run.evaluation.path.distance, 0.012)
        distance[0] = first
        path = dataclasses.replace(run.evaluation.path, distance=distance)
        scored = dataclasses.replace(run.evaluation.demonstrations[0], path=path)
        leapt = dataclasses.replace(run, evaluation=dataclasses.replace(run.evaluation, demonstrations=(scored,)))
        caption = error_picture(leapt, worst_frame(leapt)).caption
        assert ("begins at the hand, and is 12.0 mm off one frame later" in caption) == said


def test_a_steep_search_is_drawn_to_a_logarithmic_scale():
    best, tried = np.array([0.5, 0.1, 0.02, 0.019]), np.array([10, 100, 500, 1000])
    for factor, said in ((1.0, True), (0.0, False)):
        history = SimpleNamespace(best=best * factor + (1.0 - factor), evaluations=tried)
        assert ("logarithmic" in convergence_picture(history).caption) == said


def test_torques_are_held_against_stated_limits_only(invented):
    run = invented()
    loads = joint_loads(run, RobotOptions())
    _, torques = joint_pictures(run, loads)
    assert "limits are assumed" in torques.caption
    settings = run.problem.settings.replace({"needs": {"max_torque": [9.0]}})
    stated = dataclasses.replace(run, problem=dataclasses.replace(run.problem, settings=settings))
    assert "no limit" not in joint_pictures(stated, loads)[1].caption
