"""A real scheduler and real workers as processes of 127.0.0.1, for the tests of the Dask backend."""

import json
import os
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import armdesign

LOCAL = ("--host", "127.0.0.1", "--no-dashboard")
QUIET = {
    "DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED": "False",
    "DASK_DISTRIBUTED__ADMIN__TICK__INTERVAL": "1s",
    "DASK_DISTRIBUTED__ADMIN__SYSTEM_MONITOR__INTERVAL": "10s",
}
"""Else an idle cluster, which lasts to the end of the tests, takes a tenth of a processor to look at itself."""


class Processes:
    """A scheduler and its workers; every process is ended with it."""

    def __init__(self, folder, **settings):
        self.folder, self.workers, self.started = folder, [], []
        above = os.pathsep.join([str(Path(armdesign.__file__).resolve().parents[1]), str(Path(__file__).parent)])
        self.environment = (
            os.environ | QUIET | {"PYTHONPATH": os.pathsep.join([above, os.environ.get("PYTHONPATH", "")])} | settings
        )
        note = folder / "scheduler.json"
        self.scheduler = self.start("dask_scheduler", "--port", "0", "--scheduler-file", note)
        until(lambda: note.exists() and note.read_text().endswith("}"))
        self.address = json.loads(note.read_text())["address"]

    def start(self, kind, *options):
        command = [sys.executable, "-m", f"distributed.cli.{kind}", *LOCAL, *map(str, options)]
        with (self.folder / "log").open("a") as log:
            process = subprocess.Popen(command, stdout=log, stderr=log, env=self.environment, cwd=self.folder)
        self.started.append(process)
        return process

    def add_worker(self, threads=1, *options):
        """Start a worker without a nanny: killed, it stays dead."""
        self.workers.append(self.start_worker("--no-nanny", "--nthreads", threads, *options))
        return self.workers[-1]

    def start_worker(self, *options):
        common = ("--local-directory", self.folder, "--memory-limit", 0)
        return self.start("dask_worker", self.address, *common, *options)

    def stop(self):
        for process in reversed(self.started):  # the scheduler last; a nanny ends its workers
            process.terminate()
        for process in self.started:
            try:
                process.wait(2)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


@contextmanager
def processes(folder, **settings):
    started = Processes(folder, **settings)
    try:
        yield started
    finally:
        started.stop()


def until(condition, timeout=60.0):
    """Wait for a condition."""
    deadline = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError("what was waited for has not come")
        time.sleep(0.02)
