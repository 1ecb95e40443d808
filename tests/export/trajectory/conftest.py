"""The two examples followed by arms that a short search found, as finished runs."""

from pathlib import Path

import pytest

from armdesign.demonstration import read_recording
from armdesign.kinematics.dh import DHTable
from armdesign.search.evaluation import evaluate_design
from armdesign.search.prepare import prepare
from armdesign.search.result import Result
from armdesign.settings.sections import Settings

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
ARMS = {
    "packaging": DHTable.from_rows(
        [(-1.5708, 0, 0), (0.85977, 0.073592, 0), (0.36384, 0.3816, 0.071341), (-0.93753, 0, 0.1)]
    ),
    "welding": DHTable.from_rows(
        [
            (-0.10246, 0, 0),
            (1.5708, 0, 0),
            (-1.5708, 0.16768, 0),
            (-1.5708, 0.10868, 0.29206),
            (0.70633, 0, 0.010015),
            (1.5708, 0, 0.1),
        ]
    ),
}


def finished(scenario):
    table = ARMS[scenario]
    settings = {"design": {"dof": table.dof}, "fitness": {"scenario": scenario, "reach_tolerance": 0.002}}
    problem = prepare(read_recording(EXAMPLES / f"{scenario}.csv"), Settings().replace(settings))
    return Result(problem, evaluate_design(table, problem), name=scenario)


@pytest.fixture(scope="session")
def runs():
    return {scenario: finished(scenario) for scenario in ARMS}


@pytest.fixture(params=tuple(ARMS))
def run(request, runs):
    """Each of the two."""
    return runs[request.param]
