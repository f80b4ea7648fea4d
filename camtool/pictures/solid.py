"""Pictures of the stock after a program: its shaded height map on a page.

`iso` shows the block from outside, aslant, and `bottom` too, turned over about the axis X; `front`
and `side` as a drawing does; all with its sizes along its edges. `top`, `leftover`, `gouge` show
it from above, with axes. The raster is a PNG within the SVG; all that is written stands in the SVG
itself."""

from __future__ import annotations

import math

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Octets
from camtool.errors import OptionError
from camtool.pictures import text
from camtool.pictures.chains import chains_of, path_data
from camtool.pictures.colours import (
    BINS,
    FRAME,
    OUTLINE,
    PAPER,
    QUIET,
    bin_colours,
    channels,
    on_dark,
)
from camtool.pictures.layers import DotGroup, LegendEntry, faults_of, line_swatch
from camtool.pictures.options import SVG_WIDTH_PX, PictureOptions
from camtool.pictures.page import (
    BAR_GAP,
    BAR_WIDTH,
    HEAD_GAP,
    LEGEND_DROP,
    NAME_LIFT,
    TICK_CAP,
    axes_around,
    fitted,
    foot_of,
    legend_rows,
    mat,
    scale_bar,
    sheet,
    table_of,
    title_and_notes,
)
from camtool.pictures.plot import Plot
from camtool.pictures.relief import (
    CAMERAS,
    SAMPLES,
    Camera,
    Stage,
    data_uri,
    floor_colours,
    light_of,
    picture_of,
    png_of,
    stage_of,
)
from camtool.pictures.scene import Scene, StockPair
from camtool.pictures.svg import Look, PathData, element, number
from camtool.pictures.text import TextStyle
from camtool.pictures.view import (
    CROP_SHAPES,
    MARGIN,
    TALLEST,
    WIDEST,
    PageBox,
    View,
    decimals_of,
    fit,
    multiples,
    page_width,
    round_step,
)
from camtool.records import replace
from camtool.stock.before import WHOLE
from camtool.stock.heightmap import Box, HeightMap, cell_for, height_map

MAP_CELLS = 3_000_000
"""Largest number of cells of a height map: 12 MB, and as much for the moves that cut them."""

MAX_RASTER_PX = 2400
"""Wider pictures show larger pixels: the map has no finer cells."""

BOARD_SHARE = 0.14
"""Width of the board around the stock, as a share of its longer side."""

AROUND_SHARE = 0.04
"""Room around the stock in its picture, as a share of its longer side."""

LABEL_ROOM = 34.0
"""Room on the page beside the block for its sizes."""

ISO_SCALE = math.sqrt(2.0 / 3.0)
"""Lengths on the picture over lengths along the axes, in the view "iso"."""

MAX_COMPARED = 1_000_000
"""Cells of a map whose heights are compared with the wanted ones."""

WALL_CELLS = 1.0
"""Width of the band beside walls in which heights are not compared, in cells."""

BESIDE_CELLS = 1
"""Two stocks are compared by the extreme heights within so many cells: a wall that has moved by
less than a cell is no difference of heights."""

MIN_SHOWN_MM = 2e-3

MAX_BAR = 320.0

BAR_STEPS = 200
GREY = "#b9bec4"
FROM_ABOVE = ("top", "leftover", "gouge")
LEVEL = ("front", "side")
"""Views along the table, in which the block hides the cuts: their outline is dashed."""

DASHES = "7 4"
BAR_NAMES = {"leftover": "left (mm)", "gouge": "too deep (mm)"}
GHOST_PEN, GHOST_ALPHA = 1.3, "8c"


class Solid(Struct, frozen=True, eq=False):
    """The content of a picture of the stock: the block and its moves, the map of the part that is
    shown, where that part ends in X and Y, how deep the moves cut there, mm, and how much (NY, NX)
    mm it is higher or lower than wanted, None if not asked for."""

    pair: StockPair
    height_map: HeightMap
    ends_mm: tuple[float, float]
    cut_mm: float
    off_mm: Floats | None = None

    @property
    def deepest_mm(self) -> float:
        """Depth of the deepest cut that is shown, mm; no more than the thickness."""
        return min(-float(self.height_map.heights.min(initial=0.0)), self.pair.thickness_mm)


def draw_solid(scene: Scene, options: PictureOptions) -> str:
    """Return SVG text of a view of the stock.

    OptionError if moves or tools are not known, or if the view needs wanted moves and there are
    none."""
    if scene.cut is None:
        raise OptionError(
            f"the view {options.view} shows the stock, and nothing cuts it here",
            mend="give the machine of the toolpath (--target), or drop --view",
        )
    pair = scene.cut()
    width = page_width(options.size_px or SVG_WIDTH_PX)
    window = _window(pair, options)
    solid = _solid(pair, window, options)
    head, top = title_and_notes(scene.title, _notes(solid, options), width)
    if options.view in FROM_ABOVE:
        return _from_above(scene, solid, options, head, top)
    return _from_outside(scene, solid, options, head, top)


def _window(pair: StockPair, options: PictureOptions) -> Box:
    """Return the part of the plane that is shown: left, lower, right and upper edge, mm."""
    if options.crop_mm is not None:
        x, y, wide, high = options.crop_mm
        return x, y, x + wide, y + high
    left, bottom, right, top = pair.box_mm
    pad = AROUND_SHARE * max(right - left, top - bottom)
    return left - pad, bottom - pad, right + pad, top + pad


def _solid(pair: StockPair, window: Box, options: PictureOptions) -> Solid:
    """Compute the height map of the part of the stock in a window, as fine as the pixels of the
    picture."""
    side = max(window[2] - window[0], window[3] - window[1])
    # Seen from above, the stock beside the window throws shadows into it.
    margin = 0.1 * side if options.view in FROM_ABOVE else 0.0
    low, high = np.array(window[:2]) - margin, np.array(window[2:]) + margin
    box = (*np.maximum(low, pair.box_mm[:2]).tolist(), *np.minimum(high, pair.box_mm[2:]).tolist())
    if box[0] >= box[2] or box[1] >= box[3]:
        raise OptionError(
            f"the stock is not in the part from ({window[0]:g}, {window[1]:g}) to "
            f"({window[2]:g}, {window[3]:g}) mm",
            where="--crop",
            mend="it lies between ({:g}, {:g}) and ({:g}, {:g}) mm".format(*pair.box_mm),
        )
    pixels = min(options.size_px or SVG_WIDTH_PX, MAX_RASTER_PX) * SAMPLES
    cells = MAP_CELLS if options.view not in BAR_NAMES else MAX_COMPARED
    cell = max(side / pixels, cell_for(box, cells))
    map_found = height_map(pair.moves, box, cell, owners=True)
    cut_mm = -float(map_found.heights.min(initial=0.0))
    material = map_found if pair.before is None else pair.before.shown_in(map_found)
    if options.view == "bottom":
        before = replace(pair.before or WHOLE, thickness_mm=pair.thickness_mm)
        return Solid(pair, before.turned_over(material), (box[2], -box[1]), cut_mm)
    if options.view not in BAR_NAMES:
        return Solid(pair, material, box[2:], cut_mm)
    lowest, highest = _wanted_heights(pair, map_found, box, options)
    heights = material.heights.clip(-pair.thickness_mm)
    deviations = heights - highest if options.view == "leftover" else lowest - heights
    # Material that was gone before counts neither as left nor as cut.
    deviations = np.where(material.heights == map_found.heights, deviations, 0.0)
    return Solid(pair, material, box[2:], cut_mm, deviations.astype(np.float64))


def _wanted_heights(
    pair: StockPair, stock_map: HeightMap, box: Box, options: PictureOptions
) -> tuple[Floats, Floats]:
    """Return the least and the greatest height (NY, NX) mm that is wanted in each cell."""
    if pair.bands is not None:
        bands = pair.bands(WALL_CELLS * stock_map.cell_mm)
        rows = [
            bands(np.column_stack([stock_map.x, np.full(len(stock_map.x), y)]))
            for y in stock_map.y.tolist()
        ]
        stacked = np.stack(rows).clip(-pair.thickness_mm, 0.0)
        return stacked[..., 0], stacked[..., 1]
    if pair.wanted is None:
        raise OptionError(
            f"the view {options.view} compares the stock with the wanted one, which is not known",
            mend="give the drawing and its job (verify --against), or use --view top",
        )
    wanted_heights = height_map(pair.wanted, box, stock_map.cell_mm).heights.clip(
        -pair.thickness_mm
    )
    low, high = (
        _extreme(wanted_heights, extreme).astype(np.float64)
        for extreme in (np.minimum, np.maximum)
    )
    return low, high


def _extreme(heights: np.ndarray, extreme: np.ufunc) -> np.ndarray:
    """Return for each cell the greatest or least height within BESIDE_CELLS of it; `extreme` is
    np.maximum or np.minimum."""
    for axis in (0, 1):
        pad = [(0, 0), (0, 0)]
        pad[axis] = (BESIDE_CELLS, BESIDE_CELLS)
        wide, count = np.pad(heights, pad, mode="edge"), heights.shape[axis]
        for step in range(2 * BESIDE_CELLS + 1):
            part = wide.take(range(step, step + count), axis)
            heights = part if step == 0 else extreme(heights, part)
    return heights


def _notes(solid: Solid, options: PictureOptions) -> tuple[str, ...]:
    """Return the lines below the title: size of the stock, deepest cut and greatest difference."""
    left, bottom, right, top = solid.pair.box_mm
    sizes = (right - left, top - bottom, solid.pair.thickness_mm)
    size_text = " × ".join(number(size, 2) for size in sizes)
    guessed = "" if solid.pair.known else ", as large as the cuts need"
    depth = number(solid.cut_mm, 3)
    is_through = solid.pair.known and solid.cut_mm >= solid.pair.thickness_mm
    notes = [
        f"stock {size_text} mm{guessed}; cut {depth} mm deep{', through it' if is_through else ''}"
    ]
    if solid.off_mm is not None:
        max_mm = float(solid.off_mm.max(initial=0.0))
        word = "higher" if options.view == "leftover" else "lower"
        extent = f"nowhere more than {number(MIN_SHOWN_MM, 3)} mm {word} than {solid.pair.against}"
        if max_mm > MIN_SHOWN_MM:
            row, column = divmod(int(solid.off_mm.argmax()), solid.off_mm.shape[1])
            x, y = solid.height_map.x[column], solid.height_map.y[row]
            than = f"{number(max_mm, 3)} mm {word} than {solid.pair.against}"
            extent = f"up to {than}, at ({x:.2f}, {y:.2f}) mm"
        cell = number(solid.height_map.cell_mm, 3)
        notes.append(f"{extent}; walls beside their place by less than {cell} mm are not shown")
    return tuple(notes)


def _from_above(
    scene: Scene, solid: Solid, options: PictureOptions, head: str, head_end: float
) -> str:
    """Return the SVG text of a view from above, with axes."""
    width = page_width(options.size_px or SVG_WIDTH_PX)
    left, bottom, right, top = _window(solid.pair, options)
    shapes = (WIDEST, TALLEST) if options.crop_mm is None else CROP_SHAPES
    bar = _bar_of(solid, options)
    shown = np.array([[left, right], [bottom, top]])
    view, ticks = fitted(shown, head_end + HEAD_GAP, width, shapes, lambda _: bar.width)
    faults = faults_of(scene)
    entries = [*_entries(scene, options), *faults.entries(view)]
    table, bar_y = table_of(entries, view, view.box)
    legend_y = view.box.bottom + LEGEND_DROP
    sizes = (width, foot_of(table, legend_y))
    return sheet(
        scene.title,
        sizes,
        options,
        _raster(_stage(solid, bar, options), CAMERAS["top"], view, view.box, options),
        _ghost(scene, CAMERAS["top"], view) if options.view != "top" else "",
        faults.draw(Plot(view)) if faults else "",
        mat(view.box, *sizes),
        head,
        axes_around(view, ticks),
        bar.draw(view.box),
        legend_rows(table, view.box.left, legend_y),
        scale_bar(view, view.box.right, bar_y),
    )


def _from_outside(
    scene: Scene, solid: Solid, options: PictureOptions, head: str, top: float
) -> str:
    """Return the SVG text of a view of the block from outside, with its sizes."""
    width = page_width(options.size_px or SVG_WIDTH_PX)
    camera, bar = CAMERAS[options.view], _bar_of(solid, options)
    level, is_below = options.view in LEVEL, options.view == "bottom"
    corners = _corners(solid, camera)
    low, high = corners.min(axis=0), corners.max(axis=0)
    box_right = width - MARGIN - (0.0 if level else bar.width)
    thick = text.width(_thickness(solid), TICK_CAP) + 8.0
    room = LABEL_ROOM * float(high[0] - low[0]) / (box_right - MARGIN - thick)
    shown = np.column_stack([low - np.array([0.0, room]), high + np.array([0.0, 0.5 * room])])
    view = fit(shown, MARGIN, top + 20.0, box_right - thick, (0.2, 0.8))
    all_across = PageBox(0.0, top, width, view.box.bottom + 20.0)
    marks = faults_of(scene)
    # Places on the upper face are not seen from below.
    faults = _on_the_stock(replace(marks, places=()) if is_below else marks, solid, camera)
    entries = [*_entries(scene, options), *faults.entries(view)]
    along = replace(view, scale=view.scale * ISO_SCALE) if camera is CAMERAS["iso"] else view
    table, bar_y = table_of(entries, along, view.box)
    legend_y = view.box.bottom + LEGEND_DROP - 30.0
    sizes = (width, foot_of(table, legend_y))
    return sheet(
        scene.title,
        sizes,
        options,
        _raster(_stage(solid, bar, options), camera, view, all_across, options),
        _deepest(solid, camera, view) if level else "",
        "" if level or is_below else _ghost(scene, camera, view),
        faults.draw(Plot(view)) if faults else "",
        head,
        _sizes(solid, camera, view),
        "" if level else bar.draw(replace(view.box, right=box_right)),
        legend_rows(table, view.box.left, legend_y),
        scale_bar(along, view.box.right, bar_y - 30.0),
    )


def _on_the_stock(marks: DotGroup, solid: Solid, camera: Camera) -> DotGroup:
    """Return marks at (x, y) mm moved to where the camera sees those places on the surface of the
    stock; marks beside the stock are left out.

    Marks behind a higher part of the stock are seen through it."""
    at = np.array(marks.places, dtype=np.float64).reshape(-1, 2)
    heights = solid.height_map.at(at).clip(-solid.pair.thickness_mm)
    rows = np.column_stack([at, heights])[~np.isnan(heights)].tolist()
    return replace(marks, places=tuple(camera.place(*row) for row in rows))


def _stage(solid: Solid, bar: MmBar, options: PictureOptions) -> Stage:
    """Return the stage of the picture; in views of differences its cells have their colours."""
    stage = stage_of(solid.height_map, solid.pair.thickness_mm, solid.pair.moves, BOARD_SHARE)
    if solid.off_mm is None:
        return stage
    index = np.minimum((solid.off_mm / bar.top * BINS).astype(np.int64), BINS - 1)
    lights = np.array([light_of(colour) for colour in bin_colours(dark=options.dark)])
    tint = np.where(
        (solid.off_mm > MIN_SHOWN_MM)[..., None], lights[index.clip(min=0)], light_of(GREY)
    )
    pad = stage.margin
    tint = np.pad(tint.astype(np.float32), ((pad, pad), (pad, pad), (0, 0)))
    return replace(stage, tint=tint)


def _raster(
    stage: Stage, camera: Camera, view: View, box: PageBox, options: PictureOptions
) -> str:
    """Return the SVG image of the stage that fills a box of the page.

    It has one pixel for each pixel of the picture, up to a picture width of MAX_RASTER_PX."""
    size_px = options.size_px or SVG_WIDTH_PX
    per_unit = min(size_px, MAX_RASTER_PX) / page_width(size_px)
    left, right = math.floor(box.left * per_unit), math.ceil(box.right * per_unit)
    top, foot = math.floor(box.top * per_unit), math.ceil(box.bottom * per_unit)
    (u, _), (_, v) = view.x_range, view.y_range
    per_mm = view.scale * per_unit
    first = u - (view.box.left * per_unit - left) / per_mm
    last = v + (view.box.top * per_unit - top) / per_mm
    wide, high = right - left, foot - top
    window = (first, last - high / per_mm, first + wide / per_mm, last)
    paper = on_dark(PAPER) if options.dark else PAPER
    pixels = picture_of(stage, camera, window, (wide, high), paper)
    look: Look = {"x": left / per_unit, "y": top / per_unit}
    look |= {"width": wide / per_unit, "height": high / per_unit}
    return element("image", {"id": "stock", **look, "href": data_uri(png_of(pixels))})


def _ghost(scene: Scene, camera: Camera, view: View) -> str:
    """Return the SVG of the drawn contours, laid on the top of the stock."""
    if scene.drawing is None or not len(scene.drawing.paths):
        return ""
    # The plane of the drawing, as the camera sees it: three places give the matrix.
    zero = view.page(*camera.place(0.0, 0.0, 0.0))
    sides = [view.page(*camera.place(x, y, 0.0)) for x, y in ((1.0, 0.0), (0.0, 1.0))]
    parts = [f"{side[k] - zero[k]:.9g}" for side in sides for k in (0, 1)]
    matrix = f"matrix({' '.join(parts)} {zero[0]:.9g} {zero[1]:.9g})"
    # On dark paper too the material is light, and so its lines stay dark.
    pen: Look = {"fill": "none", "stroke": OUTLINE + GHOST_ALPHA}
    pen["stroke-width"] = view.mm(GHOST_PEN)
    data = path_data(chains_of(scene.drawing.paths))
    lines = element("path", {"d": data, **pen})
    return element("g", {"id": "ghost", "transform": matrix}, lines)


def _deepest(solid: Solid, camera: Camera, view: View) -> str:
    """Return the SVG of the block's front face, and of the outline of the deepest cuts behind it,
    dashed."""
    front = camera.direction[0] == 0.0
    low = solid.height_map.heights.min(axis=0 if front else 1).clip(-solid.pair.thickness_mm)
    begins = np.concatenate([[0], np.flatnonzero(np.diff(low)) + 1])
    first = solid.height_map.corner_mm[0 if front else 1]
    edges = first + solid.height_map.cell_mm * np.append(begins, len(low))
    edges[-1] = solid.ends_mm[0 if front else 1]
    data, before = PathData(), 0.0
    for left, right, z in zip(edges[:-1], edges[1:], low[begins].tolist(), strict=True):
        if before == 0.0 > z:
            data.move(*view.page(float(left), 0.0))
        if before < 0.0 or z < 0.0:
            data.line(*view.page(float(left), z))
        if z < 0.0:
            data.line(*view.page(float(right), z))
        before = z
    pen: Look = {"fill": "none", "stroke": OUTLINE, "stroke-width": GHOST_PEN}
    pen["stroke-linejoin"] = "round"
    corners = np.array([view.page(*place) for place in _corners(solid, camera).tolist()])
    (x, y), (width, height) = corners.min(axis=0).tolist(), np.ptp(corners, axis=0).tolist()
    face: Look = {"id": "face", "x": x, "y": y, "width": width, "height": height, **pen}
    look: Look = {"id": "deepest", "d": str(data), "stroke-dasharray": DASHES, **pen}
    return element("rect", face) + element("path", look)


def _entries(scene: Scene, options: PictureOptions) -> list[LegendEntry]:
    """Return the entries of the legend of a view of the stock."""
    if options.view in LEVEL:
        return [LegendEntry(line_swatch(OUTLINE, GHOST_PEN, DASHES), "deepest cuts behind")]
    if scene.drawing is None or not len(scene.drawing.paths) or options.view in ("top", "bottom"):
        return []
    return [LegendEntry(line_swatch(OUTLINE, GHOST_PEN), "drawing")]


# The sizes of the block, and the bar of depths or differences.


def _corners(solid: Solid, camera: Camera) -> Floats:
    """Return the corners (8, 2) of the block on the picture, mm: X changes fastest, then Y, then
    Z."""
    (left, right), (bottom, top) = _extents(solid)
    heights = (-solid.pair.thickness_mm, 0.0)
    return np.array(
        [camera.place(x, y, z) for z in heights for y in (bottom, top) for x in (left, right)]
    )


def _extents(solid: Solid) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the lowest and highest X, and Y, of the shown part of the block, mm; the map may
    reach beyond it by less than a cell."""
    left, bottom = solid.height_map.corner_mm
    right, top = solid.ends_mm
    return (left, right), (bottom, top)


def _sizes(solid: Solid, camera: Camera, view: View) -> str:
    """Return the SVG of width, depth and thickness of the block, beside its lower edges."""
    corners = [view.page(*place) for place in _corners(solid, camera).tolist()]
    across, along = ((high - low) for low, high in _extents(solid))
    names = (f"{number(across, 1)} mm", f"{number(along, 1)} mm")
    # Edges of the foot along X and along Y, those nearer to the viewer; and the upright one at the
    # right.
    edges = [
        max(((corners[a], corners[b]) for a, b in pairs), key=lambda ends: ends[0][1] + ends[1][1])
        for pairs in (((0, 1), (2, 3)), ((0, 2), (1, 3)))
    ]
    right = max(range(4), key=lambda corner: corners[corner][0] + 1e-3 * corners[corner][1])
    labels = []
    for (one, other), name in zip(edges, names, strict=True):
        if abs(one[0] - other[0]) < 1.0:  # seen from its end
            continue
        slope = (other[1] - one[1]) / (other[0] - one[0])
        anchor = "middle" if abs(slope) < 0.1 else ("start" if slope < 0.0 else "end")
        x, y = 0.5 * (one[0] + other[0]), 0.5 * (one[1] + other[1])
        shift = {"middle": (0.0, 26.0), "start": (10.0, 20.0), "end": (-10.0, 20.0)}[anchor]
        labels.append(
            text.label(name, (x + shift[0], y + shift[1]), TextStyle(TICK_CAP, QUIET, anchor))
        )
    x = corners[right][0] + 8.0
    y = 0.5 * (corners[right][1] + corners[right + 4][1]) + 0.5 * TICK_CAP
    labels.append(text.label(_thickness(solid), (x, y), TextStyle(TICK_CAP, QUIET)))
    return element("g", {"id": "sizes"}, *labels)


def _thickness(solid: Solid) -> str:
    return f"{number(solid.pair.thickness_mm, 2)} mm"


class MmBar(Struct, frozen=True, eq=False):
    """A bar of colours (N, 3) for 0 to `top` mm, with its name; `is_downward`: 0 is at its upper
    end."""

    name: str
    top: float
    colours: Octets
    is_downward: bool

    @property
    def labels(self) -> list[tuple[float, str]]:
        """Values along the bar with their texts: round numbers, and the greatest value."""
        step = round_step(self.top / 4.0)
        decimals = decimals_of(step)
        round_ones = multiples(0.0, self.top, step)
        shown = [(value, number(value, decimals)) for value in round_ones]
        if self.top - round_ones[-1] > 0.3 * step:
            shown.append((self.top, number(self.top, decimals + 1)))
        return shown

    @property
    def width(self) -> float:
        """Width that the bar and its numbers need right of the plot."""
        widest = max(text.width(name, TICK_CAP) for _, name in self.labels)
        return BAR_GAP + max(BAR_WIDTH + 12.0 + widest, text.width(self.name, TICK_CAP))

    def draw(self, box: PageBox) -> str:
        """Return the SVG of the bar, right of the plot and no higher than MAX_BAR."""
        height = min(box.height - 2.0 * NAME_LIFT, MAX_BAR)
        bar_x, top = box.right + BAR_GAP, 0.5 * (box.top + box.bottom - height)
        sides: Look = {"x": bar_x, "y": top, "width": BAR_WIDTH, "height": height}
        column = self.colours if self.is_downward else self.colours[::-1]
        pixels = np.repeat(column[:, None, :], 2, axis=1)
        look: Look = {"preserveAspectRatio": "none", "href": data_uri(png_of(pixels))}
        ticks, parts = PathData(), [element("image", {**sides, **look})]
        for value, name in self.labels:
            share = value / self.top if self.is_downward else 1.0 - value / self.top
            y = top + share * height
            ticks.move(bar_x + BAR_WIDTH, y)
            ticks.line(bar_x + BAR_WIDTH + 5.0, y)
            place = (bar_x + BAR_WIDTH + 12.0, y + TICK_CAP / 2.0)
            parts.append(text.label(name, place, TextStyle(TICK_CAP, QUIET)))
        pen: Look = {"fill": "none", "stroke": FRAME, "stroke-width": 1.4}
        parts += [element("rect", {**sides, **pen}), element("path", {"d": str(ticks), **pen})]
        parts.append(text.label(self.name, (bar_x, top - NAME_LIFT), TextStyle(TICK_CAP, QUIET)))
        return element("g", {"id": "mm-scale"}, *parts)


def _bar_of(solid: Solid, options: PictureOptions) -> MmBar:
    """Return the colour bar of a picture: of depths, or of differences from the wanted heights."""
    if solid.off_mm is None:
        return MmBar("depth (mm)", solid.deepest_mm or 1.0, floor_colours(BAR_STEPS), True)
    colours = [channels(colour) for colour in bin_colours(dark=options.dark)]
    rows = np.repeat(np.array(colours, dtype=np.uint8), 8, axis=0)
    top = max(float(solid.off_mm.max(initial=0.0)), 10.0 * MIN_SHOWN_MM)
    return MmBar(BAR_NAMES[options.view], top, rows, False)
