"""Tolerances: first order against drawn arms, closed forms, and what calibration gives back."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import armdesign
from armdesign.building.tolerance import (
    Tolerances,
    clearance_sigma,
    gaps,
    importance,
    near_spots,
    sensitivities,
    tolerance,
    tool_points,
)
from armdesign.cli import app
from armdesign.errors import SettingsError
from armdesign.fitness.block import as_rows
from armdesign.kinematics.dh import DHTable
from armdesign.runs.writing import write_result

EXAMPLE = Path(__file__).parents[2] / "examples" / "packaging.csv"


@pytest.fixture(scope="module")
def design():
    return armdesign.design(EXAMPLE, dof=4, budget=300, kind="thin")


@pytest.fixture(scope="module")
def tube():
    return armdesign.design(EXAMPLE, dof=3, budget=300, rate=10.0, kind="tube")


def random_table(rng, n):
    rows = np.c_[rng.uniform(-2, 2, n + 1), rng.uniform(-0.3, 0.3, (n + 1, 2)), rng.uniform(-1, 1, n + 1)]
    return DHTable.from_rows(rows, rng.uniform(-1, 1), "".join(rng.choice(["R", "R", "P"], n)))


def test_tool_points_are_those_of_the_table():
    rng = np.random.default_rng(0)
    for n in (1, 3, 6):
        table, q = random_table(rng, n), rng.uniform(-1, 1, (4, n))
        points = tool_points(as_rows([table])[0], table.base_yaw, q, table.prismatic)[0]
        assert points == pytest.approx(np.array([table.frames(each)[-1, :3, 3] for each in q]))


def test_sensitivities_in_closed_form():
    table, q = DHTable.from_rows([(0, 0, 0.1), (0, 0.4, 0), (0, 0.3, 0)]), np.array([[0.0, 0.0], [0.3, 0.5]])
    J = sensitivities(table, q)
    # stretched along x: a zero turns all behind it, a length moves along it, a twist of what lies on its axis nothing
    assert J[0, :, 0, 3] == pytest.approx([0, 0.7, 0], abs=1e-8)
    assert J[0, :, 1, 3] == pytest.approx([0, 0.3, 0], abs=1e-8)
    assert J[0, :, 2, 1] == pytest.approx([1, 0, 0], abs=1e-8)
    assert J[0, :, 1, 0] == pytest.approx([0, 0, 0], abs=1e-8)
    assert J[1, :, 2, 1] == pytest.approx([np.cos(0.8), np.sin(0.8), 0], abs=1e-8)


@pytest.mark.parametrize("uniform", [False, True])
def test_first_order_and_drawn_arms_agree(design, uniform):
    report = tolerance(design, Tolerances(samples=2000, uniform=uniform))
    assert report.moved == pytest.approx(report.first_order, rel=0.05)
    assert sum(share.moved**2 for share in report.budget) == pytest.approx(report.first_order**2)
    assert report.band.nominal <= report.band.p95
    assert report.calibrated.p95 < report.band.p95


def test_budget_is_in_proportion_and_seeds_repeat(design):
    one, two = (tolerance(design, Tolerances(5e-4 * k, 0.003 * k, 0.002 * k, samples=200)) for k in (1, 2))
    assert two.first_order == pytest.approx(2.0 * one.first_order)
    assert one == tolerance(design, Tolerances(5e-4, 0.003, 0.002, samples=200))
    lengths = tolerance(design, Tolerances(1e-3, 0.0, 0.0, samples=100)).budget
    moved = [share.moved for share in lengths if share.name.startswith(("a_", "d_"))]
    assert moved == pytest.approx([5e-4] * 10, rel=1e-6)


def test_distribution_by_part():
    chosen = Tolerances(uniform=("length",))
    sigmas = chosen.sigmas(3)
    drawn = chosen.drawn(np.random.default_rng(0), sigmas, 20000)
    assert np.std(drawn, axis=0) == pytest.approx(sigmas, rel=0.05)
    assert np.abs(drawn[..., 1:3]).max() <= chosen.length < np.abs(drawn[..., 1:3]).max() * 1.001
    assert np.mean(np.abs(drawn[..., 3]) < chosen.zero) == pytest.approx(0.9545, abs=0.01)


def test_importance_is_sorted_and_names_free_entries(design):
    found = importance(design)
    space = design.problem.space
    assert {each.name for each in found} == {n for n, free in zip(space.names, space.free, strict=True) if free}
    assert [each.worse for each in found] == sorted((each.worse for each in found), reverse=True)
    assert found[0].worse > 0.0


def test_commands_and_bad_input(tube, tmp_path):
    write_result(tmp_path / "run", tube)
    run = CliRunner().invoke
    outcome = run(app, ["tolerance", str(tmp_path / "run"), "--samples", "100", "--length", "1mm uniform"])
    assert (outcome.exit_code, "matters most" in outcome.stdout) == (0, True)
    assert run(app, ["importance", str(tmp_path / "run")]).exit_code == 0
    assert run(app, ["tolerance", str(tmp_path / "run"), "--twist", "much"]).exit_code == 2
    for bad in ({"samples": 1}, {"length": -1.0}, {"length": 0.0, "twist": 0.0, "zero": 0.0}, {"uniform": ["d"]}):
        with pytest.raises(SettingsError):
            Tolerances(**bad)


def test_clearance_of_drawn_arms_agrees_with_its_first_order(tube):
    """In the frame in which an arm is nearest to itself, far from a change of the nearest pair."""
    chosen, spots = Tolerances(uniform=True), near_spots(tube)[:1]
    rows, sigmas = as_rows([tube.table])[0], chosen.sigmas(3)
    drawn = chosen.drawn(np.random.default_rng(0), sigmas, 400)
    found = gaps(tube, spots, rows + drawn)
    assert np.std(found) == pytest.approx(clearance_sigma(tube, spots, sigmas), rel=0.05)
    assert float(gaps(tube, spots, rows)[0]) == pytest.approx(tube.verdict.self_clearance.value, abs=1e-3)
    report = tolerance(tube, Tolerances(samples=20))
    assert report.clearance.p5 <= report.clearance.median
    assert report.calibrated_clearance.arms <= report.clearance.arms == 20
