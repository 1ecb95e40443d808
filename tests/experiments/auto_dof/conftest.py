"""Small searches for the number of joints on an example."""

from pathlib import Path

import pytest

from armdesign.demonstration import read_recording
from armdesign.experiments.auto_dof.choose_dof import Callbacks, carry_out_auto, start_auto
from armdesign.experiments.auto_dof.dof_rule import Rule
from armdesign.search.prepare import prepare
from armdesign.settings.sections import Settings

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="session")
def problem_for():
    """The example task, problem for n joints, with a search that takes a moment."""
    recording = read_recording(ROOT / "examples" / "packaging.csv")

    def ready(n, **search):
        given = {"particles": 16, "iterations": 3} | search
        settings = Settings().replace({"task": {"rate": 5.0}, "design": {"dof": n}, "search": given})
        return prepare(recording, settings)

    return ready


@pytest.fixture(scope="session")
def choose(problem_for):
    """Search for the number of joints in a folder, or go on."""

    def chosen(folder, joints=(3, 4), rule=None, fresh=True, **callbacks):
        if fresh:
            folder.mkdir(exist_ok=True)
            start_auto(folder, {n: problem_for(n) for n in joints}, rule or Rule(0.04, 0.0))
        return carry_out_auto(folder, callbacks=Callbacks(**callbacks))

    return chosen


@pytest.fixture(scope="session")
def uninterrupted(choose, tmp_path_factory):
    """A choice made in one go: its folder and outcome."""
    folder = tmp_path_factory.mktemp("auto") / "whole"
    return folder, choose(folder)
