"""Loops of which the processor runs several turns at once, and what they need.

Compilers leave a loop for the least or the largest number narrow, since numbers that are none
(NaN) and the sign of 0 would come out otherwise. `smaller` and `larger` promise that there are
none, and `wide` that sums may be taken in any order. Indices should run from 0 to the length of
an array, which needs no look at their signs.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import numpy as np
import numpy.typing as npt
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from camtool.kernels.compiled import loose_bare

Floats = npt.NDArray[np.float64]

wide = loose_bare("nnan", "nsz", "reassoc")
"""As `camtool.kernels.compiled.bare`, for loops over errors: sums may be taken in any order."""


def _of_two(name: str) -> Callable[[float, float], float]:
    """The compiler's instruction `name` of two float64."""

    def typed(typing_context: Any, a: Any, b: Any) -> tuple[Any, Callable[..., Any]]:
        return types.float64(types.float64, types.float64), emit

    def emit(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kind = args[0].type
        made = ir.FunctionType(kind, [kind, kind])
        function = builder.module.declare_intrinsic(name, [kind], fnty=made)
        return builder.call(function, args, fastmath=("nnan", "nsz"))

    return cast(Callable[[float, float], float], intrinsic(typed))


smaller = _of_two("llvm.minnum")
"""The smaller of two float64, neither of which is NaN."""

larger = _of_two("llvm.maxnum")
"""The larger of two float64, neither of which is NaN."""


@wide
def first_of(values: Floats, value: float) -> int:
    """The first place of `value` in `values` (n,), or n: without an early end, but wide."""
    count = len(values)
    place = count
    for k in range(len(values)):
        place = min(place, k if values[k] == value else count)
    return place
