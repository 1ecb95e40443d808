"""Keep the best arm ever found for a task and a number of joints: python benchmarks/best_known.py RUNS...

Goes through all finished runs below the folders named, of whatever search, and puts those that are better than the
record, or on a task that has none, into benchmarks/best_known.json. The fitness is computed afresh from the design.
"""

from __future__ import annotations

import sys
from pathlib import Path

from armdesign.experiments.studies.record import Best, better_of, fingerprint, read_best, write_best
from armdesign.runs.listing import read_runs
from armdesign.runs.reading import FinishedRun, read_finished
from armdesign.search.evaluation import evaluate_design


def entry_of(run: FinishedRun) -> Best:
    """A finished run as an entry."""
    task, content = run.prepared.settings.task, run.content
    cut = f" from {task.start:g} s to {task.stop:g} s" if task.start is not None and task.stop is not None else ""
    rate = f" at {task.rate:g} Hz" if task.rate is not None else ""
    scenario = run.prepared.settings.fitness.scenario
    name = f"{Path(str(task.recording)).name}{cut}{rate}, {scenario} weights"
    found = f"{content.get('algorithm')}, {content.get('evaluations')} candidates, seed {content.get('seed')}"
    fitness = evaluate_design(run.table, run.prepared).fitness
    phi = tuple(float(x) for x in run.prepared.space().phi(run.table))
    return Best(name, run.table.dof, fitness, phi, found)


def main(folders: list[str]) -> None:
    """Update the record."""
    best = read_best()
    for folder in folders:
        for status in read_runs(Path(folder)):
            if status.state != "finished":
                continue
            run = read_finished(status.folder)
            key, entry = fingerprint(run.prepared), entry_of(run)
            if better_of(best.get(key), entry) is entry:
                print(f"{entry.task}, n = {entry.dof}: {entry.fitness:.6f} ({entry.found})")
                best[key] = entry
    write_best(best)


if __name__ == "__main__":
    main(sys.argv[1:])
