"""The metaheuristics of opytimizer, the package the paper used, on any objective, with a budget that holds.

What had to be done for a version of each that works (opytimizer 3.1; later ones freeze their iteration counter):

* All: `Opytimizer.start` logs every iteration to a file in the working folder and draws a progress bar; its loop is
  written out here instead. A run ends when an objective of our own has counted the budget, since the generations of
  ABC differ in size. Random numbers come from NumPy's global generator, the only one opytimizer draws from: it is
  seeded for the run and put back as it was, and a process carries out one run at a time.
* GA, ES, ABC, SA evaluate within their update, and `start` evaluates every agent once more behind it, half of the
  budget and more for values that are known. That second evaluation is left out.
* SA starts at the temperature 100 and ends at 82 after 200 iterations, whatever the objective's scale: at lengths in
  metres it accepts every move, a random walk. Here (``sa``) it starts at a given temperature and ends at a thousandth
  of it; ``sa-default`` is as opytimizer has it.
* GA mutates by N(0, 1), SA moves by N(0, 0.1) and ABC's scouts by U(-1, 1), whatever the ranges of the variables.
  That suits angles in radians; the caller scales variables with other ranges to the same width.
* WOA divides by the number of iterations less one and follows new random agents instead of present ones; ES keeps its
  step sizes by place, not by agent, when it sorts; ABC's onlookers prefer the worse sources. These run as they are.
"""

from __future__ import annotations

import copy
import logging
import math
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import version
from typing import Any

import numpy as np

from armdesign._types import Array
from armdesign.errors import MissingExtraError, SettingsError

Objective = Callable[[Array], float]
Prefetch = Callable[[Array], Array]

ALGORITHMS = ("ga", "pso", "woa", "es", "abc", "sa", "sa-default")
HOMES = {"ga": "evolutionary", "es": "evolutionary", "pso": "swarm", "woa": "swarm", "abc": "swarm", "sa": "science"}
IN_UPDATE = ("ga", "es", "abc", "sa", "sa-default")
"""Those that evaluate their agents while they move them."""
SHARE = {"ga": 0.75, "es": 0.5, "abc": 2.0}
"""Evaluations in an iteration per agent, at least; 1 for the others."""
COOLED = 1e-3
FEWEST_GENERATIONS = 4
"""Generations a budget has to pay for: the first, and one iteration of the hungriest, ABC."""
TURN = threading.Lock()
"""Held by the one run of a process that draws from NumPy's global generator."""


class BudgetSpentError(Exception):
    """The budget is spent: the way out of opytimizer's loop."""


@dataclass(frozen=True, eq=False)
class Minimum:
    """What a run has found."""

    x: Array  # the best position, shape (D,)
    value: float  # the objective there
    evaluations: int  # evaluations spent


class CountedObjective:
    """The objective, counted, with the best so far; values fetched in advance count when they are asked for."""

    def __init__(self, objective: Objective, budget: int, on_evaluation: Callable[[int, float], None] | None) -> None:
        """Nothing spent yet."""
        self.objective, self.budget, self.on_evaluation = objective, budget, on_evaluation
        self.spent, self.value, self.x = 0, math.inf, np.zeros(0)
        self.known: dict[bytes, float] = {}

    def __call__(self, position: Array) -> float:
        """The value at a position, shape (D, 1).

        Raises:
            BudgetSpentError: There is nothing left to spend.
        """
        if self.spent >= self.budget:
            raise BudgetSpentError
        x = np.array(position, dtype=float).ravel()
        value = self.known.pop(x.tobytes(), None)
        value = float(self.objective(x)) if value is None else value
        self.spent += 1
        if value < self.value:
            self.value, self.x = value, x
        if self.on_evaluation is not None:
            self.on_evaluation(self.spent, self.value)
        return value


def check_opytimizer() -> None:
    """See that there is an opytimizer that works.

    Raises:
        MissingExtraError: There is none, or one whose iteration counter does not count.
    """
    fix = "Run: pip install 'armdesign[bench]'"
    try:
        import opytimizer  # noqa: F401, PLC0415 (an extra)
    except ImportError as error:
        message = "the metaheuristics of this study need opytimizer, which is not installed"
        raise MissingExtraError(message, fix=fix) from error
    found = version("opytimizer")
    if int(found.split(".")[0]) > 3:
        message = f"opytimizer {found} does not count its iterations, which freezes the schedules of WOA"
        raise MissingExtraError(message, value=found, allowed="opytimizer 3.1", fix=fix)


def check_budget(budget: int, agents: int, fix: str | None = None) -> None:
    """Refuse a budget in which some algorithm does not finish an iteration.

    Args:
        budget: Number of evaluations.
        agents: Number of agents.
        fix: How to get a larger one.

    Raises:
        SettingsError: It is too small.
    """
    least = FEWEST_GENERATIONS * agents
    if budget < least:
        raise SettingsError(
            f"a budget of {budget} evaluations is too small for one iteration of {agents} agents",
            value=budget,
            allowed=f"{least} or more, which pays for the first generation and an iteration of ABC, the hungriest",
            fix=fix,
        )


def minimise(
    name: str,
    objective: Objective,
    lower: Array,
    upper: Array,
    *,
    budget: int,
    agents: int,
    seed: int,
    temperature: float,
    first: Array | None = None,
    prefetch: Prefetch | None = None,
    on_evaluation: Callable[[int, float], None] | None = None,
) -> Minimum:
    """Minimise an objective over a box by one of the algorithms.

    Args:
        name: One of ``ALGORITHMS``.
        objective: Value at a position, shape (D,); finite.
        lower: Lower bounds, shape (D,).
        upper: Upper bounds, shape (D,).
        budget: Number of evaluations; all of them are spent.
        agents: Number of agents.
        seed: Seed, below 2^32.
        temperature: Temperature SA starts at, of the size of differences between good positions.
        first: First positions, shape (agents, D); default uniform in the box.
        prefetch: Values at many positions at once, where that is quicker; changes nothing but the time.
        on_evaluation: Called with the number of evaluations and the best value after each; may raise to end it all.

    Raises:
        SettingsError: The budget is too small.
    """
    check_budget(budget, agents)
    counted = CountedObjective(objective, budget, on_evaluation)
    with global_generator(seed):
        space = make_space(agents, lower, upper, first)
        iterations = math.ceil((budget - agents) / (SHARE.get(name, 1.0) * agents))
        optimizer = make_optimizer(name, iterations, temperature)
        with suppress(BudgetSpentError):
            loop(name, optimizer, space, counted, iterations, prefetch)
    return Minimum(counted.x, counted.value, counted.spent)


def loop(
    name: str,
    optimizer: Any,  # noqa: ANN401 (opytimizer has no types)
    space: Any,  # noqa: ANN401
    counted: CountedObjective,
    iterations: int,
    prefetch: Prefetch | None,
) -> None:
    """What `Opytimizer.start` does, without what goes wrong there.

    Raises:
        BudgetSpentError: As soon as the budget is spent.
    """
    optimizer.compile(space)
    fetch(counted, prefetch, [agent.position for agent in space.agents])
    optimizer.evaluate(space, counted)
    for iteration in range(iterations):
        if name in IN_UPDATE:
            fetch(counted, prefetch, rehearsed(optimizer, space) if prefetch is not None else [])
            optimizer.update(space, counted)
            space.clip_by_bound()
            continue
        optimizer.update(space, *((iteration, iterations) if name == "woa" else ()))
        space.clip_by_bound()
        fetch(counted, prefetch, [agent.position for agent in space.agents])
        optimizer.evaluate(space, counted)


def fetch(counted: CountedObjective, prefetch: Prefetch | None, positions: Sequence[Array]) -> None:
    """Have positions that are about to be evaluated evaluated together, as far as the budget goes."""
    if prefetch is None or not positions:
        return
    X = np.array([np.ravel(position) for position in positions[: counted.budget - counted.spent]])
    if len(X):
        counted.known = {x.tobytes(): float(value) for x, value in zip(X, prefetch(X), strict=True)}


def rehearsed(optimizer: Any, space: Any) -> list[Array]:  # noqa: ANN401
    """The positions an update is going to evaluate, as far as they do not depend on the values found on the way."""
    positions: list[Array] = []

    def note(position: Array) -> float:
        positions.append(np.array(position))
        return 1e300

    state = np.random.get_state()  # noqa: NPY002 (opytimizer draws from it)
    copy.deepcopy(optimizer).update(copy.deepcopy(space), note)
    np.random.set_state(state)  # noqa: NPY002
    return positions


def make_space(agents: int, lower: Array, upper: Array, first: Array | None) -> Any:  # noqa: ANN401
    """Agents in a box."""
    quiet()
    from opytimizer.spaces import SearchSpace  # noqa: PLC0415

    space = SearchSpace(agents, len(lower), lower.tolist(), upper.tolist())
    for agent, x in zip(space.agents, () if first is None else first, strict=first is not None):
        agent.position = np.array(x, dtype=float)[:, None]
    return space


def make_optimizer(name: str, iterations: int, temperature: float) -> Any:  # noqa: ANN401
    """An optimizer with opytimizer's defaults, SA's temperature aside."""
    quiet()
    kind = name.partition("-")[0]
    module = import_module(f"opytimizer.optimizers.{HOMES[kind]}")
    params = {"T": temperature, "beta": COOLED ** (1.0 / iterations)} if name == "sa" else None
    return getattr(module, kind.upper())(params)


def quiet() -> None:
    """Load opytimizer, and keep it from writing to the screen and to a file in the working folder."""
    before = logging.getLoggerClass()
    for name in ("spaces", *(f"optimizers.{home}" for home in HOMES.values())):
        import_module(f"opytimizer.{name}")
    logging.setLoggerClass(before)
    for name, logger in logging.root.manager.loggerDict.items():
        if name.partition(".")[0] == "opytimizer" and isinstance(logger, logging.Logger):
            logger.disabled = True


@contextmanager
def global_generator(seed: int) -> Iterator[None]:
    """Seed NumPy's global generator, and put it back as it was behind the block."""
    with TURN:
        state = np.random.get_state()  # noqa: NPY002
        np.random.seed(seed)  # noqa: NPY002
        try:
            yield
        finally:
            np.random.set_state(state)  # noqa: NPY002
