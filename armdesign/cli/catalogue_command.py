"""``armdesign catalogue``: look at the catalogues of actuators, and check one's own."""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import Annotated

import typer

from armdesign.building.catalogue import Actuator, examine, find_catalogue, shipped
from armdesign.cli import PanelCommand
from armdesign.cli.command_errors import one_sentence_errors
from armdesign.cli.screen import show_table, show_text
from armdesign.errors import CatalogueError, counted

app = typer.Typer(
    name="catalogue",
    help="Show and check catalogues of actuators.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
HEADINGS = ("actuator", "rated [N m]", "peak [N m]", "no load [rpm]", "mass [g]", "housing [mm]", "price")


@app.command("list", cls=PanelCommand)
@one_sentence_errors
def list_catalogues() -> None:
    """List the catalogues that come with the package."""
    rows = []
    for name in shipped():
        found = find_catalogue(name)
        peaks = [actuator.peak_torque for actuator in found.actuators]
        rows.append((name, found.maker, str(len(peaks)), f"{min(peaks):.3g} to {max(peaks):.3g}"))
    show_table(("family", "maker", "sizes", "peak torque [N m]"), rows, left=(0, 1))


@app.command(cls=PanelCommand)
@one_sentence_errors
def show(
    name: Annotated[str, typer.Argument(metavar="NAME", help="A family, or a catalogue file.")],
) -> None:
    """Show the sizes of a family, and where its figures come from."""
    found = find_catalogue(name)
    show_table(HEADINGS, [cells(actuator, found.currency) for actuator in found.actuators])
    for source in found.sources:
        show_text(f"{', '.join(source.figures)}: {source.document}, {source.date}.")


@app.command(cls=PanelCommand)
@one_sentence_errors
def check(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="A catalogue file of your own, TOML or a table of motors.")
    ],
) -> None:
    """Check a catalogue file: every fault in a sentence."""
    found, faults = examine(file)
    if found is None:
        for fault in faults[:-1]:
            typer.echo(f"error: {fault}", err=True)
        raise CatalogueError(faults[-1], value=str(file))
    typer.echo(f"{file}: {counted(len(found.actuators), 'actuator')} of {found.maker}, nothing wrong.")


def cells(actuator: Actuator, currency: str) -> tuple[str, ...]:
    """An actuator as a row of text."""
    return (
        actuator.name,
        f"{actuator.rated_torque:.3g}",
        f"{actuator.peak_torque:.3g}",
        f"{actuator.no_load_speed * 30.0 / pi:.4g}",
        f"{actuator.mass * 1e3:.4g}",
        f"{actuator.diameter * 1e3:.4g} x {actuator.length * 1e3:.4g}",
        "-" if actuator.price is None else f"{actuator.price:.0f} {currency}",
    )
