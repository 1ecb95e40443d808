"""Numbers that stand for what was not seen become gaps, whatever the format."""

from dataclasses import replace

import numpy as np
import pytest

from armdesign.demonstration.points.unseen import hide_unseen
from armdesign.demonstration.recording import Take

FRAMES, HIDDEN = 60, slice(20, 32)


@pytest.fixture
def take():
    rng = np.random.default_rng(0)
    walk = 1000.0 + np.cumsum(rng.normal(scale=3.0, size=(4, FRAMES, 3)), axis=1)
    return Take(np.arange(FRAMES) / 100.0, dict(zip("abcd", walk, strict=True)), {}, "take", "TRC")


def with_point(take, values, where=HIDDEN):
    path = take.points["b"].copy()
    path[where] = values
    return replace(take, points={**take.points, "b": path})


def gaps(take):
    return {name: int(np.isnan(values[:, 0]).sum()) for name, values in take.points.items()}


@pytest.mark.parametrize(
    ("value", "kind"), [(0.0, "zeros"), (-9999.0, "sentinels"), (9999999.0, "sentinels"), (-16512.0, "sentinels")]
)
def test_zeros_and_sentinels_are_gaps(take, value, kind):
    found = hide_unseen(with_point(take, value))
    assert gaps(found) == {"a": 0, "b": 12, "c": 0, "d": 0}
    (step,) = found.steps
    assert step.name == kind
    assert "0.2 s to 0.31 s" in step.sentence
    assert step.details == {"count": 12, "points": {"b": 12}}
    assert np.array_equal(found.points["b"][32:], take.points["b"][32:])


def test_a_marker_that_is_held_and_jumps_then_is_a_gap(take):
    path = take.points["b"] + np.linspace(0.0, 900.0, FRAMES)[:, None]
    found = hide_unseen(with_point(replace(take, points={**take.points, "b": path}), path[19]))
    assert gaps(found)["b"] == 12
    assert [step.name for step in found.steps] == ["held"]


def test_a_marker_that_lies_still_stays_with_a_doubt(take):
    path = take.points["b"].copy()
    path[20:] += path[19] - path[31]
    found = hide_unseen(with_point(replace(take, points={**take.points, "b": path}), path[19]))
    assert gaps(found)["b"] == 0
    (step,) = found.steps
    assert step.name == "still"
    assert "0.19 s to 0.31 s" in step.sentence


def test_nothing_else_is_touched(take):
    assert hide_unseen(take) is take
    held = with_point(take, take.points["b"][0], slice(None))  # a marker on the table
    assert hide_unseen(held) is held
    for how in ({"captured": False}, {"solved": True}):  # at the origin by a pose, or counted from there
        zero = replace(with_point(take, 0.0), **how)
        assert hide_unseen(zero) is zero
    equal = with_point(take, 1010.0)  # three equal numbers where everything is
    assert gaps(hide_unseen(equal))["b"] == 0
