"""Drawings made of paths, as an importer would have given them."""

from __future__ import annotations

from collections.abc import Sequence

from camtool.geometry.drawing import Drawing, Units
from camtool.geometry.polylines import Polyline, Polylines


def drawing_of(paths: Sequence[Polyline], layers: Sequence[str] | None = None) -> Drawing:
    """A drawing of these paths, called "PATH 0", "PATH 1", …, on layer "0" unless told."""
    count = len(paths)
    return Drawing(
        Polylines.of(paths),
        tuple(layers or ("0",) * count),
        ("",) * count,
        tuple(f"PATH {index}" for index in range(count)),
        "test.dxf",
        Units("mm", 1.0, "said by the test"),
    )
