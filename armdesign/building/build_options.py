"""What an arm is to be built of, and how well."""

from __future__ import annotations

from dataclasses import dataclass

from armdesign.errors import SettingsError

SLOWEST = 0.02
"""Share of the demonstrated speed below which an arm counts as too weak to move."""


@dataclass(frozen=True)
class BuildOptions:
    """What an arm is built of, and how well.

    Attributes:
        catalogue: A family or a catalogue file.
        least: What is minimised: ``mass`` or ``price``.
        margin: Factor on the torques that are needed.
        payload: Point mass at the tool [kg]; None for the task's.
        speed: Share of the demonstrated speed; ``auto`` for the largest at which there is a choice.
        stock: Tubes to choose from, ``aluminium`` or a file; None to keep those of the design.
        deflection: How far the tool may sag under the payload [m].
        snap: Whether lengths become what tubes are cut to, and twists those of brackets.
        printed: Whether brackets of any angle can be had.
        known_holes: Whether only actuators are taken whose bolt holes the catalogue knows, which drills every bracket.
    """

    catalogue: str
    least: str = "mass"
    margin: float = 1.2
    payload: float | None = None
    speed: float | str = 1.0
    stock: str | None = None
    deflection: float = 1e-3
    snap: bool = True
    printed: bool = False
    known_holes: bool = False

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            SettingsError: A value is not allowed.
        """
        if self.least not in ("mass", "price"):
            raise SettingsError(f"--for is {self.least!r}", value=self.least, allowed=["mass", "price"])
        if isinstance(self.speed, str) and self.speed != "auto":
            raise SettingsError(f"--speed is {self.speed!r}", value=self.speed, allowed="auto, or a number")
        for name, number, low, high in (
            ("--margin", self.margin, 1.0, 100.0),
            ("--payload", self.payload or 0.0, 0.0, 1000.0),
            ("--deflection", self.deflection, 1e-6, 1.0),
            ("--speed", 1.0 if isinstance(self.speed, str) else self.speed, SLOWEST, 1.0),
        ):
            if not low <= number <= high:
                raise SettingsError(f"{name} is {number:g}", value=number, allowed=f"{low:g} to {high:g}")
