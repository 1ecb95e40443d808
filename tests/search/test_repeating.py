"""The settings.toml of a run repeats it to the last bit: here, in a fresh process, for any block size."""

import json

import pytest

from armdesign.cli import app
from armdesign.demonstration import read_recording
from armdesign.runs.writing import write_result
from armdesign.search.prepare import prepare
from armdesign.search.search import search
from armdesign.settings.sections import Settings, read_settings

COMPUTED = ("history.csv", "trajectory.csv", "task.csv", "arm.urdf")


def content(folder):
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    result.pop("wall_time")
    return result


def same(one, other):
    for name in COMPUTED:
        assert (one / name).read_bytes() == (other / name).read_bytes(), name
    return True


def test_settings_of_a_run_read_back_as_they_were(finished):
    settings = read_settings(finished.folder / "settings.toml")
    assert settings == finished.result.problem.settings
    assert Settings().replace(settings.to_dict()) == settings


def test_fresh_process_in_another_place_repeats_the_run(runs, tmp_path, process):
    folder, out = runs["welding"].folder, tmp_path / "again"
    code = "import os, sys; os.chdir(sys.argv.pop(1)); from armdesign.cli import main; main()"
    flags = ["--config", folder / "settings.toml", "--out", out, "--quiet", "--no-report", "--workers", "1"]
    outcome = process(code, tmp_path, "search", *flags)
    assert outcome.returncode == 0, outcome.stderr
    assert same(out, folder)
    assert content(out) == content(folder)
    assert (out / "settings.toml").read_bytes() == (folder / "settings.toml").read_bytes()


@pytest.mark.parametrize(("scenario", "prune", "block"), [("packaging", True, 3), ("welding", False, None)])
def test_python_repeats_the_run_in_other_blocks_and_without_pruning(runs, tmp_path, scenario, prune, block):
    folder = runs[scenario].folder
    settings = read_settings(folder / "settings.toml").replace({"search": {"prune": prune}})
    result = search(prepare(read_recording(settings.task.recording), settings), block=block)
    write_result(tmp_path / "again", result)
    assert same(tmp_path / "again", folder)
    again, before = content(tmp_path / "again"), content(folder)
    assert (again["rejected"].pop("pruned") > 0) == prune
    assert before["rejected"].pop("pruned") > 0
    assert again["rejected"] == before["rejected"]


def test_task_file_repeats_the_run_without_the_recording(finished, tmp_path):
    flags = ["--base", "origin", "--config", str(finished.folder / "settings.toml"), "--out", str(tmp_path / "again")]
    app(["search", str(finished.folder / "task.csv"), *flags, "--quiet"], standalone_mode=False)
    assert same(tmp_path / "again", finished.folder)
