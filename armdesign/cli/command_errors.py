"""Errors of the commands: one sentence and an exit code; what may not be given together; outputs that are there."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import ParamSpec, TypeVar

import typer

from armdesign.cli.screen import console, wrapped
from armdesign.errors import ArmDesignError, RunFolderError, SettingsError
from armdesign.settings.sections import ALGORITHM_SETTINGS

Arguments = ParamSpec("Arguments")
Outcome = TypeVar("Outcome")
INTERRUPTED = 130
RESUME_FLAGS = ("resume", "workers", "cluster", "quiet", "dry_run", "report")
"""What may be given with --resume."""


def one_sentence_errors(command: Callable[Arguments, Outcome]) -> Callable[Arguments, Outcome]:
    """Turn errors for bad input into one sentence on stderr and exit code 2, Ctrl-C into 130."""

    @functools.wraps(command)
    def guarded(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Outcome:
        try:
            return command(*args, **kwargs)
        except ArmDesignError as error:
            out, sentence = console(stderr=True), f"armdesign: {error}"
            typer.echo(wrapped(sentence, out.width) if out.is_terminal else sentence, err=True)
            raise typer.Exit(error.exit_code) from error
        except KeyboardInterrupt as error:
            typer.echo("armdesign: stopped", err=True)
            raise typer.Exit(INTERRUPTED) from error

    return guarded


def refuse_beside_resume(context: typer.Context, what: str, fix: str, also: tuple[str, ...] = ()) -> None:
    """See that nothing is given beside --resume that would change what is computed.

    Args:
        context: The command's context.
        what: What is resumed, "a search" or "a sweep".
        fix: What to do instead.
        also: Further parameters that may be given.

    Raises:
        SettingsError: Another flag or argument was given.
    """
    given = [
        max(parameter.opts, key=len)
        if str(parameter.opts[0]).startswith("-")
        else f"the {str(parameter.name).removesuffix('s')}"
        for parameter in context.command.params
        if parameter.name not in (*RESUME_FLAGS, *also)
        and getattr(context.get_parameter_source(str(parameter.name)), "name", "") == "COMMANDLINE"
    ]
    if given:
        message = f"--resume goes on with {what} as it was started, but {', '.join(given)} is given as well"
        raise SettingsError(message, value=given, fix=fix)


def refuse_without(needed: str, given: Mapping[str, object]) -> None:
    """Refuse flags that have no effect without another one that is not there.

    Raises:
        SettingsError: One of them was given.
    """
    for flag, value in given.items():
        if value is not None and value is not False:
            raise SettingsError(f"{flag} is given without {needed}", value=value, fix="Leave it out, or add that")


def refuse_other_algorithms(given: Mapping[str, object], algorithms: Sequence[str]) -> None:
    """Refuse settings of the search that none of the algorithms in use has.

    Raises:
        SettingsError: One of the settings belongs to other algorithms only.
    """
    for name, value in given.items():
        owners = [owner for owner, settings in ALGORITHM_SETTINGS.items() if name in settings]
        if owners and not set(owners) & set(algorithms):
            flag = f"--{name.replace('_', '-')}"
            raise SettingsError(
                f"{flag} is given, but the algorithm is {', '.join(algorithms)}", value=value,
                allowed=f"{flag} with {', '.join(owners)}", fix="Leave it out, or choose another --algorithm",
            )  # fmt: skip


def refuse_existing(*targets: Path, overwrite: bool) -> None:
    """Turn away outputs that are there already, before any work is done.

    Raises:
        RunFolderError: One of them exists and may not be replaced.
    """
    for target in targets:
        if target.exists() and not overwrite:
            fix = "Use --overwrite to replace it, or give another name"
            raise RunFolderError(f"{target} is there already", value=str(target), fix=fix)
