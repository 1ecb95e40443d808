"""Search algorithms that ask for fitness values and are told them; they know nothing of robots.

    space = SearchSpace(Box(lower, upper, angular))
    search = make_algorithm("rapso", space, np.random.default_rng(1), {"particles": 400, "iterations": 200})
    while not search.done:
        X = search.ask()
        search.tell(*evaluate(X))  # fitness (N,) and validity (N,), by the caller's means

To add an algorithm:

1. One file here with a class derived from :class:`Algorithm` (its abstract methods are all there is to write; PSO in
   `pso.py` is the shortest example) and a frozen dataclass of its parameters, named as its settings.
2. Its class in the one line of :data:`ALGORITHMS` in `registry.py`.
3. Its settings: entries of `Search` in `armdesign/settings/sections.py`, and their names in `ALGORITHM_SETTINGS` there.

The contract in `tests/swarm/test_swarm_contract.py` then runs over it, and every command offers it.
"""

from armdesign.swarm.algorithm import Algorithm, Effort, History, State
from armdesign.swarm.multibasin import MultiBasin
from armdesign.swarm.part import Part
from armdesign.swarm.pso import PSO, RAPSO
from armdesign.swarm.registry import ALGORITHMS, algorithm_from_state, make_algorithm
from armdesign.swarm.space import Box, Sampler, SearchSpace, Slab

__all__ = [
    "ALGORITHMS",
    "PSO",
    "RAPSO",
    "Algorithm",
    "Box",
    "Effort",
    "History",
    "MultiBasin",
    "Part",
    "Sampler",
    "SearchSpace",
    "Slab",
    "State",
    "algorithm_from_state",
    "make_algorithm",
]
