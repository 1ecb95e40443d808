"""The engine: a study that was stopped, killed or extended holds the same as one that was not."""

import csv
import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from matplotlib.text import Text

from armdesign import Settings, prepare, read_recording
from armdesign.errors import RunFolderError, SettingsError
from armdesign.experiments.studies import temporal_study as temporal
from armdesign.experiments.studies.study_engine import legible, planned, run_study
from armdesign.experiments.studies.study_plan import StudyRequest
from armdesign.experiments.studies.study_registry import perform
from armdesign.experiments.studies.study_store import read_study_folder
from armdesign.experiments.studies.temporal_study import draw_solvers
from armdesign.experiments.sweep.jobs import Reporter, carry_out_work
from armdesign.experiments.sweep.units import carry_out_unit, unit_worker
from armdesign.search.backends.processes import WorkerProcesses
from armdesign.search.backends.workers import Event, JobContext
from armdesign.views.report.drawing import png

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
SOLVERS = ("slsqp", "dls-1")


class Here:
    """This process; it can be told to break down after so many units, or to share no disk."""

    def __init__(self, most=1000, share_disk=True):
        self.most, self.share_disk, self.jobs, self.taken = most, share_disk, [], []

    def room(self):
        return 1 - len(self.jobs)

    def begin(self, job):
        if len(self.taken) == self.most:
            raise KeyboardInterrupt
        self.jobs.append(job)
        self.taken.append(job.content.place.name)

    def wait(self, timeout):
        job = self.jobs.pop()
        return [Event(job, "answer", carry_out_unit(job.content))]

    def interrupt(self):
        pass

    def close(self):
        pass


class Stopping(JobContext):
    """Asks for the end."""

    def stop_requested(self):
        return True


@pytest.fixture(scope="module")
def ask():
    """What a small study is asked, and its tasks."""
    recordings = {name: read_recording(EXAMPLES / f"{name}.csv") for name in ("packaging", "welding")}

    def make(tasks=("packaging",), dof=(3,), reps=2, changes=None, **options):
        prepared = {}
        for key in tasks:
            settings = Settings().replace({"fitness": {"scenario": key}}).replace(changes or {})
            for n in dof:
                prepared[key, n] = prepare(recordings[key], settings.replace({"design": {"dof": n}}))
        options = {"algorithms": SOLVERS, "budget": 400} | options
        return StudyRequest("temporal", tasks, dof, reps, 0, options), prepared

    return make


@pytest.fixture(scope="module")
def whole(ask, tmp_path_factory):
    """An undisturbed study."""
    folder = tmp_path_factory.mktemp("whole") / "study"
    run_study(folder, *ask(), lambda units: Here())
    return folder


@pytest.fixture
def copy(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "study")


def found(folder):
    """What every unit found, without times."""
    records = {}
    for path in sorted(folder.glob("*/record.json")):
        record = json.loads(path.read_text())["found"]
        records[path.parent.name] = {name: value for name, value in record.items() if name != "cpu_times"}
    return records


def stamps(folder):
    return {path: path.stat().st_mtime_ns for path in folder.glob("packaging-*/*")}


def test_study_leaves_its_tables_its_figure_and_what_they_hang_on(whole, ask):
    study_request, tasks = ask()
    units = planned(study_request, tasks)
    about = json.loads((whole / "about.json").read_text())
    assert {path.name for path in whole.iterdir() if path.name[0] != "." and path.is_file()} == {
        "about.json", "figure.png", "runs.csv", "study.json", "table.csv", "table.md", "table_found.csv",
    }  # fmt: skip
    assert (whole / "figure.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert about["seeds"] == [0, 1]
    assert set(about["run_times"]) == {unit.name for unit in units}
    assert about["run_time"] == pytest.approx(sum(about["run_times"].values()))
    session = about["sessions"][0]
    assert {"cpu", "cores", "command", "wall_time", "python"} < set(session)
    assert {"armdesign", "pin", "numpy", "numba", "opytimizer"} <= set(session["versions"])
    with (whole / "runs.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["folder"] for row in rows] == [unit.name for unit in units]
    assert {row["state"] for row in rows} == {"finished"}


def test_best_known_is_the_least_of_all(whole):
    records = found(whole)
    assert len(records) == 6
    with (whole / "table.csv").open(encoding="utf-8", newline="") as stream:
        rows = {row["solver"]: row for row in csv.DictReader(stream)}
    best = [
        min(values)
        for k in (0, 1)
        for values in zip(*(r["g"] for name, r in records.items() if name.endswith(f"design{k}")), strict=True)
    ]
    assert float(rows["best known"]["n = 3"]) == pytest.approx(1e3 * sum(best) / len(best))
    assert float(rows["DLS, 1024 starts"]["found [%]"]) == 100.0


def test_broken_down_and_resumed_equals_undisturbed(whole, ask, tmp_path):
    folder = tmp_path / "study"
    with pytest.raises(KeyboardInterrupt):
        run_study(folder, *ask(), lambda units: Here(most=2))
    assert len(found(folder)) == 2
    workers = Here()
    result = run_study(folder, *read_study_folder(folder), lambda units: workers)
    assert len(workers.taken) == 4
    assert found(folder) == found(whole)
    assert result.runs.count("finished") == 6
    assert len(json.loads((folder / "about.json").read_text())["sessions"]) == 1


def test_where_a_unit_is_carried_out_changes_nothing(whole, ask, tmp_path):
    run_study(tmp_path / "study", *ask(), lambda units: Here(share_disk=False))
    assert found(tmp_path / "study") == found(whole)


def test_worker_processes_change_nothing(whole, ask, tmp_path):
    run_study(tmp_path / "study", *ask(), lambda units: WorkerProcesses(2, unit_worker))
    assert found(tmp_path / "study") == found(whole)


def test_finished_study_is_not_touched_again(copy, ask):
    before = stamps(copy)
    run_study(copy, *ask(), lambda units: pytest.fail("nothing was left to do"))
    assert stamps(copy) == before


@pytest.mark.parametrize(
    "more", [{"reps": 3}, {"dof": (3, 4)}, {"algorithms": ("dls-16", *SOLVERS)}], ids=lambda more: next(iter(more))
)
def test_more_of_everything_adds_the_missing_runs_alone(copy, ask, more):
    before, earlier, workers = stamps(copy), found(copy), Here()
    result = run_study(copy, *ask(**more), lambda units: workers)
    assert not set(workers.taken) & set(earlier)
    assert len(result.runs.rows) == len(earlier) + len(workers.taken)
    assert {path: stamp for path, stamp in stamps(copy).items() if path in before} == before


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"reps": 1}, "also has repetitions 2"),
        ({"algorithms": ("slsqp",)}, "also has algorithms dls-1"),
        ({"budget": 500}, "budget is 400 there and 500 here"),
        ({"dof": (4,)}, "also has dof 3"),
        ({"changes": {"fitness": {"delta": 0.02}}}, "packaging: fitness.delta is 0.01 there and 0.02 here"),
    ],
)
def test_other_settings_and_less_are_refused(copy, ask, change, message):
    before = {path: path.read_bytes() for path in copy.rglob("*") if path.is_file()}
    with pytest.raises(SettingsError, match=message):
        run_study(copy, *ask(**change), lambda units: Here())
    assert {path: path.read_bytes() for path in copy.rglob("*") if path.is_file()} == before


def test_folder_of_something_else_is_refused(whole, ask, tmp_path):
    study_request, tasks = ask()
    with pytest.raises(RunFolderError, match="holds no study"):
        read_study_folder(tmp_path)
    with pytest.raises(SettingsError, match="holds the study 'temporal', not 'robot'"):
        read_study_folder(whole, "robot")
    (tmp_path / "sweep.toml").touch()
    with pytest.raises(RunFolderError, match="holds a sweep, not a study"):
        run_study(tmp_path, study_request, tasks, lambda units: Here())


def test_damaged_record_is_done_again(copy, ask, whole):
    (copy / "packaging-n3-slsqp-design1" / "record.json").write_text("{")
    workers = Here()
    run_study(copy, *ask(), lambda units: workers)
    assert workers.taken == ["packaging-n3-slsqp-design1"]
    assert found(copy) == found(whole)


def test_unit_that_fails_is_told_and_stops_nobody(copy, ask, monkeypatch):
    shutil.rmtree(copy / "packaging-n3-slsqp-design1")

    def fail(*args):
        raise ValueError("no good")

    monkeypatch.setattr(temporal, "perform", fail)
    result = run_study(copy, *ask(), lambda units: Here())
    assert result.runs.count("failed") == 1
    assert result.runs.rows["packaging-n3-slsqp-design1"]["stopped_by"] == "ValueError: no good"
    assert result.tables[0].notes[0] == "1 of 6 runs failed; runs.csv says why."


def test_work_that_is_told_to_stop_leaves_no_record(copy):
    place = copy / "packaging-n3-slsqp-design0"
    (place / "record.json").unlink()
    assert carry_out_work(place, perform, Stopping()) == ("interrupted", "")
    assert not (place / "record.json").exists()
    assert carry_out_work(place, perform, JobContext()) == ("finished", "")


def test_reporter_tells_what_is_done():
    class Nobody:
        requested = False

    heard, context = [], JobContext()
    context.report = heard.append
    Reporter(Nobody(), context)(3, 10, 0.5)
    assert (heard[0]["iteration"], heard[0]["iterations"], heard[0]["fitness"]) == (3, 10, 0.5)


def test_plan_refuses_what_cannot_be(ask):
    study_request, tasks = ask()
    for changed, message in [
        (replace(study_request, reps=0), "0 repetitions"),
        (
            replace(study_request, options={"algorithms": ("newton",), "budget": 400}),
            "no solver 'newton'; allowed: ga, pso",
        ),
    ]:
        with pytest.raises(SettingsError, match=message):
            planned(changed, tasks)


def test_budget_that_does_not_last_an_iteration_is_refused(ask):
    with pytest.raises(SettingsError, match="a budget of 399 evaluations is too small"):
        planned(*ask(algorithms=("pso",), budget=399))


def test_designs_are_valid_and_do_not_hang_on_how_many_there_are(whole, ask):
    _, tasks = ask()
    designs = {name: record["Phi"] for name, record in found(whole).items()}
    assert designs["packaging-n3-slsqp-design0"] == designs["packaging-n3-dls-1-design0"]
    assert designs["packaging-n3-slsqp-design0"] != designs["packaging-n3-slsqp-design1"]
    objective = tasks["packaging", 3].objective()
    scores, _ = objective.evaluate([designs["packaging-n3-slsqp-design0"], designs["packaging-n3-slsqp-design1"]])
    assert scores.valid.all()


def test_joints_that_make_no_arm_are_named(ask):
    study_request, tasks = ask()
    prepared = next(iter(tasks.values()))
    short = replace(prepared, settings=prepared.settings.replace({"design": {"length": (5.0, 6.0)}}))
    with pytest.raises(SettingsError, match=r" with \d joints?: the bounds of a and d"):
        planned(study_request, dict.fromkeys(tasks, short))


def test_a_figure_is_legible_where_it_is_printed_80_mm_wide():
    found = {
        "DLS, 1 start": {"a": (1e-3, 5.0), "b": (2e-3, 1.0)},
        "DLS, 64 starts": {"a": (0.01, 0.0), "b": (0.1, 0.0)},
    }
    sizes = []

    def drawn():
        figure = legible(draw_solvers, found, ["a", "b"])
        figure.draw_without_rendering()
        texts = [each for each in figure.findobj(Text) if each.get_text().strip() and each.get_visible()]
        sizes.extend(each.get_fontsize() * 80.0 / (25.4 * figure.get_figwidth()) for each in texts)
        assert figure.get_suptitle().endswith("DLS, 64 starts")  # the quickest that is exact on both tasks
        return figure

    png(drawn)
    assert min(sizes) >= 6.0
