"""Sweeps: many searches, one for every combination of recording, algorithm, joints, angle interval D and seed.

A sweep is a folder of run folders with one table over them. Its units are whole searches that do not depend on each
other, so that a crew of worker processes here, or a cluster, carries them out in any order to the same folder.
"""

from armdesign.sweep.conduct import Standing, run_sweep, run_units
from armdesign.sweep.crew import Crew, News
from armdesign.sweep.futures_crew import FuturesCrew
from armdesign.sweep.ledger import Ledger
from armdesign.sweep.local_crew import LocalCrew
from armdesign.sweep.plan import Sweep, Unit, units_of
from armdesign.sweep.store import read_sweep
from armdesign.sweep.units import Outcome, carry_out_elsewhere, carry_out_unit, contents

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
