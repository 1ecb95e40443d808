"""result.schema.json, which the package ships, describes every result.json that is written, and all of it."""

from __future__ import annotations

import copy
import json
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator
from typer.testing import CliRunner

from armdesign.cli import app
from armdesign.runs.contents import SCHEMA_VERSION
from armdesign.runs.folder import RESULT_SCHEMA

ROOT = Path(__file__).parents[2]
SCHEMA = json.loads(RESULT_SCHEMA.read_text(encoding="utf-8"))
EXAMPLES = ROOT / "examples"
QUICK = ("--dof", "3", "--budget", "120", "--effort", "budget", "--workers", "1", "--rate", "5")
PLACE = "x=0.3..0.8 y=-0.75..-0.45 z=0.8"


def closed(schema):
    """The schema without room for anything that it does not describe."""
    if isinstance(schema, list):
        return [closed(each) for each in schema]
    if not isinstance(schema, dict):
        return schema
    shut = {name: closed(each) for name, each in schema.items()}
    return {"additionalProperties": False, **shut} if isinstance(schema.get("properties"), dict) else shut


STRICT = Draft202012Validator(closed(copy.deepcopy(SCHEMA)))


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Run folders of all kinds by their names."""
    folder = tmp_path_factory.mktemp("runs")
    packaging, welding, lift = (EXAMPLES / name for name in ("packaging.csv", "welding.csv", "box_lift.c3d"))
    cell = EXAMPLES / "box_lift_cell.toml"
    commands = {
        "plain": ("search", packaging, *QUICK, "--body", "thin"),
        "swarm": ("search", packaging, "--body", "thin", *QUICK[-4:], "--particles", "60", "--iterations", "2"),
        "prismatic": ("search", packaging, *QUICK, "--joints", "RRP"),
        "several": (
            "search",
            f"{packaging}@0:1",
            f"{packaging}@0.5:1.5",
            "--holdout",
            f"{packaging}@1:1.9",
            *QUICK,
            "--body",
            "thin",
        ),
        "oriented": ("search", welding, *QUICK, "--dof", "6", "--scenario", "welding", "--body", "thin"),
        "cell": ("search", lift, *QUICK, "--obstacles", cell, "--place", PLACE, "--tolerance", "5mm"),
        "build": ("build", folder / "plain", "--catalogue", "rmd", "--no-snap"),
    }
    made = {}
    for name, words in commands.items():
        outcome = CliRunner().invoke(app, [*map(str, words), "--out", str(folder / name), "--quiet"])
        made[name] = outcome
    return folder, made


@pytest.mark.parametrize("name", ["plain", "swarm", "prismatic", "several", "oriented", "cell", "build"])
def test_result_is_as_the_schema_says(runs, name):
    folder, outcomes = runs
    assert outcomes[name].exit_code in ((0, 3) if name == "build" else (0,)), outcomes[name].output
    results = sorted((folder / name).rglob("result.json"))
    # of a holdout there is one where the arm that so few candidates have found reaches it
    assert len(results) in ((2, 3) if name == "several" else (1,))
    for path in results:
        assert [error.message for error in STRICT.iter_errors(json.loads(path.read_text()))] == []


def test_schema_is_one_and_of_the_version_that_is_written():
    Draft202012Validator.check_schema(SCHEMA)
    assert SCHEMA["properties"]["schema_version"]["const"] == SCHEMA_VERSION


@pytest.mark.parametrize("name", ["dof", "dh", "settings", "verdict"])
def test_schema_refuses_what_is_no_result(runs, name):
    result = json.loads((runs[0] / "plain" / "result.json").read_text())
    result[name] = "six"
    assert [list(error.path) for error in STRICT.iter_errors(result)] == [[name]]
