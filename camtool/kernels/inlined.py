"""How numba compiles a function that only other compiled functions call: for them to take in.

numba would optimise it, make machine code of it and hold that ready, and do the first again in
every kernel that takes it in. Here it is left as it is written until then: a kernel is optimised
once, with all that it calls. No such function is kept on disk, being part of its kernels there.
"""

from __future__ import annotations

from typing import Any, cast

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler

LIBRARY: Any = JITCodeLibrary
COMPILER: Any = Compiler


class NoMachineCode:
    """Stands for the generator of machine code, which has none of an inlined function."""

    def set_env(self, name: str, environment: Any) -> None:
        """Python's objects of a function: compiled functions do not come to them."""


class Inlined(cast(Any, LIBRARY)):  # type: ignore[misc]
    """The code of a function, in LLVM's language alone."""

    @property
    def codegen(self) -> NoMachineCode:
        """Nothing that would look for the machine code."""
        return NoMachineCode()

    def get_pointer_to_function(self, name: str) -> int:
        """0: it is nowhere in memory."""
        self._ensure_finalized()
        return 0

    def _optimize_final_module(self) -> None:
        """Whoever takes this in optimises it."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


class InlinedCompiler(cast(Any, COMPILER)):  # type: ignore[misc]
    """numba's way of compiling, into such code."""

    def _compile_core(self) -> Any:
        codegen = self.state.targetctx.codegen()
        self.state.library = Inlined(codegen, self.state.func_id.func_qualname)
        return super()._compile_core()
