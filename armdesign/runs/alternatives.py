"""The best arms of a search that are really different, each as a run folder of its own.

A search keeps the good designs it has come upon in ``alternatives.json``; the same arm written down in another way,
with an axis turned round, does not count twice.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from armdesign._types import Array

from armdesign.search.arm_symmetry import arm_distances
from armdesign.errors import RunFolderError, SearchError, SettingsError
from armdesign.search.evaluation import Evaluation, evaluate_design
from armdesign.files import write_whole
from armdesign.fitness.constraints import DesignSpace
from armdesign.search.prepare import Prepared

FILE, FOLDER = "alternatives.json", "alternatives"
KEPT = 60
"""Designs that a run folder keeps at most."""
DIFFERENT = 0.3
"""Distance from which two arms count as different, every entry in terms of the width of its bounds."""


@dataclass(frozen=True)
class Alternative:
    """One of several arms for the same task.

    Attributes:
        rank: 1 for the best.
        evaluation: The arm with its path.
        folder: Its run folder.
    """

    rank: int
    evaluation: Evaluation
    folder: Path


def different(Phi: Array, space: DesignSpace, distance: float, most: int) -> list[int]:
    """Indices of designs that differ from each other, going down the list.

    Args:
        Phi: Designs, best first, shape (A, D).
        space: The design space.
        distance: Smallest distance, see arm_distances.
        most: Largest number of them.
    """
    kept: list[int] = []
    for k, design in enumerate(Phi):
        if len(kept) == most:
            break
        if not kept or float(arm_distances(space, design, Phi[kept]).min()) >= distance:
            kept.append(k)
    return kept


def write_designs(folder: Path, prepared: Prepared, basins: tuple[Array, Array] | None) -> tuple[str, ...]:
    """Write the good designs of a search, best first; returns the name of the file.

    Args:
        folder: The run folder.
        prepared: Task and settings.
        basins: Designs Phi, shape (A, D), and their fitness, shape (A,), best first.
    """
    if basins is None:
        return ()
    Phi, fitness = basins
    chosen = different(Phi, prepared.space(), 0.5 * DIFFERENT, KEPT)
    designs = [{"fitness": float(fitness[k]), "phi": [float(x) for x in Phi[k]]} for k in chosen]
    names = [name for name, free in zip(prepared.space().names, prepared.space().free, strict=True) if free]
    write_whole(folder / FILE, json.dumps({"entries": names, "designs": designs}, indent=1) + "\n")
    return (FILE,)


def read_designs(folder: Path, space: DesignSpace) -> Array:
    """The good designs of a search, best first, shape (A, D).

    Raises:
        RunFolderError: There are none, or the file is damaged.
    """
    path = folder / FILE
    try:
        content: Any = json.loads(path.read_text(encoding="utf-8"))
        Phi = np.array([design["phi"] for design in content["designs"]], dtype=float)
        if Phi.ndim != 2 or Phi.shape[1] != int(space.free.sum()) or not np.isfinite(Phi).all():
            raise ValueError(f"designs of {int(space.free.sum())} numbers are expected")
    except FileNotFoundError as error:
        raise RunFolderError(
            f"{folder} keeps no alternatives: {FILE} is missing", value=str(folder),
            fix="Search anew, best with --algorithm multibasin; runs of earlier versions and evaluations keep none",
        ) from error  # fmt: skip
    except OSError as error:
        raise RunFolderError(f"cannot read {path}: {error.strerror}", value=str(path)) from error
    except (ValueError, KeyError, TypeError) as error:
        raise RunFolderError(f"{path} is damaged: {error}", value=str(path), fix="Search anew") from error
    return Phi


def write_alternatives(
    folder: Path, prepared: Prepared, *, count: int = 5, distance: float = DIFFERENT
) -> list[Alternative]:
    """Evaluate the best arms that differ, and write each as a run folder below ``alternatives``.

    Args:
        folder: The run folder of a search.
        prepared: Its task and settings.
        count: Number of arms.
        distance: How different they have to be, see ``different``.

    Raises:
        RunFolderError: The run keeps none, or a folder cannot be written.
        SettingsError: A setting is out of range.
    """
    from armdesign.runs import folder as runfolder  # noqa: PLC0415 (imports this module)

    check_options(count, distance)
    space = prepared.space()
    Phi = read_designs(folder, space)
    found: list[Alternative] = []
    for k in different(Phi, space, distance, len(Phi)):
        if len(found) == count:
            break
        try:
            evaluation = evaluate_design(space.table(Phi[k]), prepared)
        except SearchError:  # does not reach the start on this machine by a hair
            continue
        place = folder / FOLDER / str(len(found) + 1)
        runfolder.write_evaluation(place, evaluation, prepared)
        found.append(Alternative(len(found) + 1, evaluation, place))
    remove_alternatives(folder, beyond=len(found))
    return found


def remove_alternatives(folder: Path, beyond: int = 0) -> None:
    """Remove what an earlier ``armdesign alternatives`` has written and is not valid any more.

    Args:
        folder: The run folder.
        beyond: Rank up to which they stay.
    """
    from armdesign.runs import folder as runfolder  # noqa: PLC0415 (imports this module)

    for place in sorted((folder / FOLDER).glob("[0-9]*")):
        if place.is_dir() and place.name.isdecimal() and int(place.name) > beyond:
            runfolder.remove_run(place)


def check_options(count: int, distance: float) -> None:
    """Refuse what makes no sense.

    Raises:
        SettingsError: A setting is out of range.
    """
    if not 1 <= count <= KEPT:
        raise SettingsError(f"{count} alternatives are asked for", value=count, allowed=f"1 to {KEPT}")
    if not (np.isfinite(distance) and 0.0 < distance <= 10.0):
        raise SettingsError(f"a distance of {distance:g} is asked for", value=distance, allowed="above 0 up to 10")
