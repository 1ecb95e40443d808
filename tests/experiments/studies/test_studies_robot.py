"""The study of searches: all spend the same, from the same first generation, and the tables say what they found."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from armdesign import Settings, prepare, read_recording
from armdesign.errors import SearchError, SettingsError
from armdesign.experiments.studies import robot_study as robot
from armdesign.experiments.studies.study_engine import planned
from armdesign.experiments.studies.study_plan import Record, StudyRequest
from armdesign.experiments.studies.study_registry import perform
from armdesign.experiments.sweep.units import UnitJob, begin_unit, carry_out_unit

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
SMALL = {"particles": 8, "iterations": 5}


@pytest.fixture(scope="module")
def study_request():
    return StudyRequest("robot", ("packaging",), (4,), 2, 3, {"algorithms": tuple(robot.TITLES)})


@pytest.fixture(scope="module")
def tasks():
    recording = read_recording(EXAMPLES / "packaging.csv")
    return {("packaging", 4): prepare(recording, Settings().replace({"design": {"dof": 4}, "search": SMALL}))}


@pytest.fixture(scope="module")
def records(study_request, tasks, tmp_path_factory):
    """What all units found."""
    folder, found = tmp_path_factory.mktemp("robot"), []
    for unit in planned(study_request, tasks):
        place = begin_unit(folder, unit)
        outcome = carry_out_unit(UnitJob(place, perform))
        assert outcome.state == "finished", outcome.reason
        result = place / ("result.json" if unit.work is None else "record.json")
        content = json.loads(result.read_text())
        found.append(Record(unit, "finished", "", content.get("found", content), place, content["wall_time"]))
    return found


def test_every_search_spends_the_same_evaluations(records):
    assert {record.content["evaluations"] for record in records} == {SMALL["particles"] * SMALL["iterations"]}


def test_what_is_told_is_the_fitness_of_the_design(records, tasks):
    objective = tasks["packaging", 4].objective()
    for record in records:
        if record.unit.work is not None:
            scores, _ = objective.evaluate([record.content["Phi"]])
            assert scores.fitness[0] == pytest.approx(record.content["fitness"], rel=1e-9)


def test_no_search_ends_above_the_best_of_the_common_first_generation(records, tasks):
    prepared = tasks["packaging", 4]
    for record in records:
        first = prepared.space.sample(np.random.default_rng(record.seed), SMALL["particles"])
        scores, _ = prepared.objective().evaluate(first)
        assert record.content["fitness"] <= scores.fitness.min() * (1.0 + 1e-9)


def test_tables_hold_means_over_the_runs(study_request, records):
    summary, joints = robot.tables(study_request, records)
    for row, algorithm in zip(summary.rows, robot.TITLES, strict=True):
        values = [record.content["fitness"] for record in records if record.algorithm == algorithm]
        assert row[0] == robot.TITLES[algorithm]
        assert row[1].mean == row[2].mean == pytest.approx(np.mean(values))
        assert row[1].spread == pytest.approx(np.std(values, ddof=1))
        assert row[-1] == "2/2"
    assert len(joints.rows) == len(robot.TITLES)
    assert robot.figure(study_request, records).axes


def test_tables_cope_with_runs_that_are_missing(study_request, records):
    missing = [Record(record.unit, "failed", "why", {}, record.folder) for record in records[:2]]
    summary, _ = robot.tables(study_request, [*missing, *records[2:]])
    assert summary.rows[0][1] is None
    assert summary.rows[0][-1] == "0/2"
    assert robot.figure(study_request, missing).axes


def test_search_without_a_valid_arm_says_so(tasks):
    unreachable = tasks["packaging", 4].with_settings({"fitness": {"reach_tolerance": 1e-12}})
    with pytest.raises(SearchError, match="no valid arm was found in 40 evaluations"):
        robot.perform(unreachable, {"algorithm": "ga", "seed": 0}, lambda *report: None)


def test_unknown_algorithm_and_too_few_iterations_are_refused(study_request, tasks):
    with pytest.raises(SettingsError, match="no search algorithm 'de'; allowed: abc, ga, pso-opytimizer"):
        robot.plan(StudyRequest("robot", study_request.tasks, study_request.dof, 1, 0, {"algorithms": ("de",)}), tasks)
    recording = read_recording(EXAMPLES / "packaging.csv")
    short = {"packaging": prepare(recording, Settings().replace({"design": {"dof": 4}, "search": {"iterations": 3}}))}
    with pytest.raises(SettingsError, match="a budget of 1200 evaluations is too small"):
        robot.plan(study_request, {("packaging", 4): short["packaging"]})


@pytest.mark.parametrize("setting", [{"patience": 2}, {"target": 0.3}, {"time_limit": 60.0}, {"first": [[0.0] * 11]}])
def test_settings_that_would_make_the_searches_unequal_are_refused(study_request, tasks, setting):
    prepared = tasks["packaging", 4]
    unequal = replace(prepared, settings=prepared.settings.replace({"search": setting}))
    with pytest.raises(SettingsError, match=f"search.{next(iter(setting))} is set, but the searches"):
        robot.plan(study_request, {("packaging", 4): unequal})
