"""Where a candidate begins: start poses that are looked at, solved and carried along the path (method section 4)."""

from __future__ import annotations

import numpy as np

from armdesign.fitness.kernels.solver_state import DESCEND, DONE, GAUSS, NEWTON, OPEN, POLISH, SAMPLE, SMALLEST_DAMPING
from armdesign.kinematics.compilation import branch

SAME_POSE = 0.05  # poses nearer than this count as one [rad]
TIE = 1.0 - 1e-6  # a later start has to be better by this much


@branch
def begin_candidate(state, problem, n, starts, cutoff, pose, candidate):
    """Put a new candidate at its first start pose, or straight at the polish of its own where it has one.

    Where every frame has to reach, a cutoff cannot tell whether the arm is valid, and is ignored.
    """
    state.phase, state.candidate = SAMPLE, candidate
    state.cutoff = np.inf if problem.every == 1 else cutoff
    state.t, state.k, state.kept_count, state.final_count, state.start_count = 0, 0, 0, 0, 0
    state.f_sum, state.E_sum, state.steps, state.accepted, state.frames = 0.0, 0.0, 0, 0, 0
    state.pruned, state.valid, state.nearest, state.closing = 0, 0, np.inf, 0
    state.path, state.best, state.best_r = 0, -1, np.inf
    state.farthest, state.miss_frame, state.miss = 0, 0, np.inf
    for i in range(3):
        for j in range(3):
            state.mount[i, j] = 1.0 if i == j else 0.0
    given = True
    for j in range(n):
        state.trial[j] = starts[0, j]
        given = given and np.isfinite(pose[j])
    if given:
        for j in range(n):
            state.trial[j] = min(max(pose[j], problem.lower[j]), problem.upper[j])
            state.final_q[0, j] = state.trial[j]
        state.phase, state.final_count = POLISH, 1
        begin_frame(state, problem, n)


@branch
def begin_frame(state, problem, n):
    """The trial opens a frame; the ball is centred there unless the caller moves it."""
    state.fresh, state.closing, state.tries = 1, 0, 0
    state.damping, state.model = SMALLEST_DAMPING, NEWTON if problem.second_order == 1 else GAUSS
    for j in range(n):
        state.previous[j] = state.trial[j]


@branch
def keep_start(state, value, limit):
    """Insert the present start pose into the best few, stable for equal values."""
    place = state.kept_count if state.kept_count < limit else limit
    while place > 0 and value < state.kept_value[place - 1]:
        if place < limit:
            state.kept[place], state.kept_value[place] = state.kept[place - 1], state.kept_value[place - 1]
        place -= 1
    if place < limit:
        state.kept[place], state.kept_value[place] = state.k, value
        state.kept_count = min(state.kept_count + 1, limit)


@branch
def keep_finalist(state, n, limit):
    """Insert the outcome of a descent into the best few, unless the same pose is among them."""
    for i in range(state.final_count):
        distance = 0.0
        for j in range(n):
            distance += (state.final_q[i, j] - state.q[j]) ** 2
        if distance < SAME_POSE * SAME_POSE:
            if not state.value < state.final_value[i]:
                return
            state.final_count -= 1  # the better one takes its place below
            for k in range(i, state.final_count):
                state.final_value[k] = state.final_value[k + 1]
                for j in range(n):
                    state.final_q[k, j] = state.final_q[k + 1, j]
            break
    place = state.final_count if state.final_count < limit else limit
    while place > 0 and state.value < state.final_value[place - 1]:
        if place < limit:
            state.final_value[place] = state.final_value[place - 1]
            for j in range(n):
                state.final_q[place, j] = state.final_q[place - 1, j]
        place -= 1
    if place < limit:
        state.final_value[place] = state.value
        for j in range(n):
            state.final_q[place, j] = state.q[j]
        state.final_count = min(state.final_count + 1, limit)


@branch
def keep_reaching(state, n, g, miss, limit):
    """Insert the present solved start into the best few that reach, unless the same pose is among them.

    Of equally good ones the first one comes first, whatever the last bit.
    """
    if not g < np.inf:
        return
    place = 0
    while place < state.start_count and not g < state.start_g[place] * TIE:
        place += 1
    end = state.start_count
    for i in range(state.start_count):
        distance = 0.0
        for j in range(n):
            distance += (state.start_q[i, j] - state.q[j]) ** 2
        if distance < SAME_POSE * SAME_POSE:
            if i < place:
                return
            end = min(end, i)  # the first one of that pose makes room
    if place >= limit:
        return
    if end == state.start_count:
        end = min(end, limit - 1)
        state.start_count = end + 1
    for i in range(end, place, -1):
        state.start_g[i], state.start_miss[i] = state.start_g[i - 1], state.start_miss[i - 1]
        for j in range(n):
            state.start_q[i, j] = state.start_q[i - 1, j]
    state.start_g[place], state.start_miss[place] = g, miss
    for j in range(n):
        state.start_q[place, j] = state.q[j]


@branch
def next_start(state, problem, starts, n):
    """Go to the next start pose to be solved from, or to the best one found; without one the candidate is done."""
    state.start_steps = state.steps
    if state.phase in (SAMPLE, DESCEND) and state.k < state.kept_count:
        for j in range(n):
            state.trial[j] = starts[state.kept[state.k], j]
        state.phase = DESCEND
    elif state.phase == DESCEND or state.k < state.final_count:
        state.k = 0 if state.phase == DESCEND else state.k
        for j in range(n):
            state.trial[j] = state.final_q[state.k, j]
        state.phase = POLISH
    elif state.start_count > 0:
        open_path(state, problem, n)
        return
    else:
        state.phase = DONE
        state.miss = state.nearest
    begin_frame(state, problem, n)


@branch
def open_path(state, problem, n):
    """Begin the path from a start that reaches."""
    state.phase, state.t, state.f_sum, state.E_sum = OPEN, 0, 0.0, 0.0
    for j in range(n):
        state.trial[j] = state.start_q[state.path, j]
    begin_frame(state, problem, n)
