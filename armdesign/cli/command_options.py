"""Options that several commands share, and the settings that flags and a settings file make together."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer

from armdesign.errors import SettingsError
from armdesign.settings.sections import Settings, read_settings


def option(flag: str, metavar: str | None, words: str, panel: str | None = None, **more: Any) -> Any:  # noqa: ANN401
    """An option of a command.

    Args:
        flag: Its name; of a switch also the name that turns it off.
        metavar: How the help writes its value; None for a switch.
        words: The help, with the unit and what holds by default.
        panel: Title of the options that the help lists it among.
        more: Further arguments of typer.Option.
    """
    return typer.Option(flag, metavar=metavar, help=words, rich_help_panel=panel, **more)


OUTPUT = "Output"
"""Panel of the options on what is written and printed."""
ConfigOption = Annotated[
    Path | None,
    typer.Option(
        "--config",
        metavar="FILE",
        help="Settings file in TOML, see search --write-config; options given beside it take precedence.",
    ),
]
QuietOption = Annotated[
    bool, typer.Option("--quiet", "-q", help="Print neither progress nor tables.", rich_help_panel=OUTPUT)
]
OverwriteOption = Annotated[
    bool, typer.Option("--overwrite", help="Replace the run that the output folder holds.", rich_help_panel=OUTPUT)
]


def number_of(flag: str, text: str, allowed: str, unit: str = "") -> float:
    """The number that a flag gives, with its unit or without.

    Raises:
        SettingsError: It is no number.
    """
    try:
        return float(text.removesuffix(unit))
    except ValueError as error:
        raise SettingsError(f"{flag} is {text!r}", value=text, allowed=allowed) from error


def settings_from_flags(config: Path | None, given: Mapping[str, Mapping[str, Any]]) -> Settings:
    """Settings of the file, with the flags that were given over them.

    Args:
        config: The file; None for the published settings.
        given: Values by section and entry; None where nothing was given.
    """
    return with_flags(Settings() if config is None else read_settings(config), given)


def with_flags(settings: Settings, given: Mapping[str, Mapping[str, Any]]) -> Settings:
    """Settings with the flags that were given over them.

    Args:
        settings: The settings.
        given: Values by section and entry; None where nothing was given. Paths of obstacles become whole ones, as they
            count from here and not from where the settings are written.

    Raises:
        SettingsError: A value is not allowed, or one for bodies is given with an arm that has none.
    """
    changes = {
        section: {name: value for name, value in entries.items() if value is not None}
        if isinstance(entries, Mapping)
        else entries
        for section, entries in given.items()
    }
    cell, body = changes.get("cell", {}), changes.get("body", {})
    if isinstance(cell, Mapping) and isinstance(cell.get("obstacles"), list):
        changes["cell"] = {**cell, "obstacles": [str(Path(path).resolve()) for path in cell["obstacles"]]}
    made = settings.replace(changes)
    without = [name for name in ("clearance", "module_slide") if name in body]
    if without and made.body.kind == "thin":
        flag = f"--{without[0].replace('_', '-')}"
        raise SettingsError(
            f"{flag} is given, but a thin arm has no body", value=body[without[0]], allowed=f"{flag} with --body tube",
            fix="Leave one of the two out",
        )  # fmt: skip
    return made


class WeightFlags(NamedTuple):
    """What --scenario and --weights say; None where they are not given."""

    scenario: str | None = None
    weights: list[float] | None = None  # one more than there are points where the first is the orientation's

    @classmethod
    def out_of(cls, given: Mapping[str, dict[str, Any]]) -> WeightFlags:
        """Take them out of the settings whose flags were given: what they mean depends on the recording's points."""
        return cls(given["fitness"].pop("scenario", None), given["fitness"].pop("weights", None))

    def over(self, settings: Settings) -> Settings:
        """Settings with these weights: --weights as given, --scenario instead of the file's."""
        if self.scenario is not None:
            entries = {"scenario": self.scenario, "weights": (), "orientation_weight": None}
            settings = settings.replace({"fitness": entries})
        if self.weights is None:
            return settings
        return settings.replace({"fitness": {"weights": self.weights, "orientation_weight": None}})
