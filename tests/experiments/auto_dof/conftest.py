"""Small searches for the number of joints on an example."""

from contextlib import contextmanager
from pathlib import Path

import pytest

from armdesign.demonstration import read_recording
from armdesign.experiments.auto_dof.choose_dof import Watch, carry_out_auto, start_auto
from armdesign.experiments.auto_dof.dof_rule import Rule
from armdesign.search.backends import InProcess
from armdesign.search.prepare import prepare
from armdesign.settings.sections import Settings

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="session")
def prepare_for():
    """The example task, prepared for n joints, with a search that takes a moment."""
    recording = read_recording(ROOT / "examples" / "packaging.csv")

    def ready(n, **search):
        given = {"particles": 16, "iterations": 3} | search
        settings = Settings().replace({"task": {"rate": 5.0}, "design": {"dof": n}, "search": given})
        return prepare(recording, settings)

    return ready


@pytest.fixture(scope="session")
def hire():
    """Evaluation in this process."""

    @contextmanager
    def hired(prepared):
        yield InProcess(prepared)

    return hired


@pytest.fixture(scope="session")
def choose(prepare_for, hire):
    """Search for the number of joints in a folder, or go on."""

    def chosen(folder, joints=(3, 4), rule=None, fresh=True, **watch):
        if fresh:
            folder.mkdir(exist_ok=True)
            start_auto(folder, {n: prepare_for(n) for n in joints}, rule or Rule(0.04, 0.0))
        return carry_out_auto(folder, hire, Watch(**watch))

    return chosen


@pytest.fixture(scope="session")
def uninterrupted(choose, tmp_path_factory):
    """A choice made in one go: its folder and outcome."""
    folder = tmp_path_factory.mktemp("auto") / "whole"
    return folder, choose(folder)
