"""How a drawing is read: the options of a caller."""

from __future__ import annotations

import math
from dataclasses import dataclass

from camtool.errors import OptionError
from camtool.records import replace
from camtool.units import MM_PER_UNIT

FORMATS = ("dxf", "svg", "points", "solid", "bitmap")
"""Names of the formats, each with a package of that name beside this file."""

SUFFIXES = (".dxf", ".svg", ".svgz", ".step", ".stp", ".brep", ".brp")
"""The extensions by which a folder is searched for drawings. Lists of points and scripts share
theirs with other files, so that they must be named or matched by a pattern."""

TEXTS = ("skip", "outline", "stroke")
"""What becomes of text: left out, the outlines of its font, or the lines of an engraving font."""

TRACES = ("outline", "centre")
"""What becomes of dark shapes in a picture of pixels: their outlines, or their centre lines."""

OF_PICTURES = {
    "width_mm": "--width",
    "own_dpi": "--own-dpi",
    "threshold": "--threshold",
    "speckle_px": "--speckle",
    "smooth_px": "--smooth",
    "invert": "--invert",
    "trace": "--trace",
}
"""The fields of `ReadOptions` that are for pictures of pixels alone, and their flags."""

TEXT_SKIPPED = "is text: read it with --text outline, or --text stroke for engraving"
"""Why text is left out."""

TOLERANCE_MM = 0.0005
"""Largest distance between a curve and the arcs that stand for it."""

GAP_MM = 0.01
"""Open ends that lie nearer than this are joined."""

DPI = 96.0
"""Pixels per inch, as in CSS."""

_MM_PER_INCH = 25.4


@dataclass(frozen=True)
class Selection:
    """Which entities are read; empty fields choose all.

    `layers` and `exclude_layers`: patterns with `*`, `?` and `[…]`, in any case. `colours`:
    "#rrggbb". `line_types`: patterns like those of layers (DASHED, CENTER*).
    """

    layers: tuple[str, ...] = ()
    exclude_layers: tuple[str, ...] = ()
    colours: tuple[str, ...] = ()
    line_types: tuple[str, ...] = ()


@dataclass(frozen=True)
class ReadOptions:
    """How to read a drawing; every field has a default that suits most files.

    `units`: the unit of the file's numbers, over what the file says (a name of
    `units.MM_PER_UNIT`). `tolerance_mm`: how far fitted arcs may lie from a curve; `gap_mm`: open
    ends nearer than this are joined: both on the part, which is `scale` times as large as what
    is drawn. With `chain_gaps` false only equal ends are joined; `across_layers` joins ends of
    different layers too. `dpi`: pixels per inch of SVG's px (None: what the program that
    wrote the file took, else DPI). `format`: one of FORMATS, over what
    the content looks like. `select`: which entities.

    `text`: one of TEXTS. `recognise_arcs`: chords on one circle become arcs again. `layout`: a
    layout of a DXF by name instead of model space; `dimensions`: read the lines of dimensions.
    `section_z_mm`: where a solid is cut; `allow_scripts`: run a build123d script to get a solid.

    Of pictures of pixels, whose size must be given by `width_mm`, `dpi`, or `own_dpi` (what the
    file claims): pixels at least as dark as `threshold` (0 white … 1 black) are drawn, or with
    `invert` those as light; shapes of less than `speckle_px` pixels are not; contours are smoothed
    within `smooth_px` pixels; `trace`: one of TRACES.
    Raises OptionError.
    """

    units: str | None = None
    tolerance_mm: float = TOLERANCE_MM
    gap_mm: float = GAP_MM
    scale: float = 1.0
    dpi: float | None = None
    format: str | None = None
    chain_gaps: bool = True
    across_layers: bool = False
    select: Selection = Selection()
    text: str = "skip"
    recognise_arcs: bool = False
    layout: str | None = None
    dimensions: bool = False
    section_z_mm: float | None = None
    allow_scripts: bool = False
    width_mm: float | None = None
    own_dpi: bool = False
    threshold: float = 0.5
    speckle_px: float = 4.0
    smooth_px: float = 0.75
    invert: bool = False
    trace: str = "outline"

    def __post_init__(self) -> None:
        if self.units is not None and self.units.lower() not in MM_PER_UNIT:
            known = ", ".join(u for u in MM_PER_UNIT if u.isascii() and u != '"')
            raise OptionError(f"unknown unit {self.units!r}", mend=f"use one of {known}")
        if self.format is not None and self.format not in FORMATS:
            raise OptionError(
                f"unknown drawing format {self.format!r}", mend=f"use one of {', '.join(FORMATS)}"
            )
        if self.text not in TEXTS:
            raise OptionError(
                f"text {self.text!r} is not known",
                mend=f"use one of {', '.join(TEXTS)}",
            )
        if self.section_z_mm is not None and not math.isfinite(self.section_z_mm):
            raise OptionError(f"section_z_mm is {self.section_z_mm}, it must be a height")
        for name in ("tolerance_mm", "dpi", "scale"):
            value = self.px_an_inch if name == "dpi" else getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise OptionError(f"{name} is {value}, it must be above 0")
        for name in ("gap_mm", "speckle_px", "smooth_px"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise OptionError(f"{name} is {value}, it must be 0 or more")
        if self.width_mm is not None and not 0.0 < self.width_mm < math.inf:
            raise OptionError(f"width_mm is {self.width_mm}, it must be above 0")
        if not 0.0 < self.threshold < 1.0:
            raise OptionError(
                f"threshold is {self.threshold}, it must be between 0 (white) and 1 (black)"
            )
        if self.trace not in TRACES:
            raise OptionError(
                f"trace {self.trace!r} is not known", mend=f"use one of {', '.join(TRACES)}"
            )

    @property
    def px_an_inch(self) -> float:
        """As asked, or as CSS has it."""
        return DPI if self.dpi is None else self.dpi

    def as_drawn(self) -> ReadOptions:
        """The same with lengths of the part as they are in the drawing; `scale` says so still.

        A tolerance does not come below POSITION_EPS_MM by that: positions nearer than this are
        one."""
        from camtool.geometry.polylines import POSITION_EPS_MM

        return replace(
            self,
            tolerance_mm=max(
                self.tolerance_mm / self.scale, min(self.tolerance_mm, POSITION_EPS_MM)
            ),
            gap_mm=self.gap_mm / self.scale,
        )

    def mm_per(self, unit: str) -> float:
        """One `unit` in mm; a px is as large as `dpi` makes it."""
        name = unit.lower()
        return _MM_PER_INCH / self.px_an_inch if name == "px" else MM_PER_UNIT[name]


DEFAULTS = ReadOptions()
"""The options when none are given."""
