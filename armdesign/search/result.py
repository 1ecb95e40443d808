"""What a search or an evaluation ends with: the arm, what it does on the demonstrations, and how it was found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from armdesign._types import Array
from armdesign._version import __version__
from armdesign.errors import counted
from armdesign.fitness.constraints import joint_limits
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.dh_files import read_design
from armdesign.search.design_problem import DesignProblem
from armdesign.search.evaluation import Evaluation, evaluate_design
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


@dataclass(frozen=True, eq=False)
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
