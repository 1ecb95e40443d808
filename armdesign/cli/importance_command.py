"""``armdesign importance``: which entries of a design matter."""

from __future__ import annotations

from math import degrees
from pathlib import Path
from typing import Annotated

import typer

from armdesign.building.tolerance import importance as importance_of
from armdesign.cli.command_errors import one_sentence_errors
from armdesign.cli.screen import compiling, show_table
from armdesign.runs.checking import finished_arm


@one_sentence_errors
def importance(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="Run folder of a search, an evaluation or a build.")],
) -> None:
    """Say which entries of a design matter for its fitness r.

    Each is moved by 1 mm or 1 deg either way, and the path solved again: where to be exact, and where free.
    """
    result = finished_arm(run)
    with compiling(quiet=False, bodies=True):
        found = importance_of(result)
    rows = []
    for each in found:
        size = f"{each.value * 1e3:.1f} mm" if each.name.startswith(("a_", "d_", "base_x", "base_y", "base_z")) else (
            f"{degrees(each.value):.2f} deg")  # fmt: skip
        rows.append((each.name, size, f"{each.worse * 1e3:+.2f}"))
    show_table(("entry", "value", "r grows by [mm]"), rows)
