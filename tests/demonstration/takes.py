"""Contents read as one format, for the tests of the formats."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from armdesign.demonstration.files.formats import FORMATS
from armdesign.demonstration.points.unseen import hide_unseen
from armdesign.demonstration.recording import Take
from armdesign.errors import RecordingError


def read_as(form: ModuleType, folder: Path, content: bytes | str | list[str]) -> Take:
    """The take in a file with this content (or these lines), which has to be recognised as of this format."""
    content = "".join(f"{line}\r\n" for line in content) if isinstance(content, list) else content
    path = folder / "take.any"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    head = path.read_bytes()[:8192]
    assert next(each.read for each in FORMATS if each.matches(head)) is form.read
    return hide_unseen(form.read(path))


def refused_as(form: ModuleType, folder: Path, content: bytes | str | list[str]) -> str:
    """What is said of a file with this content, which has to be refused."""
    with pytest.raises(RecordingError) as caught:
        read_as(form, folder, content)
    text = str(caught.value)
    assert "take.any" in text
    assert "\n" not in text
    assert len(text) < 600
    return text


def steps(take: Take) -> dict[str, str]:
    """Name to sentence of what was odd in the file."""
    return {step.name: step.sentence for step in take.steps}


def table(take: Take) -> np.ndarray:
    """Positions of all points side by side, shape (T, 3 n)."""
    return np.hstack(list(take.points.values()))
