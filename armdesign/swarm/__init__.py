"""Particle swarms that ask for fitness values and are told them; they know nothing of robots.

swarm = make_swarm("rapso", box, 400, np.random.default_rng(1))
for _ in range(200):
    X = swarm.ask()
    swarm.tell(*evaluate(X))  # fitness (N,) and validity (N,), by the caller's means

:class:`MultiBasin` is asked and told alike; it takes a budget of candidates instead of particles and iterations.
"""

from armdesign.swarm.base import History, Sampler, State, Swarm
from armdesign.swarm.effort import Effort, computational_effort, converged_at, measure_effort
from armdesign.swarm.multibasin import MultiBasin
from armdesign.swarm.pso import PSO
from armdesign.swarm.rapso import RAPSO
from armdesign.swarm.recipe import Recipe
from armdesign.swarm.region import Slab
from armdesign.swarm.registry import ALGORITHMS, make_swarm, swarm_from_state
from armdesign.swarm.space import Box

__all__ = [
    "ALGORITHMS",
    "PSO",
    "RAPSO",
    "Box",
    "Effort",
    "History",
    "MultiBasin",
    "Recipe",
    "Sampler",
    "Slab",
    "State",
    "Swarm",
    "computational_effort",
    "converged_at",
    "make_swarm",
    "measure_effort",
    "swarm_from_state",
]
