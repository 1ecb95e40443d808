"""The state of a search on disk: whole or not at all, without pickle, one generation back kept as well.

A state is a flat dictionary of arrays and JSON values. It is stored as an npz archive with the JSON part as text and
a digest over everything; a state that was cut short, belongs to another task or comes from another version is refused.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import threading
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from armdesign._version import __version__
from armdesign.errors import RunFolderError
from armdesign.files import remove_files, write_whole

CURRENT, PREVIOUS, NEXT = "state.npz", "state-previous.npz", "state-next.npz"
HEADER, FORMAT = "__json__", 1
ANEW = "Start the search anew with --overwrite"
State = dict[str, Any]


def pack(state: State, identity: str) -> bytes:
    """A state as the bytes of an npz archive.

    Args:
        state: Arrays and JSON values.
        identity: What the state belongs to, see ``resumable.identity``.
    """
    arrays = {name: value for name, value in state.items() if isinstance(value, np.ndarray)}
    values = {name: value for name, value in state.items() if name not in arrays}
    text = json.dumps({"format": FORMAT, "version": __version__, "identity": identity, "values": values})
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, array in {HEADER: np.array(text), **arrays}.items():
            with archive.open(f"{name}.npy", "w") as stream:
                np.lib.format.write_array(stream, array, allow_pickle=False)
    content = buffer.getvalue()
    return content + hashlib.sha256(content).digest()


def unpack(content: bytes, identity: str, source: Path) -> State:
    """The state out of an archive.

    Args:
        content: The archive.
        identity: What the state has to belong to.
        source: Its file, for messages.

    Raises:
        RunFolderError: Cut short or damaged, of another version, or of another task.
    """
    body, digest = content[:-32], content[-32:]
    if hashlib.sha256(body).digest() != digest:
        raise RunFolderError(f"the saved state {source} is cut short or damaged", value=str(source), fix=ANEW)
    with np.load(io.BytesIO(body), allow_pickle=False) as archive:
        arrays = {name: archive[name] for name in archive.files}
    header = json.loads(str(arrays.pop(HEADER)))
    if header["format"] != FORMAT or header["version"] != __version__:
        raise RunFolderError(
            f"the saved state {source} was written by armdesign {header['version']}, this is {__version__}",
            value=header["version"],
            fix="Resume it with that version, or start the search anew with --overwrite",
        )
    if header["identity"] != identity:
        raise RunFolderError(
            f"the saved state {source} belongs to another task or other settings than the run folder's",
            value=str(source),
            fix=ANEW,
        )
    return arrays | dict(header["values"])


def load_state(folder: Path, identity: str, on_note: Callable[[str], None] | None = None) -> State | None:
    """The newest good state of a run folder; None where there is none yet.

    Args:
        folder: The run folder.
        identity: What the state has to belong to.
        on_note: Called with a sentence where the newest state cannot be used and the one before it is.

    Raises:
        RunFolderError: States are there, but none can be used.
    """
    failure: RunFolderError | None = None
    for path in (folder / CURRENT, folder / PREVIOUS):
        try:
            state = unpack(path.read_bytes(), identity, path)
        except FileNotFoundError:
            continue
        except RunFolderError as error:
            failure = failure or error
        except OSError as error:
            failure = failure or RunFolderError(f"cannot read the saved state {path}: {error.strerror}")
        except (ValueError, KeyError, zipfile.BadZipFile) as error:
            failure = failure or RunFolderError(f"the saved state {path} is not one of armdesign's: {error}", fix=ANEW)
        else:
            if failure is not None and on_note is not None:
                on_note(f"{str(failure).removesuffix(f'. {failure.fix}')}; going on from the one before it.")
            return state
    if failure is not None:
        raise failure
    return None


def save_state(folder: Path, content: bytes) -> None:
    """Put a packed state in place, keeping the one before it.

    Args:
        folder: The run folder.
        content: The state, see ``pack``.

    Raises:
        RunFolderError: It cannot be written; the states on disk are untouched.
    """
    fresh = folder / NEXT
    write_whole(fresh, content)
    try:
        if (folder / CURRENT).exists():
            os.replace(folder / CURRENT, folder / PREVIOUS)
        os.replace(fresh, folder / CURRENT)
    except OSError as error:
        raise RunFolderError(f"cannot write the saved state in {folder}: {error.strerror}") from error


def remove_states(folder: Path, *, keep_newest: bool = False) -> None:
    """Remove the states and what a killed process may have left half-written.

    Args:
        folder: The run folder.
        keep_newest: Keep the state that a finished search can be extended from.

    Raises:
        RunFolderError: A file cannot be removed.
    """
    newest = [] if keep_newest else [folder / CURRENT]
    remove_files([*newest, folder / PREVIOUS, folder / NEXT, *folder.glob(".*.tmp")])


class StateWriter:
    """Packs and writes states in the background: the search does not wait for the disk. The newest one wins."""

    def __init__(self, folder: Path, identity: str) -> None:
        """Start the writing thread.

        Args:
            folder: The run folder.
            identity: What the states belong to, see ``resumable.identity``.
        """
        self.folder, self.identity = folder, identity
        self.waiting: State | None = None
        self.failure: Exception | None = None
        self.closing = False
        self.changed = threading.Condition()
        self.thread = threading.Thread(target=self._work, name="armdesign-state", daemon=True)
        self.thread.start()

    def submit(self, state: State) -> None:
        """Hand over a state, which nobody may change any more.

        Raises:
            RunFolderError: An earlier one could not be written.
        """
        with self.changed:
            if self.failure is not None:
                raise self.failure
            self.waiting = state
            self.changed.notify()

    def close(self) -> None:
        """Write what is waiting and end.

        Raises:
            RunFolderError: A state could not be written.
        """
        with self.changed:
            self.closing = True
            self.changed.notify()
        self.thread.join()
        if self.failure is not None:
            raise self.failure

    def _work(self) -> None:
        """Body of the thread."""
        while True:
            with self.changed:
                self.changed.wait_for(lambda: self.waiting is not None or self.closing)
                state, self.waiting = self.waiting, None
            if state is None:
                return
            try:
                save_state(self.folder, pack(state, self.identity))
            except Exception as error:  # whatever it is, the search has to learn of it
                with self.changed:
                    self.failure = error
                return
