"""The paper's studies, done over on any demonstration: each a sweep, with tables and a figure.

Temporal fitness by many solvers, robot fitness by many searches, RA-PSO against PSO, and designs over the number of
joints. ``study_plan`` holds what a study shall do, ``study_registry`` which studies there are.
"""

from armdesign.experiments.studies.study_engine import StudyResult, run_study
from armdesign.experiments.studies.study_plan import Defaults, Record, StudyRequest, search_unit, task_name, work_unit
from armdesign.experiments.studies.study_registry import STUDIES, study_module
from armdesign.experiments.studies.study_tables import Column, Spread, Table, spread_of

__all__ = [
    "STUDIES",
    "Column",
    "Defaults",
    "Record",
    "Spread",
    "StudyRequest",
    "StudyResult",
    "Table",
    "run_study",
    "search_unit",
    "spread_of",
    "study_module",
    "task_name",
    "work_unit",
]
