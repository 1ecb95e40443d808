"""The search algorithm of the settings, in the space of the designs, and one batch of it."""

from __future__ import annotations

from dataclasses import asdict, astuple
from typing import Any, NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.errors import SettingsError, counted
from armdesign.fitness.constraints import DesignSpace
from armdesign.fitness.robot import Rejections
from armdesign.search.arm_symmetry import canonical_form, length_slab
from armdesign.search.backends.backend import Backend
from armdesign.settings.sections import Search as SearchSettings
from armdesign.swarm import Algorithm, Box, Sampler, SearchSpace, make_algorithm


class Note(NamedTuple):
    """What a search keeps of a batch beside what its algorithm has learnt; numbers, which that hands on.

    Attributes:
        constraints: See Rejections.
        reach: See Rejections.
        start: See Rejections.
        pruned: See Rejections.
        path: See Rejections.
        nearest: Smallest distance between a first frame's end-effector and the hand [m].
        fitness: r of the best arm of the batch [m]; infinite where none counts.
        path_fitness: Its f [m].
        area: Its E [m].
    """

    constraints: float
    reach: float
    start: float
    pruned: float
    path: float
    nearest: float
    fitness: float
    path_fitness: float
    area: float

    @property
    def removed(self) -> Rejections:
        """How many candidates each test has removed."""
        return Rejections(*map(int, self[:5]))


def step(swarm: Algorithm, backend: Backend, *, prune: bool) -> None:
    """Ask for a batch, have it evaluated, tell.

    Args:
        swarm: The search, or a part of it.
        backend: Who evaluates.
        prune: Whether what comes to lie beyond its cutoff may be dropped.
    """
    X = swarm.ask()
    # what is dropped on the way changes nothing of what the swarm does next
    cutoff = swarm.cutoff if prune else np.full(len(X), np.inf)
    hints, sloped = swarm.hints, swarm.wants_slopes
    scores, removed = backend.evaluate(X, cutoff, hints, slopes=sloped, coarse=swarm.coarse)
    slopes = scores.slopes if sloped and scores.slopes.shape[1] else None
    # candidates evaluated with a hint do not count: from a start pose searched anew they may do worse
    pure = scores.fitness if hints is None else np.where(np.isfinite(hints).all(axis=1), np.inf, scores.fitness)
    k = int(np.argmin(pure))
    best = (np.inf, np.inf, np.inf)
    if not swarm.coarse and pure[k] < np.inf:
        best = float(scores.fitness[k]), float(scores.path_fitness[k]), float(scores.area[k])
    note = (*astuple(removed), float(scores.start_error.min()), *best)
    swarm.tell(scores.fitness, scores.valid, scores.q0, slopes, Note(*note))


def new_swarm(settings: SearchSettings, space: DesignSpace) -> Algorithm:
    """The search algorithm of the settings, before its first batch.

    Args:
        settings: The algorithm with its parameters, seed, and designs to begin with.
        space: The design space.
    """
    rng = np.random.default_rng(settings.seed)
    return make_algorithm(settings.algorithm, search_space(settings, space), rng, parameters(settings, space))


def parameters(settings: SearchSettings, space: DesignSpace) -> dict[str, Any]:
    """The settings by name, with what is left to the design space.

    Args:
        settings: As the user set them.
        space: The design space.
    """
    # with few joints few frames tell the basins apart; with many, wide steps may lead into another branch of the path
    coarse = settings.coarse if settings.coarse is not None else 40 if space.dof <= 3 else 100
    # with five and more, or where the base is placed too, the light start of a coarse look misses the best of a sample
    return asdict(settings) | {"coarse": coarse, "doubted": space.dof >= 5 or bool(space.sites)}


def search_space(settings: SearchSettings, space: DesignSpace) -> SearchSpace:
    """What a search algorithm may know of designs: bounds, the arm's length, equal arms, and how to draw valid ones.

    Args:
        settings: Designs to begin with.
        space: The design space.
    """
    return SearchSpace(
        Box(*space.bounds, space.angular), sample=first_generation(settings, space), anew=space.sample,
        slab=length_slab(space), canonical=canonical_form(space),
    )  # fmt: skip


def first_generation(settings: SearchSettings, space: DesignSpace) -> Sampler:
    """Where a search begins: the designs of ``search.first``, the others drawn from Omega_l.

    As much is drawn as without them, so that the random numbers of the search stay what they are without.

    Args:
        settings: Designs to begin with.
        space: The design space.

    Raises:
        SettingsError: A design has another number of entries than Phi or lies outside the bounds; when drawn, also
            where there are more designs than the first generation has room for.
    """
    first = settings.first or ()
    names = space.free_names
    for k, design in enumerate(first):
        if len(design) != len(names):
            raise SettingsError(
                f"search.first[{k}] has {counted(len(design), 'number')}", value=len(design),
                allowed=f"{len(names)}: {', '.join(names)}",
            )  # fmt: skip
        for name, x, low, high in zip(names, design, *space.bounds, strict=True):
            if not low <= x <= high:
                raise SettingsError(
                    f"search.first[{k}] has {name} = {x:g}", value=x, allowed=f"{low:g} to {high:g}, its bounds"
                )

    def sample(rng: np.random.Generator, count: int) -> Array:
        if len(first) > count:
            raise SettingsError(
                f"search.first has {len(first)} designs for a first generation of {counted(count, 'candidate')}",
                value=len(first), allowed=f"up to {count}", fix="Leave some out, or make the search larger",
            )  # fmt: skip
        X = space.sample(rng, count)
        if first:
            X[: len(first)] = first
        return X

    return sample
