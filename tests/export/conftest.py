"""Finished runs of both examples: good arms, scored and written to a folder."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from armdesign.cli import app
from armdesign.runs.reading import read_result

ROOT = Path(__file__).resolve().parents[2]
ARMS = {
    "packaging": [(-1.5708, 0, 0), (0.8598, 0.0736, 0), (0.3638, 0.3816, 0.0713), (-0.9375, 0, 0.1)],
    "welding": [
        (-0.1025, 0, 0), (1.5708, 0, 0), (-1.5708, 0.1677, 0), (-1.5708, 0.1087, 0.2921), (0.7063, 0, 0.01),
        (1.5708, 0, 0.1),
    ],
}  # fmt: skip


@pytest.fixture(scope="session")
def invoke():
    """Run a command in this process."""

    def call(*args):
        return CliRunner().invoke(app, [str(arg) for arg in args])

    return call


@pytest.fixture(scope="session")
def finished(invoke, tmp_path_factory):
    """A run folder and the run read back from it, by scenario."""
    runs = {}
    for scenario, rows in ARMS.items():
        folder = tmp_path_factory.mktemp("runs") / scenario
        table = folder.with_suffix(".csv")
        table.write_text("alpha,a,d\n" + "".join(",".join(map(repr, row)) + "\n" for row in np.array(rows).tolist()))
        recording = ROOT / "examples" / f"{scenario}.csv"
        outcome = invoke("evaluate", table, recording, "--scenario", scenario, "--out", folder, "--quiet")
        assert outcome.exit_code == 0, outcome.output
        runs[scenario] = SimpleNamespace(folder=folder, run=read_result(folder))
    return runs


@pytest.fixture(params=ARMS)
def each(finished, request):
    """Each of the finished runs."""
    return finished[request.param]
