"""Errors that quote a file stay legible."""

from __future__ import annotations

import pytest

from armdesign.demonstration.files.readers import MOST_LETTERS, legible, legible_text
from armdesign.errors import RecordingError


def test_what_is_legible_stays():
    assert (
        legible_text("take.csv, line 3: 'Ellbögen' 手 is odd. Mend it")
        == "take.csv, line 3: 'Ellbögen' 手 is odd. Mend it"
    )


@pytest.mark.parametrize("letter", list("\0\x07\x1b\x7f\x85\u2028\ufeff\n\r\t\x0b"))
def test_nothing_in_it_moves_the_cursor(letter):
    text = legible_text(f"a{letter}b")
    assert text.isprintable()
    assert len(text) == 3


def test_long_quotations_lose_their_middle():
    text = legible_text(f"take.csv, line 3: '{'N' * 5000}'. Mend it")
    assert len(text) <= MOST_LETTERS
    assert text.startswith("take.csv, line 3: 'NNN")
    assert text.endswith("'. Mend it")


def test_the_error_stays_itself():
    @legible
    def read() -> None:
        raise RecordingError("a\nb", value=7, allowed="c\0", fix="d")

    with pytest.raises(RecordingError, match=r"^a b; allowed: c\?. d$") as caught:
        read()
    assert (caught.value.value, caught.value.fix) == (7, "d")
