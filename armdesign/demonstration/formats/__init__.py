"""File formats of motion recordings, told apart by what stands in the file.

A new format is one module here with a test of the first bytes and a reader, and one entry in ``FORMATS``.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from armdesign.demonstration.take import Take


class Format(NamedTuple):
    """One format.

    Attributes:
        name: What the format is called in messages.
        matches: Whether a file beginning with these bytes (``sniff.HEAD_SIZE`` of them at most) has the format.
        read: Reads such a file as it stands.
    """

    name: str
    matches: Callable[[bytes], bool]
    read: Callable[[Path], Take]


FORMATS: tuple[Format, ...] = ()
"""Asked in this order; one entry a line."""
