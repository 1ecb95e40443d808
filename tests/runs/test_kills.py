import os
import random
import signal
import subprocess
import sys
import time

import child_runs as runs
import pytest

from armdesign.runs.resumable import finished

PLACES = [  # one kill for every state that the folder can be in
    ("task.csv", 1, "after"),
    ("settings.toml", 1, "after"),
    ("state-previous.npz", 1, "after"),
    ("state.npz", 6, "after"),
    ("result.json", 1, "before"),
    ("result.json", 1, "after"),
]
MORE_PLACES = [
    ("task.csv", 1, "before"),
    *(("task.json", 1, moment) for moment in ("before", "after")),
    ("settings.toml", 1, "before"),
    *(("state-next.npz", count, "before") for count in (1, 3)),
    *(("state.npz", count, "before") for count in (1, 3)),
    ("state-previous.npz", 1, "before"),
    *((name, 1, "after") for name in ("history.csv", "trajectory.csv", "arm.urdf")),
]


@pytest.mark.parametrize(
    ("name", "count", "moment"), [*PLACES, *(pytest.param(*place, marks=pytest.mark.slow) for place in MORE_PLACES)]
)
def test_killed_beside_a_rename(tmp_path, child, begin, check, name, count, moment):
    folder = tmp_path / "run"
    killed = child(*begin(folder), before=lambda: runs.die_at_rename(name, count, moment))
    assert killed.wait() == -signal.SIGKILL
    check(folder)


def test_killed_when_an_earlier_run_is_being_replaced(tmp_path, child, begin, check):
    """The settings of one run never meet the task of another."""
    folder = tmp_path / "run"
    for name in ("task.csv", "settings.toml"):
        other = ("search", runs.EXAMPLES / "welding.csv", "--particles", 10, "--iterations", 40, "--out", folder)
        ended = child(*other, "--overwrite", before=lambda: runs.at_iteration(2, runs.send(signal.SIGINT)))
        assert ended.wait() in (2, 130), ended.said()
        killed = child(*begin(folder, "--overwrite"), before=lambda: runs.die_at_rename(name, 1, "before"))  # noqa: B023
        assert killed.wait() == -signal.SIGKILL
        check(folder)


def dies_at_call(k, folder, child, begin, check):
    """Whether the run was killed at that call to the file system; checks that it recovers."""
    code = child(*begin(folder), before=lambda: runs.die_at_call(k)).wait()
    assert code in (0, -signal.SIGKILL)
    if folder.is_dir():
        check(folder)
    return code != 0


@pytest.mark.parametrize("k", [22, *(pytest.param(k, marks=pytest.mark.slow) for k in (5, 39, 56, 73))])
def test_killed_at_some_call_to_the_file_system(tmp_path, child, begin, check, k):
    dies_at_call(k, tmp_path / "run", child, begin, check)


@pytest.mark.slow
def test_killed_at_every_call_to_the_file_system(tmp_path, child, begin, check):
    k = 1
    while dies_at_call(k, tmp_path / f"run-{k}", child, begin, check):
        k += 1
    assert k > 60


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_killed_at_a_random_moment(tmp_path, child, begin, check, seed):
    folder, rng = tmp_path / "run", random.Random(seed)
    killed = child(*begin(folder), before=lambda: runs.linger(0.03))
    runs.until((folder / "state.npz").exists)
    time.sleep(rng.uniform(0.0, 0.2))
    os.kill(killed.pid, signal.SIGKILL)
    assert killed.wait() == -signal.SIGKILL
    check(folder)


def test_a_state_cut_off_by_the_kill_is_cleared_away(tmp_path, child, begin, check):
    folder = tmp_path / "run"
    child(*begin(folder), before=lambda: runs.die_at_rename("state-next.npz", 3, "before")).wait()
    assert any(name.endswith(".tmp") for name in runs.names(folder))
    check(folder)
    assert runs.names(folder) == runs.FINISHED


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_workers_end_with_a_killed_search_and_it_goes_on_without_them(tmp_path, child, begin, check):
    folder = tmp_path / "run"
    killed = child(*begin(folder, "--workers", 2), before=lambda: runs.linger(0.2))
    assert runs.until((folder / "state.npz").exists), killed.said()
    workers = runs.workers_of(killed.pid)
    assert len(workers) == 2
    os.kill(workers[0], signal.SIGKILL)
    assert runs.until(lambda: len(set(runs.workers_of(killed.pid)) - set(workers)) == 1)
    workers = runs.workers_of(killed.pid)
    os.kill(killed.pid, signal.SIGKILL)
    assert killed.wait() == -signal.SIGKILL
    assert runs.until(lambda: not any(map(runs.alive, workers)), 20.0)
    check(folder)


COMMAND = [sys.executable, "-c", "from armdesign.cli import main; main()"]
LONGER = ("--particles", "60", "--iterations", "40", "--out")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_thirty_kills_of_searches_and_of_their_workers(tmp_path):
    rng, kills = random.Random(0), {"search": 0, "worker": 0, "terminated": 0}
    recording = runs.EXAMPLES / "packaging.csv"
    reference = tmp_path / "reference"
    subprocess.run([*COMMAND, "search", recording, *LONGER, reference, "--workers", "2", "-q"], check=True)
    wanted, attempt = runs.outcome(reference), 0
    while sum(kills.values()) < 30 or min(kills.values()) < 5:
        folder = tmp_path / f"run-{attempt}"
        attempt += 1
        first = ["search", recording, *LONGER, folder, "--overwrite"]
        while not finished(folder):
            known = (folder / "settings.toml").is_file() and (folder / "task.json").is_file()
            args = ["search", "--resume", folder] if known else first
            live_dangerously([*COMMAND, *args, "-q", "--workers", rng.choice("1223")], folder, rng, kills)
        assert runs.outcome(folder) == wanted
    print(kills)


def live_dangerously(command, folder, rng, kills):
    """Run a search until it ends or is ended, after a random time or a random number of states."""
    with (folder.parent / "log").open("w+") as log:
        search = subprocess.Popen([str(part) for part in command], stderr=log, stdout=log)
        seen = []
        while search.poll() is None:
            wait_a_while(search, folder, rng)
            workers = runs.workers_of(search.pid)
            kind = rng.choice(["search", "search", "worker", "terminated"])
            if search.poll() is not None or (kind == "worker" and not workers):
                continue
            if kind == "worker":
                os.kill(rng.choice(workers), signal.SIGKILL)
            else:
                os.kill(search.pid, signal.SIGKILL if kind == "search" else signal.SIGTERM)
                search.wait(120)
            kills[kind] += 1
            seen += workers
        said = log.seek(0) or log.read()
    assert search.returncode in (0, 130, -signal.SIGKILL, -signal.SIGTERM), said
    assert "Traceback" not in said
    assert runs.until(lambda: not any(map(runs.alive, seen)), 30.0)


def wait_a_while(search, folder, rng):
    if rng.random() < 0.3:
        time.sleep(rng.uniform(0.0, 6.0))
        return
    for _ in range(rng.randint(1, 3)):
        before = written(folder)
        runs.until(lambda: written(folder) != before or search.poll() is not None)  # noqa: B023
    time.sleep(rng.uniform(0.0, 0.05))


def written(folder):
    try:
        return (folder / "state.npz").stat().st_mtime_ns
    except OSError:
        return None
