"""armdesign: turn a recorded human-arm demonstration into the robot arm that does the job."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_HOMES = {
    "ArmDesignError": "armdesign.errors",
    "DHTable": "armdesign.kinematics.dh",
    "Study": "armdesign.settings",
    "arm_model": "armdesign.kinematics.models",
    "evaluate_design": "armdesign.evaluation",
    "prepare": "armdesign.study",
    "read_design": "armdesign.kinematics.dh_files",
    "read_recording": "armdesign.demonstration",
    "read_study": "armdesign.settings",
    "search": "armdesign.search",
    "write_search": "armdesign.runfolder",
}
__all__ = [
    "ArmDesignError",
    "DHTable",
    "Study",
    "__version__",
    "arm_model",
    "evaluate_design",
    "prepare",
    "read_design",
    "read_recording",
    "read_study",
    "search",
    "write_search",
]

if TYPE_CHECKING:
    from armdesign.demonstration import read_recording
    from armdesign.errors import ArmDesignError
    from armdesign.evaluation import evaluate_design
    from armdesign.kinematics.dh import DHTable
    from armdesign.kinematics.dh_files import read_design
    from armdesign.kinematics.models import arm_model
    from armdesign.runfolder import write_search
    from armdesign.search import search
    from armdesign.settings import Study, read_study
    from armdesign.study import prepare


def __getattr__(name: str) -> Any:  # noqa: ANN401 (any public name)
    """Load a public name from its home on first use, so that the import of the package stays quick."""
    if name not in _HOMES:
        raise AttributeError(f"module 'armdesign' has no attribute '{name}'")
    return getattr(import_module(_HOMES[name]), name)
