"""How often the start pose found is the best known one, over the effort spent on it (method section 4).

``python benchmarks/starts.py [--designs 500] [--dof 3 4 5 6]``: random designs of Omega_l on the first frame of both
examples; the best known start is the best of all settings tried, among them a far larger one. A start counts as
found when its g is within 0.01 mm of the best known.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from armdesign.demonstration import read_recording
from armdesign.fitness.constraints import joint_limits
from armdesign.fitness.evaluator import BlockEvaluator
from armdesign.fitness.problem import make_problem
from armdesign.settings import Study
from armdesign.study import Prepared, prepare

EXAMPLES = Path(__file__).parent.parent / "examples"
EFFORTS = ((128, 16), (128, 24), (128, 64), (192, 96), (384, 192))
REFERENCE = (2048, 256)


def first_frame_scores(prepared: Prepared, designs: np.ndarray, starts: int, descents: int) -> tuple[np.ndarray, float]:
    """G_0 of every design (infinite where the start is missed), and the mean steps spent."""
    study = prepared.study.replace({"solver": {"starts": starts, "descents": descents}})
    task = prepared.task
    problem = make_problem(
        task.P[:1],
        None if task.R is None else task.R[:1],
        task.dt,
        joint_limits(study.design),
        study.fitness,
        study.solver,
    )
    scores = BlockEvaluator(problem).evaluate(*prepared.space().rows(designs))
    return scores.path_fitness, float(scores.start_steps.mean())


def share_table(name: str, dof: int, count: int) -> None:
    """Print one line: share of the designs whose best known start is found, and steps, for each effort."""
    study = Study().replace({"design": {"dof": dof}})
    prepared = prepare(read_recording(EXAMPLES / f"{name}.csv"), study)
    rng = np.random.default_rng(1)
    designs = prepared.space().sample(rng, 20 * count if dof <= 3 else 4 * count)
    reference, _ = first_frame_scores(prepared, designs, *REFERENCE)
    designs = designs[np.isfinite(reference)][:count]
    results = [first_frame_scores(prepared, designs, *effort) for effort in (*EFFORTS, REFERENCE)]
    best = np.min([g for g, _ in results], axis=0)
    cells = [f"{100 * np.mean(g <= best + 1e-5):5.1f} % {steps:5.0f}" for g, steps in results]
    print(f"{name:>10} {dof:2d} {len(designs):5d}  " + "  ".join(cells), flush=True)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--designs", type=int, default=500)
    parser.add_argument("--dof", type=int, nargs="+", default=[3, 4, 5, 6])
    arguments = parser.parse_args()
    print("starts, descents:       " + "  ".join(f"{s:>6},{d:<4}  " for s, d in (*EFFORTS, REFERENCE)))
    for name in ("packaging", "welding"):
        for dof in arguments.dof:
            share_table(name, dof, arguments.designs)


if __name__ == "__main__":
    main()
