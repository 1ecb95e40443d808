"""Arms side by side, each with its solver state: what one call of Pinocchio and one of the kernel serve at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.fitness.batch import Batch
from armdesign.fitness.kernels.path import advance, exchange
from armdesign.fitness.kernels.solver_state import ARM, DONE, IDLE, SCRATCH, TRACE
from armdesign.fitness.problem import Problem
from armdesign.kinematics.compilation import machine_code
from armdesign.kinematics.models import ArmBlock

NARROWING = 3


class Slots:
    """B arms of n joints in one Pinocchio model, and the solver state of each.

    A candidate's numbers do not depend on its slot or on the number of slots, so that it can move on to other slots.

    Attributes:
        arms: The block of arms.
        records: ARM records, shape (B,); the next three are views of them.
        states: STATE records, shape (B,).
        chains: CHAIN records, shape (B,).
        attitudes: ATTITUDE records, shape (B,).
    """

    def __init__(self, size: int, dof: int, prismatic: Sequence[bool] = ()) -> None:
        """Allocate the slots; none is in use.

        Args:
            size: Number of slots B.
            dof: Joints per arm n.
            prismatic: Which of them slide; none by default.
        """
        self.arms = ArmBlock(size, dof, prismatic)
        self.records = np.zeros(size, dtype=ARM)
        self.states, self.chains = self.records["state"], self.records["chain"]
        self.attitudes = self.records["attitude"]
        self.states["phase"] = IDLE
        self.scratch = np.zeros(1, dtype=SCRATCH)
        self.traces = np.zeros((size, 0), dtype=TRACE)

    def __len__(self) -> int:
        return len(self.states)

    def hand_in(self, paths: Array) -> None:
        """Write the joint paths of the candidates that are done, out of their traces, to paths (N, T, n)."""
        frames, n = paths.shape[1:]
        for b in np.flatnonzero(self.states["phase"] == DONE):
            state = self.states[b]
            if state["valid"] == 1 and state["pruned"] == 0:
                first = int(state["path"]) * frames
                paths[state["candidate"]] = self.traces["q"][b, first : first + frames, :n]

    def clear(self) -> None:
        """Give up whatever is under way."""
        self.states["phase"] = IDLE

    def exchange(self, problem: Problem, batch: Batch, outcome: NDArray[np.void], cursor: int) -> int:
        """Collect the candidates that are done, begin the next ones; returns the index of the next."""
        return int(exchange(self.records, self.arms.views, problem.arrays, batch, outcome, cursor))

    def advance(self, problem: Problem, trace: NDArray[np.void]) -> int:
        """Step on every slot until some are done; returns how many.

        Args:
            problem: The task and its settings.
            trace: TRACE records, shape (B, K T) for K paths, or (B, 0) to keep none.
        """
        arguments, update = (self.records, self.arms.views, self.scratch, problem.arrays, trace), self.arms.update
        update()
        done = advance(*arguments)
        step = machine_code(advance)
        while not done:
            update()
            done = step(*arguments)
        return int(done)

    def take_over(self, other: Slots) -> None:
        """Go on with the candidates of other slots, which are idle then; as many as there is room for at most.

        Their traces come along where both slots keep them.
        """
        n = self.arms.dof
        for here, there in enumerate(np.flatnonzero(other.states["phase"] != IDLE)):
            self.records[here] = other.records[there]
            to, of = slice(here * n, (here + 1) * n), slice(there * n, (there + 1) * n)
            self.arms.placements[to], self.arms.q[to] = other.arms.placements[of], other.arms.q[of]
            if self.traces.shape[1] == other.traces.shape[1]:
                self.traces[here] = other.traces[there]
        other.clear()


def widths(widest: int) -> list[int]:
    """Numbers of slots to keep ready, from the widest down to one: the last candidates drag no idle slots along."""
    sizes = [widest]
    while sizes[-1] > 1:
        sizes.append(max(1, sizes[-1] // NARROWING))
    return sizes
