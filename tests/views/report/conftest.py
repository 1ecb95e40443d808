"""Finished runs: two small searches in folders, and arms that are made up, with a motion that is made up as well."""

import dataclasses
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from armdesign.demonstration import read_recording
from armdesign.demonstration.task import Task
from armdesign.fitness.block import BlockEvaluator
from armdesign.kinematics.dh import DHTable
from armdesign.runs.folder import claim_folder
from armdesign.runs.writing import write_result
from armdesign.search.design_problem import DesignProblem
from armdesign.search.evaluation import Evaluation, PathEvaluation
from armdesign.search.prepare import prepare
from armdesign.search.result import Result, SearchFacts
from armdesign.search.search import search
from armdesign.settings.sections import Settings
from armdesign.swarm import History
from armdesign.views.report import cell_pictures, cell_rendering, plots, report_page, tracking
from armdesign.views.report.drawing import Picture

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
VOID = {"meta", "link", "br", "hr", "img", "input", "col"}
FACTS = {
    "algorithm": "rapso",
    "seed": 7,
    "evaluations": 60,
    "computational_effort": 12.0,
    "converged_at": 3,
    "rejected": {"constraints": 4, "reach": 3, "start": 2, "pruned": 1},
    "mean_valid": 4.0,
    "wall_time": 1.5,
}


class Page(HTMLParser):
    """A page taken apart: every element closed in its place, tables as rows of text, all attributes."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.open, self.attributes, self.tags, self.rows, self.text = [], [], [], [], []
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, name, value) for name, value in attrs]
        if tag not in VOID:
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_startendtag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, name, value) for name, value in attrs]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if "style" not in self.open:
            self.text.append(data)
        if {"td", "th"} & set(self.open[-3:]):
            self.rows[-1][-1] += data

    def all(self, name):
        return [value for _, each, value in self.attributes if each == name]


@pytest.fixture(autouse=True, scope="module")
def small_pictures():
    """Shaded pictures of a ninth of the pixels; tests of whole commands draw them at their size."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cell_rendering, "WIDTH", 300)
        patch.setattr(cell_rendering, "INSET", 120)
        yield


@pytest.fixture(scope="session")
def take_apart():
    return Page


@pytest.fixture(scope="session")
def numbers():
    """The numbers in a text, true minus signs and all."""
    return lambda text: [float(x) for x in re.findall(r"-?\d+(?:\.\d+)?", text.replace("−", "-"))]


@pytest.fixture(scope="session")
def invented():
    """A run that is made up: a random arm that swings along a recording it has nothing to do with."""

    def make(dof=3, scenario="packaging", *, seed=0, names=None, name="made-up", stopped_by="iterations", table=None):
        rng = np.random.default_rng(seed)
        problem = problem_for(scenario, dof, names)
        if table is None:
            rows = np.stack(
                [rng.uniform(-1.5, 1.5, dof + 1), rng.uniform(0, 0.3, dof + 1), rng.uniform(0, 0.3, dof + 1)]
            )
            table = DHTable.from_rows(rows.T)
        time = problem.task.time
        q = rng.uniform(-1, 1, dof) + 0.5 * np.sin(rng.uniform(1, 3, dof) * time[:, None] + rng.uniform(0, 3, dof))
        path = BlockEvaluator(problem.path_problem, block=1).replay(table, q)
        f, E = float(path.g.mean()), float(path.area.mean())
        fitness = problem.settings.fitness
        r = fitness.lambda_f * f + fitness.lambda_E * E
        evaluation = Evaluation(table, r, f, E, (PathEvaluation(r, f, E, path),))
        if stopped_by is None:
            return Result(problem, evaluation, name=name)
        best = np.array([np.inf, 0.9, 0.7, 0.7])
        history = History(best, best + 0.1, np.array([0, 4, 5, 3]), 20 * np.arange(1, 5))
        return Result(problem, evaluation, history, SearchFacts(**FACTS, stopped_by=stopped_by), name=name)

    return make


def problem_for(scenario, dof, names=None):
    """An example's task with other names for its points."""
    settings = Settings().replace(
        {
            "task": {"recording": str(EXAMPLES / f"{scenario}.csv")},
            "design": {"dof": dof},
            "fitness": {"scenario": scenario},
        }
    )
    problem = prepare(read_recording(EXAMPLES / f"{scenario}.csv"), settings)
    if names is None:
        return problem
    task = problem.task
    renamed = Task(task.time, task.P, None, task.quaternions, names, task.base, task.steps)
    demonstration = dataclasses.replace(problem.first, task=renamed)
    return DesignProblem(problem.settings, (demonstration,))


@pytest.fixture
def undrawn(monkeypatch):
    """Pages with empty figures, for what does not depend on them."""

    def empty(key, build, alt, caption=""):
        return Picture(key, '<svg viewBox="0 0 2 1"></svg>', alt, caption)

    for module in (plots, cell_pictures, tracking):
        monkeypatch.setattr(module, "picture", empty)
    for name, key in (("cell_rendering", "rendering"), ("worst_rendering", "worst"), ("sketch_picture", "sketch")):
        monkeypatch.setattr(report_page, name, lambda *_, key=key, **__: empty(key, None, ""))


@pytest.fixture(scope="session")
def longer():
    """A run on a task that is repeated many times over."""

    def stretch(run, times):
        task, path = run.problem.task, run.evaluation.path
        frames = len(task.time) * times
        time = task.time[0] + task.dt * np.arange(frames)
        P = np.tile(task.P, (times, 1, 1))
        first = dataclasses.replace(run.problem.first, task=Task(time, P, None, None, task.points, task.base))
        problem = dataclasses.replace(run.problem, demonstrations=(first,))
        q = np.tile(np.concatenate([path.q, path.q[::-1]]), (times // 2, 1))
        path = BlockEvaluator(problem.path_problem, block=1).replay(run.table, q)
        score = dataclasses.replace(run.evaluation.demonstrations[0], path=path)
        return dataclasses.replace(
            run, problem=problem, evaluation=dataclasses.replace(run.evaluation, demonstrations=(score,))
        )

    return stretch


@pytest.fixture(scope="session")
def folders(tmp_path_factory):
    """The folder of a small search of each scenario."""
    made = {}
    for scenario, dof in (("packaging", 3), ("welding", 5)):
        problem = problem_for(scenario, dof).with_settings({"search": {"particles": 20, "iterations": 3}})
        folder = claim_folder(tmp_path_factory.mktemp("runs") / scenario)
        write_result(folder, search(problem))
        made[scenario] = folder
    return made
