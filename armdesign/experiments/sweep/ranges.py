"""Lists of whole numbers as they are written in a flag: 3, 3-6, 3,5 or 1-3,7."""

from __future__ import annotations

import re

from armdesign.errors import SettingsError

MOST = 10_000
ALLOWED = "whole numbers, ranges such as 3-6, and lists of them such as 3,5 or 1-3,7"


def whole_numbers(text: str, flag: str) -> tuple[int, ...]:
    """The numbers of a list, in its order, each once.

    Raises:
        SettingsError: An entry is neither a whole number nor a range, a range is upside down, or there are too many.
    """
    found: dict[int, None] = {}
    for part in text.split(","):
        first, last = ends(part.strip(), text, flag)
        if last - first >= MOST or len(found) + last - first >= MOST:
            raise SettingsError(f"{flag} {text} has more than {MOST} entries", value=text, allowed=f"up to {MOST}")
        found |= dict.fromkeys(range(first, last + 1))
    return tuple(found)


def seed_numbers(text: str, flag: str = "--seeds") -> tuple[int, ...]:
    """The seeds: a bare number k is a count and means 0 to k - 1; anything else is a list as in `whole_numbers`.

    Raises:
        SettingsError: See `whole_numbers`; or a count of 0.
    """
    if not re.fullmatch(r"[0-9]+", text.strip()):
        return whole_numbers(text, flag)
    if int(text) == 0:
        raise SettingsError(
            f"{flag} is 0: a bare number counts the seeds", value=text, allowed="a count of at least 1",
            fix=f"For the seed 0 alone write {flag} 1; for the seed 7 alone {flag} 7-7",
        )  # fmt: skip
    return whole_numbers(f"0-{int(text) - 1}", flag)


def ends(part: str, text: str, flag: str) -> tuple[int, int]:
    """First and last number of one entry.

    Raises:
        SettingsError: It is neither a whole number nor a range, or the range is upside down.
    """
    match = re.fullmatch(r"([0-9]{1,19})(?:\s*-\s*([0-9]{1,19}))?", part)
    if match is None:
        where = f"{flag} {text!r} has " + (f"the entry {part!r}" if part else "an empty entry")
        raise SettingsError(where, value=part, allowed=ALLOWED)
    first, last = int(match[1]), int(match[2] or match[1])
    if last < first:
        raise SettingsError(
            f"{flag} has the range {part}: its ends are upside down", value=part, fix=f"Write {last}-{first}"
        )
    return first, last
