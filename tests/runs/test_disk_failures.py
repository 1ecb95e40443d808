import errno
import os
import subprocess
import sys

import child_runs as runs
import pytest

from armdesign.errors import RunFolderError
from armdesign.runs import resumable as running
from armdesign.runs.lock import locked
from armdesign.search.backends.backend import InProcess
from armdesign.search.search import Search

FAILURES = {
    errno.ENOSPC: "the disk is full",
    errno.EROFS: "the disk is read-only",
    errno.EACCES: "the folder cannot be written to",
    errno.EIO: os.strerror(errno.EIO),
}


def refused(done, words):
    """Checks for one sentence and exit code 2."""
    assert done.exit_code == 2, done.output
    sentence = done.output.splitlines()[-1]
    assert sentence.startswith("armdesign: cannot ")
    assert words in sentence
    assert "Traceback" not in done.output


def fail_from(patch, name, count, number):
    """Let every write fail from the count-th time on that this file is written."""
    opened, seen = os.open, []

    def failing(path, flags, *mode, **options):
        if f".{name}." in os.path.basename(path):
            seen.append(path)
        if len(seen) >= count and flags & os.O_CREAT:
            raise OSError(number, os.strerror(number), str(path))
        return opened(path, flags, *mode, **options)

    patch.setattr(os, "open", failing)


WRITES = [("task.csv", 1), ("settings.toml", 1), ("state-next.npz", 1), ("state-next.npz", 4)]


@pytest.mark.parametrize(
    ("name", "count", "number"),
    [
        *((*write, errno.ENOSPC) for write in WRITES[::3]),
        *(pytest.param(*write, errno.ENOSPC, marks=pytest.mark.slow) for write in WRITES[1:3]),
        *((*WRITES[0], number) for number in list(FAILURES)[1:]),
    ],
)
def test_a_disk_that_fails_gives_one_sentence_and_the_run_can_be_taken_up(
    tmp_path, begin, cli, monkeypatch, check, name, count, number
):
    folder = tmp_path / "run"
    with monkeypatch.context() as patch:
        synchronously(patch)
        fail_from(patch, name, count, number)
        refused(cli(*begin(folder, "-q")), FAILURES[number])
    assert not any(file.endswith(".tmp") for file in runs.names(folder))
    assert "result.json" not in runs.names(folder)
    if count == 4:
        assert {"state.npz", "state-previous.npz"} <= runs.names(folder)
    check(folder)


def synchronously(patch):
    def submit(self, state):
        running.checkpoint.save_state(self.folder, running.checkpoint.pack(state, self.identity))

    patch.setattr(running.checkpoint.StateWriter, "submit", submit)


@pytest.mark.parametrize("name", ["history.csv", "result.json"])
def test_a_disk_that_is_full_at_the_end_costs_nothing(tmp_path, begin, cli, monkeypatch, check, name):
    folder = tmp_path / "run"
    with monkeypatch.context() as patch:
        fail_from(patch, name, 1, errno.ENOSPC)
        refused(cli(*begin(folder, "-q")), f"{name}: the disk is full")
    check(folder)
    assert runs.names(folder) == runs.FINISHED


@pytest.mark.parametrize("call", ["fsync", "replace"])
def test_a_flush_or_a_rename_that_fails(tmp_path, begin, cli, monkeypatch, check, call):
    folder, calls = tmp_path / "run", [0]
    done = getattr(os, call)

    def failing(*args, **options):
        calls[0] += 1
        if calls[0] > 9:
            raise OSError(errno.ENOSPC, "No space left on device")
        return done(*args, **options)

    with monkeypatch.context() as patch:
        patch.setattr(os, call, failing)
        refused(cli(*begin(folder, "-q")), "")
    assert "result.json" not in runs.names(folder)
    check(folder)


@pytest.mark.parametrize(("k", "becomes"), [(1, "nothing"), (3, "a file"), (6, "nothing")])
def test_a_folder_that_is_taken_away_meanwhile(tmp_path, begin, cli, monkeypatch, check, k, becomes):
    folder, elsewhere, advance = tmp_path / "run", tmp_path / "elsewhere", Search.advance

    def taking_away(self):
        if self.swarm.iteration == k - 1:
            folder.rename(elsewhere)
            if becomes == "a file":
                folder.touch()
        return advance(self)

    words = {"nothing": "the folder does not exist", "a file": "part of the path is a file, not a folder"}
    with monkeypatch.context() as patch:
        synchronously(patch)
        patch.setattr(Search, "advance", taking_away)
        refused(cli(*begin(folder, "-q")), words[becomes])
    assert folder.is_file() == (becomes == "a file")
    check(elsewhere)


@pytest.mark.parametrize("name", ["settings.toml", "task.csv"])
def test_a_removed_file_of_the_run_is_named(tmp_path, begin, cli, monkeypatch, name):
    folder, identity = tmp_path / "run", running.identity

    def removed_before(place):
        (place / name).unlink()
        return identity(place)

    monkeypatch.setattr(running, "identity", removed_before)
    refused(cli(*begin(folder, "-q")), str(folder / name))


def test_resuming_where_nothing_may_be_written(tmp_path, child, begin, cli, monkeypatch, check):
    folder = tmp_path / "run"
    assert child(*begin(folder), before=lambda: runs.at_iteration(4, runs.die)).wait() < 0
    (folder / ".lock").unlink()
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    opened = os.open

    def read_only(path, flags, *mode, **options):
        if flags & os.O_CREAT:
            raise OSError(errno.EROFS, os.strerror(errno.EROFS), str(path))
        return opened(path, flags, *mode, **options)

    with monkeypatch.context() as patch:
        patch.setattr(os, "open", read_only)
        refused(cli("search", "--resume", folder, "-q"), os.strerror(errno.EROFS))
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    check(folder)


def test_a_lock_needs_no_room_on_the_disk(tmp_path, monkeypatch):
    def full(descriptor, content):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "write", full)
    with locked(tmp_path), pytest.raises(RunFolderError, match="in use by another process"), locked(tmp_path):
        pass
    assert not runs.names(tmp_path)


@pytest.fixture
def small_disk(tmp_path):
    """A disk of 128 KiB, where this process may make one."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=128k", "armdesign-test", str(disk)]
    if sys.platform != "linux" or subprocess.run(mount, check=False, capture_output=True).returncode:
        pytest.skip("needs the right to mount a small disk")
    yield disk
    subprocess.run(["umount", "-l", str(disk)], check=True)


@pytest.mark.slow
@pytest.mark.parametrize("k", [1, 4, 6])
def test_a_disk_that_really_fills_up(small_disk, task, undisturbed, check, k):
    folder, filler = small_disk / "run", small_disk / "filler"
    folder.mkdir()

    def fill(progress):
        if progress.iteration == k:
            with filler.open("wb", buffering=0) as stream:
                while True:
                    try:
                        stream.write(bytes(1024))
                    except OSError:
                        return

    with pytest.raises(RunFolderError, match="the disk is full"):
        running.carry_out(folder, task, InProcess(task), fresh=True, on_progress=fill)
    assert not {name for name in runs.names(folder) if name.endswith(".tmp")}
    with pytest.raises(RunFolderError, match="the disk is full"):
        running.carry_out(folder, running.read_problem(folder), InProcess(task))
    filler.unlink()
    result, _ = running.carry_out(folder, running.read_problem(folder), InProcess(task))
    assert runs.rows(folder) == undisturbed.rows
    assert result.facts.stopped_by == "iterations"
    assert runs.names(folder) == runs.FINISHED
