"""Compiled functions that only compiled ones call.

What numba makes besides, to call a function from Python and from C, takes a good part of the time
of compiling; functions that nobody calls from there go without.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

Function = TypeVar("Function", bound=Callable[..., Any])


def inner(function: Function) -> Function:
    """Compile a function for the use of compiled ones; Python cannot call it."""
    options = {"cache": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return cast(Function, cast(Any, njit)(**options)(function))
