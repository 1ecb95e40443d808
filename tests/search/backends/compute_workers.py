"""Stand-ins for a worker's body: light ones that start at once, answer plain arithmetic, and die when they are told to.

A worker process imports its body by name, so the bodies live in a module of their own that needs NumPy alone.
"""

import os
import time
from types import SimpleNamespace

import numpy as np

POISON = 666.0
SLOW, RAISES, DIES_ONCE = 7.0, 8.0, 9.0


def scores(Phi):
    """What an evaluation would give, computed candidate by candidate: a pure function of each."""
    r = np.array([float(np.sum(np.sin(row) ** 2)) for row in Phi])
    whole = np.arange(len(Phi)) * 0
    return SimpleNamespace(
        fitness=r, path_fitness=r / 2, area=r / 3, valid=r > 0.5, pruned=r < 0.1, start_error=r / 4,
        q0=np.outer(r, [1.0, 2.0]), mount=np.tile(np.eye(3), (len(Phi), 1, 1)), miss_frame=whole, miss=r,
        steps=whole, start_steps=whole, accepted=whole, frames=whole,
        slopes=np.zeros((len(Phi), 0)),
    )  # fmt: skip


def removed(Phi):
    """Counts that add up over chunks."""
    return SimpleNamespace(constraints=len(Phi), reach=int((Phi > 0.5).sum()), start=0, pruned=0, path=0)


def answer_chunks(pipe, prepared, block):
    """The protocol of a worker; ``prepared`` may name a file that lets one worker die."""
    pipe.send(None)
    try:
        while True:
            Phi, *_ = pipe.recv()
            if np.any(Phi == POISON):
                os._exit(1)
            if np.any(Phi == DIES_ONCE) and os.path.exists(prepared):
                os.unlink(prepared)
                os._exit(1)
            if np.any(Phi == SLOW):
                time.sleep(0.05)
            pipe.send((scores(Phi), removed(Phi)))
    except (EOFError, OSError):
        return


def answer_errors(pipe, prepared, block):
    """A worker whose evaluation reports bad input."""
    from armdesign.errors import DesignError  # noqa: PLC0415

    pipe.send(None)
    try:
        while True:
            Phi, *_ = pipe.recv()
            bad = bool(np.any(Phi == RAISES))
            pipe.send(DesignError("no such arm", value=RAISES) if bad else (scores(Phi), removed(Phi)))
    except (EOFError, OSError):
        return


def never_starts(pipe, prepared, block):
    """A worker that ends before it is ready."""
    os._exit(3)


def never_ends(pipe, prepared, block):
    """A worker that is at a chunk for ever."""
    pipe.send(None)
    pipe.recv()
    time.sleep(600.0)
