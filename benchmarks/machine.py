"""The machine and how busy it is otherwise, so that a reader can judge the noise."""

from __future__ import annotations

import os
import statistics
import time
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np
import pinocchio

from armdesign._version import __version__
from armdesign.experiments.studies.machine import about_machine


def machine() -> dict[str, str | int]:
    """What the figures hang on."""
    return {
        "armdesign": __version__,
        **about_machine(),
        "numpy": np.__version__,
        "pinocchio": pinocchio.__version__,
        "numba": numba.__version__,
        "load average": load_average(),
    }


def load_average() -> str:
    """Processes that ran or waited over the last 1, 5 and 15 minutes; those of this run count as well."""
    return ", ".join(f"{load:.2f}" for load in os.getloadavg()) if hasattr(os, "getloadavg") else "unknown"


@dataclass(frozen=True)
class Moment:
    """A reading of the clocks.

    Attributes:
        wall: Time [s].
        own: Processor time of this run so far, of its children once they have ended [s].
        busy: That of the whole machine [s].
        stolen: What the host gave to other guests [s].
        pace: Time of a fixed computation [s]; a neighbour who crowds the caches shows nowhere else.
    """

    wall: float
    own: float
    busy: float
    stolen: float
    pace: float


def moment() -> Moment:
    """The present reading; processor times are 0 where the system does not tell."""
    pace = fixed_computation()
    try:
        first_line = Path("/proc/stat").read_text(encoding="utf-8").split("\n", 1)[0]
        ticks = [int(word) / os.sysconf("SC_CLK_TCK") for word in first_line.split()[1:9]]
    except OSError:
        return Moment(time.monotonic(), 0.0, 0.0, 0.0, pace)
    user, nice, system, _, _, irq, softirq, stolen = ticks
    return Moment(time.monotonic(), sum(os.times()[:4]), user + nice + system + irq + softirq, stolen, pace)


def fixed_computation(runs: int = 25) -> float:
    """Median time of a little arithmetic in Python, about 2 ms [s]."""
    seconds = []
    for _ in range(runs):
        began = time.perf_counter()
        sum(k * k for k in range(30_000))
        seconds.append(time.perf_counter() - began)
    return statistics.median(seconds)


def disturbance(before: Moment) -> str:
    """A sentence on what else used the machine since then."""
    now = moment()
    wall = now.wall - before.wall
    others = max(0.0, (now.busy - before.busy) - (now.own - before.own)) / wall
    stolen = (now.stolen - before.stolen) / wall
    return (
        f"[{wall:.0f} s; meanwhile other processes used {others:.2f} cores, the host took {stolen:.2f} away; a fixed "
        f"computation took {1e3 * before.pace:.2f} ms before, {1e3 * now.pace:.2f} ms after]"
    )
