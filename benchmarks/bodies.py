"""What bodies, obstacles and a free base cost per candidate of a search, against the thin arm at the shoulder."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from plan import PACKAGING, Plan
from searches import searched
from tables import Row, Table

DOFS = (3, 6)
OBSTACLES = 10
REGION = "x=-0.3..0.3 y=-0.3..0.3 z=0.6..1.2"
"""About the shoulder of the packaging example."""


def tables(plan: Plan) -> Iterator[Table]:
    """One table: searches of the same budget with ever more in them."""
    budget = plan.pick({3: 6000, 6: 3000}, {3: 1500, 6: 600})
    with tempfile.TemporaryDirectory() as folder:
        cell = Path(folder) / "cell.toml"
        cell.write_text(obstacles(np.random.default_rng(0)), encoding="utf-8")
        cases: dict[str, dict[str, Any]] = {
            "thin": {"body": {"kind": "thin"}},
            "bodies": {"body": {"kind": "tube"}},
            "and obstacles": {"body": {"kind": "tube"}, "cell": {"obstacles": [str(cell)]}},
            "and a free base": {
                "body": {"kind": "tube"},
                "cell": {"obstacles": [str(cell)], "place": [REGION]},
            },
        }
        for sections in cases.values():  # compiles and loads everything
            searched(problem(3, {**sections, "search": {"budget": 100}}))
        rows: list[Row] = []
        for dof in DOFS:
            costs = plan.in_rounds(list(cases.values()), lambda sections, n=dof: cost(n, sections, budget[n]))
            best = [min(measured) for measured in costs]
            rows.append(
                {"n": dof}
                | {f"{name} us": us for name, us in zip(cases, best, strict=True)}
                | {"x thin": best[-1] / best[0]}
            )
    yield Table(
        "bodies",
        f"Microseconds per candidate of a search, {OBSTACLES} obstacles, packaging, one process "
        f"(best of {plan.repeats} rounds)",
        rows,
        ["x thin: the last column over the thin arm's; the aim is 2.5 at most."],
    )


def cost(dof: int, sections: dict[str, Any], budget: int) -> float:
    """Microseconds of evaluating per candidate."""
    done = searched(problem(dof, {**sections, "search": {"budget": budget}}))
    return 1e6 * done.evaluating / int(done.result.history.evaluations[-1])


def problem(dof: int, sections: dict[str, Any]) -> Any:
    """The packaging example, its base at rest."""
    return PACKAGING.problem(dof, **{**sections, "task": {"base_mode": "fixed"}})


def obstacles(rng: np.random.Generator) -> str:
    """Boxes, spheres and cylinders round about at 1 to 1.6 m, and a floor, as a cell file."""
    lines = ['[[plane]]\nname = "ground"\npoint = [0.0, 0.0, -0.2]\nnormal = [0.0, 0.0, 1.0]']
    for i in range(OBSTACLES - 1):
        angle = 2.0 * np.pi * i / (OBSTACLES - 1)
        far = rng.uniform(1.0, 1.6)
        centre = [round(float(v), 3) for v in (far * np.cos(angle), far * np.sin(angle), rng.uniform(0.5, 1.5))]
        kind = ("box", "sphere", "cylinder")[i % 3]
        size = {"box": "size = [0.3, 0.2, 0.4]", "sphere": "radius = 0.15", "cylinder": "radius = 0.05\nlength = 0.8"}
        lines.append(f'[[{kind}]]\nname = "{kind} {i}"\ncenter = {centre}\n{size[kind]}')
    return "\n\n".join(lines) + "\n"
