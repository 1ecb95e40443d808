"""Names for what a file calls by one and the same."""

from __future__ import annotations

from collections import Counter
from collections.abc import Container


def unused_name(name: str, used: Container[str], given: Counter[str]) -> str:
    """A name that is not used yet: the one wanted, or with a number behind it.

    Args:
        name: The name wanted.
        used: Names that are used.
        given: How often each name was wanted so far; counted up here.
    """
    given[name] += 1
    result = name if given[name] == 1 else f"{name} ({given[name]})"
    while result in used:
        given[name] += 1
        result = f"{name} ({given[name]})"
    return result
