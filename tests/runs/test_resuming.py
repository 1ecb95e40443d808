"""What the command does around a run folder that another process uses, or has left unfinished."""

import signal
import time

import child_runs as runs
import pytest

from armdesign.cli import screen


@pytest.fixture
def killed(tmp_path, child, begin):
    """The folder of a run that was killed in its fourth iteration."""
    folder = tmp_path / "run"
    assert child(*begin(folder), before=lambda: runs.at_iteration(4, runs.die)).wait() == -signal.SIGKILL
    return folder


def test_an_unfinished_run_is_not_begun_anew_by_the_way(killed, begin, cli, check):
    before = (killed / "state.npz").read_bytes()
    done = cli(*begin(killed, "-q"))
    assert done.exit_code == 2
    assert "--resume" in done.output
    assert "--overwrite" in done.output
    assert (killed / "state.npz").read_bytes() == before
    check(killed)


def test_a_free_name_is_not_that_of_an_unfinished_run(killed):
    from armdesign.runs.folder import free_folder  # noqa: PLC0415

    assert free_folder(killed.parent, killed.name) == killed.parent / f"{killed.name}-2"


def test_overwriting_begins_anew(killed, begin, cli, undisturbed):
    assert cli(*begin(killed, "-q", "--overwrite")).exit_code == 0
    assert runs.outcome(killed) == undisturbed.outcome
    assert runs.names(killed) == runs.FINISHED


def test_the_state_of_one_run_never_gets_into_another(tmp_path, child, begin, undisturbed):
    """Two commands begin in one folder: while the first compiles, the second starts there and dies."""
    folder, go = tmp_path / "run", tmp_path / "go"

    def wait_while_compiling():
        screen.compile_kernels = lambda *_, **__: runs.until(go.exists)

    first = child(*begin(folder, "-q"), before=wait_while_compiling)
    assert runs.until(folder.exists), first.said()
    time.sleep(0.1)
    dies = lambda: runs.at_iteration(3, runs.die)  # noqa: E731
    second = child(*begin(folder, "--overwrite", "--seed", 1), before=dies)
    assert second.wait() == -signal.SIGKILL, second.said()
    go.touch()
    assert first.wait() == 0, first.said()
    assert runs.outcome(folder) == undisturbed.outcome


def test_resuming_a_finished_run_clears_away_what_a_kill_has_left(tmp_path, child, begin, check):
    folder = tmp_path / "run"
    killed = child(*begin(folder), before=lambda: runs.die_at_rename("result.json", 1, "after"))
    assert killed.wait() == -signal.SIGKILL
    assert {"state.npz", "task.json"} <= runs.names(folder)
    check(folder)
    assert runs.names(folder) == runs.FINISHED


def test_a_sentence_says_that_the_newest_state_is_bad(killed, cli, undisturbed):
    (killed / "state.npz").write_bytes(b"")
    done = cli("search", "--resume", killed)
    said = " ".join(done.output.split())
    assert f"the saved state {killed / 'state.npz'} is cut short or damaged; going on from the one" in said
    assert runs.outcome(killed) == undisturbed.outcome
