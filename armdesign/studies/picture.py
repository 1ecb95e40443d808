"""A Matplotlib figure as PNG, in the look of the reports."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from armdesign.report.drawing import STYLE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOTS_PER_INCH = 150


def png(build: Callable[[], Figure]) -> bytes:
    """A figure as PNG, apart from whatever settings of Matplotlib are in force.

    Args:
        build: Makes the figure, within the settings of the reports.
    """
    import matplotlib as mpl  # noqa: PLC0415 (slow to load)

    content = io.BytesIO()
    with mpl.rc_context(), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")
        mpl.rcdefaults()
        parameters: Any = mpl.rcParams
        parameters.update(STYLE)
        build().savefig(content, format="png", dpi=DOTS_PER_INCH, metadata={"Software": None})
    return content.getvalue()
