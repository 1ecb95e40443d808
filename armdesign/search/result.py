"""What a search or an evaluation ends with: the arm, what it does on the demonstrations, and how it was found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from armdesign._types import Array
from armdesign._version import __version__
from armdesign.demonstration.task import task_lines
from armdesign.errors import counted
from armdesign.fitness.constraints import joint_limits
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.dh_files import read_design
from armdesign.kinematics.line_drawing import Line, drawing, shown
from armdesign.search.design_problem import DesignProblem
from armdesign.search.evaluation import Evaluation, PathEvaluation, evaluate_design
from armdesign.swarm import ALGORITHMS, History


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
        stopped_by: Why it ended: iterations, budget, patience, target, time_limit or interrupted.
        wall_time: How long it took, earlier parts of a resumed search included [s].
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

    @property
    def interrupted(self) -> bool:
        """Whether somebody ended it before its time."""
        return self.stopped_by == "interrupted"


@dataclass(frozen=True, eq=False, repr=False)
class Result:
    """An arm that does a task: found by a search, given and scored, or read from a run folder.

    Attributes:
        problem: The demonstrations and the settings.
        evaluation: The arm (``evaluation.table``) with its path on every demonstration.
        history: Best, mean, valid and evaluated candidates per iteration; None for an arm that was not searched.
        facts: How the search went; None for an arm that was not searched.
        basins: Good designs Phi, shape (A, D), and their fitness, shape (A,), best first, for the alternatives.
        name: What to call it; for people, not safe for XML.
        version: Version of armdesign that has computed it.
        folder: The run folder it was read from; None for a result in memory.
    """

    problem: DesignProblem
    evaluation: Evaluation
    history: History | None = None
    facts: SearchFacts | None = None
    basins: tuple[Array, Array] | None = None
    name: str = "arm"
    version: str = __version__
    folder: Path | None = None

    def __repr__(self) -> str:
        found = self.evaluation
        scores = f"r {found.fitness:.4f} m, f {1e3 * found.path_fitness:.2f} mm, E {1e3 * found.area:.2f} mm"
        lines = [f"arm of {counted(self.table.dof, 'joint')}, {hand_error(found.demonstrations)}; {scores}"]
        if found.holdouts:
            lines.append(f"  held out: {hand_error(found.holdouts)}")
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

    @property
    def table(self) -> DHTable:
        """The arm's DH table."""
        return self.evaluation.table

    @property
    def fitness(self) -> float:
        """R (eq. 6) [m]."""
        return self.evaluation.fitness

    @property
    def limits(self) -> Array:
        """Joint limits of the search, shape (n, 2) [rad]."""
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


def hand_error(scores: Sequence[PathEvaluation]) -> str:
    """How far the end-effector is from the hand on some demonstrations, in words; the hand is the last point."""
    reached = [each.path.distance[:, -1] for each in scores if each.missed is None]
    if len(reached) < len(scores):
        return "the hand is not reached"
    error = 1e3 * np.concatenate(reached)
    return f"hand error {error.mean():.1f} mm mean, {error.max():.1f} mm largest"


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
    table = arm if isinstance(arm, DHTable) else read_design(arm)
    return Result(problem, evaluate_design(table, problem), name=name)
