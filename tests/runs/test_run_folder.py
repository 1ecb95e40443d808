"""The run folder, read with nothing but JSON, CSV and URDF readers."""

import csv
import hashlib
import json
import re
import shutil
import tomllib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import outside_fitness
import pinocchio as pin
import pytest
import yourdfpy

from armdesign import files
from armdesign.demonstration import read_recording
from armdesign.errors import RunFolderError
from armdesign.kinematics.dh import DHTable
from armdesign.runs.folder import claim_folder, free_folder
from armdesign.runs.reading import read_result
from armdesign.runs.writing import write_result
from armdesign.search.prepare import prepare
from armdesign.search.search import search
from armdesign.settings.sections import Settings

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
KEYS = {
    "schema_version",
    "dof",
    "algorithm",
    "seed",
    "settings",
    "dh",
    "length",
    "fitness",
    "path_fitness",
    "area",
    "mount",
    "weights",
    "orientation_weight",
    "orientation_metric",
    "point_error",
    "start_error",
    "evaluations",
    "computational_effort",
    "converged_at",
    "mean_valid",
    "wall_time",
    "verdict",
}


@pytest.fixture(scope="module")
def searched(tmp_path_factory):
    """A small search of each scenario in its run folder."""
    done = {}
    for scenario in ("packaging", "welding"):
        recording = EXAMPLES / f"{scenario}.csv"
        changes = {
            "task": {"recording": str(recording)},
            "design": {"dof": 6},
            "search": {"particles": 10, "iterations": 4},
            "fitness": {"scenario": scenario},
        }
        result = search(prepare(read_recording(recording), Settings().replace(changes)))
        folder = tmp_path_factory.mktemp(scenario) / "run"
        write_result(folder, result)
        content = json.loads((folder / "result.json").read_text(encoding="utf-8"))
        done[scenario] = SimpleNamespace(folder=folder, result=result, content=content)
    return done


@pytest.fixture(params=["packaging", "welding"])
def run(searched, request):
    """Each of them."""
    return searched[request.param]


def table_of(content):
    dh = content["dh"]
    assert dh["convention"] == "modified"
    return DHTable.from_rows([[row["alpha"], row["a"], row["d"]] for row in dh["rows"]], dh["base_yaw"])


def columns(path):
    with path.open(newline="", encoding="utf-8") as stream:
        header, *rows = csv.reader(stream)
    return header, np.array(rows, dtype=float)


def task_of(folder, points):
    """P, and R where the task has an orientation."""
    header, table = columns(folder / "task.csv")
    places = [[header.index(f"{point}_{axis}") for axis in "xyz"] for point in points]
    turns = [i for i, name in enumerate(header) if re.search(r"_q[xyzw]$", name)]
    R = [pin.Quaternion(row).normalized().matrix() for row in table[:, turns]] if turns else None
    return table[:, places], R


def test_folder_holds_what_it_should_and_no_more(run):
    assert {path.name for path in run.folder.iterdir()} == {
        "result.json",
        "trajectory.csv",
        "task.csv",
        "task.json",
        "history.csv",
        "alternatives.json",
        "settings.toml",
        "arm.urdf",
    }


def test_result_has_every_key(run):
    content = run.content
    assert set(content) >= KEYS
    assert content["schema_version"] == 1
    assert len(content["dh"]["rows"]) == content["dof"] + 1 == 7
    assert all(set(row) == {"alpha", "a", "d"} for row in content["dh"]["rows"])
    assert np.shape(content["mount"]) == (3, 3)
    assert (content["algorithm"], content["seed"]) == ("rapso", 0)
    assert content["evaluations"] == 40
    assert set(content["point_error"]) == {"upper_arm", "forearm", "hand"}
    assert all(set(error) == {"mean", "max"} for error in content["point_error"].values())


def test_the_verdict_is_read_back_and_where_there_is_none_it_is_made(run, tmp_path):
    verdict = run.result.verdict
    assert read_result(run.folder).verdict == verdict
    shutil.copytree(run.folder, tmp_path / "old")
    path = tmp_path / "old" / "result.json"
    content = dict(run.content)
    del content["verdict"]
    path.write_text(json.dumps(content), encoding="utf-8")
    again = read_result(tmp_path / "old").verdict
    assert again.hand_error.max == pytest.approx(verdict.hand_error.max, abs=1e-9)
    assert again.peak_speed == pytest.approx(verdict.peak_speed)
    assert again.feasible == verdict.feasible


@pytest.mark.parametrize("damage", ["fine", {}, {"hand_error": 3}])
def test_a_damaged_verdict_is_refused(searched, tmp_path, damage):
    shutil.copytree(searched["packaging"].folder, tmp_path / "run")
    content = searched["packaging"].content | {"verdict": damage}
    (tmp_path / "run" / "result.json").write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(RunFolderError) as refused:
        read_result(tmp_path / "run")
    assert refused.value.value == damage


def test_a_run_without_a_body_in_its_settings_is_that_of_a_thin_arm(searched, tmp_path):
    shutil.copytree(searched["packaging"].folder, tmp_path / "old")
    path = tmp_path / "old" / "settings.toml"
    path.write_text(re.sub(r"(?ms)^\[body\].*?(?=^\[)", "", path.read_text(encoding="utf-8")), encoding="utf-8")
    assert read_result(searched["packaging"].folder).problem.settings.body.kind == "tube"
    assert read_result(tmp_path / "old").problem.settings.body.kind == "thin"


def test_numbers_in_the_result_fit_together(run):
    content, settings = run.content, run.content["settings"]["fitness"]
    table = table_of(content)
    assert content["length"] == table.length
    assert content["fitness"] == settings["lambda_f"] * content["path_fitness"] + settings["lambda_E"] * content["area"]
    assert content["orientation_weight"] + sum(content["weights"]) == pytest.approx(1.0, abs=1e-12)
    assert (content["weights"], content["orientation_metric"]) == (settings["weights"], settings["orientation_metric"])
    np.testing.assert_allclose(np.array(content["mount"]) @ np.transpose(content["mount"]), np.eye(3), atol=1e-12)
    assert content["start_error"] <= settings["reach_tolerance"]
    assert 1 <= content["converged_at"] <= 4
    assert content["computational_effort"] == pytest.approx(content["mean_valid"] * content["converged_at"])


def test_effort_is_that_of_the_history(run):
    _, history = columns(run.folder / "history.csv")
    best, valid = history[:, 1], history[:, 3]
    W = int(np.argmax(best <= 1.01 * best[-1])) + 1
    assert run.content["converged_at"] == W
    assert run.content["mean_valid"] == pytest.approx(valid[:W].mean())


def test_history_obeys_its_laws(run):
    header, rows = columns(run.folder / "history.csv")
    assert header == ["iteration", "best", "mean", "valid", "evaluations"]
    iteration, best, mean, valid, evaluations = rows.T
    np.testing.assert_array_equal(iteration, np.arange(1, 5))
    assert (best[1:] <= best[:-1]).all()
    assert (mean >= best).all()
    assert ((valid >= 0) & (valid <= 10)).all()
    np.testing.assert_array_equal(evaluations, 10 * iteration)
    assert best[-1] == run.content["fitness"]


def test_trajectory_has_a_row_a_frame_within_limits_and_continuity(run):
    header, rows = columns(run.folder / "trajectory.csv")
    assert header == ["time", *(f"joint_{i + 1}" for i in range(6))]
    _, task = columns(run.folder / "task.csv")
    np.testing.assert_array_equal(rows[:, 0], task[:, 0])
    assert len(rows) == run.content["frames"] == len(task)
    q = rows[:, 1:]
    assert np.abs(q).max() <= np.pi
    assert np.linalg.norm(np.diff(q, axis=0), axis=1).max() <= np.deg2rad(10.0) * (1 + 1e-9)


def test_task_has_the_recording_s_own_header(searched):
    for scenario, run in searched.items():
        recorded, table = columns(EXAMPLES / f"{scenario}.csv")
        header, rows = columns(run.folder / "task.csv")
        turns = ["hand_qx", "hand_qy", "hand_qz", "hand_qw"] if scenario == "welding" else []
        assert header == ["time", *recorded[4:13], *turns]
        for point in ("upper_arm", "forearm", "hand"):
            for axis in "xyz":
                moved = table[:, recorded.index(f"{point}_{axis}")] - table[:, recorded.index(f"shoulder_{axis}")]
                np.testing.assert_allclose(rows[:, header.index(f"{point}_{axis}")], moved, rtol=0, atol=1e-12)


def test_every_number_has_all_its_digits(run):
    """The shortest text that reads back as the same double: 17 significant digits where it takes them."""
    longest = 0
    for name in ("history.csv", "trajectory.csv", "task.csv", "settings.toml", "result.json", "arm.urdf"):
        text = (run.folder / name).read_text(encoding="utf-8")
        text = re.sub(r'"reasons": \[[^\]]*\]', "", text)  # sentences, for people
        for number in re.findall(r"(?<![\w.\-/])-?\d+\.\d+(?:e[-+]?\d+)?(?![\w.])", text):
            assert repr(float(number)) == number, (name, number)
            longest = max(longest, len(number.lstrip("-0.").replace(".", "").split("e")[0]))
    assert longest in (16, 17)


def test_written_numbers_are_those_computed(run):
    best, content = run.result.evaluation, run.content
    assert content["fitness"] == best.fitness
    assert content["path_fitness"] == best.path_fitness
    assert content["area"] == best.area
    assert content["mount"] == best.path.mount.tolist()
    assert columns(run.folder / "trajectory.csv")[1][:, 1:].tobytes() == best.path.q.tobytes()
    table = table_of(content)
    for name in ("alpha", "a", "d"):
        np.testing.assert_array_equal(getattr(table, name), getattr(best.table, name))


def test_outside_recomputation_gives_the_same_fitness(run):
    content = run.content
    P, R = task_of(run.folder, content["points"])
    _, rows = columns(run.folder / "trajectory.csv")
    f, E = outside_fitness.fitness(
        table_of(content), rows[:, 1:], P, np.array(content["weights"]), content["settings"]["fitness"]["delta"],
        content["orientation_weight"], R, np.array(content["mount"]),
    )  # fmt: skip
    assert f == pytest.approx(content["path_fitness"], abs=1e-9)
    assert pytest.approx(content["area"], abs=1e-9) == E


def test_errors_per_point_are_those_of_the_trajectory(run):
    content = run.content
    P, _ = task_of(run.folder, content["points"])
    _, rows = columns(run.folder / "trajectory.csv")
    table, weights = table_of(content), np.array(content["weights"])
    distances = []
    for q, points in zip(rows[:, 1:], P, strict=True):
        line = outside_fitness.corners(table, q)
        distances.append(outside_fitness.errors(line, outside_fitness.place(line, points, weights), points))
    for name, distance in zip(content["points"], np.transpose(distances), strict=True):
        assert content["point_error"][name]["mean"] == pytest.approx(distance.mean(), abs=1e-9)
        assert content["point_error"][name]["max"] == pytest.approx(distance.max(), abs=1e-9)
    assert content["start_error"] == pytest.approx(distances[0][-1], abs=1e-9)


def test_urdf_stands_where_the_table_says(run):
    table = table_of(run.content)
    _, rows = columns(run.folder / "trajectory.csv")
    path = run.folder / "arm.urdf"
    model = pin.buildModelFromUrdf(str(path))
    data = model.createData()
    robot = yourdfpy.URDF.load(str(path), load_meshes=False, build_scene_graph=True)
    assert model.nq == robot.num_actuated_joints == 6
    for q in rows[::9, 1:]:
        frames = table.frames(q)
        pin.framesForwardKinematics(model, data, q)
        robot.update_cfg(q)
        for name, pose in [*((f"link_{i + 1}", frames[i]) for i in range(6)), ("tool0", frames[-1])]:
            np.testing.assert_allclose(data.oMf[model.getFrameId(name)].homogeneous, pose, rtol=0, atol=1e-12)
            np.testing.assert_allclose(robot.get_transform(name, "base_link"), pose, rtol=0, atol=1e-12)


def test_urdf_has_the_joint_limits_of_the_settings(run):
    model = pin.buildModelFromUrdf(str(run.folder / "arm.urdf"))
    np.testing.assert_array_equal(model.lowerPositionLimit, np.full(6, -np.pi))
    np.testing.assert_array_equal(model.upperPositionLimit, np.full(6, np.pi))


def test_settings_in_the_folder_are_those_in_the_result(run):
    settings = tomllib.loads((run.folder / "settings.toml").read_text(encoding="utf-8"))
    assert json.loads(json.dumps(settings)) == run.content["settings"]
    assert settings["task"]["base"] == "shoulder"
    assert settings["task"]["points"] == ["upper_arm", "forearm", "hand"]
    assert Path(settings["task"]["recording"]).is_file()


def test_result_names_the_recording(run):
    recording = run.content["recording"]
    assert Path(recording["path"]).parent == EXAMPLES
    assert recording["sha256"] == hashlib.sha256(Path(recording["path"]).read_bytes()).hexdigest()


def test_what_was_removed_is_counted(run):
    rejected = run.content["rejected"]
    _, history = columns(run.folder / "history.csv")
    assert set(rejected) == {"constraints", "reach", "start", "pruned", "path"}
    removed = rejected["constraints"] + rejected["reach"] + rejected["start"]
    assert removed + history[:, 3].sum() == run.content["evaluations"]
    assert rejected["pruned"] <= history[:, 3].sum()


def test_folder_that_cannot_be_is_refused_at_once(tmp_path):
    (tmp_path / "file").write_text("precious")
    with pytest.raises(RunFolderError, match="file is a file"):
        claim_folder(tmp_path / "file")
    with pytest.raises(RunFolderError, match=r"cannot write to the output folder .*file.sub"):
        claim_folder(tmp_path / "file" / "sub")
    with pytest.raises(RunFolderError, match="cannot write to the output folder"):
        claim_folder(tmp_path / ("x" * 300))
    assert (tmp_path / "file").read_text() == "precious"


@pytest.mark.parametrize("name", ["result.json", "state.npz"])
def test_run_is_kept_also_where_it_is_not_run(tmp_path, name):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / name).write_text("{}")
    with pytest.raises(RunFolderError, match=r"already holds a run.*--overwrite"):
        claim_folder(tmp_path / "run")
    assert (tmp_path / "run" / name).read_text() == "{}"
    assert free_folder(tmp_path, "run") == tmp_path / "run-2"
    claim_folder(tmp_path / "run", overwrite=True)


def test_folder_of_other_things_may_be_used(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    claim_folder(tmp_path)
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_failure_on_the_way_leaves_no_result_that_looks_whole(searched, tmp_path, monkeypatch):
    def broken(*args, **options):
        raise RunFolderError("no")

    folder = claim_folder(tmp_path / "run")
    monkeypatch.setattr("armdesign.runs.contents.result_urdf", broken)
    with pytest.raises(RunFolderError):
        write_result(folder, searched["packaging"].result)
    assert not (folder / "result.json").exists()


def test_disk_that_fails_while_overwriting_leaves_no_mixture(searched, tmp_path, monkeypatch):
    folder = claim_folder(tmp_path / "run")
    write_result(folder, searched["packaging"].result)
    whole = files.write_whole

    def full(path, content):
        if Path(path).name == "arm.urdf":
            raise RunFolderError(f"cannot write {path}: the disk is full")
        whole(path, content)

    monkeypatch.setattr("armdesign.runs.writing.write_whole", full)
    with pytest.raises(RunFolderError, match="the disk is full"):
        write_result(claim_folder(folder, overwrite=True), searched["welding"].result)
    assert not (folder / "result.json").exists()  # the old one would stand beside the new history


def test_a_run_folder_is_read_back_as_the_result_that_was_written(run):
    again = read_result(run.folder)
    assert (again.fitness, again.facts, again.name) == (run.result.fitness, run.result.facts, "run")
    assert again.problem.settings == run.result.problem.settings
    assert again.evaluation.path.q.tobytes() == run.result.evaluation.path.q.tobytes()
    assert again.evaluation.path.distance == pytest.approx(run.result.evaluation.path.distance, abs=1e-12)
    assert again.history.best.tobytes() == run.result.history.best.tobytes()
