"""The Drawing: what every importer returns and planning starts from."""

from __future__ import annotations

from dataclasses import dataclass, field

from camtool.findings import Finding
from camtool.geometry.polylines import Polylines


@dataclass(frozen=True)
class Units:
    """The unit of the file: its name, mm per unit, and why we believe it (one phrase)."""

    name: str
    mm_per_unit: float
    why: str


@dataclass(frozen=True)
class Skipped:
    """Entities that were not used: their kind, how many, and why."""

    kind: str
    count: int
    reason: str


@dataclass(frozen=True)
class Gap:
    """An open end that may have been meant closed: place (x, y) mm, size mm, layer."""

    at_mm: tuple[float, float]
    size_mm: float
    layer: str


@dataclass(frozen=True)
class FitError:
    """Distance between fitted arcs and the true curves, mm; zeros when nothing was fitted."""

    max_mm: float = 0.0
    rms_mm: float = 0.0


@dataclass(frozen=True, eq=False)
class Drawing:
    """Exact lines and arcs in mm, Y up, drawing frame.

    `layers`, `colours` ("#rrggbb" or "") and `sources` (entity handle or element id, such as
    "CIRCLE 2F") have one item per path. `used` counts the entities of each kind that became
    geometry; `skipped` the others, with the reason.
    """

    paths: Polylines
    layers: tuple[str, ...]
    colours: tuple[str, ...]
    sources: tuple[str, ...]
    file: str
    units: Units
    fit: FitError = field(default_factory=FitError)
    used: dict[str, int] = field(default_factory=dict)
    skipped: tuple[Skipped, ...] = ()
    gaps: tuple[Gap, ...] = ()
    findings: tuple[Finding, ...] = ()

    def __post_init__(self) -> None:
        count = len(self.paths)
        for name in ("layers", "colours", "sources"):
            if len(getattr(self, name)) != count:
                raise ValueError(f"{name}: {len(getattr(self, name))} items for {count} paths")
