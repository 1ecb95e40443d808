"""armdesign: turn a recorded human-arm demonstration into the robot arm that does the job.

result = armdesign.design("take.c3d", dof=4)                 # all in one call, or step by step:

recording = armdesign.read_recording("take.c3d")
settings = Settings(design=Design(dof=4), search=Search(budget=10_000))
problem = armdesign.prepare(recording, settings)
result = armdesign.search(problem)
armdesign.write_result("runs/take", result)                  # the run folder that the command line writes
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from armdesign._version import __version__

if TYPE_CHECKING:
    from armdesign.building.build import build
    from armdesign.building.build_options import BuildOptions
    from armdesign.building.room import room_for_motors
    from armdesign.building.tolerance import Tolerances, tolerance
    from armdesign.demonstration.convert import convert, write_conversion
    from armdesign.demonstration.cycles import find_cycles
    from armdesign.demonstration.files.hints import Hints
    from armdesign.demonstration.files.readers import read_recording
    from armdesign.demonstration.recording import Recording
    from armdesign.errors import ArmDesignError
    from armdesign.experiments.auto_dof.choose_dof import auto_dof
    from armdesign.experiments.compare.comparison import compare
    from armdesign.experiments.sweep.sweep_call import sweep
    from armdesign.export.export_files import export
    from armdesign.kinematics.dh import DHTable
    from armdesign.kinematics.dh_files import read_design
    from armdesign.kinematics.models import arm_model
    from armdesign.runs.alternatives import alternatives
    from armdesign.runs.checking import check
    from armdesign.runs.reading import read_result
    from armdesign.runs.writing import write_result
    from armdesign.search.design_arm import design
    from armdesign.search.design_problem import DesignProblem
    from armdesign.search.prepare import prepare
    from armdesign.search.result import Result, evaluate
    from armdesign.search.search import search
    from armdesign.settings.sections import Design, Fitness, Search, Settings, Solver, Task, read_settings
    from armdesign.views.writing import preview, report

_HOMES = {
    "ArmDesignError": "errors",
    "BuildOptions": "building.build_options",
    "DHTable": "kinematics.dh",
    "Design": "settings.sections",
    "DesignProblem": "search.design_problem",
    "Fitness": "settings.sections",
    "Hints": "demonstration.files.hints",
    "Recording": "demonstration.recording",
    "Result": "search.result",
    "Search": "settings.sections",
    "Settings": "settings.sections",
    "Solver": "settings.sections",
    "Task": "settings.sections",
    "Tolerances": "building.tolerance",
    "alternatives": "runs.alternatives",
    "arm_model": "kinematics.models",
    "auto_dof": "experiments.auto_dof.choose_dof",
    "build": "building.build",
    "check": "runs.checking",
    "compare": "experiments.compare.comparison",
    "convert": "demonstration.convert",
    "design": "search.design_arm",
    "evaluate": "search.result",
    "export": "export.export_files",
    "find_cycles": "demonstration.cycles",
    "prepare": "search.prepare",
    "preview": "views.writing",
    "read_design": "kinematics.dh_files",
    "read_recording": "demonstration.files.readers",
    "read_result": "runs.reading",
    "read_settings": "settings.sections",
    "report": "views.writing",
    "room_for_motors": "building.room",
    "search": "search.search",
    "sweep": "experiments.sweep.sweep_call",
    "tolerance": "building.tolerance",
    "write_conversion": "demonstration.convert",
    "write_result": "runs.writing",
}
"""The module of every public name; it is imported when the name is first used, so that the package loads at once."""

__all__ = [
    "ArmDesignError",
    "BuildOptions",
    "DHTable",
    "Design",
    "DesignProblem",
    "Fitness",
    "Hints",
    "Recording",
    "Result",
    "Search",
    "Settings",
    "Solver",
    "Task",
    "Tolerances",
    "__version__",
    "alternatives",
    "arm_model",
    "auto_dof",
    "build",
    "check",
    "compare",
    "convert",
    "design",
    "evaluate",
    "export",
    "find_cycles",
    "prepare",
    "preview",
    "read_design",
    "read_recording",
    "read_result",
    "read_settings",
    "report",
    "room_for_motors",
    "search",
    "sweep",
    "tolerance",
    "write_conversion",
    "write_result",
]


def __getattr__(name: str) -> Any:  # noqa: ANN401 (any public name)
    """Import a public name on its first use."""
    if name not in _HOMES:
        raise AttributeError(f"module 'armdesign' has no attribute '{name}'")
    globals()[name] = value = getattr(import_module(f"armdesign.{_HOMES[name]}"), name)
    return value


def __dir__() -> list[str]:
    return __all__
