"""Clearance of candidate arms along their paths: what the kernels need, laid out once, and what they find."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.bodies.kernels.capsules import MAX_CAPSULES
from armdesign.cell.kernels.distance import FieldArrays, ObstacleArrays
from armdesign.feasibility.kernels.check_arms import Arms, check_arms, settle_slides
from armdesign.feasibility.kernels.clearance import FLAGS, FRAME, WORK, Room, Traced
from armdesign.feasibility.kernels.clearance_slope import GLIDE
from armdesign.feasibility.kernels.envelope import check_envelope

MARGIN = 5e-4
"""How much more than the required clearance is asked for in the frames, so that it holds between them, too [m]."""
THIN_FRAMES = 12
"""About so many frames of every demonstration are looked at in choosing the slides."""


def make_traced(sizes: NDArray[np.void], dof: int, frames: int, obstacles: int, clearance: float) -> Traced:
    """Scratch for arms of n joints on paths of T frames.

    Args:
        sizes: One SIZES record, see ``capsule_sizes``; it knows which joints slide.
        dof: Number of joints n.
        frames: Number of frames T.
        obstacles: Number of obstacles K.
        clearance: What has to be between two bodies [m].
    """
    work = np.zeros(1, dtype=WORK)
    work[0]["chain"]["slides"][:dof] = sizes[0]["prismatic"][:dof]
    work[0]["check"]["required"], work[0]["check"]["margin"] = clearance + MARGIN, MARGIN
    return Traced(
        work,
        path=np.zeros((frames, dof)),
        ends=np.zeros((MAX_CAPSULES, frames, 6)),
        way=np.zeros((MAX_CAPSULES, frames)),
        frames=np.zeros(frames, dtype=FRAME),
        flags=np.zeros(obstacles, dtype=FLAGS),
    )


def make_room(sizes: NDArray[np.void], obstacles: ObstacleArrays, frames: int) -> Room:
    """What paths of T frames are checked against.

    Args:
        sizes: One SIZES record, see ``capsule_sizes``.
        obstacles: The obstacles in the task frame.
        frames: Number of frames T.
    """
    count = len(obstacles.kind)
    carried = np.zeros((count, frames, 2))
    for k in np.flatnonzero(obstacles.frames > 1):
        own = slice(obstacles.first[k], obstacles.first[k] + frames)
        shifts = np.linalg.norm(np.diff(obstacles.poses[own, 9:], axis=0), axis=1)
        carried[k, 1:, 0] = np.cumsum(shifts)
        carried[k, 1:, 1] = np.cumsum(np.linalg.norm(obstacles.turns[own], axis=1)[:-1])
    return Room(sizes, obstacles, carried)


class Clearance(NamedTuple):
    """What a check of N candidates finds.

    Attributes:
        violation: V, the mean over the demonstrations, shape (N,) [m]; 0: everything stays clear.
        slides: s_j of every joint with which that is so, shape (N, n) [m].
        slopes: Gradient of V by all entries at these slides, shape (N, E); (N, 0) where it is not wanted.
    """

    violation: Array
    slides: Array
    slopes: Array


class Envelope(NamedTuple):
    """The volume that the demonstrator's arm has swept.

    Attributes:
        fields: Distance from it in the task frame, by demonstration.
        allowed: How far the bodies may leave it [m].
    """

    fields: tuple[FieldArrays, ...]
    allowed: float


class Posed(NamedTuple):
    """Candidates.

    Attributes:
        rows: DH rows, shape (N, n + 1, 4).
        bases: Poses that row 0 starts from, shape (N, 12).
        slides: s_j of their joints, shape (N, n) [m].
    """

    rows: Array
    bases: Array
    slides: Array


@dataclass(frozen=True, eq=False)
class Course:
    """A path that is checked: its frames, and what is around.

    Attributes:
        room: What is around.
        traced: Scratch.
    """

    room: Room
    traced: Traced


class ClearanceCheck:
    """Checks candidates for clearance over all demonstrations; a pure function of each candidate."""

    def __init__(
        self,
        sizes: NDArray[np.void],
        dof: int,
        clearance: float,
        obstacles: Sequence[ObstacleArrays],
        frames: Sequence[int],
    ) -> None:
        """Allocate everything.

        Args:
            sizes: One SIZES record, see ``capsule_sizes``.
            dof: Number of joints n.
            clearance: What has to be between two bodies [m].
            obstacles: Obstacles in the task frame, by demonstration, the same ones each time.
            frames: Number of frames of every demonstration.
        """
        self.sizes, self.dof, self.count = sizes, dof, len(obstacles[0].kind)
        self.courses = [
            Course(make_room(sizes, around, T), make_traced(sizes, dof, T, self.count, clearance))
            for around, T in zip(obstacles, frames, strict=True)
        ]
        self.thin = [np.unique(np.r_[0 : T : -(-T // THIN_FRAMES), T - 1]) for T in frames]
        around, total = thinned_obstacles(obstacles, self.thin), sum(map(len, self.thin))
        self.thin_course = Course(
            make_room(sizes, around, total), make_traced(sizes, dof, total, self.count, clearance)
        )
        self.glides = np.zeros(1, dtype=GLIDE)

    def __call__(
        self, rows: Array, bases: Array, paths: Sequence[Array], turns: Sequence[Array] | None = None
    ) -> Clearance:
        """Check candidates; see Penalty of armdesign.fitness.robot for the arguments."""
        rows, bases = np.array(rows, dtype=float, order="C"), np.array(bases, dtype=float, order="C")
        slides = self.settled(rows, bases, paths)
        entries = 0 if turns is None else turns[0].shape[3]
        violation, _, slopes = self.at_slides(rows, bases, slides, paths, turns, entries)
        return Clearance(violation, slides, slopes)

    def settled(self, rows: Array, bases: Array, paths: Sequence[Array]) -> Array:
        """Slides of every candidate: where the joints' origins are, or elsewhere where that is better."""
        slides = rows[:, : self.dof, 2].copy()
        least, met, _ = self.at_slides(rows, bases, slides, paths)
        for _ in range(2):  # a second time where other slides have met other obstacles
            bad = np.flatnonzero(least > 0.0)
            if len(bad) == 0:
                break
            thin = np.concatenate([path[bad][:, kept] for path, kept in zip(paths, self.thin, strict=True)], axis=1)
            thin = np.ascontiguousarray(thin)  # in another order the kernel would be compiled anew
            arms = Arms(rows[bad], bases[bad], rows[bad][:, : self.dof, 2].copy(), thin, met[bad], np.zeros(len(bad)))
            settle_slides(self.thin_course.traced, self.thin_course.room, arms)
            tried, also_met, _ = self.at_slides(rows[bad], bases[bad], arms.slides, [path[bad] for path in paths])
            better = tried < least[bad]
            slides[bad[better]], least[bad[better]] = arms.slides[better], tried[better]
            if not (also_met > met[bad]).any():
                break
            met[bad] |= also_met
        return slides

    def at_slides(
        self,
        rows: Array,
        bases: Array,
        slides: Array,
        paths: Sequence[Array],
        turns: Sequence[Array] | None = None,
        entries: int = 0,
    ) -> tuple[Array, NDArray[np.int64], Array]:
        """Violation, met obstacles and gradient at given slides."""
        count = len(rows)
        violations, slopes = np.zeros((len(paths), count)), np.zeros((len(paths), count, entries))
        met = np.zeros((count, self.count), dtype=np.int64)
        for d, (course, path) in enumerate(zip(self.courses, paths, strict=True)):
            here = np.zeros((count, self.count), dtype=np.int64)
            arms = Arms(rows, bases, slides, np.array(path, dtype=float, order="C"), here, violations[d])
            turned = np.zeros((0, *path.shape[1:], entries)) if turns is None else turns[d]
            check_arms(course.traced, self.glides, course.room, arms, turned, slopes[d])
            met |= here
        return mean(violations), met, mean(slopes)

    def compile(self) -> None:
        """Compile the kernels, or load them from the disk cache, by checking no arm at all."""
        n, met = self.dof, np.zeros((0, self.count), dtype=np.int64)
        for course in (self.courses[0], self.thin_course):
            path = np.zeros((0, *course.traced.path.shape))
            arms = Arms(np.zeros((0, n + 1, 4)), np.zeros((0, 12)), np.zeros((0, n)), path, met, np.zeros(0))
            if course is self.thin_course:
                settle_slides(course.traced, course.room, arms)
            else:
                turns, slopes = np.zeros((*path.shape, 0)), np.zeros((0, 0))
                check_arms(course.traced, self.glides, course.room, arms, turns, slopes)

    def beyond(
        self, envelope: Envelope, posed: Posed, paths: Sequence[Array], turns: Sequence[Array] | None
    ) -> tuple[Array, Array]:
        """How far the moving links leave the demonstrator's swept volume by more than is allowed, as a share of that.

        Args:
            envelope: The volume.
            posed: The candidates, their slides chosen.
            paths: Joint paths, shape (N, T, n) each.
            turns: Their derivatives, where the gradient is wanted.

        Returns:
            (distance / allowed - 1)+, the mean over the demonstrations, shape (N,), and its gradient, shape (N, E).
        """
        count, entries = len(posed.rows), 0 if turns is None else turns[0].shape[3]
        excess, slopes = np.zeros((len(paths), count)), np.zeros((len(paths), count, entries))
        none_met = np.zeros((count, self.count), dtype=np.int64)
        for d, (course, path) in enumerate(zip(self.courses, paths, strict=True)):
            farthest = np.full(count, envelope.allowed)
            solved = np.array(path, dtype=float, order="C")
            arms = Arms(posed.rows, posed.bases, posed.slides, solved, none_met, farthest)
            turned = np.zeros((0, *path.shape[1:], entries)) if turns is None else turns[d]
            check_envelope(course.traced, self.glides, course.room, arms, envelope.fields[d], turned, slopes[d])
            excess[d] = farthest / envelope.allowed - 1.0
        return mean(excess), mean(slopes) / envelope.allowed


def mean(values: Array) -> Array:
    """Mean over the demonstrations, which come first, whatever their order and the other candidates."""
    added: Array = reduce(np.add, np.sort(values, axis=0)) / len(values)
    return added


def thinned_obstacles(obstacles: Sequence[ObstacleArrays], kept: Sequence[NDArray[np.intp]]) -> ObstacleArrays:
    """Obstacles at some of the frames of all demonstrations, one after the other.

    Args:
        obstacles: The obstacles of every demonstration, the same ones each time.
        kept: The frames of each.
    """
    around = obstacles[0]
    poses: list[Array] = []
    first, frames = [], []
    for k in range(len(around.kind)):
        first.append(sum(len(own) for own in poses))
        if around.frames[k] > 1:
            poses.append(np.concatenate([o.poses[o.first[k] + t] for o, t in zip(obstacles, kept, strict=True)]))
        else:
            poses.append(around.poses[around.first[k]][None])
        frames.append(len(poses[-1]))
    stacked = np.concatenate(poses) if poses else around.poses
    # between thinned frames nothing is looked at, so how they turn from one to the next does not matter
    return around._replace(
        first=np.array(first, dtype=np.int64), frames=np.array(frames, dtype=np.int64), poses=stacked,
        turns=np.zeros((len(stacked), 3)),
    )  # fmt: skip
