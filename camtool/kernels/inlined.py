"""How numba compiles our kernels: with what they need, and each line of them once.

numba would optimise a function that only kernels call, make machine code of it and hold that
ready, and do the first again in every kernel that takes it in. Here it is left as it is written
until then, and no such function is kept on disk, being part of its kernels there.

Left out besides: steps of numba's for what no kernel does (closures, comprehensions, `with`,
expressions of whole arrays), and the counting of who uses an array where a function neither makes
one nor gives one back: it works on arrays of its callers, which live longer than the call.
"""

from __future__ import annotations

from typing import Any, cast

from numba.core import compiler, compiler_machinery, typed_passes, types, untyped_passes
from numba.core.codegen import JITCodeLibrary

# numba's classes, whose types it does not tell.
COMPILER: Any = compiler.CompilerBase
LIBRARY: Any = JITCodeLibrary
PASS: Any = typed_passes.NativeLowering
register: Any = compiler_machinery.register_pass

SIMPLE = (
    types.Number,
    types.Boolean,
    types.NoneType,
    types.SliceType,
    types.RangeType,
    types.RangeIteratorType,
    types.UniTupleIter,
)
"""Values that hold no memory."""

VIEWS = ("getitem", "static_getitem")
"""What makes a part of an array without memory of its own, when the index is of numbers."""


class Library(cast(Any, LIBRARY)):  # type: ignore[misc]
    """The code of a kernel."""

    def _optimize_functions(self, module: Any) -> None:
        # Lightly: the whole is optimised again, once all is there.
        module.data_layout = self._codegen._data_layout
        for function in module.functions:
            if not function.is_declaration:
                manager, builder = self._codegen._function_pass_manager(opt=1)
                manager.run(function, builder)


class NoMachineCode:
    """Stands for the generator of machine code, which has none of an inlined function."""

    def set_env(self, name: str, environment: Any) -> None:
        """Python's objects of a function: compiled functions do not come to them."""


class Inlined(Library):
    """The code of a function that others take in, in LLVM's language alone."""

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


@register(mutates_CFG=True, analysis_only=False)
class InlinedLowering(cast(Any, PASS)):  # type: ignore[misc]
    """From numba's language to LLVM's, without counts of arrays where none is needed."""

    _name = "camtool_inlined_lowering"

    def run_pass(self, state: Any) -> bool:
        """The step of numba's, for one function."""
        if _borrows(state):
            state.targetctx = state.targetctx.subtarget(enable_nrt=False)
            vars(state.targetctx).pop("nrt", None)
        return bool(super().run_pass(state))


class KernelCompiler(cast(Any, COMPILER)):  # type: ignore[misc]
    """numba's way of compiling, for what Python calls."""

    library: Any = Library
    lowering: Any = typed_passes.NativeLowering

    def define_pipelines(self) -> list[Any]:
        """The steps of compiling."""
        steps = (
            untyped_passes.TranslateByteCode,
            untyped_passes.FixupArgs,
            untyped_passes.IRProcessing,
            untyped_passes.GenericRewrites,
            untyped_passes.ReconstructSSA,
            typed_passes.NopythonTypeInference,
            typed_passes.PreLowerStripPhis,
            typed_passes.NoPythonSupportedFeatureValidation,
            typed_passes.IRLegalization,
            typed_passes.AnnotateTypes,
            self.lowering,
            typed_passes.NoPythonBackend,
        )
        manager = cast(Any, compiler_machinery.PassManager)("kernel")
        for step in steps:
            manager.add_pass(step, step.__name__)
        manager.finalize()
        return [manager]

    def _compile_core(self) -> Any:
        remember_types(self.state.typingctx)
        codegen = self.state.targetctx.codegen()
        self.state.library = self.library(codegen, self.state.func_id.func_qualname)
        self.state.library.enable_object_caching()
        return super()._compile_core()


class InlinedCompiler(KernelCompiler):
    """The same for what only kernels call."""

    library = Inlined
    lowering = InlinedLowering


def remember_types(context: Any) -> None:
    """Let numba work out once only which type an operator or a function has for given numbers."""
    if "resolve_function_type" in vars(context):
        return
    known: dict[tuple[Any, tuple[Any, ...]], Any] = {}
    resolve = context.resolve_function_type

    def resolve_once(function: Any, arguments: Any, named: Any) -> Any:
        numbers = all(isinstance(kind, types.Number | types.Boolean) for kind in arguments)
        if named or not numbers or not isinstance(function, types.Function):
            return resolve(function, arguments, named)
        key = function, tuple(arguments)
        if known.get(key) is None:
            known[key] = resolve(function, arguments, named)
        return known[key]

    context.resolve_function_type = resolve_once


def _borrows(state: Any) -> bool:
    """Whether all arrays of a function are its caller's: no call in it gives one, nor does it."""
    if _holds(state.return_type):
        return False
    for expression, signature in state.calltypes.items():
        if signature is None or not _holds(signature.return_type):
            continue
        view = getattr(expression, "op", None) in VIEWS
        if not view or any(_is_array(kind) for kind in signature.args[1:]):
            return False
    return True


def _holds(kind: Any) -> bool:
    """Whether values of this type may hold memory."""
    if isinstance(kind, types.BaseTuple):
        return any(_holds(part) for part in cast(Any, kind))
    if isinstance(kind, types.Pair):
        return _holds(kind.first_type) or _holds(kind.second_type)
    return not isinstance(kind, SIMPLE)


def _is_array(kind: Any) -> bool:
    parts = tuple(cast(Any, kind)) if isinstance(kind, types.BaseTuple) else (kind,)
    return any(isinstance(part, types.Array) for part in parts)
