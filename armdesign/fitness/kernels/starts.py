"""Where a walk begins: the start poses that are looked at, solved and carried along the path (method section 4)."""

from __future__ import annotations

import numpy as np

from armdesign.fitness.kernels.solver_state import DESCEND, DONE, GAUSS, NEWTON, OPEN, POLISH, SAMPLE, SMALLEST_DAMPING
from armdesign.kinematics.compilation import branch

SAME_POSE = 0.05  # poses nearer than this count as one [rad]
TIE = 1.0 - 1e-6  # a later start has to be better by this much


@branch
def begin_walk(walk, problem, n, starts, cutoff, pose, candidate):
    """Put a new candidate at its first start pose, or straight at the polish of its own where it has one.

    Where every frame has to reach, a cutoff cannot tell whether the arm is valid; it is not heeded then.
    """
    walk.phase, walk.candidate = SAMPLE, candidate
    walk.cutoff = np.inf if problem.every == 1 else cutoff
    walk.t, walk.k, walk.kept_count, walk.final_count, walk.start_count = 0, 0, 0, 0, 0
    walk.f_sum, walk.E_sum, walk.steps, walk.accepted, walk.frames = 0.0, 0.0, 0, 0, 0
    walk.pruned, walk.valid, walk.nearest, walk.closing = 0, 0, np.inf, 0
    walk.path, walk.best, walk.best_r = 0, -1, np.inf
    walk.farthest, walk.miss_frame, walk.miss = 0, 0, np.inf
    for i in range(3):
        for j in range(3):
            walk.mount[i, j] = 1.0 if i == j else 0.0
    given = True
    for j in range(n):
        walk.trial[j] = starts[0, j]
        given = given and np.isfinite(pose[j])
    if given:
        for j in range(n):
            walk.trial[j] = min(max(pose[j], problem.lower[j]), problem.upper[j])
            walk.final_q[0, j] = walk.trial[j]
        walk.phase, walk.final_count = POLISH, 1
        begin_frame(walk, problem, n)


@branch
def begin_frame(walk, problem, n):
    """The trial opens a frame; the ball is centred there unless the caller moves it."""
    walk.fresh, walk.closing, walk.tries = 1, 0, 0
    walk.damping, walk.model = SMALLEST_DAMPING, NEWTON if problem.second_order == 1 else GAUSS
    for j in range(n):
        walk.previous[j] = walk.trial[j]


@branch
def keep_start(walk, value, limit):
    """Insert the start pose at hand into the best few, stable for equal values."""
    place = walk.kept_count if walk.kept_count < limit else limit
    while place > 0 and value < walk.kept_value[place - 1]:
        if place < limit:
            walk.kept[place], walk.kept_value[place] = walk.kept[place - 1], walk.kept_value[place - 1]
        place -= 1
    if place < limit:
        walk.kept[place], walk.kept_value[place] = walk.k, value
        walk.kept_count = min(walk.kept_count + 1, limit)


@branch
def keep_finalist(walk, n, limit):
    """Insert the outcome of a descent into the best few, unless the same pose is among them."""
    for i in range(walk.final_count):
        distance = 0.0
        for j in range(n):
            distance += (walk.final_q[i, j] - walk.q[j]) ** 2
        if distance < SAME_POSE * SAME_POSE:
            if not walk.value < walk.final_value[i]:
                return
            walk.final_count -= 1  # the better one takes its place below
            for k in range(i, walk.final_count):
                walk.final_value[k] = walk.final_value[k + 1]
                for j in range(n):
                    walk.final_q[k, j] = walk.final_q[k + 1, j]
            break
    place = walk.final_count if walk.final_count < limit else limit
    while place > 0 and walk.value < walk.final_value[place - 1]:
        if place < limit:
            walk.final_value[place] = walk.final_value[place - 1]
            for j in range(n):
                walk.final_q[place, j] = walk.final_q[place - 1, j]
        place -= 1
    if place < limit:
        walk.final_value[place] = walk.value
        for j in range(n):
            walk.final_q[place, j] = walk.q[j]
        walk.final_count = min(walk.final_count + 1, limit)


@branch
def keep_reaching(walk, n, g, miss, limit):
    """Insert the solved start at hand into the best few that reach, unless the same pose is among them.

    Of equally good ones the first one comes first, whatever the last bit.
    """
    if not g < np.inf:
        return
    place = 0
    while place < walk.start_count and not g < walk.start_g[place] * TIE:
        place += 1
    end = walk.start_count
    for i in range(walk.start_count):
        distance = 0.0
        for j in range(n):
            distance += (walk.start_q[i, j] - walk.q[j]) ** 2
        if distance < SAME_POSE * SAME_POSE:
            if i < place:
                return
            end = min(end, i)  # the first one of that pose makes room
    if place >= limit:
        return
    if end == walk.start_count:
        end = min(end, limit - 1)
        walk.start_count = end + 1
    for i in range(end, place, -1):
        walk.start_g[i], walk.start_miss[i] = walk.start_g[i - 1], walk.start_miss[i - 1]
        for j in range(n):
            walk.start_q[i, j] = walk.start_q[i - 1, j]
    walk.start_g[place], walk.start_miss[place] = g, miss
    for j in range(n):
        walk.start_q[place, j] = walk.q[j]


@branch
def next_start(walk, problem, starts, n):
    """Go to the next start pose to be solved from, or to the best one found; without one the walk is over."""
    walk.start_steps = walk.steps
    if walk.phase in (SAMPLE, DESCEND) and walk.k < walk.kept_count:
        for j in range(n):
            walk.trial[j] = starts[walk.kept[walk.k], j]
        walk.phase = DESCEND
    elif walk.phase == DESCEND or walk.k < walk.final_count:
        walk.k = 0 if walk.phase == DESCEND else walk.k
        for j in range(n):
            walk.trial[j] = walk.final_q[walk.k, j]
        walk.phase = POLISH
    elif walk.start_count > 0:
        open_path(walk, problem, n)
        return
    else:
        walk.phase = DONE
        walk.miss = walk.nearest
    begin_frame(walk, problem, n)


@branch
def open_path(walk, problem, n):
    """Begin the path from a start that reaches."""
    walk.phase, walk.t, walk.f_sum, walk.E_sum = OPEN, 0, 0.0, 0.0
    for j in range(n):
        walk.trial[j] = walk.start_q[walk.path, j]
    begin_frame(walk, problem, n)
