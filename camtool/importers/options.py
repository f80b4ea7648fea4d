"""The options of reading a drawing, in one table.

`ReadOptions` and its `Selection` are the table: name, type, default and flag of each option. The
flags of commands are made from it, and `Reading` has the same names and types as keywords of the
Python API, where a type checker wants them written out."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, TypedDict, get_type_hints

from msgspec import Struct

from camtool.errors import OptionError
from camtool.records import FrozenRecord, replace
from camtool.units import MM_PER_UNIT, parse_length

if TYPE_CHECKING:
    from camtool.machine.model import Machine

FORMATS = ("dxf", "svg", "points", "solid", "bitmap", "board")
"""Names of the formats, each with a package of that name beside this file."""

SUFFIXES = (".dxf", ".svg", ".svgz", ".step", ".stp", ".brep", ".brp")
"""The extensions by which a folder is searched for drawings. Lists of points, scripts,
pictures and files of boards share theirs with other files, so that they must be named or matched
by a pattern."""

TEXTS = ("skip", "outline", "stroke")
"""The treatment of text: skipped, as outlines of its font, or as lines of an engraving font."""

TRACES = ("outline", "centre")
"""The treatment of dark shapes in a picture of pixels: outlines or centre lines."""

TEXT_SKIPPED = "is text: read it with --text outline, or --text stroke for engraving"

TOLERANCE_MM = 0.0005
"""Largest distance between a curve and the arcs that stand for it."""

GAP_MM = 0.01

DPI = 96.0

_MM_PER_INCH = 25.4


class Flag(Struct, frozen=True):
    """The flag of an option, with its help and what it shows for its value; a switch has neither
    `metavar` nor `choices`. `for_pixels`: the option is for pictures of pixels alone."""

    name: str
    help: str
    metavar: str | None = None
    choices: tuple[str, ...] = ()
    for_pixels: bool = False


@dataclass(frozen=True, repr=False, eq=False)
class Selection(FrozenRecord):
    """Patterns that select entities; an empty field selects all.

    `layers` and `exclude_layers`: patterns with `*`, `?` and `[…]`, in any case. `colours`:
    "#rrggbb". `line_types`: patterns like those of layers (DASHED, CENTER*)."""

    layers: Annotated[
        tuple[str, ...], Flag("--layer", "Only these layers (CUT, ENG*).", "PATTERN")
    ] = ()
    exclude_layers: Annotated[
        tuple[str, ...], Flag("--exclude-layer", "Not these layers.", "PATTERN")
    ] = ()
    colours: Annotated[
        tuple[str, ...],
        Flag("--colour", "Only this colour (#ff0000, red, or 1 to 255).", "PATTERN"),
    ] = ()
    line_types: Annotated[
        tuple[str, ...], Flag("--line-type", "Only these line types (DASHED, CENTER*).", "PATTERN")
    ] = ()


@dataclass(frozen=True, repr=False, eq=False)
class ReadOptions(FrozenRecord):
    """Options of reading; every field has a default that suits most files.

    `units`: the unit of the file's numbers, over what the file says (a name of
    `units.MM_PER_UNIT`). `tolerance_mm`: how far fitted arcs may lie from a curve; `gap_mm`: open
    ends nearer than this are joined: both on the part, which is `scale` times as large as what
    is drawn. With `chain_gaps` false only equal ends are joined; `across_layers` joins ends of
    different layers too. `box_only`: only the box of the drawing is asked for, so that curves
    within it may be read as their chords. `dpi`: pixels per inch of SVG's px (None: what the
    program that wrote the file took, else DPI). `format`: one of FORMATS, over what the content
    looks like. `select`: which entities.

    `text`: one of TEXTS. `recognise_arcs`: chords on one circle become arcs again. `layout`: a
    layout of a DXF by name instead of model space; `dimensions`: read the lines of dimensions.
    `section_z_mm`: where a solid is cut; `allow_scripts`: run a build123d script to get a solid.

    Of pictures of pixels, whose size must be given by `width_mm`, `dpi`, or `own_dpi` (what the
    file claims): pixels at least as dark as `threshold` (0 white … 1 black) are drawn, or with
    `invert` those as light; shapes of less than `speckle_px` pixels are not; contours are smoothed
    within `smooth_px` pixels; `trace`: one of TRACES.
    Raises OptionError."""

    format: Annotated[
        str | None,
        Flag("--format", "Read it as this format, not by its content.", choices=FORMATS),
    ] = None
    units: Annotated[
        str | None, Flag("--units", "Unit of the drawing: mm, in, um, px ...", "UNIT")
    ] = None
    dpi: Annotated[
        float | None,
        Flag(
            "--dpi",
            "Pixels per inch of an SVG [96, or that of the program that drew it] or a PNG.",
        ),
    ] = None
    tolerance_mm: Annotated[
        float,
        Flag(
            "--tolerance", "Largest distance of fitted arcs from the curves of the part.", "LENGTH"
        ),
    ] = TOLERANCE_MM
    gap_mm: Annotated[float, Flag("--gap", "Ends nearer than this are joined.", "LENGTH")] = GAP_MM
    across_layers: Annotated[
        bool, Flag("--across-layers", "Join ends of different layers too.")
    ] = False
    recognise_arcs: Annotated[
        bool, Flag("--recognise-arcs", "Chords on one circle become arcs again.")
    ] = False
    text: Annotated[str, Flag("--text", "What to do with text.  [skip]", choices=TEXTS)] = "skip"
    dimensions: Annotated[bool, Flag("--dimensions", "Read the lines of dimensions too.")] = False
    layout: Annotated[
        str | None, Flag("--layout", "A layout of a DXF, not model space.", "NAME")
    ] = None
    section_z_mm: Annotated[
        float | None, Flag("--section-z", "Cut a solid at this height.", "HEIGHT")
    ] = None
    allow_scripts: Annotated[
        bool, Flag("--allow-scripts", "Run a build123d script, with your rights.")
    ] = False
    width_mm: Annotated[
        float | None, Flag("--width", "How wide a PNG or JPEG is.", "LENGTH", for_pixels=True)
    ] = None
    own_dpi: Annotated[
        bool,
        Flag("--own-dpi", "A PNG or JPEG has the pixels per inch that it says.", for_pixels=True),
    ] = False
    threshold: Annotated[
        float,
        Flag(
            "--threshold",
            "From which darkness of a PNG or JPEG on it is drawn: 0 to 1.  [0.5]",
            "DARKNESS",
            for_pixels=True,
        ),
    ] = 0.5
    invert: Annotated[
        bool, Flag("--invert", "What is light in a PNG or JPEG is drawn.", for_pixels=True)
    ] = False
    speckle_px: Annotated[
        float,
        Flag("--speckle", "Shapes of fewer pixels are left out.  [4]", "PIXELS", for_pixels=True),
    ] = 4.0
    smooth_px: Annotated[
        float,
        Flag(
            "--smooth",
            "How far contours may leave the pixels' edges.  [0.75]",
            "PIXELS",
            for_pixels=True,
        ),
    ] = 0.75
    trace: Annotated[
        str,
        Flag(
            "--trace",
            "What of dark shapes in a PNG or JPEG is drawn.  [outline]",
            choices=TRACES,
            for_pixels=True,
        ),
    ] = "outline"
    scale: float = 1.0
    box_only: bool = False
    chain_gaps: bool = True
    select: Selection = Selection()

    def __post_init__(self) -> None:
        if self.units is not None and self.units.lower() not in MM_PER_UNIT:
            units = ", ".join(u for u in MM_PER_UNIT if u.isascii() and u != '"')
            raise OptionError(f"unknown unit {self.units!r}", mend=f"use one of {units}")
        if self.format is not None and self.format not in FORMATS:
            raise OptionError(
                f"unknown drawing format {self.format!r}", mend=f"use one of {', '.join(FORMATS)}"
            )
        if self.text not in TEXTS:
            raise OptionError(
                f"text {self.text!r} is not known", mend=f"use one of {', '.join(TEXTS)}"
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
        """Pixels per inch: `dpi`, or the number that CSS defines."""
        return DPI if self.dpi is None else self.dpi

    def as_drawn(self) -> ReadOptions:
        """Return the options with lengths on the part divided by `scale`, so that they apply to
        the drawing.

        A tolerance is not reduced below POSITION_EPS_MM: positions nearer than this are one."""
        from camtool.geometry.polylines import POSITION_EPS_MM

        return replace(
            self,
            tolerance_mm=max(
                self.tolerance_mm / self.scale, min(self.tolerance_mm, POSITION_EPS_MM)
            ),
            gap_mm=self.gap_mm / self.scale,
        )

    def mm_per(self, unit: str) -> float:
        """Return the length of one `unit` in mm; that of a px follows from `dpi`."""
        name = unit.lower()
        return _MM_PER_INCH / self.px_an_inch if name == "px" else MM_PER_UNIT[name]


DEFAULTS = ReadOptions()


class Reading(TypedDict, total=False):
    """Options of reading as keywords: the fields of `ReadOptions`, and of its `Selection`
    (patterns of layers, colours and line types; without patterns, all)."""

    units: str | None
    tolerance_mm: float
    gap_mm: float
    scale: float
    dpi: float | None
    format: str | None
    box_only: bool
    chain_gaps: bool
    across_layers: bool
    text: str
    recognise_arcs: bool
    layout: str | None
    dimensions: bool
    section_z_mm: float | None
    allow_scripts: bool
    width_mm: float | None
    own_dpi: bool
    threshold: float
    speckle_px: float
    smooth_px: float
    invert: bool
    trace: str
    layers: Sequence[str]
    exclude_layers: Sequence[str]
    colours: Sequence[str]
    line_types: Sequence[str]


def flags_of(record: type[ReadOptions | Selection]) -> Iterator[tuple[str, Flag, Any]]:
    """Yield name, flag and type of each option that has a flag."""
    for name, hint in get_type_hints(record, include_extras=True).items():
        for flag in getattr(hint, "__metadata__", ()):
            yield name, flag, hint.__origin__


_HEX = re.compile(r"#(?:[0-9a-f]{3}|[0-9a-f]{6})")


def colour_named(text: str) -> str:
    """Return "#rrggbb" for "#rgb", "#rrggbb", a colour name of SVG or a colour number of AutoCAD
    (1–255); OptionError for any other text."""
    word = text.strip().lower()
    if _HEX.fullmatch(word):
        return word if len(word) > 4 else "#" + "".join(2 * digit for digit in word[1:])
    if re.fullmatch(r"\d{1,3}", word) and 1 <= int(word) <= 255:
        from ezdxf.colors import aci2rgb

        # 7 is the foreground: white on a black screen, black on paper, and read as black.
        number = int(word)
        return "#000000" if number == 7 else "#{:02x}{:02x}{:02x}".format(*aci2rgb(number))
    from camtool.importers.svg.colours import NAMES

    if word in NAMES:
        return NAMES[word]
    raise OptionError(
        f"unknown colour {text!r}", mend="give #rrggbb, a name such as red, or 1 to 255"
    )


def options_of(fields: Mapping[str, Any], machine: Machine | None = None) -> ReadOptions:
    """Return the options with these fields of `ReadOptions` and `Selection`, by name.

    Lengths may be texts with a unit, and a single pattern may stand without a list. Tolerances
    that are not given are those of the `machine`, if there is one. Raises OptionError."""
    settings: dict[str, Any] = {}
    if machine is not None:
        defaults = machine.defaults
        settings = {"tolerance_mm": defaults.fit_tolerance_mm, "gap_mm": defaults.gap_mm}
    selection: dict[str, tuple[str, ...]] = {}
    for name, value in fields.items():
        if name in Selection.__dataclass_fields__:
            patterns = (value,) if isinstance(value, str) else tuple(value)
            named = name == "colours"
            selection[name] = tuple(map(colour_named, patterns)) if named else patterns
        elif name.endswith("_mm") and isinstance(value, str):
            settings[name] = parse_length(value, name=name)
        else:
            settings[name] = value
    return ReadOptions(**settings, select=Selection(**selection))
