"""Functions that numba compiles when they are first called, and not before.

    @kernel   a loop that Python calls
    @inner    what only compiled functions call: it is compiled as a part of those alone
              (`camtool.kernels.inlined`)
    @bare     the same, where arrays are neither made nor returned: nobody counts who holds
              those that it is given. Counting takes a locked instruction for each slice and
              each array of a tuple, a third of the time of loops over some hundred numbers

numba itself is loaded with the first call. What it compiled is kept on disk, and a later run loads
it without the hundred modules with which numba compiles (a third of a second). A number written
into a call of another kernel is an int or a float like any other: numba alone would compile that
kernel once more for each such number. A division by zero gives inf or NaN, as in numpy.
"""

from __future__ import annotations

import functools
import gc
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar, cast

Function = TypeVar("Function", bound=Callable[..., Any])


OWN_COMPILERS_FOR = ("0.68.",)
"""The versions of numba that `camtool.kernels.inlined` knows the inside of; with others kernels
are compiled numba's own way, which takes longer and gives the same."""


def own_compilers() -> bool:
    """Whether the installed numba is one that we know the inside of."""
    import numba

    return str(numba.__version__).startswith(OWN_COMPILERS_FOR)


class Kernel:
    """Stands for a function until it is called, and then for what numba made of it."""

    def __init__(
        self,
        function: Callable[..., Any],
        *,
        inside: bool,
        loose: frozenset[str] = frozenset(),
        bare: bool = False,
    ) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self.inside = inside
        self.loose = loose
        self.bare = bare

    def __call__(self, *arguments: Any) -> Any:
        """Run what was compiled; compile first when it was not."""
        return self.entry(*arguments)

    @functools.cached_property
    def entry(self) -> Any:
        """numba's form of the function for Python; of inner ones it is for tests, and not kept."""
        return self._made(no_cpython_wrapper=False) if self.inside else self.dispatcher

    @functools.cached_property
    def dispatcher(self) -> Any:
        """numba's form of the function for other kernels; what Python calls is kept on disk."""
        options: dict[str, Any] = {"no_cpython_wrapper": self.inside}
        if own_compilers():
            from camtool.kernels.inlined import InlinedCompiler, KernelCompiler

            options["pipeline_class"] = InlinedCompiler if self.inside else KernelCompiler
        made = self._made(**options)
        if not self.inside:
            made._cache = _kept(self.py_func)
        return made

    @property
    def _numba_type_(self) -> Any:
        """What numba takes this for where a kernel calls it."""
        return self.dispatcher._numba_type_

    def _made(self, **options: Any) -> Any:
        import numba

        # Options of numba's that its own types do not know.
        njit: Any = numba.njit
        loose = set(self.loose) or False
        if self.bare:
            options["_nrt"] = False
        make = njit(error_model="numpy", no_cfunc_wrapper=True, fastmath=loose, **options)
        return _plain(make(self.py_func))


def kernel(function: Function) -> Function:
    """Compile a function that Python calls."""
    return cast(Function, Kernel(function, inside=False))


def inner(function: Function) -> Function:
    """Compile a function for the use of compiled ones."""
    return cast(Function, Kernel(function, inside=True))


def bare(function: Function) -> Function:
    """Compile a function for the use of compiled ones that makes no arrays, nor returns any."""
    return cast(Function, Kernel(function, inside=True, bare=True))


def loose_bare(*promises: str) -> Callable[[Function], Function]:
    """As `bare`, with promises about its numbers (LLVM's fast-math flags)."""

    def made(function: Function) -> Function:
        loose = frozenset(promises)
        return cast(Function, Kernel(function, inside=True, loose=loose, bare=True))

    return made


def _plain(made: Any) -> Any:
    """Literal arguments of a call in a kernel are taken for what they are besides, numbers."""
    from numba.core import types

    unliteral: Any = types.unliteral
    template = made.get_call_template

    def of_plain(arguments: Any, named: Any) -> Any:
        plain = {name: unliteral(kind) for name, kind in named.items()}
        return template(tuple(unliteral(kind) for kind in arguments), plain)

    made.get_call_template = of_plain
    return made


def _kept(function: Callable[..., Any]) -> Any:
    """numba's cache on disk; what is there is loaded without all that compiling needs, and what
    another process compiles now is waited for."""
    from numba.core.caching import FunctionCache
    from numba.core.runtime.nrt import rtsys

    class Kept(cast(Any, FunctionCache)):  # type: ignore[misc]
        turn = Turn()

        def load_overload(self, signature: Any, target: Any) -> Any:
            rtsys.initialize(target)
            found = self._found(signature, target)
            if found is None:
                self.turn.end()
                self._impl.locator.ensure_cache_path()
                self.turn = Turn(Path(self.cache_path) / f"{self._impl.filename_base}.lock")
                found = self._found(signature, target)
                if found is not None:
                    self.turn.end()
            return found

        def save_overload(self, signature: Any, made: Any) -> None:
            super().save_overload(signature, made)
            self.turn.end()

        def _found(self, signature: Any, target: Any) -> Any:
            with self._guard_against_spurious_io_errors():
                return self._load_overload(signature, target)

    return Kept(function)


class Turn:
    """While it lasts no other process compiles the same function: it waits for its own turn.

    A kernel has its turn before those that it calls, so two processes never wait for each other.
    It ends with the process at last. Where the system has no such locks both compile. Meanwhile
    no garbage is looked for, which would take a tenth of the time: a compiler keeps what it makes,
    and later nobody looks there either (a twentieth).
    """

    def __init__(self, file: Path | None = None) -> None:
        self.file, self.lock = file, None
        self.collects = file is not None and gc.isenabled()
        if file is not None:
            gc.disable()
        if file is not None and find_spec("fcntl"):
            import fcntl

            self.lock = file.open("wb")
            fcntl.flock(self.lock, fcntl.LOCK_EX)

    def end(self) -> None:
        """Let the others go on."""
        if self.collects:
            gc.freeze()
            gc.enable()
            self.collects = False
        if self.file is not None and self.lock is not None:
            self.file.unlink(missing_ok=True)
            self.lock.close()
            self.lock = None
