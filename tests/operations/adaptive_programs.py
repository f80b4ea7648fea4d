"""Programs of adaptive pockets: drawings of their paths, posted as anybody would."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import ezdxf

import camtool
from camtool.geometry.polylines import Polyline
from camtool.planning.job import Entry, Job, Operation, Tool
from camtool.run import Run
from camtool.target.registry import LoadedTarget
from tests.oracles.contours import SQUARE, star
from tests.paths import moved, scaled

LIFT_MM = {"island": 0.2, "star": 0.0}
SHAPES = {
    "island": [SQUARE, moved(scaled(SQUARE, 0.2), 3.0, 5.0)],
    "star": [scaled(star(5, 4.0, 12.0), 0.5)],
}


def posted(
    paths: Sequence[Polyline],
    diameter_mm: float,
    limit: float,
    target: str | LoadedTarget,
    folder: Path,
    lift_mm: float = 0.0,
    **settings: object,
) -> Run:
    """Return the run of a pocket 1 mm deep."""
    document = ezdxf.new(units=ezdxf.units.MM)
    for path in paths:
        rows = [(x, y, bulge) for x, y, bulge in path.vertices.tolist()]
        document.modelspace().add_lwpolyline(rows, format="xyb", close=True)
    document.saveas(folder / "pocket.dxf")
    operation = Operation(
        kind="pocket",
        tool=Tool(diameter_mm, number=1),
        depth_mm=1.0,
        spindle_rpm=9000.0,
        plunge_feed_mm_min=60.0,
        own=(("strategy", "adaptive"), ("engagement_rad", limit), ("lift_mm", lift_mm)),
        entry=Entry("helix", angle_rad=math.radians(5.0)),
        **settings,  # type: ignore[arg-type]
    )
    job = Job(operations=(operation,))
    return camtool.post(str(folder / "pocket.dxf"), target, job)
