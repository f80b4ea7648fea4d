"""Array types: float64, int64, int32, int8, bool and uint8, of any shape.

Docstrings give the shape and the unit where an array is used: `(K, 2)` mm.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Indices = npt.NDArray[np.int32]
Codes = npt.NDArray[np.int8]
Bools = npt.NDArray[np.bool_]
Octets = npt.NDArray[np.uint8]
