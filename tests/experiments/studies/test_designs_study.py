"""Fitness over the number of joints: the chosen n is that of the rule, the arms are those of the runs."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from armdesign.demonstration import read_recording
from armdesign.errors import SettingsError
from armdesign.experiments.auto_dof.dof_rule import Rule, choose_dof
from armdesign.experiments.studies import designs_study as designs
from armdesign.experiments.studies.study_plan import Record, StudyRequest
from armdesign.kinematics.dh_files import read_design
from armdesign.runs.resumable import carry_out
from armdesign.search.backends.backend import InProcess
from armdesign.search.prepare import prepare
from armdesign.settings.sections import Settings

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def study_request():
    return StudyRequest(
        "designs", ("packaging",), (3, 4, 5), 2, 0, {"algorithm": "rapso", "within": 4.0, "enough": 5.0}
    )


@pytest.fixture(scope="module")
def tasks():
    recording = read_recording(ROOT / "examples" / "packaging.csv")
    basis = Settings().replace({"task": {"rate": 5.0}, "search": {"particles": 12, "iterations": 3}})
    return {("packaging", n): prepare(recording, basis.replace({"design": {"dof": n}})) for n in (3, 4, 5)}


@pytest.fixture(scope="module")
def records(study_request, tasks, tmp_path_factory):
    """Small searches, carried out."""
    above, found = tmp_path_factory.mktemp("designs"), []
    for unit in designs.plan(study_request, tasks):
        place = above / unit.name
        place.mkdir()
        carry_out(place, unit.problem, InProcess(unit.problem), fresh=True)
        content = json.loads((place / "result.json").read_text(encoding="utf-8"))
        found.append(Record(unit, "finished", "", content, place))
    return found


def test_choice_is_that_of_the_rule(study_request, records):
    best = {}
    for n in study_request.dof:
        best[n] = min((r.content for r in records if r.dof == n), key=lambda content: content["fitness"])
    for within, enough in ((4.0, 5.0), (4.0, 0.0), (1000.0, 0.0), (0.0, 1e6)):
        (choice,) = designs.choices(
            replace(study_request, options=study_request.options | {"within": within, "enough": enough}), records
        )
        f = {n: content["path_fitness"] for n, content in best.items()}
        assert choice.chosen == choose_dof(f, Rule(within / 100.0, enough / 1e3))
        assert f"{1e3 * f[choice.chosen]:.2f} mm" in choice.explanation


def test_final_table_is_the_arm_in_the_papers_units(study_request, records):
    (choice,) = designs.choices(study_request, records)
    arm = read_design(choice.best[choice.chosen].folder / "result.json")
    _, table = designs.tables(study_request, records)
    assert [row[5] for row in table.rows] == [*map(str, range(choice.chosen)), "EE"]
    assert np.array([row[6:] for row in table.rows]) == pytest.approx(np.stack([arm.alpha, arm.a, arm.d], axis=1))
    r, f, E = table.rows[0][2:5]
    assert r == pytest.approx((15.0 * f + 5.0 * E) / 1e3)


def test_spread_is_over_the_seeds(study_request, records):
    table, _ = designs.tables(study_request, records)
    for row, n in zip(table.rows, study_request.dof, strict=True):
        values = [r.content["fitness"] for r in records if r.dof == n]
        assert row[2] == len(values)
        assert row[3].mean == pytest.approx(np.mean(values))
        assert row[3].spread == pytest.approx(np.std(values, ddof=1))
        assert row[6] == pytest.approx(min(values))
    assert sum("*" in row[1] for row in table.rows) == 1


@pytest.mark.parametrize("count", [0, 1, 3])
def test_an_unfinished_study_has_its_tables_and_figure(study_request, records, tmp_path, count):
    part = [r if i < count else replace(r, state="waiting", content={}) for i, r in enumerate(records)]
    assert len(designs.tables(study_request, part)) == 2
    designs.figure(study_request, part).savefig(tmp_path / "figure.png")


def test_nothing_is_explained_before_the_last_search_has_ended(study_request, records):
    part = [r if i == 0 else replace(r, state="waiting", content={}) for i, r in enumerate(records)]
    (choice,) = designs.choices(study_request, part)
    assert f"so far; {len(records) - 1} of {len(records)} searches have yet to end" in choice.explanation
    assert "the most that were to be tried" not in choice.explanation


def test_joints_without_an_arm_are_passed_over(study_request, records):
    part = [replace(r, state="failed", content={}) if r.dof == 3 else r for r in records]
    (choice,) = designs.choices(study_request, part)
    assert choice.chosen > 3
    assert "no arm of 3 was found" in choice.explanation.lower()


def test_chosen_arm_is_drawn_and_shown(study_request, records, tmp_path):
    names = designs.more(study_request, records, tmp_path)
    assert names == ("packaging-arm.png", "packaging-preview.html")
    assert (tmp_path / names[0]).read_bytes()[:4] == b"\x89PNG"
    assert "</html>" in (tmp_path / names[1]).read_text(encoding="utf-8")


def test_a_rule_that_cannot_be_is_refused(study_request, tasks):
    with pytest.raises(SettingsError, match="--within is -1"):
        designs.plan(replace(study_request, options=study_request.options | {"within": -1.0}), tasks)
