"""Recordings of any known format, told apart by what stands in the file.

A new format is one module with a test of the first bytes and a reader, and one entry in ``READERS``.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from armdesign.demonstration.plain_csv import read_plain_csv
from armdesign.demonstration.recording import Recording
from armdesign.demonstration.sniff import describe_binary, is_text, read_head
from armdesign.errors import RecordingError


class Reader(NamedTuple):
    """One format.

    Attributes:
        name: What the format is called in messages.
        matches: Whether a file beginning with these bytes has the format.
        read: Reads such a file.
    """

    name: str
    matches: Callable[[bytes], bool]
    read: Callable[[Path], Recording]


# Asked in this order. Plain CSV comes last and takes any text, so that its reader can say what is wrong with it.
READERS = (Reader("plain CSV", is_text, read_plain_csv),)


def read_recording(path: str | os.PathLike[str]) -> Recording:
    """Read a recording, whatever the ending of its name.

    Args:
        path: The file.

    Returns:
        The recording as it stands in the file.

    Raises:
        RecordingError: The file cannot be read, has none of the known formats, or something in it is wrong.
    """
    source = Path(path)
    head = read_head(source)
    for reader in READERS:
        if reader.matches(head):
            return reader.read(source)
    known = [reader.name for reader in READERS]
    message = f"{source} is not a recording of a known format"
    raise RecordingError(message, value=str(source), allowed=known, fix=describe_binary(head))
