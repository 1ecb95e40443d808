"""The swarms by name."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from armdesign.errors import SettingsError
from armdesign.swarm import saved
from armdesign.swarm.base import Sampler, Swarm
from armdesign.swarm.pso import PSO
from armdesign.swarm.rapso import RAPSO
from armdesign.swarm.space import Box

ALGORITHMS: Mapping[str, type[Swarm]] = MappingProxyType({swarm.name: swarm for swarm in (PSO, RAPSO)})


def make_swarm(
    name: str,
    box: Box,
    particles: int,
    rng: np.random.Generator,
    sample: Sampler | None = None,
    **parameters: Any,  # noqa: ANN401
) -> Swarm:
    """Build a swarm by its name.

    Args:
        name: A key of :data:`ALGORITHMS`.
        box: Bounds of the positions, D entries.
        particles: Number of particles N.
        rng: Source of every draw.
        sample: Draws the initial positions; default uniform in the box.
        **parameters: The algorithm's own settings; the rest keep their defaults.

    Raises:
        SettingsError: The name or a setting is unknown, or a setting is out of range.
        SearchError: `sample` returned something else than N positions in the box.
    """
    algorithm = _algorithm(name)
    return algorithm(box, particles, rng, sample=sample, **algorithm.known_parameters(parameters))


def swarm_from_state(state: Mapping[str, Any]) -> Swarm:
    """The swarm, of whichever algorithm, that :meth:`Swarm.state` described.

    Raises:
        SettingsError: The algorithm or a setting is unknown or out of range.
        SearchError: An entry is missing or does not fit.
    """
    return _algorithm(saved.entry(state, "algorithm")).from_state(state)


def _algorithm(name: object) -> type[Swarm]:
    """The class of that name."""
    if not isinstance(name, str) or name not in ALGORITHMS:
        raise SettingsError(f"there is no swarm algorithm {name!r}", value=name, allowed=sorted(ALGORITHMS))
    return ALGORITHMS[name]
