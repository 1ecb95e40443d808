"""The search algorithms by name: a new one is a line here, or a plug-in."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from armdesign import plugins
from armdesign._types import Array
from armdesign.errors import SearchError, SettingsError
from armdesign.swarm import checks
from armdesign.swarm.algorithm import Algorithm
from armdesign.swarm.checks import SavedState
from armdesign.swarm.multibasin import MultiBasin
from armdesign.swarm.pso import PSO, RAPSO
from armdesign.swarm.space import SearchSpace


@functools.cache
def algorithm_of_plugin(kind: Any, plugin: plugins.Plugin) -> type[Algorithm]:  # noqa: ANN401
    """A plug-in as a search algorithm: whatever goes wrong in it names its package.

    Args:
        kind: What the plug-in's entry point names.
        plugin: The plug-in.

    Raises:
        TypeError: It is none, or not a whole one.
    """
    if not (isinstance(kind, type) and issubclass(kind, Algorithm)):
        raise TypeError(f"{kind!r} is no class derived from armdesign.swarm.Algorithm")
    if inspect.isabstract(kind):
        raise TypeError(f"{kind.__name__} lacks {', '.join(sorted(kind.__abstractmethods__))}")

    class Checked(kind):  # type: ignore[misc]
        """The plug-in's class, whose answers are checked."""

        def _next(self) -> Array:
            drawn = super()._next()
            try:
                count = len(checks.numbers("the positions", drawn, (None, self.box.dimension)))
                inside: Array = self.box.checked(drawn, max(1, count))
            except SearchError as error:
                raise ValueError(f"_next gives what it may not: {error}") from error
            return inside

        def _take(self, *answers: Any) -> float:  # noqa: ANN401 (as the base has them)
            return float(super()._take(*answers))

        Parameters = plugin.guarded(kind.Parameters, ("__init__",))

    own = (name for name, member in vars(Algorithm).items() if inspect.getattr_static(Checked, name) is not member)
    Checked.__name__, Checked.__qualname__, Checked.__module__ = kind.__name__, kind.__qualname__, kind.__module__
    return plugin.guarded(Checked, own)


ALGORITHMS: Mapping[str, type[Algorithm]] = plugins.Plugged(
    {kind.name: kind for kind in (MultiBasin, RAPSO, PSO)}, plugins.ALGORITHMS, algorithm_of_plugin
)


def make_algorithm(
    name: str, space: SearchSpace, rng: np.random.Generator, settings: Mapping[str, Any] | None = None
) -> Algorithm:
    """Begin a search by the algorithm's name.

    Args:
        name: A key of :data:`ALGORITHMS`.
        space: Where to search.
        rng: Source of every draw.
        settings: Settings of a search by name; the algorithm takes its parameters from them, each with its default.

    Raises:
        SettingsError: There is no such algorithm, or a parameter is out of range.
    """
    kind = _kind(name)
    names = {field.name for field in fields(kind.Parameters)}
    given = {} if settings is None else {name: value for name, value in settings.items() if name in names}
    return kind(space, rng, kind.Parameters(**given))


def algorithm_from_state(
    state: Mapping[str, Any],
    space: SearchSpace,
    length: int | None = None,
    settings: Mapping[str, Any] | None = None,
) -> Algorithm:
    """The search, by whichever algorithm, that :meth:`Algorithm.state` described.

    Args:
        state: The state; arrays may come back as nested lists.
        space: The search space that it ran in.
        length: How long it shall go on, in its unit; by default as long as before.
        settings: Parameters by name, of which those that are changeable count; by default they stay, too.

    Raises:
        SettingsError: The algorithm or a parameter is unknown or out of range.
        SearchError: An entry is missing or does not fit.
    """
    return _kind(SavedState(state).entry("algorithm")).from_state(state, space, length, settings)


def _kind(name: object) -> type[Algorithm]:
    """The class of that name."""
    if not isinstance(name, str) or name not in ALGORITHMS:
        fix = "Install the package that has it, on every worker of a cluster, too"
        raise SettingsError(f"there is no search algorithm {name!r}", value=name, allowed=list(ALGORITHMS), fix=fix)
    return ALGORITHMS[name]
