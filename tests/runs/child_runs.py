"""Searches in processes of their own that can be killed at will, and what they leave behind."""

import json
import os
import signal
import sys
import time
import traceback
from pathlib import Path

import numpy as np

from armdesign.cli import app
from armdesign.runs import checkpoint
from armdesign.runs.folder import PREVIEW, REPORT
from armdesign.search.backends import parallel
from armdesign.search.search import Search

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
FINISHED = {
    "history.csv", "settings.toml", "task.csv", "task.json", "trajectory.csv", "arm.urdf", "alternatives.json",
    "result.json", "state.npz",
}  # fmt: skip


def outcome(folder):
    """Everything a finished run says, times aside."""
    texts = {name: (folder / name).read_text() for name in FINISHED - {"result.json", "state.npz"}}
    result = json.loads((folder / "result.json").read_text())
    result.pop("wall_time")
    return texts | {"result.json": result}


def names(folder):
    """Files in a run folder; preview and report, which only come when all is done, do not count."""
    return {path.name for path in folder.iterdir()} - {PREVIEW, REPORT}


def rows(folder):
    """Lines of history.csv below its header."""
    return (folder / "history.csv").read_text().splitlines()[1:]


def stopped_by(folder):
    return json.loads((folder / "result.json").read_text())["stopped_by"]


class Child:
    """An armdesign command in a forked process, the leader of a group of its own; its output goes to a log."""

    def __init__(self, log, args, before=None):
        """Start; ``before`` runs in the child only, to arrange what is to happen to it."""
        self.log, self.code = log, None
        sys.stdout.flush()
        self.pid = os.fork()
        if self.pid == 0:
            os._exit(self._live(args, before))

    def _live(self, args, before):
        code = 99
        try:
            os.setsid()
            stream = self.log.open("w", buffering=1)
            os.dup2(stream.fileno(), 1)
            os.dup2(stream.fileno(), 2)
            sys.stdout = sys.stderr = stream
            if before is not None:
                before()
            app([str(arg) for arg in args])
        except SystemExit as error:
            code = error.code or 0
        except BaseException:
            traceback.print_exc()
        return code

    def poll(self):
        """Exit code, minus the signal's number where one has killed it; None while it runs."""
        if self.code is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            self.code = os.waitstatus_to_exitcode(status) if pid else None
        return self.code

    def wait(self, seconds=120.0):
        assert until(lambda: self.poll() is not None, seconds), self.log.read_text()
        return self.code

    def said(self):
        return self.log.read_text()


def until(condition, seconds=180.0):
    """Wait until the condition holds; whether it came to."""
    deadline = time.monotonic() + seconds
    while not (met := condition()) and time.monotonic() < deadline:
        time.sleep(0.01)
    return bool(met)


def workers_of(pid):
    """Process numbers of the workers of a process: its own children, or those of the server that forks them."""
    parents = {entry: parent_of(entry) for entry in Path("/proc").iterdir() if entry.name.isdigit()}
    own = {entry: command_of(entry) for entry, parent in parents.items() if parent == pid}
    servers = {int(entry.name) for entry, command in own.items() if b"multiprocessing.forkserver" in command}
    spawned = [entry for entry, command in own.items() if b"spawn_main" in command]
    return [int(entry.name) for entry in [*spawned, *(e for e, parent in parents.items() if parent in servers)]]


def parent_of(entry):
    try:
        return int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
    except (OSError, IndexError):
        return None


def command_of(entry):
    try:
        return (entry / "cmdline").read_bytes()
    except OSError:
        return b""


def alive(pid):
    """Whether a process still runs; one that waits to be reaped does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] not in "ZX"
    except OSError:
        return False


def write_each_state_at_once():
    """Make the search wait for every state, so that the n-th write belongs to the n-th iteration."""

    def submit(self, state):
        checkpoint.save_state(self.folder, checkpoint.pack(state, self.identity))

    checkpoint.StateWriter.submit = submit


def die():
    os.kill(os.getpid(), signal.SIGKILL)


def die_at_rename(name, count, moment):
    """Die just before or after the count-th time that a file is renamed to this name."""
    rename, seen = os.replace, []

    def replace(source, target):
        hit = Path(target).name == name
        if hit:
            seen.append(target)
        if hit and len(seen) == count:
            if moment == "after":
                rename(source, target)
            die()
        rename(source, target)

    write_each_state_at_once()
    os.replace = replace


def die_at_call(k):
    """Die before the k-th call with which a file is opened, flushed, renamed or removed."""
    left = [k]

    def counting(call):
        def counted(*args, **kwargs):
            left[0] -= 1
            if left[0] == 0:
                die()
            return call(*args, **kwargs)

        return counted

    for name in ("open", "fsync", "replace", "unlink"):
        setattr(os, name, counting(getattr(os, name)))


def at_iteration(k, *actions):
    """Run the actions in the midst of the k-th iteration."""
    advance = Search.advance

    def acting(self):
        if self.swarm.iteration == k - 1:
            for action in actions:
                action()
        return advance(self)

    write_each_state_at_once()
    Search.advance = acting


def send(number):
    """A signal to this very process."""
    return lambda: os.kill(os.getpid(), number)


def linger(pause):
    """Make every iteration last longer."""
    advance = Search.advance

    def slow(self):
        time.sleep(pause)
        return advance(self)

    Search.advance = slow


POISON = "ARMDESIGN_TEST_POISON"
EVALUATOR = parallel.evaluator


def poisoned_evaluator(problem, block):
    """Setup of a real worker that dies of one candidate, named in the environment by its first entry."""
    evaluate = EVALUATOR(problem, block)

    def deadly(part, context):
        if np.any(part.Phi[:, 0] == float(os.environ[POISON])):
            die()
        return evaluate(part, context)

    return deadly
