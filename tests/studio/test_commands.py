"""Searches as one would type them, and what is known of runs."""

import json
import tomllib
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from armdesign.cli import app
from armdesign.cli.screen import CompilationBar
from armdesign.experiments.auto_dof.dof_records import write_auto
from armdesign.experiments.auto_dof.dof_rule import Rule
from armdesign.runs.checkpoint import CURRENT
from armdesign.runs.folder import RESULT
from armdesign.runs.listing import RunStatus
from armdesign.settings.sections import Settings
from armdesign.studio import commands
from armdesign.studio.commands import known_runs, search_command, shown
from armdesign.studio.search_panel import NO_RUN, SearchPanel

CHANGES = {
    "plain": {},
    "task": {
        "task": {"base": "'a b'", "points": ("elbow=A+B", "hand"), "outliers": False, "low_pass": "off", "start": 0.5}
    },
    "cell": {"cell": {"place": ("x=-0.200..0.600 y=0.3 z=0",), "mounted": "any"}, "needs": {"payload": 0.25}},
    "arm": {"design": {"alpha": (-90.0, 45.0), "bounds": {"d_tool": (0.1, 0.2)}, "joint_limits": ((-90.0, 90.0),)}},
    "needs": {"needs": {"hand_tolerance": 0.02, "max_speed": (180.0,)}, "search": {"effort": "quick", "seed": 7}},
    "without a flag": {"search": {"coarse": 50}, "fitness": {"tie_hand": False}},
}


@pytest.mark.parametrize("changes", CHANGES.values(), ids=CHANGES)
def test_the_command_line_reads_back_the_settings(changes, tmp_path):
    settings = Settings().replace(changes)
    command = search_command(settings, tmp_path / "take.c3d", tmp_path / "runs")
    done = CliRunner().invoke(app, [*command.words, "--write-config"])
    assert done.exit_code == 0, done.output
    assert Settings().replace(tomllib.loads(done.output)).replace({"task": {"recording": None}}) == settings


def test_a_search_takes_a_free_folder(tmp_path):
    first = search_command(Settings(), tmp_path / "take.c3d", tmp_path / "runs")
    first.folder.mkdir(parents=True)
    second = search_command(Settings(), tmp_path / "take.c3d", tmp_path / "runs", auto=True)
    third = search_command(Settings(), tmp_path / "take.c3d", tmp_path / "runs")
    assert len({first.folder, second.folder, third.folder}) == 3
    assert "--dof=auto" in second.words


def test_a_search_that_was_there_gives_way_to_the_next_seed(tmp_path):
    found = []
    for _ in range(3):
        found.append(search_command(Settings(), tmp_path / "take.c3d", tmp_path / "runs"))
        found[-1].folder.mkdir()
    other = Settings().replace({"needs": {"payload": 1.0}})
    found.append(search_command(other, tmp_path / "take.c3d", tmp_path / "runs"))
    assert [each.folder.name for each in found] == [f"take-n3-seed{k}" for k in (0, 1, 2)] + ["take-n3-seed0-2"]
    seeds = [tomllib.loads(each.folder.with_suffix(".toml").read_text())["search"]["seed"] for each in found]
    assert seeds == [0, 1, 2, 0]


def test_that_kernels_are_compiled_is_said_only_where_they_are(tmp_path):
    assert not commands.compiles(tmp_path)
    (tmp_path / commands.LOG).write_text(CompilationBar.text)
    assert commands.compiles(tmp_path)


def test_of_a_stopped_search_for_the_number_of_joints_the_best_arm_counts(tmp_path, monkeypatch):
    write_auto(tmp_path, (3, 4, 5), Rule(), {}, None)
    bests = {"n3": 0.2, "n4": 0.1, "n5": None}
    for name in bests:
        (tmp_path / name).mkdir()
        (tmp_path / name / CURRENT).touch()
    monkeypatch.setattr(commands, "read_run", lambda place: RunStatus(place, "interrupted", best=bests[place.name]))
    found = commands.status(tmp_path)
    assert (found.folder.name, found.state) == ("n4", "stopped")


def test_the_run_that_was_watched_last_can_be_chosen_again(tmp_path):
    opened = []
    runs = SimpleNamespace(value="take-n3 (29 Nov, 14:05)")
    panel = SimpleNamespace(runs=runs, page=SimpleNamespace(folder=tmp_path), open_run=opened.append)
    SearchPanel.choose_run(panel)
    assert opened == [tmp_path / "runs" / "take-n3"]
    assert runs.value == NO_RUN  # so that choosing it again is a change
    SearchPanel.choose_run(panel)
    assert len(opened) == 1


def test_what_is_shown_is_fit_for_a_shell():
    assert shown(["report", "a b"]) == "armdesign report 'a b'"


def test_no_runs_where_there_is_no_folder(tmp_path):
    assert known_runs(tmp_path / "none") == []


def test_a_run_is_listed_with_joints_load_and_error(tmp_path):
    run = RunStatus(tmp_path, "running", dof=4)
    assert commands.facts(run) == "4 joints"
    content = {"settings": {"needs": {"payload": 0.5}}, "verdict": {"hand_error": {"max": 0.00077}}}
    (tmp_path / RESULT).write_text(json.dumps(content))
    assert commands.facts(run) == "4 joints, 0.5 kg, 0.8 mm"
    (tmp_path / RESULT).write_text("{}")
    assert commands.facts(run) == "4 joints"
