"""Settings as flags, and what is known of runs."""

import tomllib

import pytest
from typer.testing import CliRunner

from armdesign.cli import app
from armdesign.settings.sections import Settings
from armdesign.studio.commands import flags, known_runs, search_command, shown

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
    words, rest = flags(settings)
    config = tmp_path / "rest.toml"
    config.write_text(rest.to_toml())
    done = CliRunner().invoke(app, ["search", "--config", str(config), *words, "--write-config"])
    assert done.exit_code == 0, done.output
    assert Settings().replace(tomllib.loads(done.output)) == settings


def test_a_search_takes_a_free_folder_and_a_file_for_what_has_no_flag(tmp_path):
    settings = Settings().replace({"search": {"coarse": 50}})
    first = search_command(settings, tmp_path / "take.c3d", tmp_path / "runs")
    first.folder.mkdir(parents=True)
    second = search_command(settings, tmp_path / "take.c3d", tmp_path / "runs", auto=True)
    third = search_command(settings, tmp_path / "take.c3d", tmp_path / "runs")
    assert len({first.folder, second.folder, third.folder}) == 3
    assert str(tmp_path / "runs" / f"{third.folder.name}.toml") in third.words
    assert "--dof=auto" in second.words


def test_what_is_shown_is_fit_for_a_shell():
    assert shown(["report", "a b"]) == "armdesign report 'a b'"


def test_no_runs_where_there_is_no_folder(tmp_path):
    assert known_runs(tmp_path / "none") == []
