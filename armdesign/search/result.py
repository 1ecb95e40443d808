"""What a search or an evaluation ends with: the arm, what it does on the demonstrations, and how it was found."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PurePath

import numpy as np

from armdesign._types import Array
from armdesign._version import __version__
from armdesign.bodies.arm_body import ArmBody, arm_body
from armdesign.bodies.exact import free_side
from armdesign.demonstration.task import task_lines
from armdesign.errors import counted
from armdesign.feasibility.penalty import choose_slides
from armdesign.feasibility.verdict import Verdict, judge, spread
from armdesign.feasibility.violations import Followed
from armdesign.feasibility.words import MEANINGS, Judged, hand_words, headline, spread_words
from armdesign.fitness.constraints import joint_limits
from armdesign.kinematics.base_pose import BasePose
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.dh_files import read_base_pose, read_design
from armdesign.kinematics.line_drawing import Line, drawing, shown
from armdesign.kinematics.motion import SmoothMotion, smooth_motion
from armdesign.search.design_problem import Demonstration, DesignProblem
from armdesign.search.evaluation import Evaluation, PathEvaluation, at_given_place, evaluate_design, motions
from armdesign.swarm import ALGORITHMS, History
from armdesign.swarm.agreement import LEVELS, Agreement


@dataclass(frozen=True)
class SearchFacts:
    """How a search went.

    Attributes:
        algorithm: Its name.
        seed: Of the random numbers.
        evaluations: Candidates that were evaluated.
        rejected: How many of them each test has removed.
        converged_at: Iteration whose best is within 1 % of the last (method section 7).
        computational_effort: CE, valid candidates up to there (method section 7).
        mean_valid: Mean number of valid candidates in an iteration up to there.
        stopped_by: Why it ended: iterations, budget, agreement, patience, target, time_limit or interrupted.
        wall_time: How long it took, earlier parts of a resumed search included [s].
        agreement: What independent beginnings say of the best arm; None of an algorithm without any.
    """

    algorithm: str
    seed: int
    evaluations: int
    rejected: Mapping[str, int]
    converged_at: int
    computational_effort: float
    mean_valid: float
    stopped_by: str
    wall_time: float
    agreement: Agreement | None = None

    @property
    def found(self) -> str:
        """How sure the search is of the best arm, in a sentence; empty where it has nothing to say."""
        if self.agreement is None or not self.agreement.beginnings:
            return ""
        agreeing, beginnings, chance, *_ = self.agreement
        words = f"{agreeing} of {counted(beginnings, 'independent start')} of the search ended in this arm"
        if agreeing < 2:
            return f"{words}: a better one is likely, and a larger budget may find it."
        return f"{words}; another one better by 1 % is {likely(chance)} (p < {rounded_up(chance):g})."

    @property
    def interrupted(self) -> bool:
        """Whether somebody ended it before its time."""
        return self.stopped_by == "interrupted"


def likely(chance: float) -> str:
    """A chance in words."""
    return "unlikely" if chance <= LEVELS["normal"] else "possible" if chance <= LEVELS["quick"] else "likely"


def rounded_up(chance: float) -> float:
    """A chance rounded up to one digit, so that it may be said to be smaller."""
    digit = 10.0 ** math.floor(math.log10(chance))
    return min(1.0, digit * (math.floor(chance / digit) + 1))


@dataclass(frozen=True, eq=False, repr=False)
class Result:
    """An arm that does a task: found by a search, given and scored, or read from a run folder.

    Attributes:
        problem: The demonstrations as seen from the arm's base, and the settings.
        evaluation: The arm (``evaluation.table``) with its path on every demonstration.
        history: Best, mean, valid and evaluated candidates per iteration; None for an arm that was not searched.
        facts: How the search went; None for an arm that was not searched.
        basins: Good designs Phi, shape (A, D), and their fitness, shape (A,), best first, for the alternatives.
        name: What to call it; for people, not safe for XML.
        version: Version of armdesign that has computed it.
        folder: The run folder it was read from; None for a result in memory.
        known_verdict: The verdict that was written down with it; None for one that has yet to be made.
        known_slides: The slides that were written down with it; None for those that have yet to be chosen.
    """

    problem: DesignProblem
    evaluation: Evaluation
    history: History | None = None
    facts: SearchFacts | None = None
    basins: tuple[Array, Array] | None = None
    name: str = "arm"
    version: str = __version__
    folder: Path | None = None
    known_verdict: Verdict | None = None
    known_slides: tuple[float, ...] | None = None

    def __repr__(self) -> str:
        found = self.evaluation
        lines = [f"arm of {counted(self.table.dof, 'joint')}, {hand_words(self.verdict)}"]
        lines.append(f"  {headline(self.verdict, self.judged)}")
        if found.holdouts:
            lines.append(f"  held out: {self.held_out}")
        lines.append(
            f"  r {found.fitness:.4f} m, f {1e3 * found.path_fitness:.2f} mm, E {1e3 * found.area:.2f} mm: r is "
            f"{MEANINGS['r']}"
        )
        if self.facts is not None:
            lines.append(f"  best of {counted(self.facts.evaluations, 'candidate')} in {self.facts.wall_time:.1f} s")
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        """The arm in five poses over the paths that were demonstrated."""
        task, q = self.problem.task, self.evaluation.path.q
        frames = sorted({int(k) for k in np.linspace(0, len(q) - 1, 5)})
        bodies = zip(frames, self.table.skeleton(q[frames]), strict=True)
        arms = [Line(body, name=f"{task.time[k]:.2f} s", width=2.0) for k, body in bodies]
        return shown(f"{self!r}\n\n{self.table!r}", drawing([*arms, *task_lines(task)]))

    @cached_property
    def verdict(self) -> Verdict:
        """Whether the arm can exist and does its task; made once."""
        if self.known_verdict is not None:
            return self.known_verdict
        several = len(self.problem.demonstrations) > 1
        pairs = zip(self.problem.demonstrations, self.evaluation.demonstrations, strict=True)
        followed = [done(self.table, each, scored, several=several) for each, scored in pairs]
        return judge(self.body, self.base_pose, followed, self.problem.requirements)

    @cached_property
    def moved(self) -> tuple[SmoothMotion, ...]:
        """What the joints do on every demonstration that the search sees, smoothed; fitted once."""
        return tuple(smooth_motion(*path, self.limits) for path in motions(self.evaluation, self.problem))

    @cached_property
    def slides(self) -> tuple[float, ...]:
        """Where the joint modules sit on their joints' axes, s_j of ``armdesign.bodies.arm_body`` [m]; chosen once."""
        if self.known_slides is not None:
            return self.known_slides
        paths = [each.path.q for each in self.evaluation.demonstrations]
        chosen = choose_slides(self.problem.requirements, self.table, self.problem.first.base, paths)
        return tuple(chosen.tolist())

    @cached_property
    def body(self) -> ArmBody:
        """The arm's body, as it is judged, exported and shown; made once.

        The plate of an arm that hangs at a point of the recording stands on the side where it is least in the way.
        """
        return arm_body(self.table, self.problem.settings.body, self.slides, self.limits, placed=self.placed,
                        side=self.plate_side)  # fmt: skip

    @cached_property
    def plate_side(self) -> str | None:
        """The side of the base on which the plate of a hanging arm stands; None of one placed, or without bodies."""
        options = self.problem.settings.body
        if self.placed or options.kind == "thin":
            return None
        hung = arm_body(self.table, options, self.slides, self.limits)
        return free_side(hung, np.concatenate([each.path.q for each in self.evaluation.demonstrations]))

    @property
    def placed(self) -> bool:
        """Whether the base has a place of its own, on whose face it stands."""
        return self.problem.first.base is not None

    @property
    def located(self) -> bool:
        """Whether its place has been checked: in the room, or among obstacles; not at a point of a recording alone."""
        return self.base_pose.frame == "room" or bool(self.problem.first.obstacles.each)

    @property
    def judged(self) -> Judged:
        """What its verdict is put into words by."""
        return Judged(self.problem.settings, self.located)

    @property
    def held_out(self) -> str:
        """The hand's error on the demonstrations that the search did not see, in words."""
        pairs = list(zip(self.problem.holdouts, self.evaluation.holdouts, strict=True))
        if any(scored.missed is not None for _, scored in pairs):
            return "the hand is not reached"
        return f"hand error {spread_words(spread([done(self.table, *pair).miss for pair in pairs]))}"

    @property
    def table(self) -> DHTable:
        """The arm's DH table."""
        return self.evaluation.table

    @property
    def fitness(self) -> float:
        """R (eq. 6) [m]."""
        return self.evaluation.fitness

    @property
    def base_pose(self) -> BasePose:
        """Where the arm's base stands in the room."""
        return self.problem.base_pose

    @property
    def limits(self) -> Array:
        """Joint limits of the search, shape (n, 2) [rad; m of joints that slide]."""
        return joint_limits(self.problem.settings.design)

    @property
    def progress(self) -> str:
        """How far the search went, as "3 of 200 iterations"; empty for an arm that was not searched."""
        if self.facts is None:
            return ""
        search = self.problem.settings.search
        algorithm = ALGORITHMS[search.algorithm]
        done = algorithm.units_done(self.facts.evaluations, vars(search))
        return f"{done} of {counted(getattr(search, algorithm.length), algorithm.unit)}"


def done(table: DHTable, demonstration: Demonstration, scored: PathEvaluation, *, several: bool = False) -> Followed:
    """What an arm does on a demonstration, as its verdict sees it: where its tool is, and how it is turned.

    Args:
        table: The arm.
        demonstration: The demonstration.
        scored: The arm's path on it.
        several: Whether it is one of several, so that its name counts.
    """
    task, path, fitness = demonstration.task, scored.path, demonstration.settings.fitness
    miss = path.distance[:, -1]
    if not fitness.tie_hand:  # the hand may be somewhere along the arm, but the tool is at its end
        miss = np.linalg.norm(table.skeleton(path.q)[:, -1] - task.P[:, -1], axis=1)
    angle = path.orientation_error if fitness.orientation_weight else None
    return Followed(task.time, path.q, miss, angle, PurePath(demonstration.name).name if several else "")


def evaluate(arm: DHTable | str | Path, problem: DesignProblem, name: str = "arm") -> Result:
    """Score a given arm on the demonstrations of a problem.

    Args:
        arm: The arm, or the file of its DH table or of a result, see ``read_design``.
        problem: The demonstrations, prepared by settings for as many joints as the arm has.
        name: What to call it.

    Raises:
        DesignError: The arm cannot be read, has another number of joints, or no length.
        SearchError: It does not reach the first frame.
    """
    table, base = (arm, None) if isinstance(arm, DHTable) else (read_design(arm), read_base_pose(arm))
    seen = at_given_place(problem, base)
    return Result(seen, evaluate_design(table, seen), name=name)
