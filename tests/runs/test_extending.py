"""A search that has ended or stopped goes on to another length, or by other stop rules."""

import json
import os
import shutil
import signal

import child_runs as runs
import numpy as np
import pytest
from typer.testing import CliRunner

from armdesign.cli import app
from armdesign.runs.resumable import extend_run
from armdesign.settings.sections import read_settings

BASINS = ("--dof", 4, "--algorithm", "multibasin", "-q")


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A finished search in many basins, by the command line alone: its folder."""
    folder = tmp_path_factory.mktemp("finished") / "basins"
    flags = ("--to", 0.4, "--budget", 600, *BASINS, "--workers", 1, "--no-report", "--out", folder)
    done = CliRunner().invoke(app, ["search", *map(str, (runs.EXAMPLES / "packaging.csv", *flags))])
    assert done.exit_code == 0, done.output
    return folder


@pytest.fixture
def multibasin(finished, tmp_path):
    """A copy of that folder."""
    return shutil.copytree(finished, tmp_path / "basins")


def refused(outcome):
    assert outcome.exit_code == 2, outcome.output
    return outcome.output.splitlines()[-1]


@pytest.mark.parametrize("algorithm", ["pso", "rapso"])
def test_a_swarm_that_goes_on_is_the_run_it_would_have_been(tmp_path, begin, cli, algorithm):
    short, long = tmp_path / "short", tmp_path / "long"
    flags = ("-q", "--algorithm", algorithm)
    assert cli(*begin(short, *flags, "--iterations", 3)).exit_code == 0
    assert cli(*begin(long, *flags, "--iterations", 6)).exit_code == 0
    assert cli("search", "--resume", short, "-q", "--iterations", 6, "--no-report").exit_code == 0
    assert runs.outcome(short) == runs.outcome(long)


def test_a_larger_budget_goes_on_from_what_was_found_and_says_so(multibasin, cli):
    before = runs.rows(multibasin)
    done = cli("search", "--resume", multibasin, "--budget", 1200, "--no-report")
    assert done.exit_code == 0, done.output
    assert "another run than one with" in " ".join(done.output.split())
    rows = runs.rows(multibasin)
    assert rows[: len(before)] == before
    best = np.array([float(row.split(",")[1]) for row in rows])
    assert (np.diff(best) <= 0.0).all()
    result = json.loads((multibasin / "result.json").read_text())
    assert 600 < result["evaluations"] <= 1200
    assert result["settings"]["search"]["budget"] == read_settings(multibasin / "settings.toml").search.budget == 1200
    assert (result["stopped_by"], best[-1]) == ("budget", result["fitness"])


def test_a_stop_rule_that_has_ended_it_gives_way_to_a_later_one(tmp_path, begin, cli, undisturbed):
    folder = tmp_path / "run"
    assert cli(*begin(folder, "-q", "--target", 100)).exit_code == 0
    assert runs.stopped_by(folder) == "target"
    assert cli("search", "--resume", folder, "-q", "--target", 0, "--no-report").exit_code == 0
    assert runs.rows(folder) == undisturbed.rows


def test_a_search_that_has_found_nothing_can_go_on(tmp_path, cli):
    folder = tmp_path / "none"
    flags = ("--dof", 2, "--budget", 100, "-q", "--workers", 1, "--out", folder)
    assert cli("search", runs.EXAMPLES / "packaging.csv", *flags).exit_code == 4
    assert " failed " in cli("runs", folder).output
    assert cli("search", "--resume", folder, "--budget", 200, "-q").exit_code == 4
    assert "200/200" in cli("runs", folder).output


@pytest.mark.parametrize(
    ("flags", "value", "allowed"),
    [
        (("--budget", 400), "400", "more than 5"),
        (("--budget", 99), "99", "from 100"),
        (("--target", 0.001), "budget", "--budget"),
        (("--iterations", 9), "--iterations", "rapso, pso"),
        (("--seed", 1), "--seed", "another --out"),
    ],
)
def test_what_would_stop_at_once_or_be_another_search_is_refused(multibasin, cli, flags, value, allowed):
    before = {path: path.read_bytes() for path in multibasin.iterdir()}
    sentence = refused(cli("search", "--resume", multibasin, *flags))
    assert value in sentence
    assert allowed in sentence
    assert {path: path.read_bytes() for path in multibasin.iterdir()} == before


def test_without_a_saved_state_it_is_refused(multibasin, cli):
    (multibasin / "state.npz").unlink()
    assert "no saved state" in refused(cli("search", "--resume", multibasin, "--budget", 1200))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="kills forked processes")
@pytest.mark.parametrize(
    "place", [("result.json", 1, "after"), ("settings.toml", 1, "after"), ("state.npz", 2, "after")]
)
def test_killed_at_any_point_it_goes_on_to_the_same_end(tmp_path, begin, child, cli, place):
    whole, folder = tmp_path / "whole", tmp_path / "run"
    for each in (whole, folder):
        assert cli(*begin(each, "-q", "--iterations", 3)).exit_code == 0
    go_on = ("-q", "--iterations", 6, "--no-report")
    assert cli("search", "--resume", whole, *go_on).exit_code == 0
    killed = child("search", "--resume", folder, *go_on, before=lambda: runs.die_at_rename(*place))
    assert killed.wait() == -signal.SIGKILL, killed.said()
    again = cli("search", "--resume", folder, *(go_on if place[0] == "result.json" else ("-q", "--no-report")))
    assert again.exit_code == 0, again.output
    assert runs.outcome(folder) == runs.outcome(whole)


def test_the_settings_change_before_anything_is_computed(multibasin):
    extend_run(multibasin, {"budget": 900})
    assert runs.stopped_by(multibasin) == "interrupted"
    assert read_settings(multibasin / "settings.toml").search.budget == 900
