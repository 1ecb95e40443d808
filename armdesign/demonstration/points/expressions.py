"""Points as users write them: a name, a mean ``elbow=EPICl+EPICm``, or a place between ``0.5*elbow+0.5*wrist``.

A text that as a whole is the name of a point means that point, whatever letters it has. Where + * = or a comma belong
to a name inside an expression, the name has to be in quotation marks. A subject prefix may be left off where that is
unambiguous: ``ACRO_tip`` finds ``Daphnee:ACRO_tip``.
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from fractions import Fraction

from armdesign.errors import TaskError

_QUOTES = "\"'"
_MARKS = ",=*+"
_SHOWN = 30  # names listed in a message
_SUM = 1e-6
_SIDES = {"r", "l", "right", "left"}


@dataclass(frozen=True)
class Term:
    """One part of an expression."""

    name: str  # in full
    weight: float  # its factor; the factors of an expression sum to 1


@dataclass(frozen=True)
class Expression:
    """A point made of others."""

    name: str  # what the point is called
    terms: tuple[Term, ...]  # the points it is made of
    weighted: bool = False  # whether the weights were given

    @property
    def single(self) -> str | None:
        """The one point that it is, if it is one."""
        return self.terms[0].name if len(self.terms) == 1 else None

    def __str__(self) -> str:
        """The expression with all names in full, so that reading it gives the same again."""
        if self.single == self.name:
            return quoted(self.name)
        weights = [f"{term.weight:.12g}*" if self.weighted else "" for term in self.terms]
        parts = [weight + quoted(term.name) for weight, term in zip(weights, self.terms, strict=True)]
        return f"{quoted(self.name)}={'+'.join(parts)}"


def parse(text: str, known: Collection[str], source: str, purpose: str = "") -> Expression:
    """Read an expression.

    Args:
        text: The expression.
        known: Names of the points there are.
        source: The recording, for messages.
        purpose: What the point is for, such as `` for the base``, for messages.

    Raises:
        TaskError: A name is unknown or ambiguous, a weight is no number, or the weights do not sum to 1.
    """
    text = text.strip()
    whole = _find(text, known, source)
    if whole is not None:
        return Expression(text, (Term(whole, 1.0),))
    first, *rest = _split(text, "=", source)
    body = "=".join(rest) if rest else text
    name = unquoted(first)
    if not rest and len(_split(text, "+", text)) > 1:  # a mean without a name is called by its text
        name = "".join(letter for letter in text if letter not in _QUOTES)
    if not name or not body.strip():
        fix = "Write NAME, NEW=A+B or NEW=0.5*A+0.5*B"
        raise TaskError(f"{source}: '{text}' names no point{purpose}", value=text, fix=fix)
    return _combined(name, body.strip(), known, source, purpose)


def split_list(text: str) -> list[str]:
    """The entries of a list with commas between them; commas in quotation marks do not count."""
    return [part.strip() for part in _split(text, ",", "the list of points") if part.strip()]


def quoted(name: str) -> str:
    """A name as an expression needs it, in quotation marks where it holds marks itself."""
    if not (set(name) & set(_MARKS) or name[:1] in _QUOTES):
        return name
    mark = "'" if '"' in name else '"'
    return f"{mark}{name}{mark}"


def unquoted(text: str) -> str:
    """A name without the quotation marks around it."""
    text = text.strip()
    return text[1:-1] if len(text) > 1 and text[0] in _QUOTES and text[-1] == text[0] else text


def find_name(text: str, known: Collection[str], source: str, purpose: str = "") -> str:
    """The full name of a point; its subject prefix may have been left off, and quotation marks may be around it."""
    name = unquoted(text)
    found = _find(text.strip(), known, source) or _find(name, known, source)
    if found is None:
        message = f"{source}: there is no point '{name}'{purpose}"
        raise TaskError(message, value=name, allowed=nearest(name, known))
    return found


def nearest(name: str, known: Iterable[str]) -> list[str]:
    """Names for a message: those like the one that was asked for first, no more than fit into a sentence."""
    known = list(known)
    if len(known) > 3:
        by_local: dict[str, list[str]] = {}
        for each in known:
            by_local.setdefault(each.rpartition(":")[2].lower(), []).append(each)
        close = difflib.get_close_matches(name.rpartition(":")[2].lower(), by_local, n=5, cutoff=0.5)
        known = list(dict.fromkeys([*(each for local in close for each in by_local[local]), *known]))
    more = len(known) - _SHOWN
    return known if more <= 0 else [*known[:_SHOWN], f"and {more} more"]


def _find(name: str, known: Collection[str], source: str) -> str | None:
    """The point of that name, or the only one with it behind a subject prefix; None if there is none."""
    if name in known:
        return name
    if not name:
        return None
    for mark in (":", "_"):
        ends = [(each, each[: -len(mark + name)]) for each in known if each.endswith(mark + name)]
        # a subject may be left off, a side may not
        found = [each for each, subject in ends if subject and (mark == ":" or subject.lower() not in _SIDES)]
        if len(found) > 1:
            message = f"{source}: '{name}' may be any of {len(found)} points"
            raise TaskError(message, value=name, allowed=nearest(name, found), fix="Give the name in full")
        if found:
            return found[0]
    return None


def _combined(name: str, body: str, known: Collection[str], source: str, purpose: str) -> Expression:
    """A point of one or more terms."""
    whole = _find(body, known, source)
    if whole is not None:
        return Expression(name, (Term(whole, 1.0),))
    parts = [_term(part.strip(), known, source, purpose) for part in _split(body, "+", source)]
    weights = [weight for _, weight in parts if weight is not None]
    if not weights:
        return Expression(name, tuple(Term(point, 1.0 / len(parts)) for point, _ in parts))
    if len(weights) < len(parts):
        message = f"{source}: in '{body}' some points have a weight and some have none"
        raise TaskError(message, value=body, fix="Give all of them one, or none for the mean")
    total = float(sum(weights))
    if abs(total - 1.0) > _SUM:
        message = f"{source}: the weights in '{body}' sum to {total:.6g}"
        raise TaskError(message, value=total, allowed="a sum of 1", fix="With another sum it would be no place between")
    terms = [Term(point, float(weight)) for point, weight in parts if weight is not None]
    return Expression(name, tuple(terms), weighted=True)


def _term(text: str, known: Collection[str], source: str, purpose: str) -> tuple[str, Fraction | None]:
    """Name and weight of one term; no weight where none was given."""
    if not text:
        fix = "Put a name on both sides of every +; a name with a + in it stands in quotation marks"
        raise TaskError(f"{source}: there is a + without a point beside it{purpose}", value=text, fix=fix)
    first, *rest = _split(text, "*", source)
    if not rest or _find(text, known, source) is not None:
        return find_name(text, known, source, purpose), None
    try:
        weight = Fraction(first.strip())
    except (ValueError, ZeroDivisionError) as error:
        message = f"{source}: '{first.strip()[:40]}' in '{text[:80]}' is not a weight"
        allowed = "a number or a fraction, as in 0.5*elbow or 1/3*elbow"
        fix = "A name with a * in it stands in quotation marks"
        raise TaskError(message, value=first, allowed=allowed, fix=fix) from error
    return find_name("*".join(rest), known, source, purpose), weight


def _split(text: str, mark: str, source: str) -> list[str]:
    """The parts of a text between marks that are not in quotation marks; those open at the start of a name only."""
    parts, begin, quote, fresh = [], 0, "", True
    for i, letter in enumerate(text):
        if quote:
            quote = "" if letter == quote else quote
            fresh = False
            continue
        if letter in _QUOTES and fresh:
            quote = letter
        elif letter == mark:
            parts.append(text[begin:i])
            begin = i + 1
        fresh = letter in _MARKS or (fresh and letter == " ")
    if quote:
        message = f"{source}: in '{text[:80]}' the quotation mark {quote} is not closed"
        raise TaskError(message, value=text, fix=f"Put another {quote} behind the name")
    return [*parts, text[begin:]]
