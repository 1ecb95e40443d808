"""Measure the speed of armdesign: per step, frame, candidate and search, scaling, memory, starts, two yardsticks.

``python benchmarks/run.py [--quick] [--only NAME ...] [--out FILE.json] [--recordings DIR] [--before COMMAND]``
prints tables and writes the same figures as JSON. Run it on a quiet machine; ratios carry over between machines,
absolute times do not.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator
from pathlib import Path

import before
import bodies
import inner_loop
import memory
import searches
import simulated
import sizes
import starts
import workers
import yardsticks
from machine import disturbance, machine, moment
from plan import Plan, make_plan
from tables import Table

MEASUREMENTS: dict[str, Callable[[Plan], Iterator[Table]]] = {
    "steps": inner_loop.tables,
    "search": searches.tables,
    "before": before.tables,
    "workers": workers.tables,
    "simulated": simulated.tables,
    "sizes": sizes.tables,
    "bodies": bodies.tables,
    "memory": memory.tables,
    "starts": starts.tables,
    "paths": starts.path_tables,
    "plain": yardsticks.plain_tables,
    "pso": yardsticks.swarm_tables,
}


def main() -> None:
    """Measure, print and optionally write as JSON."""
    arguments = parse()
    plan = make_plan(arguments.quick, arguments.recordings, arguments.before)
    report = {"machine": machine(), "quick": plan.quick, "notes": list(plan.notes), "tables": {}}
    print(", ".join(f"{name} {value}" for name, value in report["machine"].items()))
    for note in plan.notes:
        print(note)
    for name in arguments.only or MEASUREMENTS:
        began = moment()
        for table in MEASUREMENTS[name](plan):
            print(f"\n{table.text()}", flush=True)
            report["tables"][table.name] = {"title": table.title, "rows": table.rows, "notes": table.notes}
        told = disturbance(began)
        print(told, flush=True)
        report["tables"][table.name]["disturbance"] = told
        if arguments.out is not None:  # after every table, so that a run broken off leaves what it has
            arguments.out.write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")


def parse() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="less of everything: a few minutes, rougher figures")
    parser.add_argument("--only", nargs="+", choices=list(MEASUREMENTS), metavar="NAME",
                        help=f"measure these alone: {', '.join(MEASUREMENTS)}")  # fmt: skip
    parser.add_argument("--out", type=Path, help="write the figures as JSON")
    parser.add_argument("--recordings", type=Path, help="folder with box_lift.csv and handover_giver.csv")
    parser.add_argument(
        "--before", type=Path, metavar="COMMAND", help="armdesign of an earlier installation to compare"
    )
    return parser.parse_args()


if __name__ == "__main__":
    main()
