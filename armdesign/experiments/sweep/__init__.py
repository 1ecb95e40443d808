"""Sweeps: many searches, one for every combination of recording, algorithm, joints, angle interval D and seed.

A sweep is a folder of run folders with one table over them. Its units are whole searches that do not depend on each
other, so that a crew of worker processes here, or a cluster, carries them out in any order to the same folder.
"""

from armdesign.experiments.sweep.futures_workers import FuturesCrew
from armdesign.experiments.sweep.local_workers import LocalCrew
from armdesign.experiments.sweep.run_sweep import Standing, run_sweep, run_units
from armdesign.experiments.sweep.sweep_plan import Sweep, Unit, units_of
from armdesign.experiments.sweep.sweep_store import read_sweep
from armdesign.experiments.sweep.units import Outcome, carry_out_elsewhere, carry_out_unit, contents
from armdesign.experiments.sweep.work_table import Ledger
from armdesign.experiments.sweep.workers import Crew, News

__all__ = [
    "Crew",
    "FuturesCrew",
    "Ledger",
    "LocalCrew",
    "News",
    "Outcome",
    "Standing",
    "Sweep",
    "Unit",
    "carry_out_elsewhere",
    "carry_out_unit",
    "contents",
    "read_sweep",
    "run_sweep",
    "run_units",
    "units_of",
]
