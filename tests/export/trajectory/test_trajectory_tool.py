"""What smoothing a run's path changes: its joints, its tool."""

import numpy as np
import pytest

from armdesign.export.trajectory.tool_poses import tool_deviation, tool_poses
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.motion import fit_path, peak_times

ARM = DHTable.from_rows([(0.5, 0, 0), (-1.57, 0.11, 0), (-0.27, 0.4, -0.2), (-1.57, 0, 0.1)], base_yaw=0.3)


def test_the_stated_joint_deviation_is_the_largest_at_the_frames(run):
    task, q = run.problem.task, run.evaluation.path.q
    path = fit_path(task.time, q, run.limits)
    np.testing.assert_allclose(path.deviation, np.abs(path.at(task.time) - q).max(axis=0), atol=1e-13)
    assert 0.0 < np.degrees(path.deviation.max()) < 5.0
    assert not path.bounded


def test_a_higher_cutoff_follows_closer_and_accelerates_more(run):
    task, q = run.problem.task, run.evaluation.path.q
    paths = [fit_path(task.time, q, cutoff=cutoff) for cutoff in (3.0, 6.0, 12.0)]
    deviations = [path.deviation.max() for path in paths]
    peaks = [np.abs(path.at(peak_times(path), 2)).max() for path in paths]
    assert deviations == sorted(deviations, reverse=True)
    assert peaks == sorted(peaks)


def test_tool_poses_are_those_of_the_matrix_products():
    q = np.random.default_rng(2).uniform(-3, 3, (7, 3))
    np.testing.assert_allclose(tool_poses(ARM, q), [ARM.frames(row)[-1] for row in q], atol=1e-13)


def test_the_end_effector_deviation_is_that_of_brute_force(run):
    task, q = run.problem.task, run.evaluation.path.q
    path = fit_path(task.time, q)
    found = tool_deviation(run.table, q, path)
    for t in (0, 17, len(q) // 2, len(q) - 1):
        solved, fitted = run.table.frames(q[t])[-1], run.table.frames(path.at(task.time[t]))[-1]
        assert found.distance[t] == pytest.approx(np.linalg.norm(solved[:3, 3] - fitted[:3, 3]), abs=1e-12)
        cosine = (np.trace(solved[:3, :3].T @ fitted[:3, :3]) - 1.0) / 2.0
        assert np.cos(found.angle[t]) == pytest.approx(cosine, abs=1e-12)
    assert found.distance.max() < 0.01


def test_smoothing_hardly_changes_how_well_the_hand_is_followed(run):
    task, q = run.problem.task, run.evaluation.path.q
    path = fit_path(task.time, q)
    solved, fitted = (
        np.linalg.norm(tool_poses(run.table, angles)[:, :3, 3] - task.P[:, -1], axis=1).mean()
        for angles in (q, path.at(task.time))
    )
    assert fitted < solved + 5e-4
