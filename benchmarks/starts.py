"""How often the start pose found is the best known one, over the effort spent on it (method section 4)."""

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

from armdesign.compute.processes import available_cores
from armdesign.fitness.evaluator import BlockEvaluator, Scores
from armdesign.study import Prepared

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
    prepared = job.prepared(dof)
    default = default_effort(prepared)
    tried = [effort for effort in EFFORTS if effort.descents <= MOST * default.descents]
    efforts = list(dict.fromkeys((*tried, default, *REFERENCES)))
    Phi = designs(prepared, SAMPLED[dof] * count, seed=1)
    cheap = first_scores(job, dof, Phi, efforts[0])
    often = np.flatnonzero(np.isfinite(cheap.path_fitness))
    # The strongest effort decides on the others, as many of them as stand among the first valid ones.
    last = often[count - 1] + 1 if len(often) >= count else len(Phi)
    doubtful = np.setdiff1d(np.arange(last), often)
    late = doubtful[np.isfinite(first_scores(job, dof, Phi[doubtful], REFERENCES[0]).path_fitness)]
    chosen = Phi[np.sort(np.r_[often[often < last], late])[:count]]
    scores = [(effort, first_scores(job, dof, chosen, effort)) for effort in efforts]
    return [Found(effort, s.path_fitness, s.start_steps.astype(float)) for effort, s in scores]


def default_effort(prepared: Prepared) -> Effort:
    """What the settings give."""
    problem = prepared.problem()
    record = problem.record[0]
    return Effort(len(problem.starts), int(record["descents"]), int(record["finalists"]))


def first_scores(job: Job, dof: int, Phi: Array, effort: Effort) -> Scores:
    """Scores of designs on the first frame; G_0 is their path fitness, infinite where the start is missed."""
    prepared = job.prepared(dof, solver=effort._asdict())
    return BlockEvaluator(first_frame(prepared.problem())).evaluate(*prepared.space().rows(Phi))


def share_rows(dof: int, parts: list[list[Found]]) -> list[Row]:
    """A row for every effort, the tasks together."""
    best = [np.min([found.G for found in part], axis=0) for part in parts]
    default = default_effort(PACKAGING.prepared(dof))
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
