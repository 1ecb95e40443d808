"""What stands in a motion-capture file, before anything is decided about units, axes or names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from armdesign.demonstration.recording import Array


@dataclass(frozen=True)
class Step:
    """Something that was found in the data or done to it.

    Attributes:
        name: Short name of the step, such as ``units`` or ``gaps``.
        sentence: The same for people, one or two whole sentences.
        details: The figures behind the sentence, as plain JSON values.
    """

    name: str
    sentence: str
    details: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Take:
    """A file's content in the file's own units and axes. NaN stands for "not seen in this frame".

    Attributes:
        time: Frame times, strictly increasing, shape (T,) [s].
        points: Name to positions, each of shape (T, 3) [``units``]. Markers, joints and origins of bodies alike; names
            as they stand in the file, subject prefix included, each once.
        orientations: Name to quaternions x, y, z, w (scalar last), body to reference axes, each of shape (T, 4).
        source: The file, for messages.
        format: Format and version, such as ``OptiTrack Motive CSV 1.23``.
        units: ``m``, ``cm``, ``mm`` or ``in``; None where the file does not say and the format does not settle it.
        up: Axis that points up, ``x``, ``y`` or ``z``; None where the file does not say.
        rate: Frames per second that the file declares [1/s]; None where it does not.
        bodies: Rigid bodies to the names of the markers on them, where the file tells.
        captured: Whether the numbers come straight from a capture system and want cleaning; False for plain CSV, which
            is taken as finished.
        steps: What was odd in the file and what the reader made of it.
    """

    time: Array
    points: Mapping[str, Array]
    orientations: Mapping[str, Array]
    source: str
    format: str
    units: str | None = None
    up: str | None = None
    rate: float | None = None
    bodies: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    captured: bool = True
    steps: tuple[Step, ...] = ()
