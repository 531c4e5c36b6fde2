"""Array types: the type of arrays of real numbers in signatures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.float64]
