"""Searching for the number of joints: warm starts, stops and resumes, and a folder that is a run folder."""

import json
import signal
from itertools import pairwise

import numpy as np
import pytest

from armdesign.errors import RunFolderError
from armdesign.experiments.auto_dof.choose_dof import auto_dof, publish
from armdesign.experiments.auto_dof.dof_records import has_choice, holds_auto, read_auto
from armdesign.experiments.auto_dof.dof_rule import Rule, choose_dof
from armdesign.experiments.auto_dof.extra_joint import with_extra_joint
from armdesign.kinematics.dh_files import read_design
from armdesign.runs.reading import read_problem, read_result
from armdesign.search.backends.backend import InProcess
from armdesign.search.evaluation import evaluate_design
from armdesign.search.search import NothingFoundError


def timeless(path):
    """A JSON file without what differs from run to run: times and places."""
    text = path.read_text(encoding="utf-8")

    def plain(value):
        if isinstance(value, dict):
            return {k: plain(v) for k, v in value.items() if k not in ("wall_time", "folder")}
        return [plain(v) for v in value] if isinstance(value, list) else value

    return plain(json.loads(text))


def same(folder, other):
    """Whether two choices are equal to the last bit."""
    assert timeless(folder / "auto.json") == timeless(other / "auto.json")
    for path in sorted(other.glob("n*/result.json")):
        twin = folder / path.relative_to(other)
        assert timeless(twin) == timeless(path)
        assert (twin.parent / "history.csv").read_bytes() == (path.parent / "history.csv").read_bytes()
    assert (folder / "trajectory.csv").read_bytes() == (other / "trajectory.csv").read_bytes()


def test_choice_follows_the_rule(uninterrupted):
    _, outcome = uninterrupted
    f = {found.dof: found.path_fitness for found in outcome.results}
    assert outcome.verdict.dof == choose_dof(f, Rule(0.04, 0.0))
    assert f"{1e3 * f[outcome.verdict.dof]:.2f} mm" in outcome.explanation


def test_folder_is_the_run_folder_of_the_chosen_arm(uninterrupted):
    folder, outcome = uninterrupted
    run = folder / f"n{outcome.verdict.dof}"
    for name in ("result.json", "settings.toml", "task.csv", "trajectory.csv", "history.csv", "arm.urdf"):
        assert (folder / name).read_bytes() == (run / name).read_bytes()
    assert read_result(folder).evaluation.path_fitness == read_result(run).evaluation.path_fitness
    assert (folder / "pareto.png").read_bytes()[:4] == b"\x89PNG"
    assert has_choice(folder)


def test_one_joint_more_of_no_length_is_no_worse(uninterrupted, problem_for):
    folder, outcome = uninterrupted
    for found in outcome.results:
        if not found.valid:
            continue
        table = read_design(folder / f"n{found.dof}" / "result.json")
        larger = problem_for(found.dof + 1)
        designs = with_extra_joint(table, larger.space, 1000)
        scores, _ = InProcess(larger).evaluate(designs, np.full(len(designs), np.inf))
        assert scores.valid.all()
        assert scores.path_fitness.min() <= found.path_fitness * (1.0 + 1e-6)
        assert scores.fitness.min() <= found.fitness * (1.0 + 1e-6)
        warm = read_problem(folder / f"n{found.dof + 1}") if (folder / f"n{found.dof + 1}").exists() else None
        if warm is not None:
            assert [tuple(Phi) for Phi in designs[: len(warm.settings.search.first)]] == list(
                warm.settings.search.first
            )


def test_warm_started_search_is_no_worse_than_the_smaller_arm(uninterrupted):
    _, outcome = uninterrupted
    r = [found.fitness for found in outcome.results if found.valid]
    assert all(after <= before * (1.0 + 1e-6) for before, after in pairwise(r))


@pytest.mark.parametrize(
    "stop_at", [pytest.param(1, marks=pytest.mark.slow), 3, pytest.param(5, marks=pytest.mark.slow)]
)
def test_interrupted_and_resumed_equals_uninterrupted(choose, uninterrupted, tmp_path, stop_at):
    count = 0

    def stop(progress):
        nonlocal count
        count += 1
        if count == stop_at:
            signal.raise_signal(signal.SIGINT)

    folder = tmp_path / "stopped"
    outcome = choose(folder, progress=stop)
    assert outcome.interrupted
    assert holds_auto(folder)
    assert not has_choice(folder)
    assert not (folder / "result.json").exists()
    assert choose(folder, fresh=False).verdict == uninterrupted[1].verdict
    same(folder, uninterrupted[0])


@pytest.mark.parametrize("crash_at", [pytest.param(2, marks=pytest.mark.slow), 5])
def test_crashed_and_resumed_equals_uninterrupted(choose, uninterrupted, tmp_path, crash_at):
    count = 0

    def crash(progress):
        nonlocal count
        count += 1
        if count == crash_at:
            raise MemoryError

    folder = tmp_path / "crashed"
    with pytest.raises(MemoryError):
        choose(folder, progress=crash)
    choose(folder, fresh=False)
    same(folder, uninterrupted[0])


def test_finished_searches_are_not_repeated(choose, uninterrupted):
    begun = []
    outcome = choose(uninterrupted[0], fresh=False, begin=lambda n, problem: begun.append(n))
    assert begun == []
    assert outcome.verdict == uninterrupted[1].verdict


def test_kill_while_the_chosen_arm_is_copied_is_healed(choose, uninterrupted, tmp_path):
    folder = uninterrupted[0]
    before = (folder / "result.json").read_bytes()
    (folder / "result.json").unlink()
    assert not has_choice(folder)
    choose(folder, fresh=False)
    assert (folder / "result.json").read_bytes() == before
    publish(folder / "n3", tmp_path)
    assert not (tmp_path / ".lock").exists()


def test_numbers_of_joints_without_an_arm_are_passed_over(choose, tmp_path):
    folder = tmp_path / "run"
    outcome = choose(folder, joints=(1, 3), rule=Rule(0.04, 1.0))  # a single joint cannot be 0.6 m long
    assert [found.valid for found in outcome.results] == [False, True]
    assert outcome.verdict.dof == 3
    assert read_auto(folder).failed.keys() == {1}
    assert "no arm of 1 was found" in outcome.explanation.lower()


def test_no_arm_at_all_says_once_what_to_do(choose, tmp_path):
    with pytest.raises(NothingFoundError, match="no arm of 1 to 1 joints was found") as error:
        choose(tmp_path / "run", joints=(1,))
    assert "more joints" not in str(error.value)
    assert str(error.value).endswith("wider bounds")


def test_enough_ends_it_before_the_larger_ones(choose, tmp_path):
    outcome = choose(tmp_path / "run", joints=(3, 4, 5), rule=Rule(0.04, 1.0))
    assert [found.dof for found in outcome.results] == [3]
    assert not (tmp_path / "run" / "n4").exists()


def test_one_call_chooses_and_keeps_what_is_there(problem_for, tmp_path):
    choice = auto_dof(problem_for, tmp_path / "auto", Rule(0.04, 1.0))
    assert choice.verdict.reason == "enough"
    assert has_choice(choice.folder)
    with pytest.raises(RunFolderError, match="already holds a search for the number of joints"):
        auto_dof(problem_for, choice.folder)


def test_extended_arm_at_rest_has_the_same_path(uninterrupted, problem_for):
    folder, outcome = uninterrupted
    n = outcome.results[-1].dof - 1
    table = read_design(folder / f"n{n}" / "result.json")
    evaluation = evaluate_design(table, problem_for(n))
    larger = problem_for(n + 1)
    extended = larger.space.table(with_extra_joint(table, larger.space, 1)[0])
    where = int(np.flatnonzero((extended.a == 0.0) & (extended.d == 0.0))[-1])
    q = evaluation.path.q[0]
    candidates = [extended.frames(np.insert(q, k, 0.0))[-1] for k in range(n + 1)]
    assert any(np.allclose(pose, table.frames(q)[-1], atol=1e-12) for pose in candidates), where
