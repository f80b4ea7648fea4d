"""The viewer's page: template, styles, script and data in one file; equal scenes give equal bytes.

Texts of drawings and programs stand in the page as data only. The head is JSON in which `<`, `>`
and `&` are escaped, and the script shows it as text; title and notes are escaped for HTML.
Besides, the page's policy lets the browser run no script but the one whose digest it names, and
load nothing from anywhere."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import math
import re
from collections.abc import Mapping
from contextlib import suppress
from importlib import resources
from itertools import cycle
from typing import TYPE_CHECKING

import msgspec
import numpy as np

from camtool.arrays import Floats
from camtool.errors import OptionError
from camtool.geometry.drawing import Drawing
from camtool.pictures.colours import (
    BACK,
    BACK_SPREAD,
    FEED,
    FRAME,
    GRID,
    INK,
    LAYER_COLOURS,
    PLOT,
    QUIET,
    SPREAD,
    bin_colours,
    on_dark,
)
from camtool.pictures.content import Content, content_of
from camtool.pictures.layers import LineGroup, Part, TextGroup, from_the_ground_up, swept_words
from camtool.pictures.polar import ROOM, circle_pair, dial_of, notes, plot
from camtool.pictures.scene import Playback, ReportTable, Scene, StockPair, by_feed, stock_pair
from camtool.pictures.svg import Look, element, number
from camtool.pictures.viewer.columns import (
    Columns,
    StockBox,
    Traced,
    columns_of,
    drawing_layers,
    engagement_columns,
    height_columns,
    packed,
    part_columns,
    slide_columns,
    traced_of,
)
from camtool.stock.cutters import CutterProfile
from camtool.stock.moves import stock_moves_of_toolpath
from camtool.units import UM_PER_MM

if TYPE_CHECKING:
    from camtool.planning.job import Tool

SCRIPTS = ("data.js", "paint.js", "stage.js", "solid.js", "depth.js", "panel.js", "main.js")
"""The files of the script in order; the last one starts it."""

SCRIPTED = frozenset(
    ("drawing", "swept", "travel", "rapids", "feeds", "plunges", "starts", "order", "arrows")
) | {"path", "engagement", "worst", "zero", "doubts"}
"""The layers for which the script has functions of its own, since they change with time, zoom or
other switches. It draws all others by their parts."""

MIN_TOP_UM = 1e-3
"""The colour map ends here where all errors are smaller."""

_SLOT = re.compile(r"\{([a-z]+)\}")


def viewer_page(scene: Scene, live: str = "") -> bytes:
    """Return the HTML file of a scene, UTF-8.

    Without a playback in the scene every move runs at its feed. `live`: HTML of the state of a
    program that is being sent. ValueError when the playback is that of another toolpath."""
    run, content = _run(scene), content_of(scene)
    traced = traced_of(scene, run, _top_um(scene, run))
    rows, columns = _rows(content)
    pair = None if run is None else _stock_of(scene)
    stock = None if pair is None else _box_of(pair)
    columns |= {**height_columns(pair, stock), **engagement_columns(pair, scene.toolpath)}
    if scene.toolpath is not None and stock is not None:
        cell_mm = (stock.box[2] - stock.box[0]) / (stock.grid[0] - 1)
        columns |= slide_columns(pair, len(scene.toolpath), cell_mm)
    named, data = packed({**columns_of(content, run), **traced.columns, **columns})
    script = '(() => {\n"use strict";\n' + "\n".join(map(_file, SCRIPTS)) + "})();\n"
    style = _file("viewer.css")
    title = _printable(scene.title) or "camtool"
    slots = {
        "policy": _policy(script, style),
        "title": html.escape(title),
        "notes": html.escape(" · ".join(map(_printable, scene.notes))),
        "label": html.escape(f"picture of {title}"),
        "style": style,
        "script": script,
        "circles": circles_of(scene),
        "live": live,
        "head": _json(
            {
                "columns": named,
                **_head(content, run, traced),
                **_cutting(scene, pair, stock),
                "rows": rows,
            }
        ),
        "columns": base64.b64encode(data).decode("ascii"),
    }
    # One pass: the contents of a slot are not searched for slots.
    page = _SLOT.sub(lambda match: slots[match[1]], _file("viewer.html"))
    return page.encode("utf-8")


def _run(scene: Scene) -> Playback | None:
    if scene.toolpath is None:
        return None
    return by_feed(scene.toolpath, np.inf) if scene.playback is None else scene.playback()


def _head(content: Content, run: Playback | None, traced: Traced) -> dict[str, object]:
    scene, drawing, toolpath = content.scene, content.scene.drawing, content.scene.toolpath
    names = [] if drawing is None else drawing_layers(drawing)
    blocks = None if run is None or run.blocks is None else run.blocks
    return {
        "layers": [
            {"name": name, "light": colour, "dark": on_dark(colour)}
            for name, colour in zip(names, cycle(LAYER_COLOURS), strict=False)
        ],
        "sources": [] if drawing is None else list(drawing.sources),
        "texts": [] if toolpath is None else list(toolpath.texts),
        "blocks": None if blocks is None else "\n".join(map(_one_line, blocks)),
        "hex": run is not None and run.binary,
        "tool_mm": scene.tool_mm,
        "swept": swept_words(scene),
        "top_um": _top_um(scene, run),
        "map": {"light": bin_colours(), "dark": bin_colours(dark=True)},
        "tables": [] if run is None else [_table(table) for table in run.tables],
        "off_mm": traced.count_mm,
        "worst": [
            {"at": place, "off": offset}
            for place, offset in zip(scene.worst, traced.worst_off.tolist(), strict=True)
        ],
        "travel_mm": scene.travel_mm,
        "ambiguous": [] if drawing is None else _ambiguous(drawing),
    }


MAX_HEIGHTS = 1 << 19

MIN_STEP_MM = 0.005
"""Least distance of the heights of a grid."""


def _cutting(scene: Scene, pair: StockPair | None, stock: StockBox | None) -> dict[str, object]:
    """Return, for JSON, the stock, the cutting profiles and the bodies of the tools, each with the
    first row that it cuts."""
    if pair is None or stock is None:
        return {"stock": None, "cutters": [], "bodies": []}
    begins = np.flatnonzero(np.diff(pair.moves.tool, prepend=-1))
    table = pair.moves.table[pair.moves.tool[begins]].tolist()
    turns = zip(pair.moves.row[begins].tolist(), table, strict=True)
    return {
        "stock": msgspec.structs.asdict(stock),
        "cutters": [(row, *profile) for row, profile in turns if profile[0] > 0.0],
        "bodies": [(row, *_body(tool)) for row, tool in scene.tools],
    }


def _body(tool: Tool) -> tuple[float | None, ...]:
    """Return the length of a tool's edges, the radius of its shank, its stickout, and the radius
    and length of its holder, mm; None for what is not known."""

    def half(diameter: float | None) -> float | None:
        return None if diameter is None else 0.5 * diameter

    return (
        tool.cutting_length_mm,
        half(tool.shank_diameter_mm),
        tool.stickout_mm,
        half(tool.holder_diameter_mm),
        tool.holder_length_mm,
    )


def _stock_of(scene: Scene) -> StockPair | None:
    """Return the stock and the moves that cut it; None without moves.

    Where no tool is known, the moves are those of a point."""
    toolpath = scene.toolpath
    if toolpath is None or not toolpath.is_motion.any():
        return None
    if scene.cut is not None:
        with suppress(OptionError):
            return scene.cut()
    points = (CutterProfile(0.0, 0.0),)
    moves = stock_moves_of_toolpath(toolpath, np.zeros(len(toolpath), dtype=np.int64), points)
    return stock_pair(moves, scene.stock_mm, scene.thickness_mm)


def _box_of(pair: StockPair) -> StockBox:
    """Return the box of the stock and its grid, as fine as MAX_HEIGHTS allows."""
    box = pair.box_mm
    across, upwards = box[2] - box[0], box[3] - box[1]
    finest = max(math.sqrt(across * upwards / MAX_HEIGHTS), MIN_STEP_MM)
    max_rows = max(int(across / finest), 2)
    # Of the grids that end at the right edge, the one that ends nearest to the upper edge.
    tries = np.arange(max(2, int(0.9 * max_rows)), max_rows + 1)
    steps = upwards / (across / tries)
    count = int(tries[np.argmin(np.abs(steps - np.rint(steps)))])
    rows = max(1, round(upwards * count / across))
    return StockBox(box, -pair.thickness_mm, (count + 1, rows + 1))


def _rows(content: Content) -> tuple[list[dict[str, object]], Columns]:
    """Return the layers that the script draws from their parts, the lowest first, and the columns
    of these parts."""
    rows: list[dict[str, object]] = []
    columns: Columns = {}
    for layer in from_the_ground_up():
        parts = [] if layer.name in SCRIPTED else layer.parts_in(content)
        shown = []
        for index, part in enumerate(parts):
            name = f"{layer.name}_{index}"
            columns |= part_columns(name, part)
            shown.append({"columns": name, **_part_style(part)})
        if shown:
            is_on = layer.usual and (layer.under_path or content.trace is None)
            rows.append({"name": layer.name, "key": layer.key, "on": is_on, "parts": shown})
    return rows, columns


def _part_style(part: Part) -> dict[str, object]:
    """Return, for JSON, the name, colours and widths of a part, on light and on dark ground."""
    if isinstance(part, TextGroup):
        return {"texts": part.texts, "line": _light_and_dark(part.colour)}
    look = part.look
    line = {"line": _light_and_dark(look["stroke"]), "width": look["stroke-width"]}
    if isinstance(part, LineGroup):
        dashes = str(look.get("stroke-dasharray", "")).split()
        return {"legend": part.name, **line, "dash": [float(dash) for dash in dashes]}
    return {
        "legend": part.name,
        **line,
        "radius": look["r"],
        "fill": _light_and_dark(look["fill"]),
    }


def _light_and_dark(colour: str | float) -> dict[str, str] | None:
    """Return a colour for light and for dark ground; None if there is none."""
    paint = str(colour)
    return None if paint == "none" else {"light": paint, "dark": on_dark(paint)}


def _ambiguous(drawing: Drawing) -> list[tuple[float, float]]:
    """Return the places (x, y) mm of open ends, crossings and branches."""
    healing = drawing.healing
    places = [gap.at_mm for gap in drawing.gaps]
    places += [one.at_mm for one in healing.crossings] + [one.at_mm for one in healing.branches]
    return [(float(x), float(y)) for x, y in places]


def _table(table: ReportTable) -> dict[str, object]:
    return {
        "title": table.title,
        "columns": table.columns,
        "rows": [
            {"cells": line.cells, "move": line.move, "at": line.at_mm} for line in table.lines
        ],
    }


def _top_um(scene: Scene, run: Playback | None) -> float:
    """Return the end of the map of errors, µm: the largest error of the moves and of the trace."""
    errors = [MIN_TOP_UM / UM_PER_MM]
    if run is not None:
        errors += [float(error) for error in run.error_mm[np.isfinite(run.error_mm)]]
    if scene.trace_error_mm is not None and scene.trace_cutting is not None:
        errors += np.abs(scene.trace_error_mm[scene.trace_cutting]).tolist()
    return round(max(errors) * UM_PER_MM, 6)


def _policy(script: str, style: str) -> str:
    def digest(text: str) -> str:
        return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")

    return (
        f"default-src 'none'; base-uri 'none'; form-action 'none'; "
        f"script-src 'sha256-{digest(script)}'; style-src 'sha256-{digest(style)}'"
    )


def _json(value: Mapping[str, object]) -> str:
    """Return JSON in ASCII without characters that have a meaning in HTML."""
    text = json.dumps(value, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")


def _one_line(words: str) -> str:
    """Return the text without line breaks, which separate the lines of the program."""
    return words.replace("\r", " ").replace("\n", " ")


def _printable(words: str) -> str:
    return "".join(letter if letter.isprintable() else " " for letter in words)


def _file(name: str) -> str:
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")


# The polar plots of full circles below the report: SVG within the page, in the page's colours.

MAX_PLOTS = 16

BINS_SHOWN = 120
"""Errors of neighbouring bins are joined until a plot has at most this many, one every 3°."""

WIDTH = 520.0
"""Width of a plot in its own units; letters are about 14 high."""

NAMES = {
    FEED: "feed",
    SPREAD: "spread",
    BACK: "back",
    BACK_SPREAD: "back-spread",
    FRAME: "frame",
    GRID: "grid",
    INK: "ink",
    PLOT: "paper",
    QUIET: "quiet",
}
"""For each colour of a plot the page's variable, so that plots are light or dark as the page
is."""

_PAINT = re.compile('(fill|stroke)="(#[0-9a-f]{6})"')
_SHAPE = re.compile(' d="[^"]*"')
_DECIMAL = re.compile(r"(\.\d)\d")
_ID = re.compile(' id="[^"]*"')


def circles_of(scene: Scene) -> str:
    """Return the HTML of the plots of full circles, in the order of the report; "" without any."""
    # The same circle in the other direction is in the plot of the first one.
    first = [
        number
        for number, one in enumerate(scene.rounds, 1)
        if one.partner is None or one.partner > number
    ]
    numbers = sorted(sorted(first, key=lambda which: -_size(scene, which))[:MAX_PLOTS])
    if not numbers:
        return ""
    heading = "Full circles"
    if len(numbers) < len(first):
        heading += f": the {len(numbers)} of {len(first)} with the largest circular error"
    figures = "\n".join(_figure(scene, number) for number in numbers)
    return f'<h2>{heading}</h2>\n<div class="plots">\n{figures}\n</div>\n'


def _size(scene: Scene, number: int) -> float:
    error = scene.rounds[number - 1].circular_mm
    return error if math.isfinite(error) else 0.0


def _figure(scene: Scene, circle_number: int) -> str:
    circles = circle_pair(scene, circle_number)
    errors = [_joined(circle.errors_um) for circle in circles]
    dial = dial_of(errors, WIDTH)
    dial = dial.centred_below(0.0, WIDTH)
    side = 2.0 * (dial.outer + ROOM)
    box = " ".join(map(number, (0.5 * (WIDTH - side), 0.0, side, side)))
    title = f"radial error of circle {circle_number}"
    look: Look = {"viewBox": box, "role": "img", "aria-label": title}
    svg = element("svg", look, *plot(errors, dial))
    svg = _PAINT.sub(lambda match: f'{match[1]}="var(--{NAMES[match[2]]})"', _ID.sub("", svg))
    svg = _SHAPE.sub(lambda match: _DECIMAL.sub(r"\1", match[0]), svg)
    caption = "<br>".join(map(html.escape, notes(circles, dial)))
    return f"<figure>\n{svg}\n<figcaption>{caption}</figcaption>\n</figure>"


def _joined(errors_um: Floats) -> Floats:
    """Return least, mean and largest error (B, 3) of groups of neighbouring bins, so that few
    enough remain; NaN where all of a group are."""
    joined_count = max(1, math.ceil(len(errors_um) / BINS_SHOWN))
    if len(errors_um) % joined_count:
        return errors_um
    groups = errors_um.reshape(-1, joined_count, 3)
    is_finite = np.isfinite(groups)
    count = is_finite.sum(axis=1)
    smallest = np.where(is_finite, groups, np.inf)[:, :, 0].min(axis=1)
    largest = np.where(is_finite, groups, -np.inf)[:, :, 2].max(axis=1)
    mean = np.where(is_finite, groups, 0.0)[:, :, 1].sum(axis=1) / np.maximum(count[:, 1], 1)
    joined = np.column_stack([smallest, mean, largest])
    return np.asarray(np.where(count > 0, joined, np.nan))
