import json
import math

import child_runs as runs
import numpy as np
import pytest

from armdesign.cli.setting_flags import read_flag
from armdesign.errors import SettingsError
from armdesign.runs.checkpoint import pack, unpack
from armdesign.search.backends.backend import InProcess
from armdesign.search.search import Search, stalled
from armdesign.settings.kinds import Number
from armdesign.settings.sections import Settings


def best(rows):
    return [float(row.split(",")[1]) for row in rows]


def test_a_target_ends_the_search_at_the_first_iteration_that_reaches_it(tmp_path, begin, cli, undisturbed):
    for k, target in enumerate(best(undisturbed.rows)):
        first = best(undisturbed.rows).index(target)
        if k > first:
            continue
        folder = tmp_path / f"run-{k}"
        assert cli(*begin(folder, "-q", "--target", repr(target))).exit_code == 0
        assert runs.rows(folder) == undisturbed.rows[: first + 1]
        assert runs.stopped_by(folder) == ("target" if first < len(undisturbed.rows) - 1 else "iterations")


def test_patience_ends_the_search_once_it_stalls_and_not_before(tmp_path, begin, cli):
    folder, patience = tmp_path / "run", 3
    assert cli(*begin(folder, "-q", "--iterations", 100, "--patience", patience)).exit_code == 0
    history = np.array(best(runs.rows(folder)))
    assert runs.stopped_by(folder) == "patience"
    assert len(history) < 100
    gains = 1.0 - history[patience:] / history[:-patience]
    assert gains[-1] < 1e-3
    assert np.all((gains[:-1] >= 1e-3) | np.isinf(history[:-patience][:-1]))


@pytest.mark.parametrize(
    ("history", "patience", "expected"),
    [
        ([1.0, 1.0], 2, False),
        ([1.0, 1.0, 1.0], 2, True),
        ([1.0, 1.0, 0.9991], 2, True),
        ([1.0, 1.0, 0.9989], 2, False),
        ([math.inf, math.inf, math.inf], 2, False),
        ([math.inf, 1.0, 1.0], 2, False),
        ([2.0, 1.0, 1.0, 1.0], 2, True),
    ],
)
def test_stalled_means_less_than_a_thousandth_over_the_last_iterations(history, patience, expected):
    assert stalled(np.array(history), patience) is expected


def test_a_time_limit_ends_the_search_and_the_folder_is_whole(tmp_path, begin, cli):
    folder = tmp_path / "run"
    assert cli(*begin(folder, "-q", "--iterations", 10**6, "--time-limit", "0.3s")).exit_code == 0
    assert runs.stopped_by(folder) == "time_limit"
    assert json.loads((folder / "result.json").read_text())["wall_time"] >= 0.3
    assert runs.names(folder) == runs.FINISHED


def test_a_time_limit_counts_what_was_spent_before(task, tmp_path):
    limited = Search(task, InProcess(task))
    limited.settings = Settings().replace({"search": {"time_limit": 60.0}}).search
    limited.advance()
    assert limited.ended_by() is None
    state = limited.state()
    state["search"]["elapsed"] = 60.0
    limited.restore(unpack(pack(state, "key"), "key", tmp_path))
    assert limited.ended_by() == "time_limit"


def test_a_time_limit_leaves_time_for_one_batch_on_a_busy_machine(task):
    limited = Search(task, InProcess(task))
    limited.settings = Settings().replace({"search": {"time_limit": 0.01}}).search
    limited.earlier = 1.0  # as if the processor had been away
    assert limited.ended_by() is None
    limited.advance()
    assert limited.ended_by() == "time_limit"


@pytest.mark.parametrize(
    "flags",
    [
        ("--target", "0.7"),
        ("--patience", "2"),
        ("--time-limit", "0.01", "--particles", "200", "--iterations", "1000000"),
    ],
)
def test_what_a_stop_rule_has_ended_is_finished(tmp_path, begin, cli, take_up, flags):
    folder = tmp_path / "run"
    done = cli(*begin(folder, *flags))
    assert done.exit_code == 0
    assert "stopped" in done.output
    take_up(folder)
    assert runs.names(folder) == runs.FINISHED


def test_a_killed_search_stops_by_the_same_rule_after_resuming(tmp_path, begin, cli, child, take_up):
    flags = ("-q", "--iterations", "100", "--patience", "3")
    assert cli(*begin(tmp_path / "undisturbed", *flags)).exit_code == 0
    killed = child(*begin(tmp_path / "run", *flags), before=lambda: runs.at_iteration(3, runs.die))
    assert killed.wait() < 0
    take_up(tmp_path / "run")
    assert runs.outcome(tmp_path / "run") == runs.outcome(tmp_path / "undisturbed")


@pytest.mark.parametrize(
    ("text", "expected"),
    [("90", 90.0), ("90s", 90.0), ("0.5s", 0.5), ("30m", 1800.0), ("2h", 7200.0), ("1.5d", 129600.0)],
)
def test_durations(text, expected):
    assert read_flag(Number(unit="s"), text, "--time-limit") == expected


@pytest.mark.parametrize("text", ["", "m", "abc", "5w", "1h30m", "1:30", "3 0m", "--"])
def test_what_is_no_duration_is_refused_with_an_example(text):
    with pytest.raises(SettingsError, match="30m"):
        read_flag(Number(unit="s"), text, "--time-limit")


@pytest.mark.parametrize(
    ("flag", "value"),
    [
        *(("--time-limit", value) for value in ("0", "-5m", "nan", "inf", "1e30", "soon")),
        *(("--patience", value) for value in ("0", "-1")),
        *(("--target", value) for value in ("-1", "nan", "inf")),
    ],
)
def test_stop_rules_out_of_range_are_refused_in_one_sentence(tmp_path, begin, cli, flag, value):
    folder = tmp_path / "run"
    done = cli(*begin(folder, f"{flag}={value}"))
    assert done.exit_code == 2
    assert done.output.startswith("armdesign: ")
    assert done.output.count("\n") == 1
    assert "allowed" in done.output
    assert not folder.exists()
