import json
import os
import signal
import subprocess
import sys

import child_runs as runs
import pytest

from armdesign.kinematics.dh_files import read_design
from armdesign.search.backends import parallel
from armdesign.search.backends.backend import InProcess
from armdesign.search.backends.parallel import CandidateKillsWorkersError
from armdesign.search.search import Search

BOTH = pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])


@BOTH
def test_one_signal_ends_the_search_after_the_iteration_with_a_whole_run_folder(
    tmp_path, child, begin, undisturbed, check, number
):
    folder = tmp_path / "run"
    ended = child(*begin(folder), before=lambda: runs.at_iteration(3, runs.send(number)))
    assert ended.wait() == 130
    assert ended.said().splitlines()[-1] == f"Interrupted; go on with: armdesign search --resume {folder}"
    assert runs.names(folder) == runs.FINISHED | {"state-previous.npz"}
    assert runs.stopped_by(folder) == "interrupted"
    assert runs.rows(folder) == undisturbed.rows[:3]
    assert json.loads((folder / "result.json").read_text())["fitness"] == float(runs.rows(folder)[-1].split(",")[1])
    check(folder)
    assert runs.names(folder) == runs.FINISHED


@BOTH
def test_a_second_signal_ends_it_at_once(tmp_path, child, begin, check, number):
    folder = tmp_path / "run"
    twice = (runs.send(signal.SIGINT), runs.send(number))
    ended = child(*begin(folder), before=lambda: runs.at_iteration(3, *twice))
    assert ended.wait() == 130
    assert "Traceback" not in ended.said()
    assert ended.said().splitlines()[-1] == "armdesign: stopped"
    assert not {"result.json", ".lock"} & runs.names(folder)
    check(folder)


def test_interrupted_again_and_again(tmp_path, child, begin, undisturbed, check):
    folder = tmp_path / "run"
    args = begin(folder)
    for k in (1, 2, 5):
        ended = child(*args, before=lambda: runs.at_iteration(k, runs.send(signal.SIGINT)))  # noqa: B023
        assert ended.wait() == 130, ended.said()
        assert runs.rows(folder) == undisturbed.rows[:k]
        args = ("search", "--resume", folder)
    check(folder)


def test_interrupted_in_the_last_iteration_it_is_finished(tmp_path, child, begin, undisturbed):
    folder = tmp_path / "run"
    ended = child(*begin(folder), before=lambda: runs.at_iteration(6, runs.send(signal.SIGINT)))
    assert ended.wait() == 0
    assert runs.outcome(folder) == undisturbed.outcome


def test_interrupted_before_any_arm_is_valid(tmp_path, child, begin, cli):
    folder = tmp_path / "run"
    nothing_yet = begin(folder, "--particles", 2, "--iterations", 3, "--seed", 0)
    ended = child(*nothing_yet, before=lambda: runs.at_iteration(2, runs.send(signal.SIGINT)))
    assert ended.wait() == 130
    sentence = ended.said().splitlines()[-1]
    assert sentence.startswith("armdesign: interrupted before any arm reached the first frame")
    assert sentence.endswith(f"armdesign search --resume {folder}")
    resumed = cli("search", "--resume", folder, "-q")
    fresh = cli(*begin(tmp_path / "fresh", "--particles", 2, "--iterations", 3, "-q"))
    assert resumed.exit_code == fresh.exit_code == 4
    assert resumed.output == fresh.output
    assert ".lock" not in runs.names(folder)


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
@pytest.mark.parametrize("early", [True, False])
def test_ctrl_c_in_a_terminal_reaches_the_workers_too_and_leaves_none_behind(tmp_path, child, begin, check, early):
    folder = tmp_path / "run"
    ended = child(*begin(folder, "--workers", 2), before=lambda: runs.linger(0.1))
    ready = (lambda: len(runs.workers_of(ended.pid)) == 2) if early else (folder / "state.npz").exists
    assert runs.until(ready), ended.said()
    workers = runs.workers_of(ended.pid)
    assert len(workers) == 2
    os.killpg(ended.pid, signal.SIGINT)
    assert ended.wait() == 130, ended.said()
    assert runs.until(lambda: not any(map(runs.alive, workers)), 20.0)
    assert "Traceback" not in ended.said()
    assert "KeyboardInterrupt" not in ended.said()
    check(folder)


def test_a_real_command_is_interrupted_and_taken_up_again(tmp_path, begin, undisturbed, check):
    folder = tmp_path / "run"
    code = "import child_runs; child_runs.linger(0.2); from armdesign.cli import main; main()"
    command = [sys.executable, "-c", code, *map(str, begin(folder))]
    paths = os.pathsep.join(path for path in sys.path if path)
    ended = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=os.environ | {"PYTHONPATH": paths})
    assert runs.until(lambda: (folder / "state.npz").exists() or ended.poll() is not None)
    ended.send_signal(signal.SIGINT)
    _, said = ended.communicate(timeout=120)
    assert ended.returncode == 130, said
    assert runs.rows(folder) == undisturbed.rows[: len(runs.rows(folder))]
    check(folder)


def test_a_candidate_that_kills_is_kept_and_named(tmp_path, begin, cli, monkeypatch, task, check):
    folder, evaluate = tmp_path / "run", Search.advance
    designs = []

    def deadly(self):
        if self.swarm.iteration == 2:
            designs.append(self.swarm.ask()[4])
            raise CandidateKillsWorkersError("a candidate has killed 3 worker processes", value=designs[0])
        return evaluate(self)

    with monkeypatch.context() as patch:
        patch.setattr(Search, "advance", deadly)
        ended = cli(*begin(folder, "-q"))
    assert ended.exit_code == 2
    assert ended.output.startswith("armdesign: a candidate has killed 3 worker processes")
    saved = json.loads((folder / "failed_candidate.json").read_text())
    wanted = task.space.table(designs[0])
    assert saved["error"] == "a candidate has killed 3 worker processes"
    assert [row["alpha"] for row in saved["dh"]["rows"]] == wanted.alpha.tolist()
    assert read_design(folder / "failed_candidate.json").length == wanted.length
    assert ".lock" not in runs.names(folder)
    check(folder)
    assert runs.names(folder) == runs.FINISHED


@pytest.mark.slow
def test_a_candidate_that_kills_real_workers_is_kept_and_named(tmp_path, begin, cli, monkeypatch, task, check):
    folder = tmp_path / "run"
    Phi = Search(task, InProcess(task)).swarm.ask()[3]
    with monkeypatch.context() as patch:
        patch.setenv(runs.POISON, repr(float(Phi[0])))
        patch.setattr(parallel, "evaluator", runs.poisoned_evaluator)
        ended = cli(*begin(folder, "-q", "--workers", 2))
    assert ended.exit_code == 2
    assert f"Phi = {Phi.tolist()}" in ended.output
    saved, wanted = read_design(folder / "failed_candidate.json"), task.space.table(Phi)
    assert [saved.alpha.tolist(), saved.a.tolist(), saved.d.tolist()] == [
        wanted.alpha.tolist(), wanted.a.tolist(), wanted.d.tolist()
    ]  # fmt: skip
    check(folder)
    assert runs.names(folder) == runs.FINISHED
