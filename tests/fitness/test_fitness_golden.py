"""Golden values: g, sigma, distances, E_t, f, E and r of an independent implementation, to 1e-9."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import plain_reference
import pytest
from scenes import full_turn, problem_for

from armdesign.fitness.block import BlockEvaluator
from armdesign.kinematics.dh import DHTable

FILES = sorted((Path(__file__).parents[1] / "data" / "golden").glob("*.json"))


def load(path):
    golden = json.loads(path.read_text(encoding="utf-8"))
    R = None if golden["rotations"] is None else np.array(golden["rotations"])
    return golden, np.array(golden["dh"]), np.array(golden["joints"]), np.array(golden["markers"]), R


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_replayed_joints_give_the_golden_values(path):
    golden, dh, q, P, R = load(path)
    others = {name: golden[name] for name in ("lambda_f", "lambda_E", "delta")}
    problem = problem_for(
        P, golden["n"], golden["weights"], R=R, w_0=golden["orientation_weight"], limits=full_turn(golden["n"]),
        orientation_metric=golden["metric"], mount="identity", **others,
    )  # fmt: skip
    table = DHTable.from_rows(dh)
    result = BlockEvaluator(problem, block=2).replay(table, q)
    assert table.length == pytest.approx(golden["length"], abs=1e-12)
    for name in ("g", "area", "sigma", "distance"):
        np.testing.assert_allclose(getattr(result, name), golden[name], rtol=0.0, atol=1e-9, err_msg=name)
    f, E = result.g.mean(), result.area.mean()
    r = golden["lambda_f"] * f + golden["lambda_E"] * E
    np.testing.assert_allclose([f, E, r], [golden["f"], golden["E"], golden["fitness"]], rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_the_plain_reference_agrees_with_them(path):
    golden, dh, q, P, R = load(path)
    g, E, sigma, distance, _ = plain_reference.path(
        dh, 0.0, q, P, golden["weights"], w_0=golden["orientation_weight"], R=R, metric=golden["metric"],
        delta=golden["delta"],
    )  # fmt: skip
    for found, name in ((g, "g"), (E, "area"), (sigma, "sigma"), (distance, "distance")):
        np.testing.assert_allclose(found, golden[name], rtol=0.0, atol=1e-9, err_msg=name)


def test_the_golden_files_cover_all_metrics_and_sizes():
    names = {path.stem for path in FILES}
    assert len(names) == 12
    assert {name.split("_")[1] for name in names} == {"position", "geodesic", "euler"}
