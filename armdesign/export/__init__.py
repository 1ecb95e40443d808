"""What leaves the package: robot files with solids, limits and the templates behind them, and trajectories.

As a function, ``armdesign.export(result, folder)`` is :func:`armdesign.export.export_files.export`.
"""

import sys

from armdesign._types import CallableRoom

MAIN = ("armdesign.export.export_files", "export")
sys.modules[__name__].__class__ = CallableRoom
