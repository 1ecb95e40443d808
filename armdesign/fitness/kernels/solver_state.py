"""What is known of an arm on its way along the demonstration: the phases it goes through and the records it fills."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.fitness.kernels.association import MATCH, MAX_POINTS
from armdesign.fitness.kernels.orientation import ATTITUDE
from armdesign.fitness.kernels.temporal import FRAME, MOTION
from armdesign.kinematics.kernels.dls import STEP
from armdesign.kinematics.kernels.skeleton import CHAIN, MAX_DOF

IDLE, SAMPLE, DESCEND, POLISH, OPEN, FOLLOW, REPLAY, DONE = range(8)
MOUNT_IDENTITY, MOUNT_START = 0, 1
NEWTON, GAUSS = 0, 1
MAX_DESCENTS, MAX_FINALISTS = 256, 16

PROBLEM = np.dtype(
    [
        ("weights", np.float64, MAX_POINTS),
        ("descent_weights", np.float64, MAX_POINTS),  # the weights with the hand's raised, for SAMPLE and DESCEND
        ("polish_weights", np.float64, MAX_POINTS),  # the weights with the hand's raised further, for POLISH
        ("w_0", np.float64),
        ("free", np.int64),  # number of free sigma
        (
            "start_free",
            np.int64,
        ),  # free sigma while the start is solved, where the end-effector has to reach the hand point
        ("metric", np.int64),
        ("mount", np.int64),
        ("lambda_f", np.float64),
        ("lambda_E", np.float64),
        ("delta", np.float64),
        ("radius", np.float64),  # eps, largest |q_t - q_{t-1}| [rad]; of joints that slide a metre counts as a radian
        ("slides", np.int64, MAX_DOF),  # 1 where a joint slides
        ("lower", np.float64, MAX_DOF),
        ("upper", np.float64, MAX_DOF),
        ("reach", np.float64),  # how near the hand must come at the start [m]
        ("tolerance", np.float64),  # predicted relative decrease of g at which a frame is solved
        ("floor", np.float64),  # the same, absolute [m]
        ("max_steps", np.int64),
        ("descents", np.int64),
        ("finalists", np.int64),
        ("start_paths", np.int64),  # start poses carried along the whole path
        ("every", np.int64),  # 1: the hand must be reached in every frame
        ("second_order", np.int64),
    ]
)
"""Everything about the task and the method that is one number; the frames come beside it."""

STATE = np.dtype(
    [
        ("phase", np.int64),
        ("candidate", np.int64),
        ("placed", np.int64),  # 0: the base is that of the task frame
        ("base", np.float64, 12),  # base pose in the task frame: axes x, y, z, then the origin
        ("cutoff", np.float64),  # robot fitness beyond which the candidate is of no interest
        ("t", np.int64),
        ("k", np.int64),  # index of the present start pose
        ("kept", np.int64, MAX_DESCENTS),  # best start poses so far, best first
        ("kept_value", np.float64, MAX_DESCENTS),
        ("kept_count", np.int64),
        ("final_q", np.float64, (MAX_FINALISTS, MAX_DOF)),  # best outcomes of the descents, best first
        ("final_value", np.float64, MAX_FINALISTS),
        ("final_count", np.int64),
        ("start_q", np.float64, (MAX_FINALISTS, MAX_DOF)),  # starts that reach, best first
        ("start_g", np.float64, MAX_FINALISTS),
        ("start_miss", np.float64, MAX_FINALISTS),  # distance of the hand there [m]
        ("start_count", np.int64),
        ("nearest", np.float64),  # smallest distance of the hand at a start while none reaches [m]
        ("mounted", np.int64),  # 1: the mount is given
        # the paths
        ("path", np.int64),  # start whose path is followed
        ("best", np.int64),  # start of the best path followed to its end; -1 before there is one
        ("best_r", np.float64),
        ("best_f", np.float64),  # its sums
        ("best_E", np.float64),
        ("mount", np.float64, (3, 3)),  # its mount; of the first path before
        ("farthest", np.int64),  # start of the path that went farthest before it missed the hand
        ("miss_frame", np.int64),  # where that was
        ("miss", np.float64),  # by how much [m]
        ("frames", np.int64),  # frames of all paths
        # the present frame
        ("q", np.float64, MAX_DOF),  # accepted angles
        ("trial", np.float64, MAX_DOF),  # angles to be judged next
        ("previous", np.float64, MAX_DOF),  # centre of the ball
        ("value", np.float64),  # objective at q
        ("g", np.float64),
        ("predicted", np.float64),  # decrease the model promises for the trial
        ("damping", np.float64),  # relative to the mean diagonal of the model
        ("model", np.int64),
        ("fresh", np.int64),  # 1: the trial opens a frame
        ("closing", np.int64),  # 1: solved, but the poses are those of a rejected trial
        ("tries", np.int64),
        # sums
        ("f_sum", np.float64),
        ("E_sum", np.float64),
        ("steps", np.int64),
        ("start_steps", np.int64),  # those spent on the start
        ("accepted", np.int64),
        ("pruned", np.int64),
        ("valid", np.int64),
    ]
)
"""Solver state: how far an arm has followed the demonstration."""

ARM = np.dtype([("state", STATE), ("chain", CHAIN), ("frame", FRAME), ("attitude", ATTITUDE)])
"""Everything that is kept of one arm between two trials."""

SCRATCH = np.dtype(
    [
        ("motion", MOTION),
        ("match", MATCH),
        ("step", STEP),
        ("points", np.float64, (MAX_POINTS, 3)),  # of the present frame, seen from the arm's base
        ("rotation", np.float64, (3, 3)),  # of the hand, likewise
    ]
)
"""What one trial of one arm needs; a single record serves a whole block, so that it stays in the fastest cache."""


class ProblemArrays(NamedTuple):
    """A problem as the kernels read it.

    Attributes:
        P: Points, shape (T, m, 3) [m].
        R: Hand rotations, shape (T, 3, 3), or (1, 3, 3) where orientation has no weight.
        starts: Start poses, shape (K, n) [rad].
        record: One PROBLEM record, shape (1,).
    """

    P: Array
    R: Array
    starts: Array
    record: NDArray[np.void]


OUTCOME = np.dtype(
    [
        ("done", np.int64),
        ("path", np.int64),  # start whose path counts
        ("t", np.int64),  # frames of that path
        ("frames", np.int64),  # frames of all paths
        ("best_q", np.float64, MAX_DOF),
        ("mount", np.float64, (3, 3)),
        ("start_error", np.float64),
        ("miss_frame", np.int64),
        ("miss", np.float64),
        ("f_sum", np.float64),
        ("E_sum", np.float64),
        ("steps", np.int64),
        ("start_steps", np.int64),
        ("accepted", np.int64),
        ("pruned", np.int64),
        ("valid", np.int64),
    ]
)
"""What is kept of a candidate that is done."""

TRACE = np.dtype(
    [
        ("q", np.float64, MAX_DOF),
        ("g", np.float64),
        ("area", np.float64),
        ("orientation_error", np.float64),
        ("sigma", np.float64, MAX_POINTS),
        ("distance", np.float64, MAX_POINTS),
    ]
)
"""What is accumulated of a frame; kept only where somebody asks for it."""

SMALLEST_DAMPING = 1e-9  # relative damping at which a frame begins
