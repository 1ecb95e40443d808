"""Declared parameters: one named, validated, documented entry each, in dataclasses that read and write TOML.

A section is a frozen dataclass whose fields are made by :func:`parameter`. From that one declaration come the check of
a value, the message that names the allowed range, the commented TOML and the documentation.
"""

from __future__ import annotations

import dataclasses
import inspect
import math
import sys
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar

from armdesign.errors import SettingsError

LENGTHS: Mapping[str, Fraction] = {
    "m": Fraction(1), "cm": Fraction(1, 100), "mm": Fraction(1, 1000), "in": Fraction(254, 10_000),
}  # fmt: skip
"""Units of length, in metres."""


@dataclass(frozen=True)
class Kind:
    """What values an entry takes."""

    def check(self, name: str, value: Any) -> Any:  # noqa: ANN401 (values come from TOML)
        """Return the value in its normal form.

        Raises:
            SettingsError: The value is of the wrong type or out of range; the message names the entry.
        """
        raise NotImplementedError

    def describe(self) -> str:
        """The allowed values in words."""
        raise NotImplementedError

    def refuse(self, name: str, value: object) -> SettingsError:
        """The error for a value that is not allowed."""
        return SettingsError(f"setting '{name}' is {value!r}", value=value, allowed=self.describe())


@dataclass(frozen=True)
class Number(Kind):
    """A number between two bounds; ``above`` leaves the lower bound itself out."""

    low: float = -math.inf
    high: float = math.inf
    unit: str = ""
    integer: bool = False
    above: bool = False

    def check(self, name: str, value: Any) -> float | int:  # noqa: ANN401
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= sys.float_info.max:
            raise self.refuse(name, value)  # not finite either
        outside = not self.low <= value <= self.high or (self.above and value == self.low)
        if outside or (self.integer and value != int(value)):
            raise self.refuse(name, value)
        return int(value) if self.integer else float(value)

    def describe(self) -> str:
        noun = "a whole number" if self.integer else "a number"
        unit = f" {self.unit}" if self.unit else ""
        low, high = plain(self.low), plain(self.high)
        if math.isinf(self.high) and math.isinf(self.low):
            return noun + (f" [{self.unit}]" if self.unit else "")
        if math.isinf(self.high):
            return f"{noun} {'above' if self.above else 'of at least'} {low}{unit}"
        span = f"above {low} up to" if self.above else f"from {low} to"
        return f"{noun} {span} {high}{unit}"


def plain(bound: float) -> str:
    """A bound without exponent where it is whole."""
    return str(int(bound)) if math.isfinite(bound) and bound == int(bound) else f"{bound:g}"


@dataclass(frozen=True)
class Choice(Kind):
    """One of a few words."""

    options: tuple[str, ...]

    def check(self, name: str, value: Any) -> str:  # noqa: ANN401
        if value not in self.options:
            raise self.refuse(name, value)
        return str(value)

    def describe(self) -> str:
        return ", ".join(self.options)


@dataclass(frozen=True)
class Either(Kind):
    """A value of another kind, or one certain word."""

    item: Kind
    word: str

    def check(self, name: str, value: Any) -> Any:  # noqa: ANN401
        if value == self.word:
            return self.word
        try:
            return self.item.check(name, value)
        except SettingsError as error:
            raise self.refuse(name, value) from error

    def describe(self) -> str:
        return f'{self.item.describe()}, or "{self.word}"'


@dataclass(frozen=True)
class Switch(Kind):
    """True or false."""

    def check(self, name: str, value: Any) -> bool:  # noqa: ANN401
        if not isinstance(value, bool):
            raise self.refuse(name, value)
        return value

    def describe(self) -> str:
        return "true, false"


@dataclass(frozen=True)
class Text(Kind):
    """Free text; ``example`` is how a flag's help writes it."""

    what: str = "a text"
    example: str = "TEXT"

    def check(self, name: str, value: Any) -> str:  # noqa: ANN401
        if not isinstance(value, str) or not value or not is_unicode(value):
            raise self.refuse(name, value)
        return value

    def describe(self) -> str:
        return self.what


@dataclass(frozen=True)
class Several(Kind):
    """A list of values of one kind, between two lengths.

    Its flag may be given more than once where ``repeated``; where not ``commas``, each time for one value, which may
    hold commas itself.
    """

    item: Kind
    least: int = 0
    most: int = 1000
    repeated: bool = False
    commas: bool = True

    def check(self, name: str, value: Any) -> tuple[Any, ...]:  # noqa: ANN401
        if not isinstance(value, (list, tuple)) or not self.least <= len(value) <= self.most:
            raise self.refuse(name, value)
        return tuple(self.item.check(f"{name}[{i}]", entry) for i, entry in enumerate(value))

    def describe(self) -> str:
        count = f"{self.least} to {self.most}" if self.least != self.most else f"{self.least}"
        return f"a list of {count} entries, each {self.item.describe()}"


@dataclass(frozen=True)
class Interval(Kind):
    """A pair [lower, upper] of numbers; equal ends fix the value."""

    number: Number

    def check(self, name: str, value: Any) -> tuple[float, float]:  # noqa: ANN401
        if not isinstance(value, (list, tuple)) or len(value) != 2:
            raise self.refuse(name, value)
        low, high = (self.number.check(name, end) for end in value)
        if low > high:
            raise SettingsError(
                f"setting '{name}' is {[low, high]!r}: its bounds are upside down",
                value=value,
                allowed=self.describe(),
                fix=f"Write [{high:g}, {low:g}]",
            )
        return low, high

    def describe(self) -> str:
        return f"a pair [lower, upper], lower <= upper, each {self.number.describe()}"


@dataclass(frozen=True)
class Table(Kind):
    """Named values of one kind."""

    item: Kind

    def check(self, name: str, value: Any) -> dict[str, Any]:  # noqa: ANN401
        if not isinstance(value, Mapping):
            raise self.refuse(name, value)
        return {str(key): self.item.check(f"{name}.{key}", entry) for key, entry in value.items()}

    def describe(self) -> str:
        return f"a table of entries, each {self.item.describe()}"


def parameter(
    default: Any,  # noqa: ANN401
    kind: Kind,
    doc: str,
    *,
    optional: bool = False,
    panel: str | None = None,
    flag: str | None = None,
    short: str | None = None,
) -> Any:  # noqa: ANN401
    """Declare one parameter as a dataclass field.

    Args:
        default: Published or recommended value; None where ``optional`` means "not set".
        kind: What values it takes.
        doc: One or two lines for the TOML comment and the manual, with the unit.
        optional: Whether None is allowed.
        panel: Where the help of a command lists its flag; an entry without a panel has no flag, unless its section
            has one for all entries; one with the panel "" never has.
        flag: Its flag where that is not called like the entry.
        short: What the flag's help says where ``doc`` is for a file of settings only.
    """
    metadata = {"kind": kind, "doc": doc, "optional": optional, "panel": panel, "flag": flag, "short": short}
    if isinstance(default, dict):
        return dataclasses.field(default_factory=lambda: dict(default), metadata=metadata)
    return dataclasses.field(default=default, metadata=metadata)


def flag_name(entry: dataclasses.Field[Any]) -> str:
    """An entry as the command line calls it."""
    return str(entry.metadata["flag"] or "--" + entry.name.replace("_", "-"))


class Section:
    """Base of the dataclasses made of parameters.

    Attributes:
        panel: Where the help of a command lists the flags of entries that name no panel of their own.
    """

    panel: ClassVar[str | None] = None

    def __init_subclass__(cls) -> None:
        """Add the entries to the docstring, so that ``help`` shows what each means, takes and is by default."""
        entries = {name: entry for name, entry in vars(cls).items() if isinstance(entry, dataclasses.Field)}
        wrap = textwrap.TextWrapper(100, initial_indent=" " * 4, subsequent_indent=" " * 8).fill
        lines = [wrap(f"{name}: {described(entry)}") for name, entry in entries.items()]
        cls.__doc__ = "\n".join([inspect.cleandoc(cls.__doc__ or ""), "", "Attributes:", *lines])

    def __post_init__(self) -> None:
        """Check and normalise every value.

        Raises:
            SettingsError: A value is not allowed.
        """
        for entry in dataclasses.fields(self):  # type: ignore[arg-type]
            value = getattr(self, entry.name)
            if value is None and entry.metadata["optional"]:
                continue
            object.__setattr__(self, entry.name, entry.metadata["kind"].check(self.full_name(entry.name), value))

    def __repr__(self) -> str:
        """What differs from the defaults, as one would write it."""
        return f"{type(self).__name__}({', '.join(f'{name}={value!r}' for name, value in self.changed().items())})"

    def changed(self) -> dict[str, Any]:
        """The entries that differ from their defaults."""
        default = type(self)()
        return {name: getattr(self, name) for name in self.names() if getattr(self, name) != getattr(default, name)}

    @classmethod
    def title(cls) -> str:
        """Name of the section's TOML table."""
        return cls.__name__.removesuffix("Settings").lower()

    @classmethod
    def full_name(cls, name: str) -> str:
        """Name of an entry as the user writes it."""
        return f"{cls.title()}.{name}"

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """Names of the section's entries."""
        return tuple(entry.name for entry in dataclasses.fields(cls))  # type: ignore[arg-type]


def described(entry: dataclasses.Field[Any]) -> str:
    """An entry's meaning, allowed values and default in one line."""
    made = entry.default_factory
    default = entry.default if made is dataclasses.MISSING else made()
    meaning = " ".join(str(entry.metadata["doc"]).split())
    return f"{meaning} Allowed: {entry.metadata['kind'].describe()}. Default: {default!r}."


def is_unicode(text: str) -> bool:
    """Whether a text can be stored as UTF-8; a file name of stray bytes cannot."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


def toml_value(value: Any) -> str:  # noqa: ANN401
    """A value as TOML, floats with all their digits."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, str):
        return toml_string(value)
    if isinstance(value, Mapping):
        return (
            "{ " + ", ".join(f"{toml_string(k)} = {toml_value(v)}" for k, v in value.items()) + " }" if value else "{}"
        )
    return "[" + ", ".join(toml_value(entry) for entry in value) + "]"


def toml_string(text: str) -> str:
    """A TOML basic string: quotes, backslashes and control characters escaped."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c >= " " and c != "\x7f" else f"\\u{ord(c):04X}" for c in escaped) + '"'


def section_toml(section: Section, *, comments: bool) -> str:
    """A section as TOML.

    Args:
        section: The section.
        comments: Whether each entry is preceded by its description and allowed values.
    """
    lines = [f"[{section.title()}]"]
    for entry in dataclasses.fields(section):  # type: ignore[arg-type]
        value = getattr(section, entry.name)
        if comments:
            lines += [f"# {line}" for line in str(entry.metadata["doc"]).splitlines()]
            lines += [f"# Allowed: {entry.metadata['kind'].describe()}."]
        if value is not None:
            lines.append(f"{entry.name} = {toml_value(value)}")
        elif comments:
            lines.append(f"# {entry.name} =   (not set)")
        if comments:
            lines.append("")
    return "\n".join(lines).rstrip() + "\n"
