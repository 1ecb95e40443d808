"""The paper's studies, done over on any demonstration: each a sweep, with tables and a figure.

Temporal fitness by many solvers, robot fitness by many searches, RA-PSO against PSO, and designs over the number of
joints. See ``plan`` for what a study is asked and ``registry`` for which there are.
"""

from armdesign.experiments.studies.study_engine import Finding, run_study
from armdesign.experiments.studies.study_plan import Asked, Defaults, Record, search_unit, task_name, work_unit
from armdesign.experiments.studies.study_registry import STUDIES, study_module
from armdesign.experiments.studies.study_tables import Column, Spread, Table, spread_of

__all__ = [
    "STUDIES",
    "Asked",
    "Column",
    "Defaults",
    "Finding",
    "Record",
    "Spread",
    "Table",
    "run_study",
    "search_unit",
    "spread_of",
    "study_module",
    "task_name",
    "work_unit",
]
