import json
import os
import re
import shutil
import time

import pytest

from armdesign.runs.listing import natural, read_run
from armdesign.runs.lock import locked


@pytest.fixture(scope="module")
def begun(run, packaging, packaged, tmp_path_factory):
    """A run folder with settings, a saved state of three iterations and no result, as a killed search leaves it."""
    from armdesign import Settings, prepare, read_recording  # noqa: PLC0415
    from armdesign.runs import checkpoint  # noqa: PLC0415
    from armdesign.runs import resumable as running  # noqa: PLC0415
    from armdesign.runs.reading import read_problem  # noqa: PLC0415
    from armdesign.runs.resumable import start_run  # noqa: PLC0415
    from armdesign.search.backends.backend import InProcess  # noqa: PLC0415
    from armdesign.search.search import Search  # noqa: PLC0415

    folder = tmp_path_factory.mktemp("begun") / "run"
    folder.mkdir()
    settings = Settings().replace({"design": {"dof": 6}, "search": {"particles": 10, "iterations": 50, "seed": 7}})
    start_run(folder, prepare(read_recording(packaging), settings))
    search = Search(read_problem(folder), InProcess(read_problem(folder)))
    for _ in range(3):
        search.advance()
    checkpoint.save_state(folder, checkpoint.pack(search.state(), running.identity(folder)))
    return folder


@pytest.fixture
def line(run):
    """The line of a run in the table, cell by cell."""

    def read(folder, name):
        outcome = run("runs", folder)
        assert outcome.exit_code == 0, outcome.output
        (found,) = [text for text in outcome.output.splitlines() if re.match(rf"{re.escape(name)}  ", text)]
        return re.split(r"  +", found)

    return read


def test_finished_run(packaged, line, place):
    shutil.copytree(packaged[0], place / "deep" / "er" / "a run")
    result = json.loads((packaged[0] / "result.json").read_text())
    cells = line(place, "deep/er/a run")
    assert cells[:4] == ["deep/er/a run", "finished", f"{result['fitness']:.4f}", "3/3"]
    assert cells[5:] == ["rapso", "4", "0"]


def test_search_that_was_killed_has_stopped(begun, line, place):
    shutil.copytree(begun, place / "run")
    cells = line(place, "run")
    assert (cells[1], cells[3], cells[5:]) == ("stopped", "3/50", ["rapso", "6", "7"])
    assert float(cells[2]) > 0.0


def test_previous_state_serves_where_the_newest_cannot_be_read(begun, line, place):
    shutil.copytree(begun, place / "run")
    (place / "run" / "state.npz").rename(place / "run" / "state-previous.npz")
    assert line(place, "run")[3] == "3/50"
    (place / "run" / "state.npz").write_bytes(b"PK cut short")
    assert line(place, "run")[3] == "3/50"


def test_search_that_goes_on_names_its_process(run, begun, line, place):
    shutil.copytree(begun, place / "run")
    with locked(place / "run"):
        assert line(place, "run")[1] == "running"
        assert f"running by process {os.getpid()} on " in run("runs", place).output
    assert line(place, "run")[1] == "stopped"


def test_stale_lock_of_a_dead_process_is_none(begun, line, place):
    shutil.copytree(begun, place / "run")
    (place / "run" / ".lock").write_text("process 1 on somewhere\n")
    assert line(place, "run")[1] == "stopped"


def test_interrupted_search_stands_where_its_state_stands(begun, packaged, line, place):
    shutil.copytree(begun, place / "run")
    result = json.loads((packaged[0] / "result.json").read_text()) | {"stopped_by": "interrupted"}
    (place / "run" / "result.json").write_text(json.dumps(result))
    assert (line(place, "run")[1], line(place, "run")[3]) == ("interrupted", "3/50")


@pytest.mark.parametrize(("rule", "progress"), [(("--iterations", 2), "2/2"), (("--time-limit", 1e-4), "1/200")])
def test_search_that_has_ended_without_a_valid_arm_has_failed(run, packaging, place, line, rule, progress):
    outcome = run("search", packaging, "--dof", 2, "--particles", 4, *rule, "--out", "runs/none")
    assert outcome.exit_code == 4, outcome.output
    assert line("runs", "none")[1:4] == ["failed", "-", progress]


def test_search_that_has_failed_can_go_on(run, packaging, place, line):
    run("search", packaging, "--dof", 2, "--particles", 4, "--iterations", 2, "--out", "runs/none")
    assert run("search", "--resume", "runs/none", "--iterations", 5).exit_code == 4
    assert line("runs", "none")[1:4] == ["failed", "-", "5/5"]


def test_given_arm_is_no_search(run, packaging, packaged, place, line):
    assert run("evaluate", packaged[0], packaging, "--out", "runs/arm").exit_code == 0
    assert line("runs", "arm")[1] == "evaluated"
    assert line("runs", "arm")[5:] == ["-", "4", "-"]


@pytest.mark.parametrize(
    ("name", "content", "why"),
    [
        ("result.json", '{"fitness": 0.', "result.json is damaged"),
        ("result.json", "[]", "result.json is damaged"),
        ("result.json", "{}", "result.json is damaged: KeyError('fitness')"),
        ("result.json", '{"fitness": "x"}', "result.json is damaged"),
        ("settings.toml", "[search", "settings.toml is damaged"),
        ("settings.toml", "", "settings.toml is damaged: 'search'"),
        ("settings.toml", None, "settings.toml cannot be read: No such file"),
    ],
)
def test_broken_run_is_a_row_that_says_so(packaged, run, line, place, name, content, why):
    shutil.copytree(packaged[0], place / "bad")
    shutil.copytree(packaged[0], place / "good")
    if content is None:
        (place / "bad" / name).unlink()
    else:
        (place / "bad" / name).write_text(content)
    assert line(place, "bad")[1] == "broken"
    assert line(place, "good")[1] == "finished"
    assert why in run("runs", place).output


def test_rows_stand_by_name_with_numbers_as_numbers(packaged, run, place):
    for name in ("seed10", "seed9", "a/seed2", "A"):
        shutil.copytree(packaged[0], place / "runs" / name)
    names = [text.split("  ")[0] for text in run("runs").output.splitlines()]
    assert names == ["folder", "A", "a/seed2", "seed9", "seed10"]
    assert natural(place / "x9y10") < natural(place / "x10y9")


def test_hidden_folders_other_folders_and_insides_of_runs_are_left_out(packaged, run, place):
    shutil.copytree(packaged[0], place / "runs" / "run")
    shutil.copytree(packaged[0], place / "runs" / "run" / "copy")
    shutil.copytree(packaged[0], place / "runs" / ".tasks" / "run")
    (place / "runs" / "notes").mkdir()
    (place / "runs" / "notes" / "settings.toml").write_text("[search]\nseed = 3\n")
    assert len(run("runs").output.splitlines()) == 2


def test_run_folder_itself_can_be_named(packaged, run):
    assert f"{packaged[0]}  finished" in run("runs", packaged[0]).output


def test_age_is_the_time_since_the_last_change(packaged, place, line):
    shutil.copytree(packaged[0], place / "run")
    then = time.time() - 3 * 3600 - 60
    for path in [*(place / "run").iterdir(), place / "run"]:
        os.utime(path, (then, then))
    assert line(place, "run")[4] == "3 h"
    (place / "run" / "history.csv").touch()
    assert read_run(place / "run").age < 60


def test_nothing_there_is_said_in_a_sentence(run, place):
    (place / "runs").mkdir()
    outcome = run("runs")
    assert (outcome.exit_code, outcome.output) == (0, "No runs below runs.\n")


def test_looking_changes_nothing(begun, run, place):
    shutil.copytree(begun, place / "run")
    before = {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in (place / "run").iterdir()}
    run("runs", place)
    assert {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in (place / "run").iterdir()} == before
