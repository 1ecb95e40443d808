"""What actuators are fed and talked to by: one supply voltage and one bus, where the family has such a choice."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from armdesign.building.catalogue import Actuator

MIXED = "feed each voltage by wires of its own: a cable that takes the higher one on destroys the lower"
"""What several supplies on one arm take, whose usual cables carry bus and supply together."""


@dataclass(frozen=True)
class Supply:
    """What the actuators of an arm need, which no build chooses.

    Attributes:
        voltages: Of the supplies, each as high as what it feeds has its figures at [V]; empty where not published.
        buses: One that all have in common, or the first of each; empty where not published.
        current: Sum of what they take at their peak torques [A]; None where one of them is not published.
        count: Number of the actuators.
    """

    voltages: tuple[float, ...]
    buses: tuple[str, ...]
    current: float | None
    count: int

    @property
    def words(self) -> str:
        """The same in a sentence."""
        volts = " and ".join(f"{each:g} V" for each in self.voltages) or "of a voltage that is not published"
        most = "currents are not published"
        if self.current is not None:
            most = f"up to {self.current:.3g} A, were all at their peak torque at once"
        words = (
            f"{'Supply' if len(self.voltages) < 2 else 'Supplies'}: {volts}, {most}; "
            f"bus: {' and '.join(self.buses) or 'not published'}."
        )
        return words if len(self.voltages) < 2 else f"{words} {MIXED}."

    def volts(self, actuator: Actuator) -> float | None:
        """Which of its voltages an actuator is fed with [V]; None where it is not published."""
        low = actuator.voltage
        return next((v for v in self.voltages if low is not None and low <= v <= actuator.most_voltage), None)

    def bus(self, actuator: Actuator) -> str:
        """Which of its buses an actuator is on; empty where it is not published."""
        return next((bus for bus in self.buses if set(bus.split(" or ")) & set(actuator.buses)), "")

    def ordered(self, actuator: Actuator) -> str:
        """What an actuator is ordered by: its name with what the bus adds to it."""
        return actuator.name + actuator.order.get(self.bus(actuator), "")

    @property
    def open_items(self) -> list[tuple[str, int]]:
        """What has to be bought besides and is not chosen, with how many of it."""
        current = ""
        if self.current is not None and len(self.voltages) < 2:
            current = f", {self.current:.3g} A were all at their peak torque at once"
        return [
            *((f"power supply {each:g} V{current}", 1) for each in self.voltages),
            *((f"adapter from the computer to {bus}", 1) for bus in self.buses),
            ("cable along the arm, from actuator to actuator", self.count),
            *([(MIXED, 1)] if len(self.voltages) > 1 else []),
        ]


def supply_of(actuators: Sequence[Actuator]) -> Supply:
    """What actuators need besides."""
    waiting, voltages = [(a.voltage, a.most_voltage) for a in actuators if a.voltage is not None], []
    while waiting:  # as few supplies as can be: each as high as the one that bears least allows
        most = min(high for _, high in waiting)
        voltages.append(max(low for low, _ in waiting if low <= most))
        waiting = [(low, high) for low, high in waiting if not low <= voltages[-1] <= high]
    own = [a.buses for a in actuators if a.buses]
    shared = [bus for bus in own[0] if all(bus in each for each in own)] if own else []
    if not any(a.order for a in actuators):  # any will do
        shared = [" or ".join(shared)] if shared else []
    buses = shared[:1] or dict.fromkeys(each[0] for each in own)
    known = [a.peak_current for a in actuators if a.peak_current is not None]
    current = sum(known) if len(known) == len(actuators) else None
    return Supply(tuple(sorted(voltages)), tuple(buses), current, len(actuators))


def alike(sizes: Sequence[Actuator]) -> Iterator[list[int]]:
    """The sizes, by their places, that one supply and one bus serve: for every voltage and bus that there is.

    What is not published of a size keeps it out of none.
    """
    volts: list[float | None] = list({a.voltage for a in sizes if a.voltage is not None}) or [None]
    buses: list[str | None] = list({bus for a in sizes for bus in a.buses}) or [None]
    found = {
        tuple(k for k, a in enumerate(sizes)
              if (v is None or a.voltage is None or a.voltage <= v <= a.most_voltage)
              and (bus is None or not a.buses or bus in a.buses))
        for v in volts for bus in buses
    }  # fmt: skip
    yield from (list(each) for each in sorted(found) if each)
