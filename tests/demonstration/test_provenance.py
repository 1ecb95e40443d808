"""task.json: where a task comes from and what was done, in the run folder and beside a converted recording."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from armdesign.demonstration import About, Recording, Step, read_recording, write_plain_csv
from armdesign.demonstration.convert import convert, write_conversion
from armdesign.demonstration.provenance import Provenance, Source, TaskRecord, fingerprint, read_task_json, task_json
from armdesign.errors import RunFolderError
from armdesign.runs.reading import read_problem
from armdesign.runs.resumable import start_run
from armdesign.search.prepare import prepare
from armdesign.settings.sections import Settings

PACKAGING = Path(__file__).resolve().parents[2] / "examples" / "packaging.csv"


@pytest.fixture
def captured(tmp_path):
    """The packaging example as if it came from a capture system, and its file."""
    plain = read_recording(PACKAGING)
    path = tmp_path / "capture.csv"
    write_plain_csv(path, plain)
    about = About(
        "C3D", captured=True, steps=(Step("units", "In mm.", {"unit": "mm"}), Step("up", "Y.", {"axis": "y"}))
    )
    return Recording(plain.time, plain.points, {}, "capture.csv", about), path


def content(path):
    return json.loads(path.read_text(encoding="utf-8"))


def test_task_json_says_where_a_task_comes_from_and_what_was_done(captured, tmp_path):
    recording, path = captured
    changes = {
        "recording": str(path),
        "base": "shoulder",
        "points": ("elbow=upper_arm", "hand=0.5*forearm+0.5*hand"),
        "rate": 40.0,
    }
    problem = prepare(recording, Settings().replace({"task": changes}))
    (tmp_path / "run").mkdir()
    start_run(tmp_path / "run", problem)
    written = content(tmp_path / "run" / "task.json")
    assert written["sources"] == [{"path": str(path), "sha256": hashlib.sha256(path.read_bytes()).hexdigest()}]
    assert (written["format"], written["units"], written["up"], written["mirror"]) == ("C3D", "mm", "y", False)
    assert written["base"] == "shoulder"
    assert written["points"] == ["elbow=upper_arm", "hand=0.5*forearm+0.5*hand"]
    assert written["settings"]["low_pass"] == 6.0
    assert written["settings"]["outliers"] is True
    assert (written["frames"], written["rate"]) == (len(problem.task.time), pytest.approx(40.0))
    assert [step["sentence"] for step in written["steps"]] == list(problem.notes)
    assert {"recording", "units", "up", "points", "low_pass", "resample", "segments", "motion", "task"} <= {
        step["name"] for step in written["steps"]
    }


def test_an_opened_run_knows_where_it_comes_from(captured, tmp_path):
    recording, path = captured
    problem = prepare(recording, Settings().replace({"task": {"recording": str(path)}}))
    (tmp_path / "run").mkdir()
    start_run(tmp_path / "run", problem)
    again = read_problem(tmp_path / "run")
    assert again.notes == problem.notes
    assert again.first.provenance.sources == problem.first.provenance.sources
    assert (again.first.provenance.points, again.first.provenance.base) == (
        problem.first.provenance.points,
        problem.first.provenance.base,
    )
    assert again.settings == problem.settings
    assert again.task.P.tobytes() == problem.task.P.tobytes()
    first = (tmp_path / "run" / "task.json").read_bytes()
    start_run(tmp_path / "run", again)
    assert (tmp_path / "run" / "task.json").read_bytes() == first


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"base_name": "s"}', "{"])
def test_a_damaged_task_json_is_refused(tmp_path, text):
    path = tmp_path / "task.json"
    path.write_text(text)
    with pytest.raises(RunFolderError, match=r"task.json is missing or damaged"):
        read_task_json(path)


def test_what_is_written_is_read_again(tmp_path):
    origin = Provenance(
        (Source("a.c3d", "00"), Source("b.c3d")), "C3D", "mm", "y", True, "s", ("a=b+c", "d"), "d", "fixed"
    )
    steps = (Step("units", "Metres.", {"unit": "m"}), Step("note", "Nothing."))
    (tmp_path / "t.json").write_text(task_json(TaskRecord("s", origin, steps, (0.1, 0.2, 0.3), True), 10, 100.0))
    assert read_task_json(tmp_path / "t.json") == ("s", origin, steps, (0.1, 0.2, 0.3), True)


def test_numbers_of_numpy_are_written_as_numbers(tmp_path):
    steps = (Step("x", "X.", {"a": np.float64(0.5), "b": np.int64(3), "c": float("nan"), "d": np.array([1.0, 2.0])}),)
    (tmp_path / "t.json").write_text(task_json(TaskRecord("s", Provenance(), steps), 1, 1.0))
    assert content(tmp_path / "t.json")["steps"][0]["details"] == {"a": 0.5, "b": 3, "c": None, "d": [1.0, 2.0]}


def test_beside_a_converted_recording(captured, tmp_path):
    recording, path = captured
    settings = Settings().replace({"task": {"recording": str(path), "base": "shoulder", "points": ("forearm", "hand")}})
    csv, beside = write_conversion(tmp_path / "out.csv", convert(recording, settings))
    assert beside.name == "out.task.json"
    assert content(beside)["points"] == ["forearm", "hand"]
    assert content(beside)["sources"][0]["path"] == str(path)
    assert list(read_recording(csv).points) == ["shoulder", "forearm", "hand"]


def test_files_that_are_not_there_have_no_digest(tmp_path):
    assert fingerprint(None) is None
    assert fingerprint(str(tmp_path / "none")) is None
