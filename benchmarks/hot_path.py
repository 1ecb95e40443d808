"""Speed of the inner loop: microseconds per step, frame and candidate, and the share of Pinocchio in them.

Run by hand on a quiet machine: ``python benchmarks/hot_path.py [--search] [--out FILE.json]``. Ratios carry over
between machines, absolute times do not.
"""

from __future__ import annotations

import argparse
import json
import platform
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from armdesign.demonstration import read_recording
from armdesign.fitness.evaluator import BlockEvaluator, Scores, compile_kernels
from armdesign.search import search
from armdesign.settings import Study
from armdesign.study import Prepared, prepare

EXAMPLES = Path(__file__).parent.parent / "examples"
TASKS = (("packaging", "packaging"), ("welding", "welding"))
CANDIDATES, REPEATS = 300, 5


@dataclass
class Clock:
    """Time spent in Pinocchio and in the kernel, and how often the block was advanced."""

    pinocchio: float = 0.0
    kernel: float = 0.0
    calls: int = 0
    total: float = 0.0
    scores: Scores | None = field(default=None, repr=False)


def timed_evaluation(evaluator: BlockEvaluator, rows: np.ndarray, yaw: np.ndarray) -> Clock:
    """Evaluate all candidates once, with a clock round Pinocchio's call and round the whole step."""
    clock, update, advance = Clock(), evaluator.arms.update, evaluator._advance

    def timed_update() -> None:
        began = time.perf_counter()
        update()
        clock.pinocchio += time.perf_counter() - began

    def timed_advance(trace: np.ndarray) -> int:
        began = time.perf_counter()
        done = advance(trace)
        clock.kernel += time.perf_counter() - began
        clock.calls += 1
        return done

    evaluator.arms.update, evaluator._advance = timed_update, timed_advance
    began = time.perf_counter()
    clock.scores = evaluator.evaluate(rows, yaw)
    clock.total = time.perf_counter() - began
    evaluator.arms.update, evaluator._advance = update, advance
    clock.kernel -= clock.pinocchio
    return clock


def hot_path_row(prepared: Prepared, label: str, dof: int) -> dict[str, float | int | str]:
    """Best of a few repetitions on random designs of Omega_l."""
    problem, space = prepared.problem(), prepared.space()
    compile_kernels(problem)
    rows, yaw = space.rows(space.sample(np.random.default_rng(0), CANDIDATES))
    evaluator = BlockEvaluator(problem)
    clock = min((timed_evaluation(evaluator, rows, yaw) for _ in range(REPEATS)), key=lambda c: c.total)
    scores = clock.scores
    steps, valid = int(scores.steps.sum()), scores.valid
    path_steps = int((scores.steps - scores.start_steps).sum())
    steps_per_frame = path_steps / max(int(scores.frames[valid].sum()), 1)
    return {
        "task": label,
        "n": dof,
        "m": problem.points,
        "T": problem.frames,
        "block": len(evaluator.walks),
        "us_per_step": 1e6 * clock.total / steps,
        "us_pinocchio": 1e6 * clock.pinocchio / steps,
        "us_kernel": 1e6 * clock.kernel / steps,
        "us_rest": 1e6 * (clock.total - clock.pinocchio - clock.kernel) / steps,
        "steps_per_start": float(scores.start_steps.mean()),
        "steps_per_frame": steps_per_frame,
        "us_per_frame": 1e6 * clock.total / steps * steps_per_frame,
        "us_per_candidate": 1e6 * clock.total / CANDIDATES,
        "valid_share": float(valid.mean()),
    }


def search_row(label: str, scenario: str) -> dict[str, float | int | str]:
    """A whole search with the default settings."""
    prepared = prepared_example(label, scenario, 3)
    compile_kernels(prepared.problem())
    result = search(prepared)
    return {"task": label, "n": 3, "seconds": result.wall_time, "r": result.best.fitness}


def prepared_example(name: str, scenario: str, dof: int) -> Prepared:
    """One of the example recordings with its scenario."""
    study = Study().replace({"design": {"dof": dof}, "fitness": {"scenario": scenario}})
    return prepare(read_recording(EXAMPLES / f"{name}.csv"), study)


def show(rows: list[dict[str, float | int | str]]) -> None:
    """Print rows of equal keys as a table."""
    keys = list(rows[0])
    cells = [[f"{row[k]:.2f}" if isinstance(row[k], float) else str(row[k]) for k in keys] for row in rows]
    widths = [max(len(k), *(len(line[i]) for line in cells)) for i, k in enumerate(keys)]
    for line in [keys, *cells]:
        print("  ".join(cell.rjust(width) for cell, width in zip(line, widths, strict=True)))


def main() -> None:
    """Measure, print and optionally write as JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--search", action="store_true", help="also run a whole default search per example")
    parser.add_argument("--out", type=Path, help="write the figures as JSON")
    arguments = parser.parse_args()
    print(f"{platform.processor() or platform.machine()}, Python {platform.python_version()}, NumPy {np.__version__}")
    rows = [
        hot_path_row(prepared_example(name, scenario, dof), name, dof)
        for name, scenario in TASKS
        for dof in (3, 4, 5, 6)
    ]
    show(rows)
    searches = [search_row(*task) for task in TASKS] if arguments.search else []
    if searches:
        show(searches)
    if arguments.out is not None:
        arguments.out.write_text(json.dumps({"hot_path": rows, "search": searches}, indent=2) + "\n")


if __name__ == "__main__":
    main()
