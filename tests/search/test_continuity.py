"""The bound on the joints' steps: kept as a speed in resampling, and told where it is too tight for any arm."""

import numpy as np
import pytest

from armdesign.demonstration import About, Recording, Task
from armdesign.search.prepare import prepare
from armdesign.search.prepare_demonstration import continuity_warnings, recorded_step, settled_continuity, turn_angles
from armdesign.settings.sections import Settings


@pytest.fixture
def recording():
    """An arm of 0.65 m that turns about its shoulder."""
    time = np.arange(200) / 100
    angle = 0.8 * time
    direction = np.stack([np.cos(angle), np.sin(angle), 0.2 + 0 * angle], axis=1)
    names = zip(("shoulder", "elbow", "wrist", "hand"), (0.0, 0.3, 0.55, 0.65), strict=True)
    return Recording(time, {name: reach * direction for name, reach in names}, source="r.csv")


def radius(prepared):
    return float(np.rad2deg(prepared.path_problem.record[0]["radius"]))


@pytest.mark.parametrize(("rate", "degrees"), [(50.0, 20.0), (200.0, 5.0), (25.0, 40.0)])
def test_resampling_keeps_the_speed_that_eps_means(recording, rate, degrees):
    prepared = prepare(recording, Settings().replace({"task": {"rate": rate}}))
    assert prepared.settings.fitness.continuity_speed == pytest.approx(1000.0)
    assert radius(prepared) == pytest.approx(degrees)
    (note,) = [note for note in prepared.notes if note.startswith("eps = ")]
    assert "eps = 10 deg per frame at the recorded 100 frames/s is 1000 deg/s" in note
    assert f"{degrees:g} deg per frame at {rate:g} frames/s" in note


def test_without_resampling_eps_stays_per_frame(recording):
    for changes in ({}, {"task": {"rate": 100.0}}, {"task": {"start": 0.5}}):
        prepared = prepare(recording, Settings().replace(changes))
        assert prepared.settings.fitness.continuity_speed is None
        assert radius(prepared) == pytest.approx(10.0)
        assert not any(note.startswith("eps = ") for note in prepared.notes)


def test_a_speed_that_was_asked_for_stays(recording):
    changes = {"task": {"rate": 50.0}, "fitness": {"continuity_speed": 300.0}}
    prepared = prepare(recording, Settings().replace(changes))
    assert prepared.settings.fitness.continuity_speed == 300.0
    assert radius(prepared) == pytest.approx(6.0)


def test_speed_kept_is_that_of_the_recording():
    asked = Settings().replace({"fitness": {"continuity": 3.0}, "task": {"rate": 30.0}})
    settings, (step,) = settled_continuity(asked, 1 / 120, 1 / 30)
    assert settings.fitness.continuity_speed == pytest.approx(360.0)
    assert step.details["recorded_rate"] == pytest.approx(120.0)


def test_the_rate_that_a_file_declares_counts_where_its_times_are_rounded(recording):
    time = np.round(np.arange(200) / 60, 2)  # steps of 0.01 and 0.02 s
    rounded = Recording(time, recording.points, source="r.trc", about=About("TRC", rate=60.0))
    assert 1 / recorded_step(rounded) == 60.0
    assert recorded_step(recording) == recording.step
    prepared = prepare(rounded, Settings().replace({"task": {"rate": 30.0}}))
    assert prepared.settings.fitness.continuity_speed == pytest.approx(600.0)


def task_of(P, quaternions=None, rate=100.0):
    return Task(np.arange(len(P)) / rate, P[:, None], None, quaternions, ("hand",), "shoulder")


@pytest.mark.parametrize("n", [1, 3, 6])
@pytest.mark.parametrize("longest", [0.8, 1.2])
def test_the_hand_s_bound_is_eps_times_root_n_times_the_longest_arm(n, longest):
    settings = Settings().replace({"design": {"dof": n}})
    bound = np.deg2rad(10.0) * np.sqrt(n) * longest
    for share, warned in ((0.999, False), (1.001, True)):
        P = np.zeros((10, 3))
        P[5:, 0] = share * bound
        steps = continuity_warnings(task_of(P), settings, longest)
        assert bool(steps) == warned
    (step,) = steps
    assert step.sentence.startswith(f"Warning: in 1 frame of 10 'hand' moves faster than any arm of {n} joint")
    assert "first at 0.04 s" in step.sentence
    assert step.details["fastest"] == pytest.approx(1.001 * step.details["bound"])
    assert step.details["times"] == [0.04]


@pytest.mark.parametrize("dof", [1, 4])
def test_no_arm_moves_its_hand_beyond_the_bound(dof):
    """The bound itself, tried on arms that swing all joints about one axis."""
    rng = np.random.default_rng(0)
    for _ in range(200):
        links = rng.uniform(0.0, 1.0, dof)
        q, dq = rng.uniform(-3, 3, dof), rng.normal(size=dof)
        dq *= 0.1 / np.linalg.norm(dq)
        ends = [np.sum(links * np.exp(1j * np.cumsum(angles))) for angles in (q, q + dq)]
        assert abs(ends[1] - ends[0]) <= 0.1 * np.sqrt(dof) * links.sum() + 1e-12


def test_turns_that_are_too_fast_are_told_where_they_count():
    angle = np.zeros(20)
    angle[10:] = np.deg2rad(25.0)
    turns = np.stack([np.sin(angle / 2), 0 * angle, 0 * angle, np.cos(angle / 2)], axis=1)
    task = task_of(np.zeros((20, 3)), turns)
    counting = Settings().replace({"fitness": {"orientation_weight": 0.2}})
    (step,) = continuity_warnings(task, counting, 1.2)
    assert "'hand' turns faster than any arm of 3 joints can follow with eps (at most 1.73e+03 deg/s)" in step.sentence
    assert step.details["fastest"] == pytest.approx(2500.0)
    assert continuity_warnings(task, Settings().replace({"fitness": {"orientation_weight": 0.0}}), 1.2) == ()


def test_the_angle_between_frames(recording):
    rng = np.random.default_rng(3)
    axis = rng.normal(size=(50, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    angles = np.r_[rng.uniform(0, np.pi, 48), 1e-9, np.pi]
    turns = [np.eye(3)]
    for a, x in zip(angles, axis, strict=True):
        K = np.cross(np.eye(3), -x)
        turns.append(turns[-1] @ (np.eye(3) + np.sin(a) * K + (1 - np.cos(a)) * K @ K))
    np.testing.assert_allclose(turn_angles(np.array(turns)), angles, atol=1e-7)
