import csv
import io
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time

import psutil
import pytest

from armdesign.experiments.sweep.run_sweep import run_sweep
from armdesign.experiments.sweep.sweep_store import read_sweep
from armdesign.experiments.sweep.units import unit_worker
from armdesign.runs.lock import holder_of
from armdesign.search.backends.processes import WorkerProcesses

TINY = ("--particles", 8, "--iterations", 3)
needs_signals = pytest.mark.skipif(sys.platform == "win32", reason="signals")


def rows(folder):
    with (folder / "sweep.csv").open(encoding="utf-8", newline="") as stream:
        return [{k: v for k, v in row.items() if k != "wall_time"} for row in csv.DictReader(stream)]


@pytest.fixture
def start(environment, place):
    """Start a command as a real process in its own process group; its output goes to a file."""
    started = []

    def begin(*args):
        log = (place / f"log-{len(started)}").open("w+")
        command = [sys.executable, "-c", "from armdesign.cli import main; main()", *map(str, args)]
        child = subprocess.Popen(command, stdout=log, stderr=log, env=environment, start_new_session=True)
        started.append((child, log))
        return child

    yield begin
    for child, log in started:
        if child.poll() is None:
            os.killpg(child.pid, signal.SIGKILL)
            child.wait()
        log.close()


def await_search(folder, child, saved=True):
    """Wait until a search is under way, by default until it has saved a state as well."""

    def under_way():
        return any(holder_of(run) and (not saved or (run / "state.npz").exists()) for run in folder.glob("*-seed*"))

    deadline = time.monotonic() + 120
    while not under_way():
        assert child.poll() is None, "ended too early"
        assert time.monotonic() < deadline
        time.sleep(0.02)


def await_iteration(child):
    """Wait until a worker has done more than start and draw, which takes it 1 s of a processor."""
    deadline = time.monotonic() + 120
    while max((one.cpu_times().user for one in psutil.Process(child.pid).children(recursive=True)), default=0.0) < 3.0:
        assert child.poll() is None, "ended too early"
        assert time.monotonic() < deadline
        time.sleep(0.1)


@pytest.fixture(scope="module")
def done(run, packaging, tmp_path_factory):
    """A finished sweep of one run, with what the command printed."""
    folder = tmp_path_factory.mktemp("done") / "s"
    outcome = run("sweep", packaging, "--dof", 4, *TINY, "--seeds", "7-7", "--workers", 1, "--out", folder)
    assert outcome.exit_code == 0, outcome.output
    return folder


def stamps(folder):
    return {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in folder.rglob("*") if path.is_file()}


def test_sweep_extension_and_exit_codes(run, packaging, place):
    ask = ("sweep", packaging, "--dof", "4,5", "--algorithm", "pso,rapso", *TINY, "--out", "s", "--workers", 1)
    outcome = run(*ask, "--seeds", 1)
    assert outcome.exit_code == 0, outcome.output
    names = [f"packaging-{kind}-seed0" for kind in ("pso-n4", "pso-n5", "rapso-n4-D2", "rapso-n5-D2")]
    assert [row["folder"] for row in rows(place / "s")] == names
    assert "4 of 4 runs finished." in outcome.output
    assert f"Table: {os.path.join('s', 'sweep.csv')}" in outcome.output
    for name in names:
        assert re.search(rf"^\d/4 runs.*  {name}  finished, r \d\.\d{{4}}$", outcome.output, re.MULTILINE)
    before = {path: path.stat().st_mtime_ns for path in place.glob("s/packaging-*/*")}
    outcome = run("sweep", packaging, "--dof", "2,4,5", *ask[4:], "--seeds", 1, "--quiet")
    assert (outcome.exit_code, outcome.output) == (1, "")
    assert [row["state"] for row in rows(place / "s")] == ["failed", "finished", "finished"] * 2
    assert {path: path.stat().st_mtime_ns for path in before} == before
    assert run("runs", "s").output.count("finished") == 4


def test_finished_sweep_has_nothing_to_resume(run, done, place):
    assert [row["folder"] for row in rows(done)] == ["packaging-rapso-n4-D2-seed7"]
    folder = shutil.copytree(done, place / "s")
    runs = {path: stamp for path, stamp in stamps(folder).items() if path.parent != folder}
    outcome = run("sweep", "--resume", "s")
    assert outcome.exit_code == 0
    assert outcome.output.startswith("1 of 1 runs finished.\nBest: packaging-rapso-n4-D2-seed7, hand error ")
    assert runs.items() <= stamps(folder).items()


def test_folder_is_named_after_the_recording_where_none_is_named(run, packaging, place):
    outcome = run("sweep", packaging, "--dry-run")
    assert f"1 run in {os.path.join('runs', 'packaging-sweep')}, 0 of them finished" in outcome.output


def test_dry_run_prints_the_runs_and_a_time_and_writes_nothing(run, packaging, place):
    ask = ("sweep", packaging, "--dof", "4-5", "--seeds", 2, "--algorithm", "rapso,pso", "--d", "2,4", "--out", "s")
    outcome = run(*ask, "--dry-run", "--workers", 3)
    assert outcome.exit_code == 0, outcome.output
    assert not list(place.iterdir())
    assert "12 runs in s, 0 of them finished:" in outcome.output
    lines = re.findall(r"^(packaging-\S+) +new +about ([\d:]+)$", outcome.output, re.MULTILINE)
    assert [name for name, _ in lines] == [
        f"packaging-{kind}-seed{seed}"
        for kind in ("rapso-n4-D2", "rapso-n4-D4", "rapso-n5-D2", "rapso-n5-D4", "pso-n4", "pso-n5")
        for seed in (0, 1)
    ]
    assert re.search(r"An estimate, .*: about [\d:]+ with 3 at a time", " ".join(outcome.output.split()))


def test_dry_run_of_a_sweep_that_is_there_leaves_it_alone(run, done, packaging, place):
    folder = shutil.copytree(done, place / "s")
    before = stamps(folder)
    ask = ("sweep", packaging, "--dof", 4, *TINY, "--out", "s", "--dry-run")
    outcome = run(*ask, "--seeds", "7-8")
    assert "2 runs in s, 1 of them finished:\n" in outcome.output
    assert re.search(r"^packaging-rapso-n4-D2-seed7 +finished +-$", outcome.output, re.MULTILINE)
    assert re.search(r"seed8 +new +about", outcome.output)
    assert "0 of them finished" not in run("sweep", "--resume", "s", "--dry-run").output
    assert run(*ask, "--seeds", 1).exit_code == 2
    assert stamps(folder) == before


def test_dry_run_knows_more_candidates_and_pso_as_longer(packaging):
    from armdesign import Settings, prepare, read_recording  # noqa: PLC0415
    from armdesign.experiments.sweep.estimate import Cost, Estimate, duration  # noqa: PLC0415
    from armdesign.experiments.sweep.sweep_plan import unit_for  # noqa: PLC0415

    def time_of(algorithm="rapso", **search):
        settings = Settings().replace({"search": search})
        task = prepare(read_recording(packaging), settings)
        return duration(unit_for("a.csv", task, algorithm, None, 0), Cost(0.002, 0.001, reached=True))

    assert time_of(particles=800) == pytest.approx(2 * time_of())
    assert time_of(iterations=400) == pytest.approx(2 * time_of())
    assert time_of("pso") > time_of()
    assert time_of(prune=False) > time_of()
    assert time_of(time_limit=1.0) == 1.0
    assert Estimate((1.0, 2.0, 3.0), ()).total(2) == 3.0
    assert Estimate((1.0, 5.0, 3.0), ()).total(100) == 5.0


def test_bar_in_a_terminal_is_below_the_runs_that_have_ended(monkeypatch):
    from armdesign.cli.screen import SweepBar  # noqa: PLC0415
    from armdesign.experiments.sweep.run_sweep import SweepStatus  # noqa: PLC0415
    from armdesign.experiments.sweep.units import Outcome  # noqa: PLC0415
    from armdesign.search.search import Progress  # noqa: PLC0415

    stream = io.StringIO()
    monkeypatch.setattr(stream, "isatty", lambda: True)
    monkeypatch.setattr("sys.stderr", stream)
    monkeypatch.setenv("COLUMNS", "60")
    monkeypatch.setenv("TERM", "dumb")
    with SweepBar() as bar:
        bar(SweepStatus(2, 1, 0, {"a-run": Progress(7, 20, 0.5, 0.1, 0.1, 3, 8, 1.0), "x" * 80: None}, left=61.0))
        bar(SweepStatus(2, 1, 1, {}, None, "a-run", Outcome("failed", "it was in vain")))
    lines = stream.getvalue().splitlines()
    assert "2/2 runs (1 failed)  a-run  failed: it was in vain" in lines
    assert all(len(line) <= 60 for line in lines)


@needs_signals
def test_killed_group_of_processes_goes_on_to_the_same_table(run, start, packaging, place):
    rng = random.Random(0)
    ask = ("sweep", packaging, "--dof", 4, "--algorithm", "pso", "--seeds", 3, "--particles", 8)
    for args in ((*ask, "--iterations", 30, "--out", "s", "--workers", 2), ("sweep", "--resume", "s", "--workers", 1)):
        child = start(*args)
        await_search(place / "s", child)
        time.sleep(rng.uniform(0.0, 0.2))
        os.killpg(child.pid, signal.SIGKILL)
        child.wait()
    finished = {path: path.stat().st_mtime_ns for path in place.glob("s/*seed*/result.json")}
    assert run("sweep", "--resume", "s", "--workers", 1).exit_code == 0
    undisturbed = place / "undisturbed"
    run_sweep(undisturbed, *read_sweep(place / "s"), lambda units: WorkerProcesses(1, unit_worker))
    assert rows(place / "s") == rows(undisturbed)
    assert {path: path.stat().st_mtime_ns for path in finished} == finished
    for history in undisturbed.glob("*/history.csv"):
        assert (place / "s" / history.parent.name / "history.csv").read_bytes() == history.read_bytes()


@needs_signals
def test_ctrl_c_once_stops_in_order_and_says_how_to_go_on(run, start, packaging, place):
    ask = ("sweep", packaging, "--dof", 4, "--seeds", 2, "--particles", 12, "--iterations", 100_000, "--workers", 1)
    child = start(*ask, "--out", "s")
    await_search(place / "s", child)
    refusal = run("sweep", "--resume", "s")
    assert refusal.exit_code == 2
    assert f"in use by process {child.pid}" in refusal.output
    assert "running by process" in run("runs", "s").output
    os.killpg(child.pid, signal.SIGINT)  # as a terminal does it
    assert child.wait(60) == 130
    log = (place / "log-0").read_text()
    assert "Stopping: " in log
    assert log.splitlines()[-1] == "Interrupted. Go on with: armdesign sweep --resume s"
    assert "Traceback" not in log
    assert [row["state"] for row in rows(place / "s")] == ["interrupted", "waiting"]
    assert rows(place / "s")[0]["stopped_by"] == "interrupted"
    assert re.search(r"seed0  interrupted  +\d", run("runs", "s").output)


@needs_signals
def test_sigterm_to_the_sweep_alone_stops_its_workers_and_ctrl_c_twice_stops_at_once(start, packaging, place):
    ask = ("sweep", packaging, "--dof", 6, "--particles", 20_000, "--iterations", 10, "--workers", 1)
    child = start(*ask, "--out", "s")
    await_search(place / "s", child, saved=False)
    await_iteration(child)
    child.send_signal(signal.SIGTERM)
    time.sleep(0.7)
    assert child.poll() is None  # an iteration takes minutes
    began = time.monotonic()
    child.send_signal(signal.SIGINT)
    assert child.wait(30) == 130
    assert time.monotonic() - began < 20.0
    lines = (place / "log-0").read_text().splitlines()
    assert lines[-2:] == ["Go on with: armdesign sweep --resume s", "armdesign: stopped"]
    assert not list(place.glob("s/*/result.json"))
