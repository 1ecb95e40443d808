"""The machine and the versions that the figures of a study depend on."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from armdesign._version import __version__
from armdesign.search.backends.processes import available_cores

PACKAGES = ("pin", "numpy", "scipy", "numba", "opytimizer", "cmaes", "matplotlib")


def about_machine() -> dict[str, str | int]:
    """Processor, cores and system."""
    return {
        "cpu": cpu_model(),
        "cores": available_cores(),
        "system": platform.platform(),
        "python": platform.python_version(),
    }


def versions() -> dict[str, str | None]:
    """Version of this package and of those it computes with; None where one is not installed."""
    found: dict[str, str | None] = {"armdesign": __version__}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = None
    return found


def cpu_model() -> str:
    """The processor's name."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.machine())
