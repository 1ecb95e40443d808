"""The settings.toml of a run repeats it to the last bit: here, in a fresh process, for any block size."""

import json

import pytest

from armdesign.cli import app
from armdesign.demonstration import read_recording
from armdesign.runs.writing import write_result
from armdesign.search.prepare import prepare
from armdesign.search.search import search
from armdesign.settings.sections import Settings, read_settings

FILES = ("history.csv", "trajectory.csv", "task.csv", "arm.urdf", "settings.toml")


def content(folder):
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    result.pop("wall_time")
    return result


def same(one, other):
    for name in FILES:
        assert (one / name).read_bytes() == (other / name).read_bytes(), name
    assert content(one) == content(other)
    return True


def test_settings_of_a_run_read_back_as_they_were(finished):
    settings = read_settings(finished.folder / "settings.toml")
    assert settings == finished.result.problem.settings
    assert Settings().replace(settings.to_dict()) == settings


def test_command_repeats_the_run(finished, tmp_path):
    app(
        ["search", "--config", str(finished.folder / "settings.toml"), "--out", str(tmp_path / "again"), "--quiet"],
        standalone_mode=False,
    )
    assert same(tmp_path / "again", finished.folder)


def test_fresh_process_in_another_place_repeats_the_run(finished, tmp_path, process):
    code = "import os, sys; os.chdir(sys.argv.pop(1)); from armdesign.cli import main; main()"
    settings, out = finished.folder / "settings.toml", tmp_path / "again"
    outcome = process(code, tmp_path, "search", "--config", settings, "--out", out, "--quiet")
    assert outcome.returncode == 0, outcome.stderr
    assert same(out, finished.folder)


@pytest.mark.parametrize("block", [3])
def test_python_repeats_the_run_with_another_block(finished, tmp_path, block):
    settings = read_settings(finished.folder / "settings.toml")
    result = search(prepare(read_recording(settings.task.recording), settings), block=block)
    (tmp_path / "again").mkdir(exist_ok=True)
    write_result(tmp_path / "again", result)
    assert same(tmp_path / "again", finished.folder)


def test_task_file_repeats_the_run_without_the_recording(finished, tmp_path):
    flags = ["--base", "origin", "--config", str(finished.folder / "settings.toml"), "--out", str(tmp_path / "again")]
    app(["search", str(finished.folder / "task.csv"), *flags, "--quiet"], standalone_mode=False)
    for name in ("history.csv", "trajectory.csv", "task.csv", "arm.urdf"):
        assert (tmp_path / "again" / name).read_bytes() == (finished.folder / name).read_bytes()


def test_without_pruning_the_run_is_the_same(finished, tmp_path):
    settings = read_settings(finished.folder / "settings.toml").replace({"search": {"prune": False}})
    (tmp_path / "plain").mkdir()
    write_result(tmp_path / "plain", search(prepare(read_recording(settings.task.recording), settings)))
    for name in ("history.csv", "trajectory.csv", "arm.urdf"):
        assert (tmp_path / "plain" / name).read_bytes() == (finished.folder / name).read_bytes()
    plain, pruned = content(tmp_path / "plain"), content(finished.folder)
    for result in (plain, pruned):
        result["rejected"].pop("pruned")
        result["settings"]["search"].pop("prune")
    assert plain == pruned
