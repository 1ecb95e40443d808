"""Default searches of an earlier installation and of this one: seconds to 1 % of the best known arm, and whole."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from statistics import median

import numpy as np
from plan import PACKAGING, Job, Plan
from tables import Row, Table

from armdesign.experiments.studies.best_known import fingerprint, read_best
from armdesign.experiments.studies.search_study import NEAR

NOW = Path(sys.executable).with_name("armdesign")


def tables(plan: Plan) -> Iterator[Table]:
    """Two rows for every task and number of joints; none where no earlier installation is named."""
    if plan.before is None:
        yield Table("before", "Against an earlier installation: left out, --before COMMAND names its armdesign", [])
        return
    handover = [(job, 3) for job in plan.jobs if job.name == "handover_giver"]
    cases = [(PACKAGING, 3), *plan.pick([*handover, (PACKAGING, 6)], [])]
    seeds = plan.pick(range(3), range(1))
    yield Table(
        "before",
        f"Default searches of thin arms on one worker, before and now, medians of {len(seeds)} seeds",
        [row for job, dof in cases for row in rows(plan.before, job, dof, seeds)],
        [
            "s: the search itself, without the command's start. to 1 %: of a search that ends (--target) within 1 % of",
            "the best known arm, or the best of these; one that never does takes for ever. whole: without --target.",
        ],
    )


def rows(before: Path, job: Job, dof: int, seeds: range) -> list[Row]:
    """The searches of one task, each seed before and now in turn.

    Args:
        before: The earlier installation's command.
        job: The task.
        dof: Number of joints n.
        seeds: Seeds.
    """
    problem = job.problem(dof)
    commands: dict[str, list[str | Path]] = {"before": [before], "now": [NOW, "--body", "thin"]}
    searches = {
        (when, seed): [command[0], "search", job.path, "--dof", str(dof), "--seed", str(seed), *command[1:]]
        for seed in seeds for when, command in commands.items()
    }  # fmt: skip
    whole = {key: spent(words) for key, words in searches.items()}
    known = read_best().get(fingerprint(problem))
    target = NEAR * min([fitness for _, fitness in whole.values()] + ([known.fitness] if known else []))
    near = {key: spent([*words, "--target", repr(target)]) for key, words in searches.items()}
    made: list[Row] = []
    for what, found in (("to 1 %", near), ("whole", whole)):
        times = {when: median(seconds if fitness <= target or what == "whole" else np.inf
                              for (key, _), (seconds, fitness) in found.items() if key == when)
                 for when in commands}  # fmt: skip
        row: Row = {"n": dof, "task": job.name, "frames": len(problem.task.P), "what": what}
        row |= {f"{when} s": float(times[when]) for when in commands}
        row["times"] = float(times["before"] / times["now"]) if np.isfinite(times["now"]) else None
        for when in commands:
            good = sum(fitness <= target for (key, _), (_, fitness) in found.items() if key == when)
            row[f"within 1 % {when}"] = f"{good}/{len(seeds)}"
        made.append(row)
    return made


def spent(words: list[str | Path]) -> tuple[float, float]:
    """Time and fitness of a search: seconds without the command's start, r [m]."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        subprocess.run([*words, "--workers", "1", "--no-report", "-q", "--out", out], check=True)
        content = json.loads((out / "result.json").read_text(encoding="utf-8"))
    return float(content["wall_time"]), float(content["fitness"])
