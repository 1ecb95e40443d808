"""Whether the times of a recording can be seconds."""

from __future__ import annotations

import math

from armdesign.demonstration.cleaning.gaps import seconds
from armdesign.demonstration.recording import TIME_UNITS, Step, Take, median_step

_RATES = (5.0, 2000.0)  # [1/s] of motion capture
_ROUNDING = 1e-6  # of a rate
_LONGEST = 3600.0  # [s]
_UNITS = {"ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}  # that files are written in


def time_steps(take: Take) -> tuple[Step, ...]:
    """A doubt where a take has fewer or more frames per second than any capture system, or lasts for hours.

    Where milliseconds, microseconds or nanoseconds would make sense of it, the doubt says so, with the factor.
    """
    if len(take.time) < 2:
        return ()
    step, duration = median_step(take.time), float(take.time[-1] - take.time[0])
    if not step > 0 or _is_usual(step, duration):
        return ()
    rate = 1.0 / step
    what = f"Warning: {rate:.4g} frames/s over {seconds(duration)}"
    unit = next((unit for unit in _UNITS if rate < _RATES[0] and _is_usual(step * TIME_UNITS[unit], 0.0)), None)
    if unit is None:
        sentence = f"{what} are unusual for a recording of a motion ({_RATES[0]:g} to {_RATES[1]:,.0f} frames/s)."
        return (Step("time", f"{sentence} Check the times.", {"rate": rate, "duration": duration}),)
    name, factor = _UNITS[unit], TIME_UNITS[unit]
    found = f"{1.0 / (step * factor):.4g} frames/s over {seconds(duration * factor)}"
    sentence = (
        f"{what}: the times look like {name}, not seconds, which makes {found}: say --time-unit {unit} "
        f"(a factor of {factor:g})."
    )
    details = {"rate": rate, "duration": duration, "unit": name, "factor": factor}
    return (Step("time", sentence, details),)


def _is_usual(step: float, duration: float) -> bool:
    """Whether a capture system has such a step from frame to frame, and takes last so long [s]."""
    rate = 1.0 / step if step > 0 else math.inf
    return (1.0 - _ROUNDING) * _RATES[0] <= rate <= (1.0 + _ROUNDING) * _RATES[1] and duration <= _LONGEST
