"""The box that a swarm searches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armdesign._types import Array
from armdesign.errors import SettingsError

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Box:
    """Lower and upper bound of every entry of a position, and which entries are angles.

    Equal bounds fix an entry. Any array-like is accepted; what is kept are read-only copies.

    Attributes:
        lower: Lower bounds, shape (D,).
        upper: Upper bounds, shape (D,).
        angular: True for the entries that are angles, shape (D,).
    """

    lower: Array
    upper: Array
    angular: Mask

    def __post_init__(self) -> None:
        """Normalise the three columns and check them.

        Raises:
            SettingsError: Columns of unequal length, a bound that is not a finite number, or lower > upper.
        """
        for name in ("lower", "upper"):
            _freeze(self, name, _column(name, getattr(self, name)))
        _freeze(self, "angular", _flags(self.angular))
        if not len(self.lower) == len(self.upper) == len(self.angular):
            lengths = f"{len(self.lower)}, {len(self.upper)} and {len(self.angular)}"
            raise SettingsError(
                f"the box columns lower, upper and angular have {lengths} entries", allowed="equal lengths"
            )
        for entry in np.flatnonzero(self.lower > self.upper):
            bounds = float(self.lower[entry]), float(self.upper[entry])
            message = f"box entry {entry} has lower bound {bounds[0]:g} above upper bound {bounds[1]:g}"
            raise SettingsError(message, value=bounds, allowed="lower <= upper", fix="Swap the two, or set them equal")

    @property
    def dimension(self) -> int:
        """Number of entries D, the fixed ones included."""
        return len(self.lower)

    @property
    def width(self) -> Array:
        """Extent of every entry, upper - lower, shape (D,)."""
        return np.asarray(self.upper - self.lower)

    def clip(self, X: ArrayLike) -> Array:
        """Positions moved to the nearest point of the box, a new array.

        Args:
            X: Positions, shape (..., D).

        Returns:
            Positions inside the box, shape (..., D).
        """
        return np.asarray(np.clip(np.asarray(X, dtype=float), self.lower, self.upper))


def _freeze(box: Box, name: str, column: NDArray[np.generic]) -> None:
    """Set a field of the frozen box to a read-only array."""
    column.setflags(write=False)
    object.__setattr__(box, name, column)


def _column(name: str, values: ArrayLike) -> Array:
    """A copied column of finite numbers, shape (D,)."""
    try:
        column = np.array(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise SettingsError(f"box column '{name}' does not hold numbers: {error}", value=values) from error
    if column.ndim != 1 or column.size == 0:
        raise SettingsError(f"box column '{name}' has shape {column.shape}", value=values, allowed="(D,) with D >= 1")
    for entry in np.flatnonzero(~np.isfinite(column)):
        message = f"box entry {entry} has '{name}' bound {column[entry]}"
        raise SettingsError(message, value=float(column[entry]), allowed="finite numbers")
    return column


def _flags(values: ArrayLike) -> Mask:
    """A copied column of flags, shape (D,)."""
    flags = np.array(values, dtype=object)  # keeps 0 and 1 apart from false and true
    if flags.ndim != 1 or not all(isinstance(flag, (bool, np.bool_)) for flag in flags):
        raise SettingsError("box column 'angular' does not hold flags", value=values, allowed="true or false per entry")
    return np.asarray(flags, dtype=np.bool_)
