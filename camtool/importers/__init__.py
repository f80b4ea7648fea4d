"""Drawing files to Drawing, one package per format.

`read_drawing` and `ReadOptions` are loaded on first use: the package itself costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from camtool.importers.options import ReadOptions
    from camtool.importers.read import read_drawing

__all__ = ["ReadOptions", "read_drawing"]


def __getattr__(name: str) -> object:
    if name == "ReadOptions":
        from camtool.importers.options import ReadOptions

        return ReadOptions
    if name == "read_drawing":
        from camtool.importers.read import read_drawing

        return read_drawing
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
