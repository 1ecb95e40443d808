"""Poses of a body from its markers."""

import numpy as np
import pytest

from armdesign.demonstration.files.quaternions import rotation_matrices
from armdesign.demonstration.points.rigid_fit import fit_rigid
from armdesign.errors import TaskError

RNG = np.random.default_rng(7)
STATE = RNG.bit_generator.state
NAMES = tuple("abcde")


@pytest.fixture(autouse=True)
def _same_numbers_whatever_runs_before():
    RNG.bit_generator.state = STATE


def rotations(count):
    q = np.cumsum(RNG.normal(scale=0.1, size=(count, 4)), axis=0) + np.array([0, 0, 0, 1])
    return rotation_matrices(q / np.linalg.norm(q, axis=1, keepdims=True))


def moving(n=5, frames=60, flat=False):
    angles = 2 * np.pi * np.arange(n) / n  # round a circle, so that any three of them span a triangle
    body = 0.05 * np.stack([np.cos(angles), np.sin(angles), np.zeros(n) if flat else RNG.normal(size=n)], axis=1)
    R, c = rotations(frames), RNG.normal(size=(frames, 3))
    return np.einsum("tij,nj->tni", R, body) + c[:, None], R


def hidden(markers, share):
    result = markers.copy()
    result[1:][RNG.random(markers[1:].shape[:2]) < share] = np.nan
    return result


def relative(R):
    return R @ R[:1].transpose(0, 2, 1)


@pytest.mark.parametrize(("n", "flat"), [(3, True), (4, False), (5, True), (5, False)])
def test_a_known_pose_comes_back_also_with_hidden_markers(n, flat):
    markers, R = moving(n, flat=flat)
    seen = hidden(markers, 0.3)
    fit = fit_rigid(seen, NAMES[:n], "here")
    enough = (~np.isnan(seen[:, :, 0])).sum(axis=1) >= 3
    np.testing.assert_array_equal(fit.known, enough)
    np.testing.assert_allclose(relative(fit.rotations)[enough], relative(R)[enough], atol=1e-12)
    np.testing.assert_allclose(fit.markers[enough], markers[enough], atol=1e-12)
    assert np.isnan(fit.rotations[~enough]).all()
    assert fit.rms < 1e-12
    assert fit.worst[0] < 1e-12
    np.testing.assert_allclose(np.linalg.det(fit.rotations[enough]), 1.0)


def test_quaternions_are_those_of_the_rotations_with_continuous_signs():
    fit = fit_rigid(hidden(moving()[0], 0.3), NAMES, "here")
    known = fit.known
    np.testing.assert_allclose(rotation_matrices(fit.quaternions[known]), fit.rotations[known], atol=1e-12)
    assert np.isnan(fit.quaternions[~known]).all()
    assert (np.sum(fit.quaternions[known][1:] * fit.quaternions[known][:-1], axis=1) > 0).all()


def test_turning_the_scene_turns_the_poses_and_scaling_leaves_them():
    markers, _ = moving()
    markers = markers + RNG.normal(scale=1e-3, size=markers.shape)
    Q = rotations(1)[0]
    fit = fit_rigid(markers, NAMES, "here")
    turned = fit_rigid(3.0 * markers @ Q.T + [1, 2, 3], NAMES, "here")
    np.testing.assert_allclose(turned.rotations, Q @ fit.rotations, atol=1e-9)
    np.testing.assert_allclose(turned.rms, 3.0 * fit.rms, rtol=1e-6)


def test_the_axes_are_those_of_the_markers():
    markers, _ = moving()
    fit = fit_rigid(markers, NAMES, "here")
    centre = markers.mean(axis=1)
    towards = (markers[:, 0] - centre) / np.linalg.norm(markers[:, 0] - centre, axis=1, keepdims=True)
    np.testing.assert_allclose(fit.rotations[:, :, 0], towards, atol=1e-12)
    second = np.einsum("tji,tj->ti", fit.rotations, markers[:, 1] - centre)
    np.testing.assert_allclose(second[:, 2], 0.0, atol=1e-12)
    assert (second[:, 1] > 0).all()


def test_the_residual_is_that_of_the_best_pose():
    markers, _ = moving()
    noisy = markers + RNG.normal(scale=1e-3, size=markers.shape)
    fit = fit_rigid(noisy, NAMES, "here")
    assert 0.5e-3 < fit.rms < 1.8e-3
    value, frame, marker = fit.worst
    assert value == fit.residuals[frame, marker] == np.nanmax(fit.residuals)
    best = (fit.residuals**2).sum(axis=1)
    for scale in (1e-4, 1e-3):
        turn = rotation_matrices(np.r_[RNG.normal(scale=scale, size=3), 1.0][None])[0]
        body = np.einsum("tij,nj->tni", turn @ fit.rotations, fit.template) + noisy.mean(axis=1, keepdims=True)
        assert (((noisy - body) ** 2).sum(axis=(1, 2)) >= best - 1e-15).all()


@pytest.mark.parametrize("beside", [0.0, 1e-4])
def test_markers_on_a_line_are_refused(beside):
    body = np.array([[0, 0, 0], [0.1, beside, 0], [0.2, 0, 0]])
    markers = np.einsum("tij,nj->tni", rotations(20), body)
    with pytest.raises(TaskError, match=r"here: a, b, c lie on one line \(.* mm along it, .* beside it\)"):
        fit_rigid(markers, NAMES[:3], "here")


def test_frames_whose_markers_are_on_a_line_have_no_pose():
    body = np.array([[0, 0, 0], [0.1, 0, 0], [0.2, 0, 0], [0.1, 0.1, 0]])
    markers = np.einsum("tij,nj->tni", rotations(20), body)
    markers[5, 3] = np.nan
    markers[6, 0] = np.nan
    assert fit_rigid(markers, NAMES[:4], "here").known.tolist() == [True] * 5 + [False] + [True] * 14


def test_too_few_markers_are_refused():
    with pytest.raises(TaskError, match=r"here: a, b cannot tell an orientation. Name three or more"):
        fit_rigid(np.zeros((5, 2, 3)), NAMES[:2], "here")


def test_markers_never_seen_together_are_refused():
    markers, _ = moving(3)
    markers[::2, 0] = np.nan
    markers[1::2, 1] = np.nan
    with pytest.raises(TaskError, match="a, b, c are never all seen in one frame"):
        fit_rigid(markers, NAMES[:3], "here")
