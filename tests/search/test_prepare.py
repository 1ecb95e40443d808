"""From a recording and settings to the task: who is base, who is hand, and what they weigh."""

import numpy as np
import pytest

from armdesign.demonstration import Recording
from armdesign.errors import SettingsError, TaskError
from armdesign.search.prepare import prepare
from armdesign.settings.sections import Settings


@pytest.fixture
def recording():
    """Five points along an arm of 0.75 m that turns, two of them with an orientation."""
    time = np.arange(20) / 10.0
    angle = 0.3 * time
    direction = np.stack([np.cos(angle), np.sin(angle), np.full(20, 0.2)], axis=1)
    names = ("shoulder", "upper", "elbow", "wrist", "hand")
    points = {name: np.array([0.1, 0.2, 1.0]) + i * 0.18 * direction for i, name in enumerate(names)}
    turns = np.stack([0 * angle, 0 * angle, np.sin(angle / 2), np.cos(angle / 2)], axis=1)
    return Recording(time, points, {"wrist": turns, "hand": turns}, "five.csv")


def settings(**changes):
    return Settings().replace(changes)


def test_first_point_is_the_base_and_the_others_are_followed(recording):
    prepared = prepare(recording, settings())
    assert prepared.task.base == "shoulder"
    assert prepared.task.points == ("upper", "elbow", "wrist", "hand")
    np.testing.assert_allclose(
        prepared.task.P[:, -1], recording.points["hand"] - recording.points["shoulder"], atol=1e-12
    )


def test_named_base_is_left_out_of_the_points(recording):
    prepared = prepare(recording, settings(task={"base": "upper"}))
    assert prepared.task.points == ("shoulder", "elbow", "wrist", "hand")


@pytest.mark.parametrize("m", [1, 2, 3, 4])
def test_packaging_weights_grow_along_the_arm_for_any_number_of_points(recording, m):
    points = ("upper", "elbow", "wrist", "hand")[-m:]
    fitness = prepare(recording, settings(task={"points": points})).settings.fitness
    weights = np.array(fitness.weights)
    assert weights.sum() == pytest.approx(1.0, abs=1e-15)
    np.testing.assert_allclose(weights / weights[0], np.arange(1, m + 1), rtol=1e-12)
    assert fitness.orientation_weight == 0.0


def test_welding_follows_the_hand_s_orientation_unless_told_otherwise(recording):
    points = ("upper", "elbow", "hand")
    welding = {"fitness": {"scenario": "welding"}}
    prepared = prepare(recording, settings(task={"points": points}, **welding))
    assert prepared.settings.task.orientation == prepared.task.orientation == "hand"
    assert prepared.settings.fitness.weights == (0.0, 0.1, 0.7)
    assert prepared.settings.fitness.orientation_weight == 0.2
    prepared = prepare(recording, settings(task={"points": points, "orientation": "wrist"}, **welding))
    assert prepared.task.orientation == "wrist"
    assert prepared.task.R.shape == (20, 3, 3)


def test_orientation_without_weight_is_said_not_to_be_followed(recording):
    prepared = prepare(recording, settings(task={"orientation": "hand"}))
    assert prepared.task.R is None
    assert "The orientation of 'hand' is not followed: the orientation weight w_0 is 0." in prepared.notes
    assert prepared.settings.task.orientation is None


def test_weights_given_go_over_the_scenario(recording):
    points = {"points": ("elbow", "hand")}
    given = prepare(recording, settings(task=points, fitness={"weights": (0.25, 0.75), "scenario": "welding"}))
    assert (given.settings.fitness.orientation_weight, given.settings.fitness.weights) == (0.0, (0.25, 0.75))
    given = prepare(recording, settings(task=points, fitness={"weights": (0.1, 0.2), "orientation_weight": 0.7}))
    assert (given.settings.fitness.orientation_weight, given.settings.fitness.weights) == (0.7, (0.1, 0.2))


@pytest.mark.parametrize(
    ("fitness", "message"),
    [
        ({"scenario": "welding"}, r"3 weights .* for 4 points; allowed: 4 weights"),
        ({"weights": (0.5, 0.5)}, r"2 weights \(0.5, 0.5\) for 4 points"),
        ({"weights": (0.1, 0.1, 0.1, 0.1)}, "sum to 0.4; allowed: a sum of 1"),
        ({"weights": (0.2, 0.2, 0.3, 0.3), "orientation_weight": 0.3}, "sum to 1.3; allowed: a sum of 1"),
        ({"weights": (0.2, 0.2, 0.6, 0.0)}, "the hand, the last point, has no weight"),
    ],
)
def test_weights_that_do_not_fit_are_refused(recording, fitness, message):
    with pytest.raises(SettingsError, match=message):
        prepare(recording, settings(fitness=fitness))


def test_settled_study_prepares_the_same(recording):
    for changes in ({}, {"fitness": {"scenario": "welding"}, "task": {"points": ("upper", "elbow", "hand")}}):
        first = prepare(recording, settings(**changes))
        second = prepare(recording, first.settings)
        assert second.settings == first.settings
        assert second.task.P.tobytes() == first.task.P.tobytes()
        assert second.notes == first.notes
        assert (first.task.R is None) == (second.task.R is None)


def test_points_that_count_from_the_base_are_taken_as_they_are(recording):
    first = prepare(recording, settings())
    relative = Recording(recording.time, {name: first.task.P[:, i] for i, name in enumerate(first.task.points)})
    second = prepare(relative, settings(task={"base": "origin"}))
    assert second.task.P.tobytes() == first.task.P.tobytes()
    assert second.task.points == first.task.points
    assert second.settings.task.base == "origin"
    chosen = prepare(relative, settings(task={"base": "origin", "points": ("elbow", "hand")}))
    np.testing.assert_array_equal(chosen.task.P, first.task.P[:, [1, 3]])
    with pytest.raises(TaskError, match=r"'shoulder'.*allowed: upper, elbow, wrist, hand"):
        prepare(relative, settings(task={"base": "origin", "points": ("shoulder", "hand")}))


def test_point_called_origin_is_a_point(recording):
    points = {"origin": recording.points["shoulder"], "hand": recording.points["hand"]}
    prepared = prepare(Recording(recording.time, points), settings(task={"base": "origin"}))
    assert prepared.task.points == ("hand",)
    assert np.linalg.norm(prepared.task.P[0, 0]) == pytest.approx(0.734, abs=1e-3)


def test_orientation_that_is_missing_lists_those_there_are(recording):
    changes = {
        "fitness": {"scenario": "welding"},
        "task": {"points": ("upper", "elbow", "hand"), "orientation": "elbow"},
    }
    with pytest.raises(TaskError, match=r"followed \(w_0 > 0\), but .*no orientation of 'elbow'.*allowed: wrist, hand"):
        prepare(recording, settings(**changes))


def test_start_out_of_reach_is_refused_and_later_frames_are_noted(recording):
    with pytest.raises(
        TaskError, match=r"the hand is 0\.734 m from the base, and no arm may be longer than L_max = 0\.7 m"
    ):
        prepare(recording, settings(design={"length": (0.1, 0.7)}))
    stretched = recording.changed(recording.time, lambda p: p.copy(), lambda q: q)
    points = dict(stretched.points)
    points["hand"] = points["shoulder"] + (points["hand"] - points["shoulder"]) * np.linspace(0.9, 1.2, 20)[:, None]
    notes = prepare(Recording(recording.time, points), settings(design={"length": (0.1, 0.8)})).notes
    beyond = int((np.linspace(0.9, 1.2, 20) * 0.72 * np.sqrt(1.04) > 0.8).sum())
    assert f"In {beyond} of 20 frames the hand is farther from the base (up to 0.881 m) than" in notes[-1]


def test_recording_of_the_base_alone_is_refused(recording):
    alone = Recording(recording.time, {"shoulder": recording.points["shoulder"]})
    with pytest.raises(TaskError, match="beside the base 'shoulder' there is no point to follow"):
        prepare(alone, settings())


def test_problem_and_space_follow_the_settings(recording):
    prepared = prepare(
        recording, settings(design={"dof": 5, "joint_limits": ((-90.0, 45.0),)}, fitness={"delta": 0.02})
    )
    problem, space = prepared.path_problem, prepared.space
    assert (problem.frames, problem.points, problem.dof, space.dof) == (20, 4, 5, 5)
    assert problem.record[0]["delta"] == 0.02
    assert problem.record[0]["upper"][:5].tolist() == [np.pi / 4] * 5
    assert len(space.bounds[0]) == 3 * 5 - 1  # 3 n - 1 free entries, section 2


def test_continuity_as_a_speed_counts_per_frame(recording):
    for changes, expected in (({}, 10.0), ({"continuity": 3.0}, 3.0), ({"continuity_speed": 50.0}, 5.0)):
        radius = prepare(recording, settings(fitness=changes)).path_problem.record[0]["radius"]
        assert np.rad2deg(radius) == pytest.approx(expected, rel=1e-9)
