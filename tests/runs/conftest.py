"""A small search, undisturbed and as a command that can be killed and taken up again."""

import os
from types import SimpleNamespace

import child_runs as runs
import pytest
from typer.testing import CliRunner

from armdesign.cli import app
from armdesign.demonstration import read_recording
from armdesign.fitness.block import compile_kernels
from armdesign.runs.resumable import finished
from armdesign.search.prepare import prepare
from armdesign.settings.sections import Settings

collect_ignore = [] if hasattr(os, "fork") else ["test_interrupts.py", "test_kills.py"]
RECORDING = runs.EXAMPLES / "packaging.csv"
SMALL = Settings().replace({"task": {"stop": 0.4}, "search": {"particles": 12, "iterations": 6}})


@pytest.fixture(autouse=True)
def every_state(monkeypatch):
    """A state is saved after every batch, so that kills and failures can be placed between them."""
    monkeypatch.setattr("armdesign.runs.resumable.SAVE_EVERY", 0.0)


@pytest.fixture(scope="session")
def task():
    """Task and settings of the small search, in this process."""
    return prepare(read_recording(RECORDING), SMALL)


@pytest.fixture
def cli():
    """Run a command in this process."""

    def invoke(*args):
        return CliRunner().invoke(app, [str(arg) for arg in args])

    return invoke


@pytest.fixture(scope="session")
def begin(tmp_path_factory, task):
    """Flags that begin the small search in a folder; further flags go over its settings."""
    config = tmp_path_factory.mktemp("settings") / "small.toml"
    config.write_text(SMALL.to_toml())
    compile_kernels(task.path_problem)

    def flags(folder, *more):
        return ("search", RECORDING, "--config", config, "--workers", "1", "--no-report", "--out", folder, *more)

    return flags


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory, begin):
    """The small search, undisturbed: its folder and what it says."""
    folder = tmp_path_factory.mktemp("undisturbed") / "run"
    done = CliRunner().invoke(app, [str(arg) for arg in begin(folder)])
    assert done.exit_code == 0, done.output
    assert runs.names(folder) == runs.FINISHED
    return SimpleNamespace(folder=folder, outcome=runs.outcome(folder), rows=runs.rows(folder))


@pytest.fixture
def child(tmp_path):
    """Start a command in a process of its own; none is left in the end."""
    started = []

    def start(*args, before=None):
        started.append(runs.Child(tmp_path / f"log-{len(started)}", args, before))
        return started[-1]

    yield start
    for each in started:
        if each.poll() is None:
            os.kill(each.pid, 9)
            each.wait()


@pytest.fixture
def take_up(cli, begin):
    """Bring a run to its end as a user would: resume it, or begin again where there is nothing to resume."""

    def go_on(folder):
        if finished(folder):
            before = {path: path.read_bytes() for path in folder.iterdir() if path.name in runs.FINISHED}
            done = cli("search", "--resume", folder)
            assert done.exit_code == 0
            assert " ".join(done.output.split()) == f"{folder} is finished; nothing to resume."
            assert {path: path.read_bytes() for path in before} == before
            return
        done = cli("search", "--resume", folder, "-q", "--workers", 1)
        if done.exit_code == 2 and "holds no run to resume" in done.output:
            done = cli(*begin(folder, "--overwrite", "-q"))
        assert done.exit_code == 0, done.output

    return go_on


@pytest.fixture
def check(take_up, undisturbed):
    """Take a run up and compare everything with the undisturbed one."""

    def compare(folder):
        take_up(folder)
        assert runs.outcome(folder) == undisturbed.outcome

    return compare
