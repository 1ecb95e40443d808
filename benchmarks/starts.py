"""Start poses: how often the best known one is found over the effort spent, and how often it is not the best to follow.

Method section 4 takes the start with the smallest g at the first frame. Another one may give the better path; the
second table counts how often (setting ``solver.start_paths``).
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from plan import PACKAGING, WELDING, Job, Plan, designs
from tables import Row, Table
from walks import first_frame

from armdesign.fitness.block import BlockEvaluator, Scores
from armdesign.fitness.kernels.starts import SAME_POSE
from armdesign.search.backends.processes import available_cores
from armdesign.search.design_problem import DesignProblem

Array = NDArray[np.float64]


class Effort(NamedTuple):
    """Start poses looked at, descents from the best of them, finalists solved to the end."""

    starts: int
    descents: int
    finalists: int


EFFORTS = (
    Effort(128, 16, 6), Effort(128, 24, 6), Effort(128, 64, 6), Effort(256, 128, 6), Effort(384, 192, 6),
    Effort(512, 256, 12),
)  # fmt: skip
REFERENCES = (Effort(1024, 256, 16), Effort(4096, 256, 16))
FOUND = 1e-5
"""A start counts as found when its G_0 is within this of the best known [m]."""
SAMPLED = {3: 24, 4: 5, 5: 3, 6: 2}
"""Designs to draw per valid one wanted."""
MOST = 4
"""Efforts of more than so many times the default's descents are left out."""
JOBS = (PACKAGING, WELDING)
PATHS = 8
"""Start poses carried along the whole path, to be compared with one."""
GAIN = 1e-3
"""Share of r from which another start counts as one that matters."""
BEST = 0.1
"""Share of the designs, the best by r with one path, that are looked at on their own: those a search ends with."""


class Found(NamedTuple):
    """Effort, G_0 of every design [m], and steps spent on it."""

    effort: Effort
    G: Array
    steps: Array


def tables(plan: Plan) -> Iterator[Table]:
    """The share of designs for every n and effort; rows are shared out among the cores, as nothing is timed."""
    count = plan.pick(500, 60) // len(JOBS)
    parts = [(job, dof, count) for dof in (6, 5, 4, 3) for job in JOBS]
    with ProcessPoolExecutor(available_cores(), multiprocessing.get_context("spawn")) as pool:
        results = pool.map(sought, *zip(*parts, strict=True))
        found = {(dof, job.name): result for (job, dof, _), result in zip(parts, results, strict=True)}
    rows = [row for dof in (3, 4, 5, 6) for row in share_rows(dof, [found[dof, job.name] for job in JOBS])]
    yield Table(
        "starts",
        f"Share of {count * len(JOBS)} random valid designs per n, half of them on each example's first frame, whose "
        "best known start is found",
        rows,
        [
            "Best known: the best of all rows and of "
            + " and ".join(f"{e.starts} starts with {e.descents} descents" for e in REFERENCES)
            + f"; found: within {1e3 * FOUND:g} mm of it. The aim is 99 % with the default effort.",
        ],
    )


def sought(job: Job, dof: int, count: int) -> list[Found]:
    """G_0 with every effort, of so many valid designs; valid: some effort reaches the start."""
    problem = job.problem(dof)
    default = default_effort(problem)
    tried = [effort for effort in EFFORTS if effort.descents <= MOST * default.descents]
    efforts = list(dict.fromkeys((*tried, default, *REFERENCES)))
    Phi = designs(problem, SAMPLED[dof] * count, seed=1)
    cheap = first_scores(job, dof, Phi, efforts[0])
    often = np.flatnonzero(np.isfinite(cheap.path_fitness))
    # The strongest effort decides on the others, as many of them as stand among the first valid ones.
    last = often[count - 1] + 1 if len(often) >= count else len(Phi)
    doubtful = np.setdiff1d(np.arange(last), often)
    late = doubtful[np.isfinite(first_scores(job, dof, Phi[doubtful], REFERENCES[0]).path_fitness)]
    chosen = Phi[np.sort(np.r_[often[often < last], late])[:count]]
    scores = [(effort, first_scores(job, dof, chosen, effort)) for effort in efforts]
    return [Found(effort, s.path_fitness, s.start_steps.astype(float)) for effort, s in scores]


def default_effort(problem: DesignProblem) -> Effort:
    """What the settings give."""
    path_problem = problem.path_problem
    record = path_problem.record[0]
    return Effort(len(path_problem.starts), int(record["descents"]), int(record["finalists"]))


def first_scores(job: Job, dof: int, Phi: Array, effort: Effort) -> Scores:
    """Scores of designs on the first frame; G_0 is their path fitness, infinite where the start is missed."""
    problem = job.problem(dof, solver=effort._asdict())
    return BlockEvaluator(first_frame(problem.path_problem)).evaluate(*problem.space.rows(Phi))


def share_rows(dof: int, parts: list[list[Found]]) -> list[Row]:
    """A row for every effort, the tasks together."""
    best = [np.min([found.G for found in part], axis=0) for part in parts]
    default = default_effort(PACKAGING.problem(dof))
    rows: list[Row] = []
    for k, first in enumerate(parts[0]):
        if first.effort in REFERENCES:
            continue
        hits = np.concatenate([known + FOUND >= part[k].G for part, known in zip(parts, best, strict=True)])
        rows.append(
            {
                "n": dof,
                "designs": len(hits),
                **first.effort._asdict(),
                "default": "default" if first.effort == default else "",
                "found %": 100.0 * float(hits.mean()),
                "steps": float(np.concatenate([part[k].steps for part in parts]).mean()),
            }
        )
    return rows


class Compared(NamedTuple):
    """The same valid designs with one start carried along the whole path and with several.

    Attributes:
        one: Scores with the best start at the first frame, N designs.
        several: Scores with the best path of several starts.
    """

    one: Scores
    several: Scores

    @property
    def other(self) -> NDArray[np.bool_]:
        """Whether the best path begins at another start, shape (N,)."""
        apart: NDArray[np.bool_] = np.linalg.norm(self.one.q0 - self.several.q0, axis=1) >= SAME_POSE
        return apart

    @property
    def gain(self) -> Array:
        """By which share of it r is smaller with it, shape (N,)."""
        return 1.0 - self.several.fitness / self.one.fitness


def path_tables(plan: Plan) -> Iterator[Table]:
    """How often and by how much several paths make a design better, for every task and n."""
    count = plan.pick(300, 30)
    parts = [(job, dof, count) for dof in (6, 5, 4, 3) for job in JOBS]
    with ProcessPoolExecutor(available_cores(), multiprocessing.get_context("spawn")) as pool:
        found = dict(zip([(job.name, dof) for job, dof, _ in parts], pool.map(compared, *zip(*parts, strict=True)),
                         strict=True))  # fmt: skip
    yield Table(
        "start_paths",
        f"Random valid designs for which {PATHS} start poses carried along the whole path give another start than 1, "
        "and by how much r is smaller",
        [path_row(job.name, dof, found[job.name, dof]) for job in JOBS for dof in (3, 4, 5, 6)],
        [
            f"other: the best path begins at another start; matters: r is smaller by more than {100 * GAIN:g} %. "
            "Median and largest gain are those of the designs with another start; the last columns are of the best "
            f"{100 * BEST:g} % of the designs by r with one path. Steps: kernel evaluations over those of one path.",
        ],
    )


def compared(job: Job, dof: int, count: int) -> Compared:
    """The first so many valid of random designs, with one path and with several from the same finalists."""
    finalists = max(PATHS, default_effort(job.problem(dof)).finalists)
    Phi = designs(job.problem(dof), SAMPLED[dof] * count, seed=2)
    scores = []
    for paths in (1, PATHS):
        problem = job.problem(dof, solver={"start_paths": paths, "finalists": finalists})
        scores.append(BlockEvaluator(problem.path_problem).evaluate(*problem.space.rows(Phi)))
        Phi = Phi[np.flatnonzero(scores[-1].valid)[:count]]
    one, several = scores
    valid = np.flatnonzero(one.valid)[:count]
    return Compared(Scores(**{name: values[valid] for name, values in vars(one).items()}), several)


def path_row(task: str, dof: int, found: Compared) -> Row:
    """A row of the table."""
    other, gain = found.other, found.gain
    matters, count = other & (gain > GAIN), len(other)
    best = np.argsort(found.one.fitness)[: max(1, round(BEST * count))]
    gains = gain[other] if other.any() else np.zeros(1)
    return {
        "task": task,
        "n": dof,
        "designs": count,
        "other %": 100.0 * float(other.mean()),
        "matters %": 100.0 * float(matters.mean()),
        "median gain %": 100.0 * float(np.median(gains)),
        "largest gain %": 100.0 * float(gains.max()),
        "best: matters %": 100.0 * float(matters[best].mean()),
        "best: largest gain %": 100.0 * float(np.where(other, gain, 0.0)[best].max()),
        "steps": float(found.several.steps.sum() / found.one.steps.sum()),
    }
