"""Sweeps: many searches, one for every combination of recording, algorithm, joints, angle interval D and seed.

A sweep is a folder of run folders with one table over them. Its units are whole searches that do not depend on each
other, so that worker processes here, or a cluster, carry them out in any order to the same folder.
"""

from armdesign.experiments.sweep.run_sweep import Plan, SweepStatus, run_sweep, run_units
from armdesign.experiments.sweep.run_table import RunTable
from armdesign.experiments.sweep.sweep_plan import Sweep, Unit, units_of
from armdesign.experiments.sweep.sweep_store import read_sweep
from armdesign.experiments.sweep.units import Outcome, UnitJob, carry_out_unit, contents, unit_worker

__all__ = [
    "Outcome",
    "Plan",
    "RunTable",
    "Sweep",
    "SweepStatus",
    "Unit",
    "UnitJob",
    "carry_out_unit",
    "contents",
    "read_sweep",
    "run_sweep",
    "run_units",
    "unit_worker",
    "units_of",
]
