"""A take as the studio shows it: where its points are at any time, which of them are the arm's, and its gaps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from armdesign._types import Array
from armdesign.demonstration import Recording, Selection
from armdesign.demonstration.points.expressions import quoted
from armdesign.errors import RecordingError
from armdesign.files import write_whole

ROLES = ("shoulder", "elbow", "wrist", "hand")
COLUMNS = 240
"""Columns of the picture of gaps at most."""


def keep_upload(folder: Path, name: str, content: bytes) -> Path:
    """Keep a file that came from the page, under its own name.

    Args:
        folder: Where to.
        name: Its name on the page, of which only the last part counts.
        content: What it holds.

    Raises:
        RecordingError: It has no name.
    """
    plain = Path(name.replace("\\", "/")).name.strip()
    if not plain or plain.startswith(".") or not plain.isprintable():
        raise RecordingError(f"a file cannot be called {name!r}", value=name, fix="Rename it")
    folder.mkdir(parents=True, exist_ok=True)
    write_whole(folder / plain, content)
    return folder / plain


@dataclass(frozen=True, eq=False)
class Shot:
    """A recording as it is shown, thinned for the picture alone.

    Attributes:
        recording: The recording.
        selection: The arm in it; None where none was chosen yet.
    """

    recording: Recording
    selection: Selection | None = None

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the points that were seen at all."""
        return tuple(name for name, path in self.recording.points.items() if not np.isnan(path).all())

    @cached_property
    def places(self) -> Array:
        """Where they are, shape (T, N, 3) [m]; NaN where not seen."""
        if not self.names:
            return np.zeros((self.recording.frames, 0, 3))
        return np.stack([self.recording.points[name] for name in self.names], axis=1)

    def at(self, time: float) -> Array:
        """Where the points are at a time, shape (N, 3) [m].

        Args:
            time: The time [s].
        """
        return np.asarray(self.places[nearest(self.recording.time, time)])

    @cached_property
    def chain(self) -> Array:
        """The arm from the base on, its gaps bridged for the picture, shape (T, m + 1, 3) [m]; (T, 0, 3) without."""
        if self.selection is None:
            return np.zeros((self.recording.frames, 0, 3))
        chosen = self.selection.recording.points
        names = [name for name in (self.selection.base, *self.selection.points) if name in chosen]
        return np.stack([bridged(self.recording.time, chosen[name]) for name in names], axis=1)

    def gaps(self) -> tuple[tuple[str, ...], Array]:
        """Share of frames in which each point of the arm, else every point, is seen.

        Returns:
            Names, and shares of shape (N, C), C columns over the whole time.
        """
        paths: Mapping[str, Array] = dict(zip(self.names, self.places.swapaxes(0, 1), strict=True))
        if self.selection is not None:
            paths = self.selection.recording.points
        edges = np.linspace(0, self.recording.frames, min(COLUMNS, self.recording.frames) + 1).astype(int)
        seen = np.array([np.isfinite(path[:, 0]) for path in paths.values()], dtype=float)
        shares = np.add.reduceat(seen, edges[:-1], axis=1) / np.diff(edges)
        return tuple(paths), shares


def bridged(time: Array, path: Array) -> Array:
    """A path with straight lines over its gaps, shape (T, 3) [m].

    Args:
        time: Shape (T,) [s].
        path: Shape (T, 3) [m].
    """
    seen = np.isfinite(path[:, 0])
    if seen.all() or not seen.any():
        return path
    return np.stack([np.interp(time, time[seen], column[seen]) for column in path.T], axis=1)


def nearest(times: Array, time: float) -> int:
    """Index of the frame at or before a time, the first or the last beyond the ends."""
    return int(np.clip(np.searchsorted(times, time + 1e-9, side="right") - 1, 0, len(times) - 1))


def roles_of(selection: Selection) -> dict[str, str]:
    """The expressions for base and points by what they are called on the page."""
    names = (selection.base, *selection.points)
    titles = list(ROLES) if len(names) == len(ROLES) else [f"point {k}" for k in range(len(names))]
    titles[0], titles[-1] = ROLES[0], ROLES[-1]
    return dict(zip(titles, (selection.expressions.get(name, quoted(name)) for name in names), strict=True))


def chosen_points(roles: Sequence[str], names: Sequence[str]) -> dict[str, object]:
    """Entries of the section Task for the points that were chosen on the page.

    Args:
        roles: What was chosen for shoulder, elbow, wrist and hand; names as they are, or expressions.
        names: Names of the recording, which are quoted where they hold marks.
    """
    texts = [quoted(text) if text in names else text for text in roles if text]
    return {"base": texts[0], "points": tuple(texts[1:])}
