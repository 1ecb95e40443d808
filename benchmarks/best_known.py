"""Keep the best arm ever found for a task and a number of joints: python benchmarks/best_known.py RUNS...

Goes through all finished runs below the folders named, of whatever search or of `armdesign evaluate --out`, and puts
those that are better than the record, or on a task that has none, into benchmarks/best_known.json. The fitness is
computed afresh from the design.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from armdesign.experiments.studies.best_known import Best, better_of, fingerprint, read_best, write_best
from armdesign.runs.listing import read_runs
from armdesign.runs.reading import read_result
from armdesign.search.evaluation import evaluate_design
from armdesign.search.result import Result


def entry_of(run: Result) -> Best:
    """A finished run as an entry."""
    task, facts = run.problem.settings.task, run.facts
    cut = f" from {task.start:g} s to {task.stop:g} s" if task.start is not None and task.stop is not None else ""
    rate = f" at {task.rate:g} Hz" if task.rate is not None else ""
    scenario = run.problem.settings.fitness.scenario
    around = "".join(f" in {Path(path).name}" for path in run.problem.settings.cell.obstacles)
    name = f"{Path(str(task.recording)).name}{cut}{rate}{around}, {scenario} weights"
    found = "a table"
    if facts is not None:
        found = f"{facts.algorithm}, {facts.evaluations} candidates, seed {facts.seed}"
    fitness = evaluate_design(run.table, run.problem).fitness
    phi = tuple(float(x) for x in run.problem.in_room.space.phi(run.table, run.problem.first.base))
    return Best(name, run.table.dof, fitness, phi, found)


def main(folders: list[str]) -> None:
    """Update the record."""
    best = read_best()
    for folder in folders:
        for status in read_runs(Path(folder)):
            if status.state != "finished":
                continue
            run = read_result(status.folder)
            key, entry = fingerprint(run.problem), entry_of(run)
            if not run.problem.in_room.space.admissible(np.array([entry.phi]))[0]:
                print(f"{status.folder} is left out: its arm lies outside the task's bounds")
            elif run.problem.first.obstacles.each and not run.verdict.feasible:
                print(f"{status.folder} is left out: {run.verdict.reasons[0]}")
            elif better_of(best.get(key), entry) is entry:
                print(f"{entry.task}, n = {entry.dof}: {entry.fitness:.6f} ({entry.found})")
                best[key] = entry
    write_best(best)


if __name__ == "__main__":
    main(sys.argv[1:])
