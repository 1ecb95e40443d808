"""Commands run in this process (quick) or as real ones, on the examples and on small searches."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

import armdesign
from armdesign.cli import app

ROOT = Path(__file__).resolve().parents[2]
COMMAND = "from armdesign.cli import main; main()"


@pytest.fixture(scope="session")
def packaging():
    return ROOT / "examples" / "packaging.csv"


@pytest.fixture(scope="session")
def welding():
    return ROOT / "examples" / "welding.csv"


@pytest.fixture(scope="session")
def small():
    """Flags of a search that takes a moment."""
    return ("--dof", "4", "--particles", "10", "--iterations", "3")


@pytest.fixture(scope="session")
def run():
    """Run a command in this process."""

    def invoke(*args):
        return CliRunner().invoke(app, [str(arg) for arg in args])

    return invoke


@pytest.fixture(scope="session")
def environment():
    """Environment in which a process finds this very package."""
    above = str(Path(armdesign.__file__).resolve().parents[1])
    return os.environ | {"PYTHONPATH": os.pathsep.join([above, os.environ.get("PYTHONPATH", "")])}


@pytest.fixture(scope="session")
def process(environment):
    """Run a command as a real process."""

    def start(*args, code=COMMAND, **options):
        command = [sys.executable, "-c", code, *map(str, args)]
        return subprocess.run(
            command, capture_output=True, text=True, check=False, timeout=300, **({"env": environment} | options)
        )

    return start


@pytest.fixture
def place(tmp_path, monkeypatch):
    """An empty folder to work in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def refused(run, place):
    """Run a command that has to end with one sentence, exit code 2 and nothing written; gives the sentence."""

    def invoke(*args):
        here = Path.cwd()
        before = {path: path.read_bytes() for path in here.rglob("*") if path.is_file()}
        outcome = run(*args)
        assert isinstance(outcome.exception, SystemExit), (outcome.exception, outcome.output)
        assert outcome.exit_code == 2, outcome.output
        assert "Traceback" not in outcome.output
        assert {path: path.read_bytes() for path in here.rglob("*") if path.is_file()} == before
        assert not (here / "runs").exists()
        sentence = outcome.output.splitlines()[-1]
        assert sentence.startswith("armdesign: ")
        return sentence

    return invoke


@pytest.fixture(scope="session")
def packaged(run, small, packaging, tmp_path_factory):
    """A finished packaging run: its folder and what the command printed."""
    folder = tmp_path_factory.mktemp("packaged") / "run"
    outcome = run("search", packaging, *small, "--out", folder)
    assert outcome.exit_code == 0, outcome.output
    return folder, outcome


@pytest.fixture(scope="session")
def welded(run, small, welding, tmp_path_factory):
    """A finished welding run: its folder and what the command printed."""
    folder = tmp_path_factory.mktemp("welded") / "run"
    outcome = run("search", welding, "--scenario", "welding", *small, "--out", folder)
    assert outcome.exit_code == 0, outcome.output
    return folder, outcome
