"""The flags that say how a recording becomes a task, declared once for every command that reads one."""

from __future__ import annotations

import functools
import inspect
import typing
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Annotated, Any, TypeVar

import typer

from armdesign.errors import SettingsError

Outcome = TypeVar("Outcome")

UnitsOption = Annotated[
    str | None, typer.Option("--units", help="Unit of the recording, m, cm, mm or in; default: what the file says.")
]
UpOption = Annotated[
    str | None, typer.Option("--up", help="Its axis that points up, x, y or z; default: what the file says.")
]
MirrorOption = Annotated[
    bool | None, typer.Option("--mirror/--no-mirror", help="Make a right arm of a left one.", show_default=False)
]


@dataclass(frozen=True)
class TaskFlags:
    """What was given of these flags; None where a flag was not."""

    base: Annotated[
        str | None,
        typer.Option("--base", help="Point the base stands at, the shoulder. 'origin': points count from it already."),
    ] = None
    points: Annotated[
        str | None,
        typer.Option("--points", help="Points to follow, shoulder to hand: elbow,wrist,hand or elbow=EPICl+EPICm,..."),
    ] = None
    orientation: Annotated[
        str | None, typer.Option("--orientation", help="Point whose orientation the end-effector follows.")
    ] = None
    base_mode: Annotated[
        str | None,
        typer.Option("--base-mode", help="shoulder (default): paths from the moving base; fixed: from its mean."),
    ] = None
    units: UnitsOption = None
    up: UpOption = None
    mirror: MirrorOption = None
    outliers: Annotated[
        bool | None,
        typer.Option(
            "--outliers/--no-outliers", show_default=False,
            help="Take outliers out as gaps; default: in a capture system's file.",
        ),
    ] = None  # fmt: skip
    max_gap: Annotated[
        float | None, typer.Option("--max-gap", help="Longest gap that is filled [s] (default 0.2).")
    ] = None
    repeats: Annotated[
        bool | None,
        typer.Option(
            "--repeats/--no-repeats", show_default=False,
            help="Interpolate repeated frames; default: in a capture system's file.",
        ),
    ] = None  # fmt: skip
    low_pass: Annotated[
        str | None,
        typer.Option(
            "--low-pass", help="Cut-off of the smoothing [Hz], or off; default: 6 in a capture system's file."
        ),
    ] = None
    start: Annotated[float | None, typer.Option("--from", help="First time to use [s].")] = None
    stop: Annotated[float | None, typer.Option("--to", help="Last time to use [s].")] = None
    cut: Annotated[
        list[str] | None,
        typer.Option("--cut", metavar="A:B", help="Cut out the time from A to B [s] where the hand stands still."),
    ] = None
    rate: Annotated[float | None, typer.Option("--rate", help="Resample to so many frames per second.")] = None
    scale: Annotated[float | None, typer.Option("--scale", help="Factor on all lengths.")] = None

    def changes(self) -> dict[str, Any]:
        """The task settings they ask for, by name; without those not given.

        Raises:
            SettingsError: --low-pass or --cut cannot be made out.
        """
        given = {entry.name: getattr(self, entry.name) for entry in fields(self)}
        given["points"] = None if self.points is None else names(self.points)
        given["low_pass"] = None if self.low_pass is None else cutoff(self.low_pass)
        given["cut"] = [stretch(text) for text in self.cut] if self.cut else None
        return {name: value for name, value in given.items() if value is not None}


NO_FLAGS = TaskFlags()
"""None of them given."""


def takes_task_flags(command: Callable[..., Outcome]) -> Callable[..., Outcome]:
    """Give a command all of the flags above in place of its one parameter ``task: TaskFlags``."""
    signature = inspect.signature(command, eval_str=True)
    hints = typing.get_type_hints(TaskFlags, include_extras=True)
    flags = [
        inspect.Parameter(entry.name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=hints[entry.name])
        for entry in fields(TaskFlags)
    ]
    parameters: list[inspect.Parameter] = []
    for parameter in signature.parameters.values():
        kept = parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY)
        parameters += flags if parameter.annotation is TaskFlags else [kept]

    @functools.wraps(command)
    def wrapped(**given: Any) -> Outcome:  # noqa: ANN401 (whatever the command takes)
        task = TaskFlags(**{flag.name: given.pop(flag.name) for flag in flags if flag.name in given})
        return command(task=task, **given)

    wrapped.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    wrapped.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return wrapped


def names(text: str) -> list[str]:
    """A comma-separated list of points; commas in quotation marks belong to a name."""
    from armdesign.demonstration.points.expressions import split_list  # noqa: PLC0415 (NumPy)

    return split_list(text)


def cutoff(text: str) -> float | str:
    """A cut-off in Hz, or ``off``.

    Raises:
        SettingsError: It is neither.
    """
    word = text.strip().lower()
    try:
        return "off" if word == "off" else float(word.removesuffix("hz"))
    except ValueError as error:
        allowed = "a cut-off in Hz such as 6, or off"
        raise SettingsError(f"--low-pass is {text!r}", value=text, allowed=allowed) from error


def stretch(text: str) -> tuple[float, float]:
    """Two times A:B.

    Raises:
        SettingsError: They are none.
    """
    parts = text.split(":")
    try:
        begin, end = map(float, parts)
    except ValueError as error:
        allowed = "two times A:B in seconds such as 2.5:3.1"
        raise SettingsError(f"--cut is {text!r}", value=text, allowed=allowed) from error
    return begin, end
