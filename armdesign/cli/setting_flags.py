"""Flags out of declared settings: name, help, choices, default and panel come from the declaration, read here."""

from __future__ import annotations

import dataclasses
import functools
import inspect
import re
from collections.abc import Callable, Collection, Mapping
from fractions import Fraction
from typing import Annotated, Any, TypeVar

import typer

from armdesign.demonstration.points.expressions import split_list
from armdesign.errors import SettingsError
from armdesign.settings.kinds import (
    LENGTHS,
    Choice,
    Either,
    Interval,
    Kind,
    Number,
    Section,
    Several,
    Switch,
    Table,
    Text,
    flag_name,
)

Outcome = TypeVar("Outcome")
Given = dict[str, dict[str, Any]]
"""The settings whose flags were given, as {section: {entry: value}}."""
DURATIONS = {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86400.0}


def takes_settings(
    *sections: type[Section],
    only: Collection[str] | None = None,
    without: Collection[str] = (),
    words: Mapping[str, str] | None = None,
) -> Callable[[Callable[..., Outcome]], Callable[..., Outcome]]:
    """Give a command the flags of declared settings, in place of its parameter ``given: Given``.

    Args:
        sections: Their entries with a panel get a flag; no two entries may have the same name.
        only: Names of the entries to take; None for all.
        without: Names of entries to leave out.
        words: For some entries, a word that the flag takes beside the setting's values.
    """
    kinds = {
        name: Either(entry.metadata["kind"], words[name]) if words and name in words else entry.metadata["kind"]
        for section in sections
        for name, entry in flagged(section).items()
        if (only is None or name in only) and name not in without
    }
    homes = {name: section for section in sections for name in flagged(section) if name in kinds}

    def decorate(command: Callable[..., Outcome]) -> Callable[..., Outcome]:
        parameters: list[inspect.Parameter] = []
        for parameter in inspect.signature(command, eval_str=True).parameters.values():
            if parameter.name == "given":
                parameters += [flag(homes[name], name, kind) for name, kind in kinds.items()]
            else:
                parameters.append(parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY))

        @functools.wraps(command)
        def wrapped(**values: Any) -> Outcome:  # noqa: ANN401 (whatever the command takes)
            given: Given = {section.title(): {} for section in sections}
            for name, kind in kinds.items():
                text = values.pop(name, None)
                if text is not None and text != []:
                    home = homes[name]
                    given[home.title()][name] = read_flag(kind, text, flag_name(flagged(home)[name]))
            return command(given=given, **values)

        wrapped.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        wrapped.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
        return wrapped

    return decorate


def flagged(section: type[Section]) -> dict[str, dataclasses.Field[Any]]:
    """The entries of a section that have a flag, by name."""
    entries = dataclasses.fields(section)  # type: ignore[arg-type]
    return {entry.name: entry for entry in entries if panel_of(entry, section)}


def panel_of(entry: dataclasses.Field[Any], section: type[Section]) -> str | None:
    """Where the help lists the flag of an entry; none where it has no flag."""
    panel: str | None = entry.metadata["panel"]
    return section.panel if panel is None else panel


def flag(section: type[Section], name: str, kind: Kind) -> inspect.Parameter:
    """The flag of one entry as a parameter of a command; None where it is not given."""
    entry = flagged(section)[name]
    declared, words, default = flag_name(entry), entry.metadata["short"] or entry.metadata["doc"], entry.default
    help_text = " ".join(str(words).split())
    if default not in (None, (), dataclasses.MISSING) and not isinstance(default, bool):
        help_text = f"{help_text.rstrip('.')} (default {default})."
    if isinstance(kind, Switch):
        declared, annotation = f"{declared}/--no-{declared[2:]}", bool | None
    else:
        several = isinstance(kind, Several) and (kind.repeated or isinstance(kind.item, Interval))
        repeatable = several or isinstance(kind, Table)
        annotation = list[str] | None if repeatable else str | None  # type: ignore[assignment]
    options = kind.options if isinstance(kind, Choice) else ()
    option = typer.Option(
        declared,
        help=help_text,
        metavar=metavar(kind),
        rich_help_panel=panel_of(entry, section),
        show_default=False,
        autocompletion=(lambda: list(options)) if options else None,
    )
    return inspect.Parameter(
        name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=Annotated[annotation, option]
    )


def metavar(kind: Kind) -> str | None:
    """How the help writes a flag's value."""
    match kind:
        case Choice():
            return "|".join(kind.options)
        case Either():
            return f"{metavar(kind.item)}|{kind.word}"
        case Number():
            return "N" if kind.integer else "X"
        case Text():
            return kind.example
        case Several(item=Text() as item, commas=False):
            return item.example
        case Several(item=Interval()) | Interval():
            return "A:B"
        case Table():
            return f"NAME={metavar(kind.item)}"
        case Several():
            return f"{metavar(kind.item)},..."
    return None


def read_flag(kind: Kind, text: Any, flag: str) -> Any:  # noqa: ANN401 (a setting's value)
    """The value that a flag's text means; its range is checked by the settings.

    Args:
        kind: What the flag takes.
        text: What was given: a text, a list of texts for a repeatable flag, or whether a switch is on.
        flag: Its name.

    Raises:
        SettingsError: The text cannot be made out.
    """
    match kind:
        case Either() if text.strip().lower() == kind.word:
            return kind.word
        case Table():
            return dict(read_named(kind, part, flag) for part in text)
        case Several(item=Interval()):
            return [read_flag(kind.item, part, flag) for part in text]
        case Several(item=Text(), repeated=True, commas=False):
            return list(text)
        case Several(item=Text(), repeated=True):
            return [part.strip() for each in text for part in each.split(",") if part.strip()]
        case Several(item=Text()):
            return split_list(text)
    try:
        match kind:
            case Either(item=Number() as number) | (Number() as number):
                return read_number(number, text)
            case Interval(number=number):
                begin, end = text.split(":")
                return read_number(number, begin), read_number(number, end)
            case Several(item=Number() as number):
                return [read_number(number, part) for part in text.split(",") if part.strip()]
    except (ValueError, ZeroDivisionError, OverflowError) as error:
        allowed = "two numbers A:B such as 2.5:3.1" if isinstance(kind, Interval) else kind.describe()
        examples = {"s": ", such as 90s, 30m, 2h or 1d", "m": ", such as 0.005 or 5mm"}
        if isinstance(kind, Number):
            allowed += examples.get(str(kind.unit), "")
        raise SettingsError(f"{flag} is {text!r}", value=text, allowed=allowed) from error
    return text


def read_named(kind: Table, text: str, flag: str) -> tuple[str, Any]:
    """A name and its value, as in d_tool=0.1:0.2.

    Raises:
        SettingsError: There is no name, or the value cannot be made out.
    """
    name, equals, value = text.partition("=")
    if not equals or not name.strip():
        raise SettingsError(f"{flag} is {text!r}", value=text, allowed=f"{metavar(kind)}, such as d_tool=0.1:0.2")
    return name.strip(), read_flag(kind.item, value, f"{flag} {name.strip()}")


def read_number(kind: Number, text: str) -> float | int:
    """A number, a fraction such as 1/6, or a number with its unit such as 6Hz, 5mm or, of a time, 30m.

    Raises:
        ValueError: It is none.
    """
    text = text.strip()
    if kind.unit == "s" and text[-1:] in DURATIONS:
        return float(text[:-1]) * DURATIONS[text[-1]]
    length = re.fullmatch(r"(.*[0-9.])\s*(mm|cm|m|in)", text) if kind.unit == "m" else None
    if length is not None:
        return float(Fraction(length[1]) * LENGTHS[length[2]])
    if kind.unit and text.lower().endswith(kind.unit.lower()):
        text = text[: -len(kind.unit)]
    if "/" in text:
        return float(Fraction(text))
    return int(text) if kind.integer else float(text)
