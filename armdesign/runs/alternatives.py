"""The best arms of a search that are really different, each as a run folder of its own.

A search keeps the good designs that it has found in ``alternatives.json``; the same arm written down in another way,
with an axis turned round, does not count twice.
"""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from armdesign._types import Array
from armdesign.errors import RunFolderError, SearchError, SettingsError
from armdesign.fitness.constraints import DesignSpace
from armdesign.runs.folder import ALTERNATIVES
from armdesign.runs.writing import ALTERNATIVES_FOLDER, remove_alternatives, write_result
from armdesign.search.arm_symmetry import DIFFERENT, KEPT, different_arms
from armdesign.search.design_problem import DesignProblem
from armdesign.search.evaluation import Evaluation, evaluate_candidate
from armdesign.search.result import Result


@dataclass(frozen=True)
class Alternative:
    """One of several arms for the same task.

    Attributes:
        rank: 1 for the best.
        result: The arm with its path and its verdict.
        folder: Its run folder.
    """

    rank: int
    result: Result
    folder: Path

    @property
    def evaluation(self) -> Evaluation:
        """The arm with its path."""
        return self.result.evaluation


def read_designs(folder: Path, space: DesignSpace) -> Array:
    """The good designs of a search, best first, shape (A, D).

    Args:
        folder: The run folder.
        space: The design space.

    Raises:
        RunFolderError: There are none, or the file is damaged.
    """
    path = folder / ALTERNATIVES
    try:
        content: Any = json.loads(path.read_text(encoding="utf-8"))
        Phi = np.array([design["phi"] for design in content["designs"]], dtype=float)
        if Phi.ndim != 2 or Phi.shape[1] != int(space.free.sum()) or not np.isfinite(Phi).all():
            raise ValueError(f"designs of {int(space.free.sum())} numbers are expected")
    except FileNotFoundError as error:
        raise RunFolderError(
            f"{folder} keeps no alternatives: {ALTERNATIVES} is missing", value=str(folder),
            fix="Search anew, best with --algorithm multibasin; runs of earlier versions and evaluations keep none",
        ) from error  # fmt: skip
    except OSError as error:
        raise RunFolderError(f"cannot read {path}: {error.strerror}", value=str(path)) from error
    except (ValueError, KeyError, TypeError) as error:
        raise RunFolderError(f"{path} is damaged: {error}", value=str(path), fix="Search anew") from error
    return Phi


def alternatives(result: Result, count: int = 5, distance: float = DIFFERENT) -> list[Result]:
    """The best arms of a search that are really different, best first.

    Args:
        result: Of a search, in memory or read from its run folder.
        count: Number of arms; fewer come back where no more differ.
        distance: How different they have to be, in terms of the width of the bounds, see ``different_arms``.

    Raises:
        RunFolderError: The result keeps none, as that of an evaluation.
        SettingsError: A setting is out of range.
    """
    check_options(count, distance)
    problem = result.problem
    if result.basins is not None:
        Phi = result.basins[0]
    elif result.folder is not None:
        Phi = read_designs(result.folder, problem.space)
    else:
        raise RunFolderError("the result keeps no alternatives", fix="Search with the algorithm multibasin")
    found = different_evaluations(problem, Phi, count, distance)
    return [Result(*each, name=f"{result.name} {rank}") for rank, each in enumerate(found, start=1)]


def different_evaluations(
    problem: DesignProblem, Phi: Array, count: int, distance: float
) -> list[tuple[DesignProblem, Evaluation]]:
    """Evaluate the best designs that differ, each on the demonstrations as seen from its own base.

    Args:
        problem: Demonstrations and settings.
        Phi: Designs, best first, shape (A, D).
        count: Number of arms.
        distance: How different they have to be, see ``different_arms``.
    """
    found: list[tuple[DesignProblem, Evaluation]] = []
    problem = problem.in_room
    for k in different_arms(Phi, problem.space, distance, len(Phi)):
        if len(found) == count:
            break
        with suppress(SearchError):  # does not reach the start on this machine by a hair
            found.append(evaluate_candidate(Phi[k], problem))
    return found


def write_alternatives(
    folder: Path, problem: DesignProblem, *, count: int = 5, distance: float = DIFFERENT
) -> list[Alternative]:
    """Evaluate the best arms that differ, and write each as a run folder below ``alternatives``.

    Args:
        folder: The run folder of a search.
        problem: Its task and settings.
        count: Number of arms.
        distance: How different they have to be, see ``different_arms``.

    Raises:
        RunFolderError: The run keeps none, or a folder cannot be written.
        SettingsError: A setting is out of range.
    """
    check_options(count, distance)
    found: list[Alternative] = []
    evaluations = different_evaluations(problem, read_designs(folder, problem.space), count, distance)
    for rank, (seen, evaluation) in enumerate(evaluations, start=1):
        place = folder / ALTERNATIVES_FOLDER / str(rank)
        result = Result(seen, evaluation)
        write_result(place, result)
        found.append(Alternative(rank, result, place))
    remove_alternatives(folder, beyond=len(found))
    return found


def check_options(count: int, distance: float) -> None:
    """Check how many arms are asked for and how different they have to be.

    Args:
        count: Number of arms.
        distance: How different they have to be.

    Raises:
        SettingsError: A setting is out of range.
    """
    if not 1 <= count <= KEPT:
        raise SettingsError(f"{count} alternatives are asked for", value=count, allowed=f"1 to {KEPT}")
    if not (np.isfinite(distance) and 0.0 < distance <= 10.0):
        raise SettingsError(f"a distance of {distance:g} is asked for", value=distance, allowed="above 0 up to 10")
