"""Quaternions of unit length whose signs do not flip from frame to frame."""

from __future__ import annotations

import numpy as np

from armdesign.demonstration.cleaning.gaps import seconds
from armdesign.demonstration.files.quaternions import unit_continuous
from armdesign.demonstration.recording import Recording, Step
from armdesign.errors import RecordingError

_MIN_NORM = 1e-3  # a quaternion shorter than this has no direction worth trusting
_NORM_NOTE = 1e-2  # norms further from 1 than this are mentioned


def unify_quaternions(recording: Recording) -> tuple[Recording, tuple[Step, ...]]:
    """Normalise the quaternions and make their signs continuous.

    Args:
        recording: Any recording.

    Raises:
        RecordingError: A quaternion is (nearly) zero; the message names the point and the time.
    """
    steps = []
    for name, quaternions in recording.orientations.items():
        norms = np.linalg.norm(quaternions, axis=1)
        zero = np.flatnonzero(norms < _MIN_NORM)
        if len(zero):
            where = f"frame {zero[0] + 1}, {seconds(recording.time[zero[0]])}"
            message = f"{recording.source}: the quaternion of '{name}' is zero at {where} (norm {norms[zero[0]]:.2g})"
            fix = "Leave its cells empty where it was not seen"
            raise RecordingError(message, value=float(norms[zero[0]]), fix=fix)
        if np.nanmax(np.abs(norms - 1.0), initial=0.0) > _NORM_NOTE:
            least, greatest = float(np.nanmin(norms)), float(np.nanmax(norms))
            span = f"{least:.3g} to {greatest:.3g}"
            sentence = f"Normalised the quaternions of '{name}', whose norms were {span} instead of 1."
            steps.append(Step("quaternions", sentence, {"of": name, "least": least, "greatest": greatest}))
    return recording.changed(recording.time, lambda positions: positions, unit_continuous), tuple(steps)
