import hashlib
import io
import shutil

import child_runs as runs
import numpy as np
import pytest

from armdesign.errors import ArmDesignError, RunFolderError
from armdesign.runs import checkpoint
from armdesign.runs.resumable import identity
from armdesign.search.backends.backend import InProcess
from armdesign.search.search import Search
from armdesign.swarm.checks import BIT_GENERATORS, SavedState, encode_generator

KEY = "0" * 64


@pytest.fixture(scope="module")
def backend(task):
    return InProcess(task)


@pytest.fixture
def after(task, backend):
    """A search after k iterations."""

    def advanced(k):
        run = Search(task, backend)
        for _ in range(k):
            run.advance()
        return run

    return advanced


@pytest.fixture(scope="module")
def packed(task, backend):
    run = Search(task, backend)
    run.advance()
    return checkpoint.pack(run.state(), KEY)


@pytest.fixture(scope="module")
def interrupted(tmp_path_factory, undisturbed, task, backend):
    """A run folder with a good state of iteration 4 and the one of iteration 3."""
    folder = tmp_path_factory.mktemp("interrupted") / "run"
    folder.mkdir()
    for name in ("settings.toml", "task.csv", "task.json"):
        shutil.copy(undisturbed.folder / name, folder)
    run = Search(task, backend)
    for _ in range(4):
        run.advance()
        checkpoint.save_state(folder, checkpoint.pack(run.state(), identity(folder)))
    return folder


@pytest.fixture
def folder(tmp_path, interrupted):
    """A copy of it that may be damaged."""
    return shutil.copytree(interrupted, tmp_path / "run")


def same(one, other):
    assert one.keys() == other.keys()
    for name, value in one.items():
        if isinstance(value, np.ndarray):
            assert value.dtype == other[name].dtype
            assert value.tobytes() == other[name].tobytes(), name
            assert value.shape == other[name].shape
        else:
            assert type(value) is type(other[name])
            assert value == other[name], name
    return True


@pytest.mark.parametrize("k", [0, 1, 4])
def test_a_state_comes_back_as_it_was(after, k, tmp_path):
    state = after(k).state()
    assert same(checkpoint.unpack(checkpoint.pack(state, KEY), KEY, tmp_path), state)


@pytest.mark.parametrize("k", [0, 1, 4])
def test_a_search_goes_on_from_its_state_as_if_nothing_had_happened(after, tmp_path, k):
    run, fresh = after(k), after(0)
    fresh.restore(checkpoint.unpack(checkpoint.pack(run.state(), KEY), KEY, tmp_path))
    while run.ended_by() is None:
        run.advance()
        fresh.advance()
    one, other = run.state(), fresh.state()
    one["search"].pop("elapsed")
    other["search"].pop("elapsed")
    assert same(one, other)


def test_time_spent_before_counts_after(after):
    run, fresh = after(1), after(0)
    state = run.state()
    state["search"]["elapsed"] = 100.0
    fresh.restore(state)
    assert 100.0 <= fresh.elapsed < 110.0
    assert fresh.state()["search"]["elapsed"] >= 100.0


@pytest.mark.parametrize("value", [np.inf, -np.inf, 5e-324, 0.1 + 0.2, -0.0])
def test_numbers_come_back_to_the_last_bit(value, tmp_path):
    state = {"array": np.array([value]), "number": value}
    back = checkpoint.unpack(checkpoint.pack(state, KEY), KEY, tmp_path)
    assert back["array"].tobytes() == state["array"].tobytes()
    assert np.float64(back["number"]).tobytes() == np.float64(value).tobytes()


@pytest.mark.parametrize("name", BIT_GENERATORS)
def test_generators_of_every_kind_fit_in(name, tmp_path):
    rng = np.random.Generator(getattr(np.random, name)(3))
    state = {"generator": encode_generator(rng)}
    back = checkpoint.unpack(checkpoint.pack(state, KEY), KEY, tmp_path)
    assert np.array_equal(SavedState(back).generator().random(9), rng.random(9))


def test_there_is_no_pickle_in_it(packed):
    with np.load(io.BytesIO(packed), allow_pickle=False) as archive:
        assert all(archive[name].dtype.kind in "fibU" for name in archive.files)
    with pytest.raises(ValueError, match="Object arrays"):
        checkpoint.pack({"object": np.array([object()])}, KEY)


def test_cut_short_anywhere_it_is_refused(packed, tmp_path):
    for length in range(0, len(packed), 100):
        with pytest.raises(RunFolderError, match="is cut short or damaged"):
            checkpoint.unpack(packed[:length], KEY, tmp_path)


def test_with_a_byte_changed_anywhere_it_is_refused(packed, tmp_path):
    for place in range(0, len(packed), 97):
        damaged = bytearray(packed)
        damaged[place] ^= 0x10
        with pytest.raises(RunFolderError, match="is cut short or damaged"):
            checkpoint.unpack(bytes(damaged), KEY, tmp_path)


def cut(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def flip(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 3] ^= 1
    path.write_bytes(bytes(content))


def empty(path):
    path.write_bytes(b"")


def foreign(path):
    body = b"not an archive at all"
    path.write_bytes(body + hashlib.sha256(body).digest())


def unlike(path):
    stream = io.BytesIO()
    np.savez(stream, something=np.arange(3))
    path.write_bytes(stream.getvalue() + hashlib.sha256(stream.getvalue()).digest())


def folder_in_place(path):
    path.unlink(missing_ok=True)
    path.mkdir()


DAMAGES = pytest.mark.parametrize("damage", [cut, flip, empty, foreign, unlike, folder_in_place])


@DAMAGES
def test_the_state_before_is_used_where_the_newest_is_bad(folder, damage):
    damage(folder / "state.npz")
    told = []
    state = checkpoint.load_state(folder, identity(folder), told.append)
    assert len(state["history_best"]) == 3
    assert len(told) == 1
    assert str(folder / "state.npz") in told[0]
    assert told[0].endswith("going on from the one before it.")


@DAMAGES
def test_a_run_whose_newest_state_is_bad_ends_as_undisturbed(folder, damage, check):
    if damage is not folder_in_place:
        damage(folder / "state.npz")
        check(folder)
        assert runs.names(folder) == runs.FINISHED


@DAMAGES
def test_two_bad_states_give_one_sentence_and_stay(folder, damage, cli):
    for name in ("state.npz", "state-previous.npz"):
        damage(folder / name)
    before = contents(folder)
    refused(cli("search", "--resume", folder, "-q"), str(folder / "state.npz"))
    assert contents(folder) == before


def test_without_any_state_a_run_begins_at_the_beginning(folder, check):
    for name in ("state.npz", "state-previous.npz"):
        (folder / name).unlink()
    check(folder)


def test_between_the_two_renames_the_previous_state_serves(folder, check):
    (folder / "state.npz").rename(folder / "state-next.npz")
    assert len(checkpoint.load_state(folder, identity(folder))["history_best"]) == 3
    check(folder)


def test_a_state_of_another_version_is_refused_and_kept(folder, cli, monkeypatch, check):
    before = contents(folder)
    with monkeypatch.context() as patch:
        patch.setattr(checkpoint, "__version__", "9.9")
        sentence = refused(cli("search", "--resume", folder, "-q"), "this is 9.9")
        assert checkpoint.CURRENT in sentence
    assert contents(folder) == before
    check(folder)


def test_a_state_of_another_format_is_refused(folder, cli, monkeypatch):
    monkeypatch.setattr(checkpoint, "FORMAT", 2)
    refused(cli("search", "--resume", folder, "-q"), "state.npz")


@pytest.mark.parametrize("name", ["settings.toml", "task.csv"])
def test_a_state_of_another_task_or_other_settings_is_refused_and_kept(folder, cli, name, check):
    original = (folder / name).read_text()
    other = original.replace("particles = 12", "particles = 13") if name == "settings.toml" else original[:-2] + "\n"
    assert other != original
    (folder / name).write_text(other)
    before = contents(folder)
    refused(cli("search", "--resume", folder, "-q"), "belongs to another task or other settings")
    assert contents(folder) == before
    (folder / name).write_text(original)
    check(folder)


@pytest.mark.parametrize("name", ["settings.toml", "task.json", "task.csv"])
@pytest.mark.parametrize("how", ["missing", "empty", "cut"])
def test_a_folder_without_a_whole_run_is_refused(folder, cli, name, how):
    if how == "missing":
        (folder / name).unlink()
    else:
        (empty if how == "empty" else cut)(folder / name)
    before = contents(folder)
    refused(cli("search", "--resume", folder, "-q"), "")
    assert contents(folder) == before


def test_a_folder_that_is_none_is_refused(tmp_path, cli):
    refused(cli("search", "--resume", tmp_path / "nowhere", "-q"), "holds no run to resume")
    assert not (tmp_path / "nowhere").exists()


def test_a_failed_write_in_the_background_reaches_the_search(tmp_path):
    writer = checkpoint.StateWriter(tmp_path / "gone", KEY)
    writer.submit({"array": np.zeros(3)})
    with pytest.raises(ArmDesignError, match="the folder does not exist"):
        writer.close()
    with pytest.raises(ArmDesignError, match="the folder does not exist"):
        writer.submit({"array": np.zeros(3)})
    assert not writer.thread.is_alive()


def test_an_unforeseen_failure_in_the_background_reaches_the_search(tmp_path):
    writer = checkpoint.StateWriter(tmp_path, KEY)
    writer.submit({"array": np.array([object()])})
    with pytest.raises(ValueError, match="Object arrays"):
        writer.close()


def test_the_newest_state_handed_over_is_the_one_on_disk(tmp_path):
    writer = checkpoint.StateWriter(tmp_path, KEY)
    for k in range(200):
        writer.submit({"array": np.full(1000, float(k))})
    writer.close()
    assert checkpoint.load_state(tmp_path, KEY)["array"][0] == 199.0
    assert runs.names(tmp_path) <= {"state.npz", "state-previous.npz"}


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def refused(done, words):
    """Checks for one sentence and exit code 2; gives the sentence."""
    assert done.exit_code == 2, done.output
    assert done.output.startswith("armdesign: ")
    assert done.output.count("\n") == 1
    assert words in done.output
    return done.output
