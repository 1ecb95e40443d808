"""armdesign: turn a recorded human-arm demonstration into the robot arm that does the job."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from armdesign._version import __version__

_HOMES = {
    "ArmDesignError": ("armdesign.errors", "ArmDesignError"),
    "DHTable": ("armdesign.kinematics.dh", "DHTable"),
    "Settings": ("armdesign.settings.sections", "Settings"),
    "arm_model": ("armdesign.kinematics.models", "arm_model"),
    "evaluate_design": ("armdesign.search.evaluation", "evaluate_design"),
    "prepare": ("armdesign.search.prepare", "prepare"),
    "read_design": ("armdesign.kinematics.dh_files", "read_design"),
    "read_recording": ("armdesign.demonstration", "read_recording"),
    "read_settings": ("armdesign.settings.sections", "read_settings"),
    "search_arm": ("armdesign.search.search", "search"),
    "write_result": ("armdesign.runs.writing", "write_result"),
}
__all__ = [
    "ArmDesignError",
    "DHTable",
    "Settings",
    "__version__",
    "arm_model",
    "evaluate_design",
    "prepare",
    "read_design",
    "read_recording",
    "read_settings",
    "search_arm",
    "write_result",
]

if TYPE_CHECKING:
    from armdesign.demonstration import read_recording
    from armdesign.errors import ArmDesignError
    from armdesign.kinematics.dh import DHTable
    from armdesign.kinematics.dh_files import read_design
    from armdesign.kinematics.models import arm_model
    from armdesign.runs.writing import write_result
    from armdesign.search.evaluation import evaluate_design
    from armdesign.search.prepare import prepare
    from armdesign.search.search import search as search_arm
    from armdesign.settings.sections import Settings, read_settings


def __getattr__(name: str) -> Any:  # noqa: ANN401 (any public name)
    """Load a public name from its home on first use, so that the import of the package stays quick."""
    if name not in _HOMES:
        raise AttributeError(f"module 'armdesign' has no attribute '{name}'")
    module, attribute = _HOMES[name]
    return getattr(import_module(module), attribute)
