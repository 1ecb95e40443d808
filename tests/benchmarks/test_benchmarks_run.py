from __future__ import annotations

import importlib
import json
import sys
from pathlib import Path

import numpy as np
import pytest

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"
HEADERS = {"T": "us/frame", "m": "us/frame", "n": "us/frame", "N": "us/candidate"}


@pytest.fixture
def bench(monkeypatch):
    """Import a module of the benchmarks."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    return importlib.import_module


def test_command_prints_its_tables_and_writes_them_as_json(tmp_path, bench, monkeypatch, capsys):
    out = tmp_path / "out.json"
    monkeypatch.setattr(sys, "argv", ["run.py", "--quick", "--only", "sizes", "--out", str(out)])
    monkeypatch.setattr(bench("plan").Plan, "repeats", 1)
    bench("run").main()
    printed, report = capsys.readouterr().out, json.loads(out.read_text(encoding="utf-8"))
    assert list(report["tables"]) == list(HEADERS)
    assert {"cpu", "cores", "python", "numpy", "pinocchio", "numba", "load average"} <= set(report["machine"])
    for name, table in report["tables"].items():
        assert table["title"] in printed
        assert all(row[HEADERS[name]] > 0.0 and row.keys() == table["rows"][0].keys() for row in table["rows"])
    assert [path.name for path in tmp_path.iterdir()] == ["out.json"]


def test_missing_recordings_are_told(tmp_path, bench):
    plan = bench("plan").make_plan(True, tmp_path)
    assert [job.name for job in plan.jobs] == ["packaging", "welding"]
    assert ["box_lift.csv" in note or "handover_giver.csv" in note for note in plan.notes] == [True, True]


@pytest.mark.parametrize("dof", [3, 5])
def test_plain_evaluation_gives_the_same_f_and_E(dof, bench):
    plan, walks, plain = bench("plan"), bench("walks"), bench("plain")
    design_problem = plan.PACKAGING.problem(dof, solver={"second_order": False})
    problem, space = design_problem.path_problem, design_problem.space
    Phi = plan.designs(design_problem, 60)
    starts = walks.seek_starts(problem, *space.rows(Phi))
    arms = np.flatnonzero(starts.valid)[:3]
    rows, yaw = space.rows(Phi[arms])
    scores = walks.PathWalker(problem).walk(rows, yaw, starts.poses[arms]).scores
    paths = [plain.PlainArm(space.table(Phi[k]), problem).follow(starts.poses[k]) for k in arms]
    assert np.allclose([path.f for path in paths], scores.path_fitness, rtol=1e-3)
    assert np.allclose([path.E for path in paths], scores.area, rtol=1e-3)


@pytest.mark.parametrize("dof", [3, 6])
def test_phases_apart_add_up_to_the_whole(dof, bench):
    plan, walks = bench("plan"), bench("walks")
    design_problem = plan.WELDING.problem(dof)
    problem = design_problem.path_problem
    rows, yaw = design_problem.space.rows(plan.designs(design_problem, 30))
    whole = walks.BlockEvaluator(problem).evaluate(rows, yaw)
    starts = walks.seek_starts(problem, rows, yaw)
    arms = np.flatnonzero(whole.valid)
    walked = walks.PathWalker(problem).walk(rows[arms], yaw[arms], starts.poses[arms]).scores
    assert np.array_equal(starts.valid, whole.valid)
    assert np.array_equal(starts.steps, whole.start_steps)
    assert np.array_equal(walked.steps, (whole.steps - whole.start_steps)[arms])
    assert np.array_equal(walked.fitness, whole.fitness[arms])


def test_points_along_the_arm_end_at_the_hand_and_tiling_keeps_the_pace(bench):
    plan = bench("plan")
    problem = plan.WELDING.problem(3)
    P = problem.task.P
    assert all(np.allclose(plan.with_points(problem, m).task.P[:, -1], P[:, -1]) for m in (1, 2, 5))
    longer = plan.tiled(problem, 500).task
    assert longer.P.shape == (500, *P.shape[1:])
    assert longer.R.shape == (500, 3, 3)
    fastest = np.abs(np.diff(P, axis=0)).max()
    assert np.abs(np.diff(longer.P, axis=0)).max() == pytest.approx(fastest)
