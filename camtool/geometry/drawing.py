"""The Drawing: what every importer returns and planning starts from."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import msgspec
import numpy as np
from msgspec import Struct

from camtool.arrays import Floats
from camtool.findings import Finding
from camtool.geometry.measure import segment_lengths
from camtool.geometry.nesting import Nesting
from camtool.geometry.polylines import Polylines, Segments, segment_rows

TEXT_KINDS = frozenset(("text", "mtext", "attrib", "attdef"))


def is_text(source: str) -> bool:
    """Return True if a path of this source (`TEXT 2F`) is a part of a letter."""
    return source.partition(" ")[0].casefold() in TEXT_KINDS


class Units(Struct, frozen=True):
    """The unit of the file: its name, mm per unit, and where both come from (one phrase)."""

    name: str
    mm_per_unit: float
    why: str


class Skipped(Struct, frozen=True):
    """Entities that were not used: their kind, how many, and why."""

    kind: str
    count: int
    reason: str


class Gap(Struct, frozen=True):
    """An open end that may have been meant closed: place (x, y) mm, size mm, layer."""

    at_mm: tuple[float, float]
    size_mm: float
    layer: str


class Mark(Struct, frozen=True):
    """A single point, such as the centre of a hole to drill: (x, y) mm, and where it came from."""

    at_mm: tuple[float, float]
    layer: str
    colour: str
    source: str
    line_type: str = ""


class Branch(Struct, frozen=True):
    """A place (x, y) mm where more than two open ends meet: how many, and the layer of one.

    `paths`: the indices of the paths that pass it, if these enclose something else when the ends
    are joined in another way; none if all ways enclose the same."""

    at_mm: tuple[float, float]
    ends: int
    layer: str
    paths: tuple[int, ...] = ()


class SelfCrossing(Struct, frozen=True):
    """A place (x, y) mm where the closed path of this index crosses itself."""

    at_mm: tuple[float, float]
    path: int
    layer: str


class Callout(Struct, frozen=True):
    """A dimension as the file draws it, mm: what it measures, between which places, and what its
    text and style say of its limits.

    `kind` "linear": `points_mm` are two places, measured along `direction_rad` (None: from one to
    the other); "diameter": two opposite places of a circle; "radius": its centre and a place on
    it. `measured_mm` is what the places measure. `text` is what is written in place of that, with
    "<>" for what is measured, "" for nothing else than that. `upper_mm` and `lower_mm`: the
    deviations of its style, None without any. `mm_per_unit`: the unit of the numbers in its text.
    `scale`: its text says so many times what is drawn (a view of another scale). `exact`: its
    frame says that it is theoretically exact, without limits."""

    kind: Literal["linear", "diameter", "radius"]
    points_mm: tuple[tuple[float, float], ...]
    measured_mm: float
    text: str
    layer: str
    source: str
    direction_rad: float | None = None
    upper_mm: float | None = None
    lower_mm: float | None = None
    mm_per_unit: float = 1.0
    scale: float = 1.0
    exact: bool = False


class Healing(Struct, frozen=True):
    """Corrections made on reading, counted, lengths in mm.

    `duplicates`: pieces drawn twice as a whole and left out; `overlaps`: parts of pieces that
    lie on others and were left out; `tiny_merged`: segments too short to matter that went into
    their neighbours; `arcs_recognised`: arcs made of chords. `branches` and `crossings` are the
    places where the drawing leaves a choice, or is wrong."""

    duplicates: int = 0
    duplicates_mm: float = 0.0
    overlaps: int = 0
    overlaps_mm: float = 0.0
    tiny_merged: int = 0
    arcs_recognised: int = 0
    branches: tuple[Branch, ...] = ()
    crossings: tuple[SelfCrossing, ...] = ()


class FitError(Struct, frozen=True):
    """Distance between what was drawn and the paths that stand for it, mm: the largest, and the
    rms over segments that differ; zeros if all paths are as drawn."""

    max_mm: float = 0.0
    rms_mm: float = 0.0


class Unchosen(Struct, frozen=True, eq=False):
    """Closed contours of the file, M of them, that were not chosen (by layer, colour or line
    type): they are not cut, but what is a part and what is a hole depends on them too. `layers`,
    `sources` and `line_types` have one item per path."""

    paths: Polylines = msgspec.field(default_factory=lambda: Polylines.of([]))
    layers: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()
    line_types: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Drawing:
    """Exact lines and arcs in mm, Y up, drawing frame.

    `layers`, `colours` ("#rrggbb" or "") and `sources` (entity handle or element id, such as
    "CIRCLE 2F") have one item per path, and so has `line_types` ("" is continuous; left out, all
    are). `off_mm` (N, 2): the largest and the rms distance, mm, between the segment that leaves
    each vertex of `paths` and what was drawn there: curves to the arcs fitted to them, and all
    that was joined, merged, recognised or left out on reading; left out, zeros. `made_for`: the
    scale of the part that it was read for (`ReadOptions.scale`). `datum_off_mm`: how far all of it
    may lie, in the work frame, from where the box of what was drawn would have put it. `used`
    counts the entities of each kind that became geometry; `skipped` the others, with the reason.
    `marks` are single points; a drawing of marks alone has no paths. `gaps` stay open,
    `closed_gaps` were bridged. `unchosen`: the closed contours that were left out by choice.
    `callouts`: its dimensions."""

    paths: Polylines
    layers: tuple[str, ...]
    colours: tuple[str, ...]
    sources: tuple[str, ...]
    file: str
    units: Units
    used: dict[str, int] = field(default_factory=dict)
    skipped: tuple[Skipped, ...] = ()
    gaps: tuple[Gap, ...] = ()
    findings: tuple[Finding, ...] = ()
    marks: tuple[Mark, ...] = ()
    closed_gaps: tuple[Gap, ...] = ()
    healing: Healing = field(default_factory=Healing)
    line_types: tuple[str, ...] = ()
    unchosen: Unchosen = field(default_factory=Unchosen)
    off_mm: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    made_for: float = 1.0
    callouts: tuple[Callout, ...] = ()
    datum_off_mm: float = 0.0

    def __post_init__(self) -> None:
        count = len(self.paths)
        if not len(self.off_mm):
            # One number, broadcast to the shape.
            exact = np.broadcast_to(0.0, (len(self.paths.vertices), 2))
            object.__setattr__(self, "off_mm", exact)
        if self.off_mm.shape != (len(self.paths.vertices), 2):
            raise ValueError(
                f"off_mm has shape {self.off_mm.shape} for {len(self.paths.vertices)} vertices"
            )
        if not self.line_types:
            object.__setattr__(self, "line_types", ("",) * count)
        for name in ("layers", "colours", "sources", "line_types"):
            if len(getattr(self, name)) != count:
                raise ValueError(f"{name}: {len(getattr(self, name))} items for {count} paths")

    @cached_property
    def nesting(self) -> Nesting:
        """Nesting of all contours: of the `paths`, and then of those that were not chosen."""
        return Nesting(Polylines.joined([self.paths, self.unchosen.paths]))

    @cached_property
    def fit(self) -> FitError:
        """The distance between the paths and the curves that were drawn."""
        if not self.off_mm.any():
            return FitError()
        rows = segment_rows(self.paths)
        largest, rms = self.off_mm[rows].T
        length = np.concatenate([segment_lengths(batch) for batch in Segments.batches(self.paths)])
        length[largest == 0.0] = 0.0
        total_length = float(length.sum())
        if not total_length:
            return FitError()
        return FitError(
            float(largest.max()), math.sqrt(float((length * rms**2).sum()) / total_length)
        )
