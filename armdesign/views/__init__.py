"""What people look at: the preview and the report.

Its modules are imported on their first use as ``views.writing``, ``views.preview`` or ``views.report``: Matplotlib,
MeshCat and what they bring take a second, which the help of a command does not need.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from armdesign.views import preview, report, writing

__all__ = ["preview", "report", "writing"]


def __getattr__(name: str) -> Any:  # noqa: ANN401 (a module)
    """Import a module of this room on its first use."""
    if name not in __all__:
        raise AttributeError(f"module 'armdesign.views' has no attribute '{name}'")
    return import_module(f"armdesign.views.{name}")
