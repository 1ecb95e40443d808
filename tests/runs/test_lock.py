import os
import signal
import time

import child_runs as runs
import pytest

from armdesign.errors import RunFolderError, SearchError
from armdesign.runs import lock
from armdesign.runs.lock import holder_of, locked


def test_a_lock_names_its_holder_and_is_gone_afterwards(tmp_path):
    with locked(tmp_path):
        assert holder_of(tmp_path).startswith(f"process {os.getpid()} on ")
        with pytest.raises(RunFolderError, match=f"in use by process {os.getpid()} on "), locked(tmp_path):
            pass
        assert holder_of(tmp_path) is not None
    assert holder_of(tmp_path) is None
    assert not runs.names(tmp_path)


@pytest.mark.parametrize("error", [SearchError("nothing found"), KeyboardInterrupt(), OSError(28, "full")])
def test_a_lock_is_gone_after_an_error_too(tmp_path, error):
    with pytest.raises(type(error)), locked(tmp_path):
        raise error
    assert not runs.names(tmp_path)
    with locked(tmp_path):
        pass


def test_a_removed_lock_file_locks_nobody_out_and_nobody_in(tmp_path):
    """Whoever opened the file before its holder removed it holds nothing, and tries again."""
    taken = lock.take

    def outrun(descriptor):
        lock.take = taken
        (tmp_path / lock.NAME).unlink()
        return taken(descriptor)

    lock.take = outrun
    try:
        with locked(tmp_path):
            assert lock.take is taken
            assert holder_of(tmp_path) == lock.this_process()
            with pytest.raises(RunFolderError, match="in use"), locked(tmp_path):
                pass
    finally:
        lock.take = taken
    assert not runs.names(tmp_path)


def test_the_lock_of_another_is_left_alone(tmp_path):
    with locked(tmp_path):
        (tmp_path / lock.NAME).unlink()
        (tmp_path / lock.NAME).write_text("another's")
    assert (tmp_path / lock.NAME).read_text() == "another's"


def test_a_second_process_on_a_run_folder_refuses_and_disturbs_nothing(tmp_path, child, begin, check):
    folder = tmp_path / "run"
    first = child(*begin(folder), before=lambda: runs.linger(0.5))
    assert runs.until((folder / "state.npz").exists), first.said()
    for args in (("search", "--resume", folder), begin(folder, "--overwrite")):
        second = child(*args)
        assert second.wait() == 2
        assert f"armdesign: the run folder {folder} is in use by process {first.pid} on " in second.said()
    assert first.wait() == 0, first.said()
    check(folder)


def test_a_lock_left_by_a_killed_process_blocks_nobody(tmp_path, child, begin, check):
    folder = tmp_path / "run"
    killed = child(*begin(folder), before=lambda: runs.at_iteration(3, runs.die))
    assert killed.wait() == -signal.SIGKILL
    assert str(killed.pid) in (folder / lock.NAME).read_text()
    assert holder_of(folder) is None
    check(folder)
    assert runs.names(folder) == runs.FINISHED


def test_many_at_once_hold_it_one_after_another(tmp_path, child):
    """Processes that add one to a number in a file, under the lock, lose no addition."""
    number = tmp_path / "number"
    number.write_text("0")

    def add():
        for _ in range(20):
            while not added():
                time.sleep(0.001)
        raise SystemExit(0)

    def added():
        try:
            with locked(tmp_path):
                number.write_text(str(int(number.read_text()) + 1))
        except RunFolderError:
            return False
        return True

    for each in [child(before=add) for _ in range(4)]:
        assert each.wait() == 0, each.said()
    assert number.read_text() == "80"
