"""RA-PSO against PSO: the plan pairs the seeds, the table is the paper's, each claim is judged by the figures."""

import csv
from dataclasses import replace
from pathlib import Path

import pytest

from armdesign.demonstration import read_recording
from armdesign.errors import SettingsError
from armdesign.experiments.studies import rapso_study as rapso
from armdesign.experiments.studies.study_plan import Record, StudyRequest
from armdesign.search.prepare import prepare
from armdesign.settings.sections import Settings

ROOT = Path(__file__).resolve().parents[3]
INTERVALS = (2, 3, 4, 5)


@pytest.fixture(scope="module")
def study_request():
    return StudyRequest("rapso", ("packaging",), (3, 4), 6, 0, {"d": INTERVALS, "range": ("valid", "box")})


@pytest.fixture(scope="module")
def tasks():
    recording = read_recording(ROOT / "examples" / "packaging.csv")
    return {("packaging", n): prepare(recording, Settings().replace({"design": {"dof": n}})) for n in (3, 4)}


def records(study_request, tasks, fitness, effort):
    """Finished searches that found what the two functions of a unit's search settings say."""
    found = []
    for unit in rapso.plan(study_request, tasks):
        search = unit.problem.settings.search
        content = {"fitness": fitness(search), "computational_effort": effort(search)}
        found.append(Record(unit, "finished", "", content, Path(unit.name)))
    return found


def luck(search):
    return 1.0 + 0.1 * search.seed


def factor(change):
    """Fitness or CE that RA-PSO changes by so much, by D."""
    return lambda s: luck(s) * (1.0 if s.algorithm == "pso" else 1.0 + change.get(s.angle_interval, 0.0) / 100.0)


def test_every_seed_has_its_pso_and_all_variants(study_request, tasks):
    units = rapso.plan(study_request, tasks)
    assert len({unit.name for unit in units}) == len(units) == 2 * 6 * (1 + 2 * 4)
    for n in study_request.dof:
        for seed in study_request.seeds:
            search = [
                u.problem.settings.search for u in units
                if u.problem.settings.design.dof == n and u.problem.settings.search.seed == seed
            ]  # fmt: skip
            assert sum(s.algorithm == "pso" for s in search) == 1
            variants = {(s.angle_interval, s.range) for s in search if s.algorithm == "rapso"}
            assert variants == {(D, reading) for D in INTERVALS for reading in ("valid", "box")}


def test_more_repetitions_keep_the_runs_there_are(study_request, tasks):
    few, many = ({u.name for u in rapso.plan(replace(study_request, reps=reps), tasks)} for reps in (2, 7))
    assert few < many


def test_table_holds_the_changes_in_percent(study_request, tasks):
    found = records(study_request, tasks, factor({2: -10.0, 3: 5.0}), factor(dict.fromkeys(INTERVALS, -75.0)))
    for table in rapso.tables(study_request, found):
        assert len(table.rows) == 3
        for row in table.rows:
            assert [cell.mean for cell in row[3:]] == pytest.approx([-10.0, 5.0, 0.0, 0.0] + 4 * [-75.0])


@pytest.mark.parametrize(
    ("fitness", "effort", "verdicts"),
    [
        ({2: -1.0, 3: 1.0, 4: 1.0, 5: 1.0}, -75.0, ("Here it holds", "it is even better", "Here it holds")),
        ({2: 3.0, 3: 1.0, 4: 5.0, 5: 5.0}, -75.0, ("Here it holds", "surely worse", "does not hold: D = 3")),
        ({2: -1.0, 3: 1.0, 4: 1.0, 5: 1.0}, -20.0, ("not surely by half", "even better", "Here it holds")),
        ({2: 0.0, 3: 1.0, 4: 1.0, 5: 1.0}, 10.0, ("at no D", "interval holds 0", "CE is not lower")),
    ],
)
def test_claims_are_judged_by_the_figures(study_request, tasks, fitness, effort, verdicts):
    found = records(study_request, tasks, factor(fitness), factor(dict.fromkeys(INTERVALS, effort)))
    for table in rapso.tables(study_request, found):
        for note, verdict in zip(table.notes, verdicts, strict=True):
            assert note.startswith("Paper: ")
            assert verdict in note


def test_seeds_without_all_variants_do_not_count(study_request, tasks):
    found = records(study_request, tasks, factor({2: -10.0}), factor({}))
    lost = {found[0].unit.name, found[-1].unit.name}
    kept = [r if r.unit.name not in lost else replace(r, state="failed", content={}) for r in found]
    valid, box = rapso.tables(study_request, kept)
    assert [row[2] for row in valid.rows] == [5, 6, 11]  # lost: the PSO of seed 0, and an RA-PSO of range = box
    assert [row[2] for row in box.rows] == [5, 5, 10]
    assert "too narrow" in box.notes[-1]
    assert valid.rows[0][3].mean == pytest.approx(-10.0)


@pytest.mark.parametrize("count", [0, 1, 9, 40])
def test_an_unfinished_study_has_its_tables_and_figure(study_request, tasks, tmp_path, count):
    found = records(study_request, tasks, factor({}), factor({}))
    part = [r if i < count else replace(r, state="waiting", content={}) for i, r in enumerate(found)]
    assert len(rapso.tables(study_request, part)) == 2
    rapso.figure(study_request, part).savefig(tmp_path / "figure.png")
    assert rapso.more(study_request, part, tmp_path) == ("intervals.csv",)


def test_intervals_are_written_in_full(study_request, tasks, tmp_path):
    found = records(study_request, tasks, factor({2: -10.0}), factor({}))
    rapso.more(study_request, found, tmp_path)
    with (tmp_path / "intervals.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 2 * 3 * 2 * 4
    changed = [row for row in rows if row["quantity"] == "fitness" and row["D"] == "2"]
    for name in ("change_percent", "low", "high"):
        assert [float(row[name]) for row in changed] == pytest.approx([-10.0] * 6)


def test_options_that_cannot_be_are_refused(study_request, tasks):
    for options in ({"d": (2,), "range": ("all",)}, {"d": (), "range": ("box",)}, {"d": (0,), "range": ("box",)}):
        with pytest.raises(SettingsError, match=r"allowed|empty"):
            rapso.plan(replace(study_request, options=options), tasks)
