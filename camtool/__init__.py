"""camtool: drawings in, the exact program of your machine out, its error known beforehand.

    import camtool

    drawing = camtool.read_drawing("logo.dxf", target="pic-mmh")
    posted = camtool.post(drawing, "pic-mmh")
    posted.verification.report.error_um.total.max
    camtool.preview(posted).save("logo.svg")

What stands in `__all__` lives in `camtool.api` and is loaded when it is first used, so that
`import camtool` costs nothing. `camtool.verify` and `camtool.preview` are packages as well: these
two can be called (docs/decisions/0015-python.md).
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from inspect import Signature

    from camtool.api import (
        Calibration,
        Comparison,
        Converted,
        Drawing,
        Effects,
        Gates,
        Job,
        Judging,
        ListedTarget,
        LoadedTarget,
        Looks,
        Operation,
        Picture,
        Placement,
        Posted,
        Reading,
        Stock,
        Tool,
        Toolpath,
        Verification,
        calibrate,
        compare,
        convert,
        job_of,
        load_target,
        plan,
        post,
        preview,
        read_drawing,
        read_job,
        targets,
        verify,
    )
    from camtool.errors import CamtoolError

__version__ = "0.1.0"

__all__ = [
    "Calibration",
    "CamtoolError",
    "Comparison",
    "Converted",
    "Drawing",
    "Effects",
    "Gates",
    "Job",
    "Judging",
    "ListedTarget",
    "LoadedTarget",
    "Looks",
    "Operation",
    "Picture",
    "Placement",
    "Posted",
    "Reading",
    "Stock",
    "Tool",
    "Toolpath",
    "Verification",
    "calibrate",
    "compare",
    "convert",
    "job_of",
    "load_target",
    "plan",
    "post",
    "preview",
    "read_drawing",
    "read_job",
    "targets",
    "verify",
]

_CALLED = ("preview",)
"""Packages of this one that are called like the functions of the same name in `camtool.api`."""


class _CalledPackage(ModuleType):
    """A package that can be called: `camtool.preview(...)`, beside `camtool.preview.draw`."""

    def __call__(self, *values: Any, **named: Any) -> Any:
        return self._function()(*values, **named)

    @property
    def __signature__(self) -> Signature:
        """What `help` and notebooks show."""
        from inspect import signature

        return signature(self._function())

    def _function(self) -> Any:
        import camtool.api

        return getattr(camtool.api, self.__name__.rpartition(".")[2])


class _Camtool(ModuleType):
    """This package; Python binds a package to it whenever one is first imported, by anybody."""

    def __setattr__(self, name: str, value: Any) -> None:
        if name in _CALLED and type(value) is ModuleType:
            value.__class__ = _CalledPackage
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Camtool


def __getattr__(name: str) -> Any:
    if name in _CALLED:
        from importlib import import_module

        return import_module(f"camtool.{name}")
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import camtool.api

    value = getattr(camtool.api, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
