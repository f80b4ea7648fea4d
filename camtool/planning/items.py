"""Items, which operations make and the order arranges, and the runs that they become.

    operation ─▶ Work: items ─order─▶ items with start and direction ─▶ runs ─link─▶ moves

An item is cut in one go, before or after others. A `Contour` leaves its start (and perhaps its
direction) to the order; a `Fixed` item is cut as it is. A `CutRun` is one stay of the tool in the
stock: it goes down at its first point and comes up at its last one. Items are objects; the runs of
a whole operation are held in columns (`Runs`)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from msgspec import Struct, field

from camtool.arrays import Bools, Floats, Ints
from camtool.findings import Finding
from camtool.geometry.nesting import Nesting
from camtool.geometry.polylines import Polyline, Polylines
from camtool.planning.job import Operation, Stock

RAPID = float("nan")
"""The feed of a part of a run that is a rapid (a drill between two pecks)."""


class Feeds(Struct, frozen=True):
    """Feeds of cuts and of plunges, mm/min."""

    cut_mm_min: float
    plunge_mm_min: float


class Setting(Struct, frozen=True):
    """An operation with the numbers that the machine adds: feeds; `levels_mm`, the z of its
    passes, downwards, the last at the full depth; `safe_z_mm` above the stock top (z = 0);
    `spindle_rpm`, None if off or unknown; the `stock` as far as the job gives it."""

    operation: Operation
    feeds: Feeds
    levels_mm: tuple[float, ...]
    safe_z_mm: float
    spindle_rpm: float | None = None
    stock: Stock | None = None


class CutRun(Struct, frozen=True, eq=False):
    """One stay of the tool in the stock. `vertices` (n, 4) x, y, z, bulge, mm, work frame, n ≥ 1;
    the bulge belongs to the move that leaves its vertex (with a change of z it is a helix);
    `feed_mm_min` (n − 1,), RAPID (NaN) for a rapid. The tool comes down from safe z to the first
    vertex at `plunge_mm_min`, and goes up from the last one as a rapid. `name`: the source of its
    moves; `dwell_s`: a dwell at the last vertex."""

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


class Runs(Struct, frozen=True, eq=False):
    """R runs in columns; single ones are made when asked for.

    Run i has the rows first[i] to first[i + 1] (R + 1,) of `vertices` (N, 4) and of `feed_mm_min`
    (N,), in which the last value of a run is unused; `plunge_mm_min`, `dwell_s` (R,) and `names`
    (R) are as in a CutRun. ValueError for a vertex that is not finite."""

    vertices: Floats
    feed_mm_min: Floats
    first: Ints
    plunge_mm_min: Floats
    dwell_s: Floats
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        if not np.isfinite(self.vertices).all():
            raise ValueError("a vertex is not finite")

    @classmethod
    def of(cls, runs: Iterable[CutRun]) -> Runs:
        """Return single runs as columns."""
        each = list(runs)
        feeds = [np.append(run.feed_mm_min, RAPID) for run in each]
        return cls(
            np.concatenate([np.empty((0, 4)), *(run.vertices for run in each)]),
            np.concatenate([np.empty(0), *feeds]),
            np.concatenate([[0], np.cumsum([len(feed) for feed in feeds], dtype=np.int64)]),
            np.array([run.plunge_mm_min for run in each], dtype=np.float64),
            np.array([run.dwell_s for run in each], dtype=np.float64),
            tuple(run.name for run in each),
        )

    @classmethod
    def joined(cls, parts: Sequence[Runs]) -> Runs:
        """Return the runs of all parts in one record, one part after the other."""
        if len(parts) == 1:
            return parts[0]
        before = np.cumsum([0, *(len(part.vertices) for part in parts)], dtype=np.int64)
        firsts = [part.first[:-1] + n for part, n in zip(parts, before.tolist(), strict=False)]
        empty = cls.of([])
        return cls(
            np.concatenate([empty.vertices, *(part.vertices for part in parts)]),
            np.concatenate([empty.feed_mm_min, *(part.feed_mm_min for part in parts)]),
            np.concatenate([*firsts, before[-1:]]),
            np.concatenate([empty.plunge_mm_min, *(part.plunge_mm_min for part in parts)]),
            np.concatenate([empty.dwell_s, *(part.dwell_s for part in parts)]),
            tuple(name for part in parts for name in part.names),
        )

    def __len__(self) -> int:
        return len(self.names)

    def __iter__(self) -> Iterator[CutRun]:
        return (self[index] for index in range(len(self)))

    def __getitem__(self, index: int) -> CutRun:
        row = range(len(self))[index]
        begin, end = self.first[row : row + 2].tolist()
        return CutRun(
            self.vertices[begin:end],
            self.feed_mm_min[begin : end - 1],
            float(self.plunge_mm_min[row]),
            self.names[row],
            float(self.dwell_s[row]),
        )


NO_STARTS = np.empty(0, dtype=np.int64)
"""Empty `starts`: a closed path may begin at any vertex that is no joint within an arc."""
NO_STARTS.flags.writeable = False


class Contour(Struct, frozen=True, eq=False):
    """A path of the tool centre, to be cut at all levels of its setting.

    `path` runs as it must be cut, unless `reversible`. `starts`: the vertices at which a closed
    path may begin; empty: any vertex that is no joint within an arc. `source`: the index of its
    path in the placed drawing. `material_left`: the material that stays lies to the left of the
    path; False: to the right; None: on both sides (engraved). `outline`: for the nesting, the
    closed path of which this is a part; None: the path itself."""

    path: Polyline
    setting: Setting
    name: str
    source: int
    reversible: bool = False
    starts: Ints = field(default_factory=lambda: NO_STARTS)
    material_left: bool | None = None
    outline: Polyline | None = None


class Fixed(Struct, frozen=True, eq=False):
    """Runs that are cut one after the other as they are: a pocket, a hole, a carved letter.

    `outline`: for the nesting, a closed path around them, if there is one. `centre_lines`: lines
    of the tool's centre that bound a slot beside a contour; the slot holds what lies within that
    contour."""

    runs: tuple[CutRun, ...]
    setting: Setting
    name: str
    source: int = -1
    outline: Polyline | None = None
    centre_lines: Polylines | None = None


Item = Contour | Fixed
Items = Sequence[Item]


def contours_of(items: Items) -> list[Contour]:
    """Return the contours among the items, in their order."""
    return [item for item in items if isinstance(item, Contour)]


def contours_along(
    lines: Polylines, setting: Setting, names: Iterable[str], sources: Iterable[int]
) -> list[Contour]:
    """Return a contour on each of M lines, with these names and sources (M). Material stays on
    both sides, and open ones may be cut from either end."""
    return [
        Contour(path, setting, name, source, reversible=not path.closed)
        for path, name, source in zip(lines, names, sources, strict=True)
    ]


class Air(Struct, frozen=True, eq=False):
    """A `region` (on the left of its closed paths, work frame) in which no stock is left above
    `z_mm`."""

    region: Polylines
    z_mm: float


class Chosen(Struct, frozen=True, eq=False):
    """The paths that an operation takes, in the work frame: `lines` with their `nesting`; `source`
    (M,), the index of each in the placed drawing; `names`, for messages; `points` (K, 2), mm, the
    marks of its layers, with their `point_names`. `rim` (M,): True if a closed path is the edge of
    a part, so that its inside stays, False for the edge of a hole. `file`: that of the drawing.
    `air`: what operations before have cleared, for operations that need it
    (`Operation.engagement_rad`)."""

    nesting: Nesting
    source: Ints
    names: tuple[str, ...]
    points: Floats
    point_names: tuple[str, ...]
    rim: Bools
    file: str | None = None
    air: tuple[Air, ...] = ()

    @property
    def lines(self) -> Polylines:
        """The M paths."""
        return self.nesting.lines


class Bridge(Struct, frozen=True, eq=False):
    """The bridge of material that a tab leaves: its `centre` (2,); `ahead` (2,), the direction of
    its contour there; half its width, and half the width of the slot that it spans, mm; its top;
    `fall`, the slope of its sides, as in Tab; the name of its contour."""

    centre: Floats
    ahead: Floats
    half_width_mm: float
    half_span_mm: float
    top_mm: float
    fall: float
    name: str


class Work(Struct, frozen=True, eq=False):
    """The items that an operation made of its paths, findings, and the bridges that fixed items
    leave (those of contours follow from where they begin)."""

    items: Items
    findings: tuple[Finding, ...] = ()
    bridges: tuple[Bridge, ...] = ()


class Step(Struct, frozen=True, eq=False):
    """An operation as planned: its setting; what it took; its items; the runs in order of cutting,
    with the item (R,) that each belongs to (`owner`); the length of rapids in XY in drawn order
    and as ordered, mm; and the bridges of its tabs."""

    operation: Operation
    setting: Setting
    chosen: Chosen
    items: Items
    runs: Runs
    owner: Ints
    findings: tuple[Finding, ...]
    rapid_drawn_mm: float
    rapid_mm: float
    bridges: tuple[Bridge, ...]
