"""The record to beat: the best arm ever found for a task and a number of joints, with how it was found."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from armdesign.cell.obstacle_record import obstacles_json
from armdesign.errors import SettingsError
from armdesign.files import write_whole
from armdesign.search.design_problem import DesignProblem

FILE = Path(__file__).resolve().parents[3] / "benchmarks" / "best_known.json"
"""Where it is kept; a part of the repository, not of the installed package."""
DIGITS = 6
FIELDS = (
    "weights", "w_0", "free", "metric", "mount", "lambda_f", "lambda_E", "delta", "radius", "lower", "upper", "reach",
    "start_paths", "every",
)  # fmt: skip
"""Numbers of the problem that the fitness depends on."""


@dataclass(frozen=True)
class Best:
    """The best known arm."""

    task: str  # name of the task, with its settings where it takes any
    dof: int  # number of joints n
    fitness: float  # r [m]
    phi: tuple[float, ...]  # the design, the free entries of its DH table and of its base [rad, m]
    found: str  # how it was found


def fingerprint(problem: DesignProblem) -> str:
    """What the fitness of a design depends on, as a digest: task to the micrometre, weights, bounds and limits.

    How hard the solver tries is left out, but for the number of start poses that are carried along the path. Where the
    base was free, it is one of the unknowns and not part of the task.
    """
    problem = problem.in_room
    path_problem, space = problem.path_problem, problem.space
    R = path_problem.R if path_problem.record["w_0"][0] > 0.0 else np.zeros((1, 3, 3))
    numbers = [np.asarray(path_problem.record[name], dtype=float).ravel() for name in FIELDS]
    bounds = np.array([*space.length, *space.coaxial])
    digest = hashlib.sha256(",".join(space.names).encode())
    for values in (path_problem.P, R, space.lower, space.upper, bounds, *numbers):
        digest.update((np.round(values, DIGITS) + 0.0).tobytes())
    around = problem.first.obstacles
    if around.each:  # so the arm has a body, and what it touches counts, wherever its file lies
        shapes = [{**each, "source": None} for each in json.loads(obstacles_json(around))["obstacles"]]
        digest.update(f"{problem.settings.body} {problem.settings.needs} {shapes}".encode())
    return digest.hexdigest()[:16]


def read_best(path: Path = FILE) -> dict[str, Best]:
    """The best known arms by fingerprint; none where there is no file.

    Raises:
        SettingsError: The file is damaged.
    """
    try:
        content: Mapping[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        return {key: Best(**{**entry, "phi": tuple(entry["phi"])}) for key, entry in content.items()}
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise SettingsError(f"the best known arms in {path} cannot be read: {error}", value=str(path)) from error


def write_best(best: Mapping[str, Best], path: Path = FILE) -> None:
    """Write the best known arms, by task and joints."""
    ordered = sorted(best.items(), key=lambda item: (item[1].task, item[1].dof))
    write_whole(path, json.dumps({key: asdict(entry) for key, entry in ordered}, indent=1) + "\n")


def better_of(known: Best | None, found: Best) -> Best:
    """The better one of two."""
    return found if known is None or found.fitness < known.fitness else known
