"""Searches whose answer is known: an arm that made its task is found again, and what has no answer says why."""

import numpy as np
import pinocchio as pin
import pytest

from armdesign.demonstration import Recording
from armdesign.errors import SearchError, SettingsError
from armdesign.kinematics.dh import DHTable
from armdesign.search.evaluation import evaluate_design
from armdesign.search.prepare import prepare
from armdesign.search.search import search
from armdesign.settings.sections import Settings


def generated(rng, dof):
    """An arm, and a recording of three points on it while its joints turn smoothly."""
    rows = np.zeros((dof + 1, 3))
    rows[:, 0] = rng.uniform(0.4, 1.2, dof + 1) * rng.choice([-1, 1], dof + 1)
    rows[1:-1, 1:] = rng.uniform(0.05, 0.4 / dof, (dof - 1, 2)) + 0.05
    rows[-1, 2] = 0.1
    table = DHTable.from_rows(rows)
    time = np.arange(30) / 50.0
    phase, size = rng.uniform(0, 2 * np.pi, dof), rng.uniform(0.1, 0.3, dof)
    return table, time, rng.uniform(-1, 1, dof) + size * np.sin(2.0 * time[:, None] + phase)


def recording_of(table, time, path, outside, oriented):
    """Markers at fixed places on the arm, the last at its end."""
    sigma = np.array([0.35, 0.7, 1.0])
    P = np.stack([outside.at(outside.corners(table, q), sigma) for q in path])
    points = {name: P[:, i] for i, name in enumerate(("upper", "fore", "hand"))}
    turns = {"hand": np.array([pin.Quaternion(table.frames(q)[-1][:3, :3]).coeffs() for q in path])} if oriented else {}
    return Recording(time, points, turns, "generated")


def neighbourhood(table, angle, length):
    """Bounds around every entry that is not fixed."""
    bounds = {}
    for i in range(table.dof + 1):
        label = "tool" if i == table.dof else i
        degrees = float(np.rad2deg(table.alpha[i]))
        bounds[f"alpha_{label}"] = (degrees - angle, degrees + angle)
        if 0 < i < table.dof:
            for column in ("a", "d"):
                value = float(getattr(table, column)[i])
                bounds[f"{column}_{label}"] = (value - length, value + length)
    return bounds


@pytest.mark.parametrize(("dof", "oriented"), [(3, False), (4, False), (6, True)])
def test_arm_that_made_the_task_is_found_in_its_neighbourhood(outside, dof, oriented):
    table, time, path = generated(np.random.default_rng(dof), dof)
    settings = Settings().replace(
        {
            "task": {"base": "origin"},
            "design": {"dof": dof, "bounds": neighbourhood(table, 0.2, 1e-3), "length": (0.2, 2.0)},
            "fitness": {
                "scenario": "welding" if oriented else "packaging",
                "mount": "identity",
                "lambda_E": 0.0,
                "reach_tolerance": 0.005,
            },
            "search": {"particles": 16, "iterations": 5},
        }
    )
    prepared = prepare(recording_of(table, time, path, outside, oriented), settings)
    exact = evaluate_design(table, prepared)
    assert exact.path_fitness < 1e-5
    assert exact.path.start_error < 1e-4
    found = search(prepared)
    assert found.evaluation.path_fitness < 2e-3
    assert found.evaluation.path_fitness > exact.path_fitness
    assert (np.abs(found.evaluation.table.a - table.a) <= 1e-3 + 1e-12).all()


def test_search_that_cannot_reach_tells_the_nearest(prepared_for):
    prepared = prepared_for(design={"dof": 2}, search={"particles": 5, "iterations": 1})
    with pytest.raises(
        SearchError, match=r"within 1 mm of the hand's first point: the nearest stopped [\d.]+ mm short"
    ) as raised:
        search(prepared)
    assert 1e-3 < raised.value.value < 1.0
    assert f"{1e3 * raised.value.value:.1f} mm" in str(raised.value)
    assert "more joints" in str(raised.value)


def test_arms_too_short_by_their_bounds_are_told_apart(prepared_for):
    """No start is solved where no arm is long enough; there is no nearest then."""
    design = {"bounds": {f"d_{i}": (0.0, 0.001) for i in range(1, 6)} | {f"a_{i}": (0.01, 0.02) for i in range(1, 6)}}
    prepared = prepared_for(design=design | {"dof": 6, "length": (0.1, 1.2)})
    with pytest.raises(SearchError, match="first point: none came near it"):
        search(prepared)


def test_bounds_that_leave_no_arm_are_refused(prepared_for, monkeypatch):
    monkeypatch.setattr("armdesign.fitness.constraints.SAMPLE_BATCHES", 20)  # gives up sooner
    prepared = prepared_for(design={"alpha": (0.0, 0.5), "a": (0.0, 0.0)})  # all joints on one axis
    with pytest.raises(SettingsError, match=r"no arm within the bounds .*no two joints on one axis"):
        search(prepared)
