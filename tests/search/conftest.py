"""Small searches on the examples, and fitness computed once more in plain NumPy out of joint angles."""

import json
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import outside_fitness
import pytest

import armdesign
from armdesign.demonstration import read_recording
from armdesign.runs.folder import claim_folder
from armdesign.runs.writing import write_result
from armdesign.search.prepare import prepare
from armdesign.search.search import search
from armdesign.settings.sections import Settings

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def examples():
    """The recordings by the scenario they are for."""
    return {name: ROOT / "examples" / f"{name}.csv" for name in ("packaging", "welding")}


@pytest.fixture(scope="session")
def small_study(examples):
    """Settings of a search that takes a moment."""

    def settings(scenario="packaging", **changes):
        basis = Settings().replace(
            {
                "task": {"recording": str(examples[scenario])},
                "design": {"dof": 4},
                "search": {"particles": 10, "iterations": 4},
                "fitness": {"scenario": scenario},
            }
        )
        return basis.replace(changes)

    return settings


@pytest.fixture(scope="session")
def prepared_for(examples, small_study):
    """A small search, prepared."""

    def ready(scenario="packaging", **changes):
        return prepare(read_recording(examples[scenario]), small_study(scenario, **changes))

    return ready


@pytest.fixture(scope="session")
def runs(prepared_for, tmp_path_factory):
    """A finished search of each scenario with its folder."""
    finished = {}
    for scenario in ("packaging", "welding"):
        result = search(prepared_for(scenario))
        folder = claim_folder(tmp_path_factory.mktemp(scenario) / "run")
        folder.mkdir(exist_ok=True)
        write_result(folder, result)
        content = json.loads((folder / "result.json").read_text(encoding="utf-8"))
        finished[scenario] = SimpleNamespace(folder=folder, result=result, content=content)
    return finished


@pytest.fixture(params=["packaging", "welding"])
def finished(runs, request):
    """Each of the finished searches."""
    return runs[request.param]


@pytest.fixture(scope="session")
def process():
    """Run Python code as a process that finds this very package."""
    above = str(Path(armdesign.__file__).resolve().parents[1])
    env = os.environ | {"PYTHONPATH": os.pathsep.join([above, os.environ.get("PYTHONPATH", "")])}

    def start(code, *args):
        command = [sys.executable, "-c", code, *map(str, args)]
        return subprocess.run(command, capture_output=True, text=True, check=False, env=env, timeout=300)

    return start


@pytest.fixture(scope="session")
def outside():
    """f and E of joint angles on a task, from nothing but DH products and the method's text."""
    return outside_fitness
