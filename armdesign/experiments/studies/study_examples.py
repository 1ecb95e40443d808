"""The two built-in demonstrations, which a study takes where none is named."""

from __future__ import annotations

from pathlib import Path

from armdesign.errors import SettingsError

EXAMPLES = ("packaging", "welding")
"""Names of the recordings, and of the scenario that belongs to each."""
FOLDER = "examples"
PACKAGE = Path(__file__).resolve().parent.parent.parent


def example_recording(name: str, package: Path = PACKAGE) -> Path:
    """Find a recording: inside the package (a wheel) or beside it (a checkout or an editable install).

    Args:
        name: One of ``EXAMPLES``.
        package: Folder of the package.

    Raises:
        SettingsError: It is in neither place.
    """
    places = [package / FOLDER / f"{name}.csv", package.parent / FOLDER / f"{name}.csv"]
    for place in places:
        if place.is_file():
            return place
    raise SettingsError(
        f"the built-in recording '{name}' is missing; looked for {places[0]} and {places[1]}",
        value=name,
        fix="The installation is incomplete: reinstall armdesign, or name a recording of your own",
    )
