"""The layers of pictures, one row each: what a layer consists of, or how it is drawn, and what the
legend calls it.

`LAYERS` is the table. Whatever lists, checks, draws or explains layers reads it, the viewer's page
too: one row adds a layer. A row names the parts of its layer, lines, dots or texts, which pictures
and pages draw and explain alike; or it has functions of its own for pictures, and then the
viewer's script needs one as well (`camtool.pictures.viewer.page.SCRIPTED`). Nothing here loads
numpy: help and completion ask for the names."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

from msgspec import Struct

from camtool.errors import OptionError
from camtool.patterns import guess
from camtool.pictures.colours import (
    BINS,
    DRAWING,
    ENGAGED_NAMES,
    ENGAGED_STYLES,
    FEED,
    FEED_PALE,
    GAP,
    INK,
    OUTLINE,
    PAPER,
    PLUNGE,
    RAPID,
    REVERSAL,
    STOCK,
    SWEPT,
    TRAVEL,
    VERDICTS,
    bin_colours,
)
from camtool.pictures.svg import Look, PathData, element, number, title

if TYPE_CHECKING:
    from camtool.pictures.chains import Chain
    from camtool.pictures.content import Content, Place
    from camtool.pictures.plot import Plot
    from camtool.pictures.scene import Scene
    from camtool.pictures.view import View
    from camtool.verification.report import InspectedReport

SWATCH = 34.0
"""Width of the swatch before a line of the legend."""

MAX_LAYERS_NAMED = 7

TRACE_PEN, FEED_PEN, DRAWING_PEN, ALONE_PEN = 2.7, 2.8, 4.8, 2.8
RING = 8.0

RAPID_LINE: Look = {"stroke": RAPID, "stroke-width": 1.4, "stroke-dasharray": "7 5"}
STOCK_LINE: Look = {"stroke": STOCK, "stroke-width": 2.0}
FLIP_LINE: Look = {"stroke": INK, "stroke-width": 1.6, "stroke-dasharray": "14 4 3 4"}
PIN_MARK: Look = {"r": 5.0, "fill": STOCK, "stroke": INK, "stroke-width": 1.6}
PLUNGE_MARK: Look = {"r": 5.0, "fill": PLUNGE, "stroke": PAPER, "stroke-width": 1.6}
START_MARK: Look = {"r": 5.0, "fill": PAPER, "stroke": FEED, "stroke-width": 2.2}
REVERSAL_MARK: Look = {"r": 3.4, "fill": REVERSAL, "stroke": PAPER, "stroke-width": 1.0}
WORST_MARK: Look = {"r": RING, "fill": "none", "stroke": GAP, "stroke-width": 2.0}
GAP_MARK: Look = {"r": RING, "fill": "none", "stroke": GAP, "stroke-width": 2.4}
POINT_MARK: Look = {"r": 4.0, "fill": INK, "stroke": PAPER, "stroke-width": 1.2}
TAB_MARK: Look = {"r": 6.5, "fill": "none", "stroke": PLUNGE, "stroke-width": 3.0}
FAULT_MARK: Look = {"r": 9.0, "fill": "none", "stroke": GAP, "stroke-width": 3.0}
CROSSING_MARK: Look = {"r": 5.0, "fill": GAP, "stroke": PAPER, "stroke-width": 1.2}


class LegendEntry(Struct, frozen=True):
    """An entry of the legend: its text, and its swatch as SVG from x 0 to `SWATCH`, centred on
    height 0 ("" for none)."""

    swatch: str
    name: str


class LineGroup(Struct, frozen=True, eq=False):
    """Lines and arcs of one look, as an SVG group of this id. Width and dashes are in units of the
    page; `name` stands in the legend."""

    id: str
    name: str
    chains: Sequence[Chain]
    look: Look

    def __bool__(self) -> bool:
        return bool(self.chains)

    def draw(self, plot: Plot) -> str:
        """Return the SVG of the lines, in mm."""
        mm, look = plot.view.mm, {"fill": "none", **self.look}
        look["stroke-width"] = mm(float(look["stroke-width"]))
        if "stroke-dasharray" in look:
            dashes = str(look["stroke-dasharray"]).split()
            look["stroke-dasharray"] = " ".join(f"{mm(float(dash)):.9g}" for dash in dashes)
        return plot.lines(self.id, self.chains, look)

    def entries(self, view: View) -> Iterator[LegendEntry]:
        """Yield the entry of the lines in the legend."""
        look = self.look
        dashes = str(look.get("stroke-dasharray", ""))
        swatch = line_swatch(str(look["stroke"]), float(look["stroke-width"]), dashes)
        yield LegendEntry(swatch, self.name)


class DotGroup(Struct, frozen=True, eq=False):
    """Round marks of one look at `places` (x, y) mm, as an SVG group of this id; `name` stands in
    the legend."""

    id: str
    name: str
    places: Sequence[Place]
    look: Look

    def __bool__(self) -> bool:
        return bool(self.places)

    def draw(self, plot: Plot) -> str:
        """Return the SVG of the marks, in units of the page."""
        return plot.dots(self.id, self.places, self.look)

    def entries(self, view: View) -> Iterator[LegendEntry]:
        """Yield the entry of the marks in the legend, if any of them is in view."""
        if any(view.shows(*place) for place in self.places):
            yield LegendEntry(dot_swatch(self.look), self.name)


class TextGroup(Struct, frozen=True, eq=False):
    """Short texts of one colour beside their `places` (x, y) mm, as a group of this id; a text
    without room is left out. The legend does not name them."""

    id: str
    texts: Sequence[str]
    places: Sequence[Place]
    colour: str

    def __bool__(self) -> bool:
        return bool(self.places)

    def draw(self, plot: Plot) -> str:
        """Return the SVG of the texts, in units of the page."""
        return plot.texts(self.id, self.texts, self.places, self.colour)

    def entries(self, view: View) -> Iterator[LegendEntry]:
        """Yield no entry: the legend does not name texts."""
        yield from ()


Part = LineGroup | DotGroup | TextGroup


class Layer(Struct, frozen=True):
    """A layer of a picture, made of `parts` or drawn by functions.

    parts: the groups of lines, dots and texts that it draws and that the legend names.
    holds, draw, legend: in place of parts, functions that say if the layer has anything to show,
        write its SVG, and yield its lines of the legend. A legend beside parts replaces theirs.
    ground: writes the SVG that lies below all layers.
    in_mm: the layer is drawn in mm with Y up, below all layers in units of the page.
    height: of two layers of a kind, the higher one covers the other.
    place: order in the legend.
    usual: the layer is shown when no layers are named.
    needs: content that a picture must have: a "drawing", "moves", or the predicted "path".
    under_path: the layer stays when the predicted path is shown.
    hint: reason why the layer may be empty, if that is not the drawing.
    key: key that switches the layer in the viewer."""

    name: str
    parts: Callable[[Content], Sequence[Part]] | None = None
    holds: Callable[[Content], object] | None = None
    draw: Callable[[Content, Plot], str] | None = None
    legend: Callable[[Content, View], Iterable[LegendEntry]] | None = None
    ground: Callable[[Content, Plot], str] | None = None
    in_mm: bool = False
    height: int = 100
    place: int = 100
    usual: bool = True
    needs: str = "moves"
    under_path: bool = True
    hint: str = ""
    key: str = ""

    def is_in(self, content: Content) -> bool:
        """Return True if the picture shows the layer and the layer is not empty."""
        shown = content.shown
        return (
            (self.usual if shown is None else self.name in shown)
            and (self.under_path or content.trace is None)
            and (bool(self.parts_in(content)) or bool(self.holds and self.holds(content)))
        )

    def parts_in(self, content: Content) -> list[Part]:
        """Return the parts of the layer that are not empty."""
        return [part for part in self.parts(content) if part] if self.parts else []

    def svg(self, content: Content, plot: Plot) -> str:
        """Return the SVG of the layer; "" when nothing of it is in view."""
        if self.draw is not None:
            return self.draw(content, plot)
        parts = (part.draw(plot) for part in self.parts_in(content))
        return "\n".join(part for part in parts if part)

    def entries(self, content: Content, view: View) -> Iterable[LegendEntry]:
        """Return the entries of the layer in the legend."""
        if self.legend is not None:
            return self.legend(content, view)
        return [entry for part in self.parts_in(content) for entry in part.entries(view)]


def line_swatch(colour: str, width: float, dashes: str = "") -> str:
    """Return the SVG of a piece of line, for the legend."""
    look: Look = {"stroke": colour, "stroke-width": width, "fill": "none"}
    if dashes:
        look["stroke-dasharray"] = dashes
    else:
        look["stroke-linecap"] = "round"
    return element("path", {"d": f"M1 0L{number(SWATCH - 1.0)} 0", **look})


def dot_swatch(look: Look) -> str:
    """Return the SVG of a round mark in the middle of the swatch, for the legend."""
    return element("circle", {"cx": SWATCH / 2.0, "cy": 0.0, **look})


def map_swatch(width: float) -> str:
    """Return the SVG of a piece of line in all colours of the map, for the legend."""
    step = SWATCH / BINS
    pieces = []
    for index, colour in enumerate(bin_colours()):
        data = PathData()
        data.move(index * step, 0.0)
        data.line(SWATCH, 0.0)  # the next one covers the rest: no seams
        look: Look = {"d": str(data), "stroke": colour, "stroke-width": width, "fill": "none"}
        pieces.append(element("path", look))
    return element("g", {}, *pieces)


# Drawings.


def _drawing(content: Content, plot: Plot) -> str:
    """Return the SVG of the lines of the drawing, a group for each of its layers."""
    is_alone = content.is_drawing_alone
    width = plot.pen(ALONE_PEN if is_alone else DRAWING_PEN, content.outlines)
    groups = [
        element("g", {"stroke": group.colour}, title(group.name), plot.path(group.chains))
        for group in content.groups
    ]
    return element("g", {"id": "drawing", **plot.round_pen(width)}, *groups)


def _drawing_legend(content: Content, view: View) -> Iterator[LegendEntry]:
    if not content.is_drawing_alone:
        yield LegendEntry(line_swatch(DRAWING, 5.0), "drawing")
    elif len(content.groups) == 1:
        name = content.groups[0].name
        named = f"drawing, layer {name}" if name.strip() else "drawing"
        yield LegendEntry(line_swatch(OUTLINE, 2.8), named)
    else:
        for group in content.groups[:MAX_LAYERS_NAMED]:
            yield LegendEntry(line_swatch(group.colour, 2.8), group.name or "(no layer)")
        if extra := len(content.groups[MAX_LAYERS_NAMED:]):
            yield LegendEntry("", f"and {extra} more layers")


def _noted(content: Content) -> list[Part]:
    """Return marks for open ends, drill centres, crossings and branches of contours, and faults of
    the stock."""
    places = content.places
    return [
        DotGroup("gaps", "open end", places.gaps.tolist(), GAP_MARK),
        DotGroup("points", "point", places.points.tolist(), POINT_MARK),
        DotGroup("doubts", "crossing or branch", places.ambiguous.tolist(), CROSSING_MARK),
        faults_of(content.scene),
    ]


def faults_of(scene: Scene) -> DotGroup:
    """Return the marks at the places of findings about the stock."""
    return DotGroup("faults", "finding of the stock", scene.faults, FAULT_MARK)


# Moves.


def _swept(content: Content, plot: Plot) -> str:
    """Return the SVG of the cuts at the true width of the tool."""
    ends: Look = {"stroke-linecap": "round", "stroke-linejoin": "round"}
    groups = []
    for index, each in enumerate(content.swept):
        look: Look = {"fill": SWEPT, "stroke": "none"}
        if each.width_mm is not None:
            look = {"fill": "none", "stroke": SWEPT, "stroke-width": each.width_mm, **ends}
        groups.append(plot.lines(f"swept-{index + 1}" if index else "swept", each.chains, look))
    return "\n".join(groups)


def _swept_legend(content: Content, view: View) -> Iterator[LegendEntry]:
    yield LegendEntry(line_swatch(SWEPT, 9.0), swept_words(content.scene))


def swept_words(scene: Scene) -> str:
    """Describe the width of the cuts, of one tool or of several; "" if it is not known."""
    if scene.tool_mm:
        return f"tool {scene.tool_mm:.4g} mm wide"
    if scene.nose is not None:
        return "tool, as wide as it is deep"
    tools = [tool for _, tool in scene.turns]
    widths = {tool.diameter_mm for tool in tools if tool.kind != "v" and tool.diameter_mm}
    words = [f"{wide:.4g} mm" for wide in sorted(widths)]
    words += ["V bit"] * any(tool.kind == "v" for tool in tools)
    return f"cuts: {', '.join(words)}" if words else ""


def _travel_legend(content: Content, view: View) -> Iterator[LegendEntry]:
    """Yield the size of the table's travel, if a side of its frame is in view."""
    wide, high = content.scene.travel_mm or (0.0, 0.0)
    (x0, x1), (y0, y1) = view.x_range, view.y_range
    overlaps = x0 <= wide and x1 >= 0.0 and y0 <= high and y1 >= 0.0
    inside = x0 > 0.0 and x1 < wide and y0 > 0.0 and y1 < high
    if overlaps and not inside:
        yield LegendEntry(line_swatch(TRAVEL, 2.0), f"travel {wide:g} × {high:g} mm")


def _stock(content: Content) -> list[Part]:
    """Return the outline of the stock, if the job says where it lies, and the line about which the
    part is turned over."""
    scene, parts = content.scene, list[Part]()
    if scene.stock_mm is not None:
        left, low, right, high = scene.stock_mm
        name = f"stock {right - left:g} × {high - low:g} mm"
        parts.append(LineGroup("stock", name, content.stock, STOCK_LINE))
    if scene.stock_mm is not None and scene.swept_mm is not None:
        line = {**STOCK_LINE, "stroke-dasharray": "6 5"}
        parts.append(LineGroup("passed-over", "no clamps within", content.passed_over, line))
    flips = content.straight(scene.flips)
    parts.append(LineGroup("flips", "turned over about this line", flips, FLIP_LINE))
    return parts


def _pins(content: Content) -> list[Part]:
    return [DotGroup("pins", "alignment pin", content.scene.pins, PIN_MARK)]


def _feeds(content: Content, plot: Plot) -> str:
    """Return the SVG of the feeds: solid lines, slopes in the colour of plunges; pale and thin
    below a predicted path."""
    moves, pale = content.moves, content.trace is not None
    cuts = (*moves.feeds, *moves.ramps)
    pen = plot.round_pen(plot.pen(0.6 * FEED_PEN if pale else FEED_PEN, cuts))
    if pale:
        return plot.lines("feeds", cuts, {**pen, "stroke": FEED_PALE})
    level = plot.lines("feeds", moves.feeds, {**pen, "stroke": FEED})
    slopes = plot.lines("ramps", moves.ramps, {**pen, "stroke": PLUNGE})
    return "\n".join(part for part in (level, slopes) if part)


def _feeds_legend(content: Content, view: View) -> Iterator[LegendEntry]:
    moves, trace = content.moves, content.trace
    if moves.feeds and trace is None:
        yield LegendEntry(line_swatch(FEED, 2.8), "feed")
    elif moves.feeds:
        below = "programmed path" if content.times == 1.0 else "wanted path"
        yield LegendEntry(line_swatch(FEED_PALE, 2.0), below)
    if moves.ramps and trace is None:
        yield LegendEntry(line_swatch(PLUNGE, 2.8), "slope")


# Predictions.


def _path(content: Content, plot: Plot) -> str:
    return plot.trace(content.trace, TRACE_PEN) if content.trace is not None else ""


def _path_legend(content: Content, view: View) -> Iterator[LegendEntry]:
    scale = "by error" if content.times == 1.0 else f"error × {content.times:g}"
    yield LegendEntry(map_swatch(4.0), f"predicted path, {scale}")


def _engagement(content: Content, plot: Plot) -> str:
    return plot.engagement(content.engaged, TRACE_PEN) if content.engaged is not None else ""


def _engagement_legend(content: Content, view: View) -> Iterator[LegendEntry]:
    steps = set() if content.engaged is None else set(content.engaged.step.tolist())
    if any(step >= 0 for step in steps):
        yield LegendEntry(map_swatch(4.0), "engagement of the tool")
    for step, name in ENGAGED_NAMES.items():
        if step in steps:
            colour, share = ENGAGED_STYLES[step]
            yield LegendEntry(line_swatch(colour, share * 4.0), name)


def _worst_legend(content: Content, view: View) -> Iterator[LegendEntry]:
    if any(view.shows(*place) for place in content.worst.tolist()):
        yield LegendEntry(dot_swatch(WORST_MARK), "largest errors, by rank")


# Dimensions with their verdicts.

INSPECTED_PEN = 2.2


def _inspected(content: Content) -> list[Part]:
    """Return the line from end to end of each inspected dimension, in the colour of its
    verdict."""
    parts: list[Part] = []
    for verdict, colour in VERDICTS.items():
        own_dimensions = [each for each in content.scene.inspected if each.verdict == verdict]
        look: Look = {"stroke": colour, "stroke-width": INSPECTED_PEN}
        chains = content.straight([each.places_mm for each in own_dimensions])
        parts.append(LineGroup(f"dimensions-{verdict}", f"dimension: {verdict}", chains, look))
    return parts


def _sizes(content: Content) -> list[Part]:
    """Return the ends of each inspected dimension, and its size beside it."""
    parts: list[Part] = []
    every = content.scene.inspected
    for verdict, colour in VERDICTS.items():
        ends = [end for each in every if each.verdict == verdict for end in each.places_mm]
        look: Look = {"r": 3.4, "fill": colour, "stroke": PAPER, "stroke-width": 1.0}
        parts.append(DotGroup(f"ends-{verdict}", "", ends, look))
    # If there is no room for all, those that matter most come first.
    order = {"out": 0, "undecided": 1}
    every = tuple(sorted(every, key=lambda each: order.get(each.verdict, 2)))
    middles = [_middle(*each.places_mm) for each in every]
    return [*parts, TextGroup("sizes", [_size_words(each) for each in every], middles, INK)]


def _middle(one: Place, other: Place) -> Place:
    return 0.5 * (one[0] + other[0]), 0.5 * (one[1] + other[1])


def _size_words(item: InspectedReport) -> str:
    """Format the required size and the predicted size with its uncertainty."""
    band = "" if item.expanded_um is None else f" ± {1e-3 * item.expanded_um:.3f}"
    return f"{item.asked}: {item.fit_mm:.3f}{band}"


# Part zero.


def _zero(content: Content, plot: Plot) -> str:
    place = plot.view.page(0.0, 0.0)
    return _cross(place, 13.0, {"id": "part-zero"}) if plot.view.shows(0.0, 0.0) else ""


def _zero_legend(content: Content, view: View) -> Iterator[LegendEntry]:
    if view.shows(0.0, 0.0):
        yield LegendEntry(_cross((SWATCH / 2.0, 0.0), 9.0, {}), "part zero")


def _cross(place: tuple[float, float], size: float, name: Look) -> str:
    """Return the SVG of a cross with a ring around its centre."""
    data = PathData()
    for dx, dy in ((size, 0.0), (0.0, size)):
        data.move(place[0] - dx, place[1] - dy)
        data.line(place[0] + dx, place[1] + dy)
    line: Look = {"fill": "none", "stroke": INK, "stroke-width": 1.8}
    ring: Look = {"cx": number(place[0]), "cy": number(place[1]), "r": 0.5 * size}
    lines = element("path", {"d": str(data)})
    return element("g", {**name, **line}, element("circle", ring), lines)


LAYERS = (
    Layer(
        "drawing",
        holds=lambda content: content.outlines,
        draw=_drawing,
        legend=_drawing_legend,
        ground=lambda content, plot: plot.body(content.outlines),
        in_mm=True,
        height=3,
        place=0,
        needs="drawing",
        hint="; there is no drawing in it",
    ),
    Layer(
        "swept",
        holds=lambda content: content.swept,
        draw=_swept,
        legend=_swept_legend,
        in_mm=True,
        height=1,
        place=6,
        hint="; --tool-diameter says how wide the tool is (a V bit is as wide as it is deep)",
    ),
    Layer(
        "travel",
        holds=lambda content: content.scene.travel_mm,
        draw=lambda content, plot: plot.frame(
            "travel", content.scene.travel_mm or (0.0, 0.0), TRAVEL
        ),
        legend=_travel_legend,
        in_mm=True,
        height=2,
        place=11,
        hint="; the path does not lie within the table's travel",
    ),
    Layer(
        "stock",
        _stock,
        in_mm=True,
        height=2,
        place=12,
        needs="drawing",
        hint="; [stock] of a job file says its corner and size",
    ),
    Layer(
        "pins",
        _pins,
        height=6,
        place=12,
        needs="drawing",
        hint="; pins of [[setups]] of a job file say where they are",
    ),
    Layer(
        "rapids",
        lambda content: [LineGroup("rapids", "rapid", content.moves.rapids, RAPID_LINE)],
        legend=lambda content, view: [LegendEntry(line_swatch(RAPID, 1.6, "7 5"), "rapid")],
        in_mm=True,
        height=4,
        place=3,
        under_path=False,
    ),
    Layer(
        "feeds",
        holds=lambda content: content.moves.feeds or content.moves.ramps,
        draw=_feeds,
        legend=_feeds_legend,
        in_mm=True,
        height=5,
        place=2,
    ),
    Layer(
        "plunges",
        lambda content: [
            DotGroup("plunges", "plunge", content.moves.plunges.tolist(), PLUNGE_MARK)
        ],
        legend=lambda content, view: [LegendEntry(dot_swatch(PLUNGE_MARK), "plunge")],
        height=4,
        place=4,
        under_path=False,
    ),
    Layer(
        "starts",
        lambda content: [DotGroup("starts", "start", content.starts.tolist(), START_MARK)],
        legend=lambda content, view: [LegendEntry(dot_swatch(START_MARK), "start")],
        height=3,
        place=5,
        under_path=False,
    ),
    Layer(
        "order",
        lambda content: [TextGroup("order", *content.order, INK)],
        height=7,
        under_path=False,
    ),
    Layer(
        "arrows",
        holds=lambda content: content.moves.feeds,
        draw=lambda content, plot: plot.arrows(content.moves.feeds),
        height=2,
        under_path=False,
    ),
    Layer(
        "reversals",
        lambda content: [
            DotGroup("reversals", "reversal", content.reversals.tolist(), REVERSAL_MARK)
        ],
        height=1,
        place=7,
        usual=False,
        key="v",
    ),
    Layer(
        "path",
        holds=lambda content: content.trace is not None,
        draw=_path,
        legend=_path_legend,
        in_mm=True,
        height=6,
        place=1,
        needs="path",
    ),
    Layer(
        "engagement",
        holds=lambda content: content.engaged is not None,
        draw=_engagement,
        legend=_engagement_legend,
        in_mm=True,
        height=6,
        place=1,
        usual=False,
        under_path=False,
        hint="; --tool-diameter or --job says how wide the tool is",
    ),
    Layer(
        "worst",
        holds=lambda content: len(content.worst),
        draw=lambda content, plot: plot.ranks("worst", content.worst.tolist(), WORST_MARK),
        legend=_worst_legend,
        height=8,
        place=8,
        needs="path",
    ),
    Layer(
        "zero",
        holds=lambda content: not content.is_empty,
        draw=_zero,
        legend=_zero_legend,
        height=5,
        place=10,
        needs="drawing",
    ),
    Layer(
        "tabs",
        lambda content: [DotGroup("tabs", "tab", content.scene.tabs, TAB_MARK)],
        height=9,
        place=13,
        hint="; tabs of a job, or --tabs, make some",
    ),
    Layer(
        "dimensions",
        _inspected,
        in_mm=True,
        height=7,
        place=14,
        hint="; --tolerances names some",
        key="d",
    ),
    Layer(
        "sizes",
        _sizes,
        legend=lambda content, view: (),
        height=10,
        hint="; --tolerances names some",
    ),
    Layer("doubts", _noted, height=6, place=9, needs="drawing"),
)
"""All layers, in the order in which help and messages name them."""


def layer_names() -> tuple[str, ...]:
    """Return the names of all layers."""
    return tuple(layer.name for layer in LAYERS)


def layer_of(name: str) -> Layer:
    """Return the layer with this name."""
    return next(layer for layer in LAYERS if layer.name == name)


def usual_layers() -> frozenset[str]:
    """Return the names of the layers that are shown if none are named."""
    return frozenset(layer.name for layer in LAYERS if layer.usual)


def chosen(names: Iterable[str], excluded: Iterable[str]) -> frozenset[str]:
    """Return the layers `names` (none: the usual ones) without those `excluded`; OptionError for
    unknown names, and when no layer remains."""
    shown, left_out = set(names), set(excluded)
    available = layer_names()
    for name in sorted(shown | left_out):
        if name not in available:
            raise OptionError(
                f"there is no layer {name!r}",
                mend=f"{guess(name, available)}The layers are {', '.join(available)}",
            )
    remaining = frozenset(shown or usual_layers()) - left_out
    if not remaining:
        raise OptionError("no layer is left to show", mend="name others, or leave out fewer")
    return remaining


def from_the_ground_up() -> list[Layer]:
    """Return all layers, the lowest first."""
    return sorted(LAYERS, key=lambda layer: layer.height)


def layers_in(content: Content) -> list[str]:
    """Return the names of the layers that are not empty, whether they are in the window or not."""
    return [layer.name for layer in LAYERS if layer.is_in(content)]


def legend_of(content: Content, view: View) -> list[LegendEntry]:
    """Return the entries of the legend, for all layers in the picture."""
    present = (layer for layer in LAYERS if layer.is_in(content))
    ordered = sorted(present, key=lambda layer: layer.place)
    return [entry for layer in ordered for entry in layer.entries(content, view)]


def draw_layers(content: Content, plot: Plot) -> list[str]:
    """Return the SVG of the layers, the lowest first: a group of all layers in mm, then the
    others."""
    present = [layer for layer in from_the_ground_up() if layer.is_in(content)]
    lines = [layer.ground(content, plot) for layer in present if layer.ground is not None]
    lines += [layer.svg(content, plot) for layer in present if layer.in_mm]
    lines = [line for line in lines if line]
    group = element("g", {"id": "mm", "transform": plot.view.matrix()}, *lines) if lines else ""
    return [group, *(layer.svg(content, plot) for layer in present if not layer.in_mm)]
