"""Array types that every room uses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""An array of doubles; its shape and unit stand where it is used."""
