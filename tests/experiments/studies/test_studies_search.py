"""The study of the searches: what its columns say, and the record to beat."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from armdesign.demonstration import read_recording
from armdesign.errors import SettingsError
from armdesign.experiments.studies.best_known import Best, better_of, fingerprint, read_best, write_best
from armdesign.experiments.studies.search_study import Run, defaults, plan, rows_of, tables
from armdesign.experiments.studies.study_plan import StudyRequest
from armdesign.search.evaluation import evaluate_candidate
from armdesign.search.prepare import prepare
from armdesign.settings.sections import Settings, read_settings

RECORDING = Path(__file__).resolve().parents[3] / "examples" / "packaging.csv"


def prepared(**changes):
    return prepare(read_recording(RECORDING), Settings().replace({"task": {"recording": str(RECORDING)}, **changes}))


def run(*best, step=100):
    bests = np.array(best, dtype=float)
    told = step * np.arange(1.0, len(bests) + 1)
    return Run(float(bests[-1]), int(told[-1]), 2.0, bests, told)


def test_a_row_counts_who_comes_near_and_when():
    runs = [run(np.inf, 0.2, 0.1005), run(0.3, 0.1, 0.1), run(0.4, 0.3, 0.2)]
    runs = [replace(each, sure=sure) for each, sure in zip(runs, (True, False, True), strict=True)]
    (row,) = rows_of((3, "a", "multibasin"), {(3, "a", "multibasin"): runs}, 0.1, 300)
    n, task, name, seeds, best, median, lowest, highest, within, candidates, reached, seconds, sure, wrong = row
    assert (sure, wrong) == (2, 1)
    assert (n, task, name, seeds, best) == (3, "a", "multibasin", 3, 0.1)
    assert (median, lowest, highest) == (0.1005, 0.1, 0.2)
    assert within == pytest.approx(200 / 3)
    assert (candidates, reached, seconds) == (300, 300, 2.0)


def test_a_search_with_more_candidates_is_shown_at_the_budget_as_well():
    rows = rows_of((3, "a", "pso"), {(3, "a", "pso"): [run(0.3, 0.2, 0.1)]}, 0.1, 200)
    assert [row[2] for row in rows] == ["pso at 200", "pso"]
    assert [row[5] for row in rows] == [0.2, 0.1]


def test_half_of_the_seeds_never_near_is_never():
    (row,) = rows_of((3, "a", "pso"), {(3, "a", "pso"): [run(0.3), run(0.4)]}, 0.1, 100)
    assert row[8:11] == (0.0, 100.0, np.inf)


def test_a_curve_is_infinite_before_its_first_batch():
    assert run(0.3, 0.2).at(99) == np.inf
    assert run(0.3, 0.2).at(100) == 0.3
    assert run(0.3, 0.2).at(10**9) == 0.2


def study_request(**options):
    usual = defaults(quick=True)
    return StudyRequest("search", ("packaging",), (3,), 2, 0, {**usual.options, **options})


def test_plan_has_every_algorithm_with_every_seed():
    ready = prepared()
    units = plan(study_request(budget=500, swarms=4000), {("packaging", 3): ready})
    searches = [unit.problem.settings.search for unit in units]
    assert {(each.algorithm, each.seed) for each in searches} == {
        (name, seed) for name in ("multibasin", "rapso") for seed in (0, 1)
    }
    for each in searches:
        assert each.candidates == (500 if each.algorithm == "multibasin" else 4000)
    assert len({unit.name for unit in units}) == len(units)
    assert tables(study_request(), []) != []


@pytest.mark.parametrize("options", [{"algorithms": ("abc",)}, {"budget": 3}, {"swarms": 0}])
def test_what_cannot_be_is_refused(options):
    with pytest.raises(SettingsError):
        plan(study_request(**options), {("packaging", 3): prepared()})


def test_fingerprint_is_of_the_fitness_not_of_the_search():
    plain = fingerprint(prepared())
    assert fingerprint(prepared(search={"seed": 7, "algorithm": "multibasin"})) == plain
    for changes in (
        {"design": {"dof": 4}},
        {"design": {"length": (0.6, 1.1)}},
        {"design": {"joint_limits": ((-90.0, 90.0),)}},
        {"fitness": {"lambda_E": 4.0}},
        {"task": {"recording": str(RECORDING), "rate": 25.0}},
    ):
        assert fingerprint(prepared(**changes)) != plain
    cell = {"obstacles": (str(RECORDING.with_name("packaging_cell.toml")),)}
    within = {fingerprint(prepared(cell=cell, body=body)) for body in ({}, {"kind": "tube", "clearance": 0.01})}
    assert len(within | {plain}) == 3


def test_the_record_is_kept_and_only_beaten_by_better_ones(tmp_path):
    one, two = Best("a", 3, 0.2, (1.0, 2.0), "pso"), Best("a", 3, 0.1, (1.5, 2.5), "rapso")
    assert better_of(None, one) is one
    assert better_of(one, two) is two
    assert better_of(two, one) is two
    write_best({"f": two}, tmp_path / "best.json")
    assert read_best(tmp_path / "best.json") == {"f": two}
    assert read_best(tmp_path / "none.json") == {}
    (tmp_path / "best.json").write_text("{", encoding="utf-8")
    with pytest.raises(SettingsError, match="cannot be read"):
        read_best(tmp_path / "best.json")


def test_the_record_of_the_examples_is_reproduced():
    benchmarks = RECORDING.parents[1] / "benchmarks"
    best = read_best(benchmarks / "best_known.json")
    for task in ("packaging", "welding", "packaging_cell", "welding_cell"):
        study = read_settings(benchmarks / "tasks" / f"{task}.toml")
        ready = prepare(read_recording(study.task.recording), study)
        known = best[fingerprint(ready)]
        assert known.dof == 3
        seen, found = evaluate_candidate(np.array(known.phi), ready)
        assert found.fitness == pytest.approx(known.fitness, rel=1e-4)
        assert fingerprint(seen) == fingerprint(ready)  # where a free base came to stand is part of the answer
