"""camtool: drawings in, the exact program of your machine out, its error known beforehand.

    import camtool

    drawing = camtool.read_drawing("logo.dxf", target="pic-mmh")
    posted = camtool.post(drawing, "pic-mmh")
    posted.verification.report.error_um.total.max
    camtool.preview(posted).save("logo.svg")

What stands in `__all__` lives in `camtool.api` and is loaded when it is first used, so that
`import camtool` costs nothing (docs/decisions/0015-python.md)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from camtool.version import __version__ as __version__

if TYPE_CHECKING:
    from camtool.api import *

__all__ = [
    "Calibration",
    "CamtoolError",
    "Comparison",
    "CutStock",
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
    "Reading",
    "Run",
    "Signals",
    "Stock",
    "Tool",
    "Toolpath",
    "Verification",
    "calibrate",
    "check",
    "compare",
    "convert",
    "cut_stock",
    "inspect",
    "job_of",
    "load_target",
    "meet",
    "offset",
    "plan",
    "post",
    "post_by_setup",
    "post_by_tool",
    "preview",
    "read_drawing",
    "read_job",
    "signals",
    "targets",
    "verify",
]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import camtool.api

    value = globals()[name] = getattr(camtool.api, name)
    return value


def __dir__() -> list[str]:
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
