import json
import shutil

import pytest
from sweep_stand_ins import PACKAGING, Here

from armdesign.errors import RunFolderError, SettingsError
from armdesign.experiments.sweep.run_sweep import run_sweep
from armdesign.experiments.sweep.run_table import COLUMNS, FOUND
from armdesign.experiments.sweep.sweep_plan import units_of
from armdesign.experiments.sweep.sweep_store import read_sweep
from armdesign.runs.lock import locked
from armdesign.search.search import search


@pytest.fixture(scope="module")
def whole(ask, tmp_path_factory):
    """An undisturbed sweep."""
    folder = tmp_path_factory.mktemp("whole") / "sweep"
    run_sweep(folder, *ask(), lambda units: Here(3))
    return folder


@pytest.fixture
def copy(whole, tmp_path):
    """A copy of the undisturbed sweep to work on."""
    return shutil.copytree(whole, tmp_path / "sweep")


def stamps(folder):
    """Content and time of change of every file of the runs."""
    runs = [path for path in folder.glob("packaging-*") if path.is_dir()]
    return {path: (path.read_bytes(), path.stat().st_mtime_ns) for run in runs for path in run.iterdir()}


def test_rows_stand_in_the_order_of_the_plan_whatever_ends_first(whole, ask, rows_of):
    assert [row["folder"] for row in rows_of(whole)] == [unit.name for unit in units_of(*ask())]
    assert (whole / "sweep.csv").read_text().splitlines()[0] == ",".join(COLUMNS)
    assert {row["state"] for row in rows_of(whole)} == {"finished"}


def test_rows_tell_what_the_runs_found(whole, rows_of):
    for row in rows_of(whole):
        result = json.loads((whole / row["folder"] / "result.json").read_text())
        assert {name: float(row[name]) for name in FOUND} == {name: result[name] for name in FOUND}
        assert row["stopped_by"] == result["stopped_by"] == "iterations"
        assert (row["recording"], row["algorithm"]) == ("packaging.csv", result["algorithm"])
        assert (int(row["dof"]), int(row["seed"])) == (result["dof"], result["seed"])
        assert row["D"] == ("" if row["algorithm"] == "pso" else "2")


def test_run_of_a_sweep_is_the_search_of_the_same_settings(whole, ask, rows_of):
    unit = units_of(*ask())[-1]
    assert rows_of(whole)[-1]["fitness"] == repr(search(unit.problem).evaluation.fitness)


def test_finished_runs_are_never_touched_again(copy, ask, sweep_here):
    before = stamps(copy)
    assert sweep_here(copy, ask()) is None
    assert stamps(copy) == before


def test_resuming_needs_the_folder_alone(ask, sweep_here, tmp_path, whole):
    recording = tmp_path / "packaging.csv"
    shutil.copy(PACKAGING, recording)
    assert sweep_here(tmp_path / "sweep", ask(recordings=[recording], seeds=(0,))).taken
    recording.unlink()
    shutil.rmtree(tmp_path / "sweep" / "packaging-pso-n4-seed0")
    moved = (tmp_path / "sweep").rename(tmp_path / "moved")
    assert sweep_here(moved, read_sweep(moved)).taken == ["packaging-pso-n4-seed0"]
    for name in ("history.csv", "task.csv", "trajectory.csv", "arm.urdf"):
        run = "packaging-pso-n4-seed0"
        assert (moved / run / name).read_bytes() == (whole / run / name).read_bytes()


def test_more_of_everything_adds_the_missing_runs_alone(copy, ask, sweep_here, rows_of):
    before, earlier = stamps(copy), {row["folder"]: row for row in rows_of(copy)}
    asked = ask(seeds=(2, 0, 1), angle_intervals=(2, 3))
    workers = sweep_here(copy, asked)
    assert set(workers.taken) == {unit.name for unit in units_of(*asked)} - set(earlier)
    assert {path: stamp for path, stamp in stamps(copy).items() if path in before} == before
    rows = rows_of(copy)
    assert [row["folder"] for row in rows] == [unit.name for unit in units_of(*asked)]
    assert {name: row for row in rows if (name := row["folder"]) in earlier} == earlier
    assert read_sweep(copy)[0] == asked[0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"changes": {"search": {"particles": 9}}},
            "search.particles is 8 there and 9 here.*another folder",
        ),
        ({"changes": {"search": {"patience": 2}}}, "search.patience is not set there and 2 here"),
        ({"seeds": (0, 2)}, "also has seeds 1. Ask for these as well"),
        ({"algorithms": ("rapso",)}, "also has algorithms pso"),
        ({"dof": (3,)}, "also has dof 4"),
        ({"angle_intervals": (3,)}, "also has angle intervals 2"),
    ],
)
def test_folder_keeps_to_one_kind_of_runs(copy, ask, sweep_here, files_of, change, message):
    before = files_of(copy)
    with pytest.raises(SettingsError, match=message):
        sweep_here(copy, ask(**change))
    assert files_of(copy) == before


def test_recording_that_has_changed_is_noticed(ask, sweep_here, tmp_path):
    recording = tmp_path / "task.csv"
    shutil.copy(PACKAGING, recording)
    sweep_here(tmp_path / "sweep", ask(recordings=[recording], seeds=(0,), algorithms=("pso",)))
    lines = recording.read_text().splitlines()
    recording.write_text("\n".join(lines[:-1]))
    with pytest.raises(SettingsError, match="is not what it was when the sweep"):
        sweep_here(tmp_path / "sweep", ask(recordings=[recording], seeds=(0, 1), algorithms=("pso",)))


def test_unfinished_runs_go_on_to_the_same_folder(copy, whole, ask, sweep_here, files_of):
    shutil.rmtree(copy / "packaging-pso-n4-seed1")
    (copy / "packaging-rapso-n4-D2-seed0" / "result.json").write_text('{"cut sh')
    (copy / "sweep.csv").unlink()
    assert sweep_here(copy, ask()).taken == ["packaging-pso-n4-seed1", "packaging-rapso-n4-D2-seed0"]
    assert files_of(copy) == files_of(whole)


def test_damaged_result_of_a_finished_run_is_not_written_over(copy, ask, sweep_here):
    (copy / "packaging-pso-n4-seed0" / "result.json").write_text("{}")
    with pytest.raises(RunFolderError, match=r"result.json is damaged.*Remove its folder"):
        sweep_here(copy, ask())


def test_run_of_other_settings_under_the_same_name_is_not_written_over(copy, ask, sweep_here):
    settings = copy / "packaging-pso-n4-seed0" / "settings.toml"
    settings.write_text(settings.read_text().replace("particles = 8", "particles = 9"))
    with pytest.raises(RunFolderError, match=r"packaging-pso-n4-seed0 holds another run.*Move it away"):
        sweep_here(copy, ask())


def test_folder_of_a_single_run_is_no_place_for_a_sweep(whole, ask, sweep_here):
    with pytest.raises(RunFolderError, match="holds a run, not a sweep"):
        sweep_here(whole / "packaging-pso-n4-seed0", ask())


@pytest.mark.parametrize("content", [None, "[sweep", "[sweep]\n", "[sweep]\nseeds = 3\n", "[nonsense]\nx = 1\n"])
def test_folder_without_a_readable_sweep_is_refused(tmp_path, content):
    if content is not None:
        (tmp_path / "sweep.toml").write_text(content)
    with pytest.raises(RunFolderError, match=r"holds no sweep: sweep.toml is missing|sweep.toml cannot be read"):
        read_sweep(tmp_path)


def test_second_sweep_on_a_folder_is_refused(copy, ask, sweep_here):
    with locked(copy), pytest.raises(RunFolderError, match=r"in use by process \d+"):
        sweep_here(copy, ask(seeds=(0, 1, 2)))


def test_failing_run_does_not_stop_the_others_and_is_tried_again(ask, sweep_here, rows_of, tmp_path):
    asked = ask(dof=(2, 4), seeds=(0,), algorithms=("pso",))
    told = []
    sweep_here(tmp_path, asked, on_change=told.append)
    failed, finished = rows_of(tmp_path)
    assert (failed["state"], finished["state"]) == ("failed", "finished")
    assert failed["stopped_by"].startswith("no candidate brings its end-effector within 1 mm")
    assert failed["fitness"] == ""
    assert (told[-1].finished, told[-1].failed, told[-1].total) == (1, 1, 2)
    assert sweep_here(tmp_path, asked).taken == ["packaging-pso-n2-seed0"]
    assert rows_of(tmp_path) == [failed, finished]


def test_run_folder_that_cannot_be_used_fails_alone(ask, sweep_here, rows_of, tmp_path):
    tmp_path.joinpath("packaging-pso-n4-seed0").write_text("precious")
    sweep_here(tmp_path, ask(algorithms=("pso",)))
    assert [row["state"] for row in rows_of(tmp_path)] == ["failed", "finished"]
    assert "cannot make the run folder" in rows_of(tmp_path)[0]["stopped_by"]
    assert tmp_path.joinpath("packaging-pso-n4-seed0").read_text() == "precious"
