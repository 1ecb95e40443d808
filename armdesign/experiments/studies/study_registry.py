"""The studies by name. A study is a module with the functions of ``StudyModule``, loaded when it is asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any, Protocol, cast

from armdesign.errors import SettingsError
from armdesign.experiments.sweep.jobs import Reporter
from armdesign.experiments.sweep.sweep_plan import Tasks, Unit
from armdesign.search.design_problem import DesignProblem

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from armdesign.experiments.studies.study_plan import Defaults, Record, StudyRequest
    from armdesign.experiments.studies.study_tables import Table

STUDIES = ("temporal", "robot", "rapso", "designs", "search")


class StudyModule(Protocol):
    """What a study's module offers.

    It may also have ``more(request, records, folder) -> tuple[str, ...]``, which writes further files into the study's
    folder and returns their names, and ``warm_up(prepared)``, which compiles what its works need beside the evaluator's
    kernels.
    """

    def defaults(self, quick: bool) -> Defaults:
        """What it runs with where nothing is asked for."""
        ...

    def plan(self, request: StudyRequest, tasks: Tasks) -> list[Unit]:
        """Its units; names are unique and do not depend on how many repetitions there are.

        Raises:
            SettingsError: An option cannot be.
        """
        ...

    def tables(self, request: StudyRequest, records: Sequence[Record]) -> list[Table]:
        """What came of it; records of units that failed or have yet to run have no content."""
        ...

    def figure(self, request: StudyRequest, records: Sequence[Record]) -> Figure:
        """The results as a picture."""
        ...

    def perform(self, problem: DesignProblem, work: Mapping[str, Any], reporter: Reporter) -> dict[str, Any]:
        """Do the work of a unit that is no search; returns JSON values. Only where the plan has such."""
        ...


def study_module(name: str) -> StudyModule:
    """The module of a study.

    Raises:
        SettingsError: There is no such study.
    """
    if name not in STUDIES:
        raise SettingsError(f"there is no study '{name}'", value=name, allowed=list(STUDIES))
    return cast(StudyModule, import_module(f"armdesign.experiments.studies.{name}_study"))


def perform(problem: DesignProblem, work: Mapping[str, Any], reporter: Reporter) -> dict[str, Any]:
    """Do the work of a unit that is no search, by the study that it names."""
    return study_module(work["study"]).perform(problem, work, reporter)


def warm_up(name: str, tasks: Tasks) -> None:
    """Compile what the works of a study need, once for all processes."""
    compile_more = getattr(study_module(name), "warm_up", None)
    if compile_more is not None:
        compile_more(next(iter(tasks.values())))
