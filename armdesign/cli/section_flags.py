"""Flags out of declared parameters: one for every entry of a section, with its own words, range and default."""

from __future__ import annotations

import dataclasses
import functools
import inspect
from collections.abc import Callable
from typing import Annotated, Any, TypeVar

import typer

from armdesign.settings.kinds import Number, Section, Switch

Outcome = TypeVar("Outcome")


def takes_sections(load: Callable[[], dict[str, type[Section]]]) -> Callable[..., Callable[..., Any]]:
    """Give a command a flag for every entry of some sections, in place of its parameters of their names.

    Args:
        load: Gives the sections by the names of the command's parameters; no two entries have the same name.
    """

    def decorate(command: Callable[..., Outcome]) -> Callable[..., Outcome]:
        sections = load()
        flags = {entry.name: flag(entry) for section in sections.values() for entry in dataclasses.fields(section)}  # type: ignore[arg-type]
        kept = [
            parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY)
            for name, parameter in inspect.signature(command, eval_str=True).parameters.items()
            if name not in sections
        ]

        @functools.wraps(command)
        def wrapped(**given: Any) -> Outcome:  # noqa: ANN401 (whatever the command takes)
            values = {name: given.pop(name) for name in flags if name in given}
            made = {
                name: section(**{key: values[key] for key in section.names() if values.get(key) is not None})
                for name, section in sections.items()
            }
            return command(**given, **made)

        parameters = [*kept, *flags.values()]
        wrapped.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        wrapped.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
        return wrapped

    return decorate


def flag(entry: dataclasses.Field[Any]) -> inspect.Parameter:
    """The flag of one entry; None where it is not given."""
    kind = entry.metadata["kind"]
    words = " ".join(str(entry.metadata["doc"]).split())
    name = "--" + entry.name.replace("_", "-")
    default = "" if entry.default is None or isinstance(kind, Switch) else f" (default {entry.default})"
    if isinstance(kind, Switch):
        option: Any = Annotated[bool | None, typer.Option(f"{name}/--no-{name[2:]}", help=words, show_default=False)]
    elif isinstance(kind, Number):
        option = Annotated[float | None, typer.Option(name, help=words + default)]
    else:
        option = Annotated[str | None, typer.Option(name, help=words + default)]
    return inspect.Parameter(entry.name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=option)
