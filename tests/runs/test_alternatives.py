"""The alternatives a search leaves: they differ, each is a run of its own, and bad input is one sentence."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from armdesign.cli import app
from armdesign.demonstration import read_recording
from armdesign.errors import RunFolderError, SettingsError
from armdesign.runs.alternatives import read_designs, write_alternatives
from armdesign.runs.reading import read_problem, read_result
from armdesign.runs.writing import write_result
from armdesign.search.arm_symmetry import different_arms
from armdesign.search.prepare import prepare
from armdesign.search.result import Result
from armdesign.search.search import search
from armdesign.settings.sections import Settings

RECORDING = Path(__file__).resolve().parents[2] / "examples" / "packaging.csv"


def prepared(**changes):
    settings = Settings().replace(
        {
            "task": {"recording": str(RECORDING), "rate": 10.0},
            "design": {"dof": 4},
            "solver": {"descents": 12, "starts": 64},
            "search": {"algorithm": "multibasin", "budget": 3000, "seed": 3},
        }
    )
    settings = settings.replace({"search": changes})
    return prepare(read_recording(RECORDING), settings)


@pytest.fixture(scope="module")
def reference():
    return search(prepared())


@pytest.fixture(scope="module")
def folder(reference, tmp_path_factory):
    place = tmp_path_factory.mktemp("multibasin") / "run"
    write_result(place, reference)
    return place


def test_alternatives_differ_and_are_runs_of_their_own(folder, reference):
    ready = read_problem(folder)
    found = write_alternatives(folder, ready, count=3)
    assert [each.folder.name for each in found] == ["1", "2", "3"]
    assert found[0].evaluation.fitness == pytest.approx(reference.evaluation.fitness, rel=1e-12)
    space = ready.space
    Phi = np.array([space.phi(each.evaluation.table) for each in found])
    assert different_arms(Phi, space, 0.3, 9) == [0, 1, 2]
    for each in found:
        again = read_result(each.folder)
        assert again.evaluation.fitness == each.evaluation.fitness
    fewer = write_alternatives(folder, ready, count=1)
    assert len(fewer) == 1
    assert {path.name for path in (folder / "alternatives").iterdir()} == {"1"}


def test_command_prints_them_side_by_side(folder):
    told = CliRunner().invoke(app, ["alternatives", str(folder), "--count", "2"])
    assert told.exit_code == 0, told.output
    assert "no. 1" in told.output
    assert "tool alpha [deg]" in told.output


def test_bad_input_is_one_sentence(folder, reference, tmp_path):
    write_result(tmp_path / "arm", Result(reference.problem, reference.evaluation))
    damaged = json.loads((folder / "alternatives.json").read_text(encoding="utf-8"))
    damaged["designs"][0]["phi"] = [1.0]
    write_result(tmp_path / "damaged", reference)
    (tmp_path / "damaged" / "alternatives.json").write_text(json.dumps(damaged), encoding="utf-8")
    for arguments in (
        [tmp_path / "arm"],
        [tmp_path / "damaged"],
        [folder, "--count", "0"],
        [folder, "--distance", "-1"],
    ):
        told = CliRunner().invoke(app, ["alternatives", *map(str, arguments)])
        assert told.exit_code == 2, told.output
        assert "Traceback" not in told.output
    ready = read_problem(folder)
    with pytest.raises(RunFolderError, match="keeps no alternatives"):
        read_designs(tmp_path / "arm", ready.space)
    with pytest.raises(SettingsError, match="alternatives"):
        write_alternatives(folder, ready, count=100)
