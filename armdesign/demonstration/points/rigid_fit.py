"""A body's pose from three or more markers on it, some of which may be hidden.

With the marker's places y_i in the body and x_i,t in frame t, the pose R, c minimises sum_i |R y_i + c - x_i,t|^2 over
the markers seen in that frame (Kabsch): with the singular value decomposition U S V^T of sum_i (y_i - y)(x_i,t - x)^T,
R = V diag(1, 1, det(V U^T)) U^T and c = x - R y, where x and y are the means. The places in the body come from the
frames in which all markers are seen: their mean after turning every frame onto it, repeated until it no longer changes.

The body's axes: the origin in the mean of its markers, x towards the first of them, the next one that is not on that
line in the plane of x and y, on the side of positive y.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.demonstration.files.quaternions import from_matrices, unit_continuous
from armdesign.errors import TaskError

MARKERS = 3
_ROUNDS = 20  # of the mean; it converges within a few
_STILL = 1e-12  # of the body's size
_LINE = 0.05  # markers whose second extent is this part of the first count as being on one line
_MOST = 400  # frames that the mean is taken over


@dataclass(frozen=True, eq=False)
class RigidFit:
    """Poses of a body."""

    template: Array  # places of the n markers in the body, shape (n, 3) [m]
    rotations: Array  # body to reference axes, shape (T, 3, 3); NaN where too few markers are seen
    markers: Array  # places of the markers, shape (T, n, 3) [m]; hidden ones by the pose, NaN where there is none
    residuals: Array  # distance of each marker from where the pose has it, shape (T, n) [m]; NaN where hidden

    @property
    def quaternions(self) -> Array:
        """The rotations as quaternions x, y, z, w with continuous signs, shape (T, 4)."""
        return unit_continuous(from_matrices(self.rotations))

    @property
    def rms(self) -> float:
        """Root mean square of the residuals [m]."""
        return float(np.sqrt(np.nanmean(self.residuals**2)))

    @property
    def worst(self) -> tuple[float, int, int]:
        """The largest residual [m], its frame and its marker."""
        frame, marker = np.unravel_index(np.nanargmax(self.residuals), self.residuals.shape)
        return float(self.residuals[frame, marker]), int(frame), int(marker)

    @property
    def known(self) -> NDArray[np.bool_]:
        """In which frames there is a pose, shape (T,)."""
        return ~np.isnan(self.rotations[:, 0, 0])


def fit_rigid(markers: Array, names: Sequence[str], source: str) -> RigidFit:
    """Poses of the body that markers are on.

    Args:
        markers: Their places, shape (T, n, 3) [m]; NaN = hidden.
        names: Their names, for messages.
        source: The recording, for messages.

    Raises:
        TaskError: Fewer than three markers, never all seen at once, or all on one line.
    """
    listed = ", ".join(names)
    if len(names) < MARKERS:
        fix = "Name three or more markers of one rigid body, or leave the orientation out"
        raise TaskError(f"{source}: {listed} cannot tell an orientation", value=tuple(names), fix=fix)
    seen = ~np.isnan(markers[:, :, 0])
    full = np.flatnonzero(seen.all(axis=1))
    if not len(full):
        message = f"{source}: {listed} are never all seen in one frame, so that their places on the body stay unknown"
        raise TaskError(message, value=tuple(names), fix="Leave out the one that is hidden most")
    template = _template(markers[full[np.unique(np.linspace(0, len(full) - 1, _MOST).astype(int))]])
    first, second = _extents(template)
    if second <= _LINE * first:
        message = f"{source}: {listed} lie on one line ({1e3 * first:.0f} mm along it, {1e3 * second:.1f} mm beside it)"
        fix = "Name markers that span a triangle"
        raise TaskError(f"{message}, so that turns about it are not seen", value=tuple(names), fix=fix)
    return _fit(markers, seen, template)


def _fit(markers: Array, seen: NDArray[np.bool_], template: Array) -> RigidFit:
    """Poses for known places in the body."""
    weights = np.where(_spans(seen, template)[:, None], seen, False).astype(float)  # (T, n)
    places = np.where(weights[:, :, None] > 0, markers, 0.0)
    count = np.maximum(weights.sum(axis=1), 1.0)
    x = places.sum(axis=1) / count[:, None]
    y = weights @ template / count[:, None]
    rotations = _rotations(weights, template[None] - y[:, None], places - x[:, None])
    rotations[weights.sum(axis=1) == 0] = np.nan
    posed = np.einsum("tij,tnj->tni", rotations, template[None] - y[:, None]) + x[:, None]
    residuals = np.linalg.norm(markers - posed, axis=2)
    return RigidFit(template, rotations, np.where(np.isnan(markers), posed, markers), residuals)


def _rotations(weights: Array, body: Array, places: Array) -> Array:
    """The rotations that turn places in the body best onto those seen, all about their means, shape (T, 3, 3)."""
    U, _, Vt = np.linalg.svd(np.einsum("tn,tni,tnj->tij", weights, body, places))
    V = Vt.transpose(0, 2, 1)
    mirror = np.ones((len(weights), 3))
    mirror[:, 2] = np.where(np.linalg.det(V) * np.linalg.det(U) < 0, -1.0, 1.0)
    return np.asarray((V * mirror[:, None]) @ U.transpose(0, 2, 1))


def _template(markers: Array) -> Array:
    """Places in the body, from frames in which all are seen, in the body's axes, shape (n, 3) [m]."""
    centred = markers - markers.mean(axis=1, keepdims=True)
    weights = np.ones(markers.shape[:2])
    template = centred[0]
    for _ in range(_ROUNDS):
        turned = np.einsum(
            "tji,tnj->tni", _rotations(weights, np.broadcast_to(template, centred.shape), centred), centred
        )
        before, template = template, turned.mean(axis=0)
        if np.abs(template - before).max() <= _STILL * np.abs(template).max():
            break
    return np.asarray(template @ _axes(template))


def _axes(template: Array) -> Array:
    """The body's axes as columns, shape (3, 3)."""
    distances = np.linalg.norm(template, axis=1)
    first = int(np.argmax(distances > _LINE * distances.max()))
    x = template[first] / np.linalg.norm(template[first]) if distances.max() > 0 else np.array([1.0, 0.0, 0.0])
    beside = template - np.outer(template @ x, x)
    off = np.linalg.norm(beside, axis=1)
    if off.max() <= 1e-9 * max(distances.max(), 1e-9):
        return np.eye(3)
    second = int(np.argmax(off > min(_LINE * distances.max(), 0.5 * off.max())))
    y = beside[second] / off[second]
    return np.stack([x, y, np.cross(x, y)], axis=1)


def _spans(seen: NDArray[np.bool_], template: Array) -> NDArray[np.bool_]:
    """In which frames the markers seen determine the pose: three or more, not on one line, shape (T,)."""
    sets, which = np.unique(seen, axis=0, return_inverse=True)
    enough = []
    for each in sets:
        first, second = _extents(template[each]) if each.sum() >= MARKERS else (1.0, 0.0)
        enough.append(second > _LINE * first)
    return np.array(enough, dtype=bool)[which.reshape(-1)]


def _extents(places: Array) -> tuple[float, float]:
    """How far places of shape (n, 3) spread along and beside their main line, root mean square [m]."""
    first, second = np.linalg.svd(places - places.mean(axis=0), compute_uv=False)[:2]
    return float(first / np.sqrt(len(places))), float(second / np.sqrt(len(places)))
