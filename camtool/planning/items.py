"""What operations make and the order arranges: items, and the runs that they become.

    operation ─▶ Work: items ─order─▶ items with start and direction ─▶ runs ─link─▶ moves

An item is cut in one go, before or after others. A `Contour` leaves its start (and perhaps its
direction) to the order; a `Fixed` item is cut as it is. A `CutRun` is one stay of the tool in the
stock: it goes down at its first point and comes up at its last one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from camtool.arrays import Bools, Floats, Ints
from camtool.findings import Finding
from camtool.geometry.polylines import Polyline, Polylines
from camtool.planning.job import Operation

RAPID = float("nan")
"""The feed of a part of a run that is a rapid (a drill between two pecks)."""


@dataclass(frozen=True)
class Feeds:
    """Feeds of cuts and of plunges, mm/min."""

    cut_mm_min: float
    plunge_mm_min: float


@dataclass(frozen=True)
class Setting:
    """An operation with what the machine adds to it: feeds; `levels_mm`, the z of its passes,
    downwards, the last at the full depth; `safe_z_mm` above the stock top (z = 0)."""

    operation: Operation
    feeds: Feeds
    levels_mm: tuple[float, ...]
    safe_z_mm: float


@dataclass(frozen=True, eq=False)
class CutRun:
    """`vertices` (n, 4) of x, y, z, bulge in mm, work frame, n ≥ 1; the bulge belongs to the move
    that leaves its vertex (with a change of z it is a helix); `feed_mm_min` (n−1,), RAPID (NaN)
    for a rapid. The tool comes down from safe z to the first vertex at the plunge feed of
    `plunge_mm_min`, and up from the last one as a rapid. `name` is the provenance of its moves,
    `dwell_s` is spent at the last vertex."""

    vertices: Floats
    feed_mm_min: Floats
    plunge_mm_min: float
    name: str
    dwell_s: float = 0.0

    def __post_init__(self) -> None:
        count = len(self.vertices)
        if count == 0 or self.vertices.shape != (count, 4):
            raise ValueError(f"vertices have shape {self.vertices.shape}, wanted (n, 4)")
        if self.feed_mm_min.shape != (count - 1,):
            raise ValueError(f"{len(self.feed_mm_min)} feeds for {count} vertices")
        if not np.isfinite(self.vertices).all():
            raise ValueError("a vertex is not finite")

    @classmethod
    def many(
        cls,
        vertices: Floats,
        feed_mm_min: Floats,
        first: Ints,
        plunge: float,
        names: Sequence[str],
    ) -> list[CutRun]:
        """R runs of columns: run i has the rows first[i] to first[i + 1] (R + 1,) of `vertices`
        (N, 4), and the feeds between them of `feed_mm_min` (N−1,); all plunge at one feed."""
        cls(vertices, feed_mm_min, plunge, "")  # checked as a whole
        ends = first.tolist()
        made = []
        for name, (begin, end) in zip(names, pairwise(ends), strict=True):
            run = object.__new__(cls)
            run.__dict__.update(
                vertices=vertices[begin:end],
                feed_mm_min=feed_mm_min[begin : end - 1],
                plunge_mm_min=plunge,
                name=name,
            )
            made.append(run)
        return made


@dataclass(frozen=True, eq=False)
class Contour:
    """One path of the tool centre, to be cut at all levels of its setting.

    `path` runs as it is to be cut unless `reversible`. `starts`: the vertices of a closed path at
    which it may begin; empty: any that is no joint within an arc. `source`: the index of its path
    in the placed drawing. `material_left`: what is to stay lies to the left of the path as it
    runs; False: to the right; None: on both sides (engraved). `outline`: the closed path that this
    one is a part of, for the nesting; None: the path itself.
    """

    path: Polyline
    setting: Setting
    name: str
    source: int
    reversible: bool = False
    starts: Ints = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    material_left: bool | None = None
    outline: Polyline | None = None


@dataclass(frozen=True, eq=False)
class Fixed:
    """Runs that are cut one after the other as they are: a pocket, a hole, a carved letter.

    `outline`: a closed path around it, when there is one, for the nesting.
    """

    runs: tuple[CutRun, ...]
    setting: Setting
    name: str
    source: int = -1
    outline: Polyline | None = None


Item = Contour | Fixed


@dataclass(frozen=True, eq=False)
class Work:
    """What an operation made of its paths, and its findings."""

    items: tuple[Item, ...]
    findings: tuple[Finding, ...] = ()


@dataclass(frozen=True, eq=False)
class Chosen:
    """The paths that an operation takes, in the work frame: `lines`; `source` (M,), the index of
    each in the placed drawing; `names` for people; `points` (K, 2) mm, the marks of its layers,
    with their `point_names`. `rim` (M,): whether a closed path is the rim of a part, what lies
    within it staying, or of a hole."""

    lines: Polylines
    source: Ints
    names: tuple[str, ...]
    points: Floats
    point_names: tuple[str, ...]
    rim: Bools


@dataclass(frozen=True, eq=False)
class Bridge:
    """What a tab leaves: `centre` (2,), `ahead` (2,) the direction of its contour there, half its
    width, half the width of the slot that it spans, mm; its top; `fall` as of its tab; the name of
    its contour."""

    centre: Floats
    ahead: Floats
    half_width_mm: float
    half_span_mm: float
    top_mm: float
    fall: float
    name: str


@dataclass(frozen=True, eq=False)
class Step:
    """What became of one operation: its setting, what it took, the runs in order of cutting with
    the item that each is of, how far rapids go in XY: as drawn, and as ordered, mm; and the
    bridges that its tabs leave."""

    operation: Operation
    setting: Setting
    chosen: Chosen
    runs: tuple[CutRun, ...]
    owners: tuple[Item, ...]
    findings: tuple[Finding, ...]
    rapid_drawn_mm: float
    rapid_mm: float
    bridges: tuple[Bridge, ...]
