"""The page of `send --live`: the predicted path, and its acknowledged part in another colour.

It is one self-contained HTML file, which a browser opens from the disk and which reloads itself
every second; no network port is opened for it. The path is converted to a list of SVG texts once:
an update writes the beginning of that list.
"""

from __future__ import annotations

import html
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints
from camtool.target.wire import Place
from camtool.toolpath.moves import PolarArcs, Toolpath, toolpath_extents

RELOAD_S: Final = 1.0
"""Interval at which the page is written and reloaded."""

WIDTH_PX: Final = 900
"""Larger side of the picture, pixels."""

STEPS_PX: Final = (0.25, 0.5, 1.0, 2.0)
"""Least distances between drawn points, and tolerances of the chords of arcs: the drawn path is
within twice this distance of the tool's. The first with at most MAX_LINES lines is used, else the
last."""

MAX_LINES: Final = 100_000
"""With so many lines the page has some megabytes."""

MAX_CHORD_RAD: Final = math.pi / 6.0
"""Turn of the longest chord of an arc."""

MARGIN: Final = 0.04
"""Margin around the path, as a share of its larger side."""

END_STATES: Final = ("finished", "stopped", "failed")
"""States in which the page is no longer reloaded."""

_PAGE: Final = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8">{refresh}<title>{title}</title>
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>:root{{color-scheme:light dark;--paper:#fff;--ink:#1b2530;--quiet:#566270;--frame:#aeb8c4;
--rapid:#8b96a3;--way:#9aa7b5;--done:#0f6ac4;--place:#c2500a;--bad:#b00020}}
@media screen and (prefers-color-scheme:dark){{:root{{--paper:#12171d;--ink:#e4eaf0;
--quiet:#9aa7b5;--frame:#4d5a68;--rapid:#76828f;--way:#6b7885;--done:#5cabff;--place:#ffa64d;
--bad:#ff7a66}}}}
body{{font:16px/1.4 system-ui,sans-serif;margin:0 auto;padding:1em;max-width:60em;
color:var(--ink);background:var(--paper)}}
h1{{font-size:1.3em;margin:0;overflow-wrap:anywhere}}p{{margin:.4em 0;overflow-wrap:anywhere}}
.failed,.stopped{{color:var(--bad)}}progress{{width:100%;accent-color:var(--done)}}
dl{{display:flex;flex-wrap:wrap;gap:.2em 1.5em;margin:.4em 0}}dl div{{display:flex;gap:.4em}}
dt,.key{{color:var(--quiet)}}dd{{margin:0}}
svg{{display:block;border:1px solid var(--frame);width:100%;max-height:75vh}}
path{{fill:none;vector-effect:non-scaling-stroke;stroke-linejoin:round;stroke-linecap:round}}
.way{{stroke:var(--way);stroke-width:1.6}}.done{{stroke:var(--done);stroke-width:2.2}}
.rapid{{stroke:var(--rapid);stroke-width:1;stroke-dasharray:4 4;stroke-linecap:butt}}
.place{{fill:var(--place)}}</style></head><body>
<h1>{name}</h1><p><b class="{state}">{state}</b>, {percent:.0f} %</p>
<progress max="100" value="{percent:.1f}"></progress><dl>{facts}</dl><p>{why}</p>
<svg viewBox="{box}" role="img" aria-label="the path of the tool from above">
<path class="rapid" d="{rapids}"/><path class="way" d="{cuts}"/><path class="done" d="{done}"/>
{place}</svg>
<p class="key">dashed: rapids; grey: cuts; blue: acknowledged; orange: where the machine says that
it is</p></body></html>
"""


class _SvgPath(Struct, frozen=True, eq=False):
    """A path from above as pieces of SVG, each with the block that it belongs to (K,)."""

    pieces: list[str]
    block: Ints

    def until(self, block: int) -> str:
        """Return the pieces of all blocks up to this one."""
        return "".join(self.pieces[: int(np.searchsorted(self.block, block, side="right"))])


class LivePage:
    """The page of one program; `decoded` is the toolpath that is sent."""

    def __init__(self, file: Path, title: str, decoded: Toolpath) -> None:
        self.file, self._title = file, title
        path = decoded.first(decoded.executed_rows)
        (left, right), (low, top) = toolpath_extents(path)[:2].tolist()
        side = max(right - left, top - low, 1e-3)
        around = MARGIN * side
        wide, high = right - left + 2.0 * around, top - low + 2.0 * around
        self._box = f"{left - around:.4f} {-top - around:.4f} {wide:.4f} {high:.4f}"
        self._radius = 0.008 * max(wide, high)
        for step_px in STEPS_PX:
            self._cuts, rapids = _svg_paths(path, step_px / WIDTH_PX * max(wide, high))
            if len(self._cuts.pieces) + len(rapids.pieces) <= MAX_LINES:
                break
        self._ways = "".join(rapids.pieces), "".join(self._cuts.pieces)
        moves = np.flatnonzero(path.is_motion)
        self._blocks = np.maximum.accumulate(path.block[moves])
        self._feeds = path.feed[moves]
        self._feeds[~path.is_feed[moves]] = math.inf

    def _feed_at(self, block: int) -> str:
        """Return the feed of the last move of the blocks up to this one, "" without one."""
        row = int(np.searchsorted(self._blocks, block, side="right")) - 1
        feed = float(self._feeds[row]) if row >= 0 else math.nan
        return "rapid" if feed == math.inf else f"{feed:g} mm/min" if feed == feed else ""

    def html(
        self,
        state: str,
        facts: Mapping[str, str],
        block: int,
        place: Place | None = None,
        *,
        share: float = 0.0,
        why: str = "",
    ) -> str:
        """Return the page. `block`: the last acknowledged block of what is sent; `place` (x, y, z)
        of the tool; `share`: share of the time that is over, 0 to 1."""
        rapids, cuts = self._ways
        dot = ""
        if place is not None:
            dot = f'<circle class="place" cx="{place[0]:.4f}" cy="{-place[1]:.4f}" '
            dot += f'r="{self._radius:.4f}"/>'
        seconds = f'<meta http-equiv="refresh" content="{RELOAD_S:g}">'
        rows = [
            f"<div><dt>{html.escape(name)}</dt><dd>{html.escape(text)}</dd></div>"
            for name, text in ({**facts, "feed": self._feed_at(block)}).items()
            if text
        ]
        percent = math.floor(100.0 * share)  # 100 only at the end
        return _PAGE.format(
            refresh="" if state in END_STATES else seconds,
            title=html.escape(f"{percent} % {self._title}: {state}"),
            name=html.escape(self._title),
            state=html.escape(state),
            percent=percent,
            facts="".join(rows),
            why=html.escape(why),
            box=self._box,
            rapids=rapids,
            cuts=cuts,
            done=self._cuts.until(block),
            place=dot,
        )

    def write(self, page: str) -> None:
        """Replace the page at once; OSError when it cannot be written."""
        new = self.file.with_name(f".{self.file.name}.new")
        new.write_text(page, encoding="utf-8")
        new.replace(self.file)


def _svg_paths(path: Toolpath, step_mm: float) -> tuple[_SvgPath, _SvgPath]:
    """Draw the cuts and the rapids from above, within 2 × `step_mm` of the path of the tool. A
    line is drawn at its first pass: later passes along it change nothing."""
    points, row = _points(path, step_mm)
    is_feed = path.is_feed[row]
    decimals = max(0, math.ceil(1.0 - math.log10(step_mm)))
    found: tuple[_SvgPath, ...] = ()
    lines = _lines(path.start[:2].tolist(), points.tolist(), is_feed.tolist(), step_mm)
    for feed in (True, False):
        pieces, blocks, seen = [], [], set()
        latest, at = -1, ""
        for begin, end, index in lines:
            if is_feed[index] != feed:
                continue
            texts = [f"{x:.{decimals}f} {0.0 - y:.{decimals}f}" for x, y in (begin, end)]
            key = tuple(sorted(texts))
            latest = max(latest, int(path.block[row[index]]))
            # A cut straight down is a dot.
            if key in seen or (texts[0] == texts[1] and (not feed or at == texts[0])):
                continue
            seen.add(key)
            pieces.append(("" if at == texts[0] else f"M{texts[0]}") + f"L{texts[1]}")
            blocks.append(latest)
            at = texts[1]
        found += (_SvgPath(pieces, np.array(blocks, dtype=np.int64)),)
    return found[0], found[1]


def _points(path: Toolpath, step_mm: float) -> tuple[Floats, Ints]:
    """Compute points (K, 2) mm along the moves in order, with as many on each arc as chords within
    `step_mm` need, and the row (K,) of each point."""
    arms = PolarArcs(path, path.is_arc)
    radius = np.maximum(arms.radius, arms.end_radius)
    flat = 1.0 - np.minimum(step_mm / np.maximum(radius, step_mm), 1.0)
    turn = np.minimum(2.0 * np.arccos(flat), MAX_CHORD_RAD)
    count = np.ceil(np.abs(arms.sweep) / turn).astype(np.int64)
    inner = np.maximum(count - 1, 0)
    which = np.repeat(np.arange(len(count)), inner)
    nth = np.arange(len(which)) - np.repeat(np.cumsum(inner) - inner, inner) + 1
    moves = np.flatnonzero(path.is_motion)
    between = arms.points(which, nth / count[which])
    points = np.concatenate([between[:, :2], path.end[moves, :2]])
    row = np.concatenate([arms.row[which], moves])
    order = np.argsort(row, kind="stable")
    return points[order], row[order]


def _lines(
    start: list[float], points: list[list[float]], is_feed: list[bool], step_mm: float
) -> list[tuple[list[float], list[float], int]]:
    """Return the lines between kept points, each with the index of its end: points at least
    `step_mm` from the one before, and all points at which cuts or rapids end."""
    found, last = [], start
    for index, (point, feed) in enumerate(zip(points, is_feed, strict=True)):
        ends = index + 1 == len(points) or is_feed[index + 1] != feed
        if ends or math.dist(point, last) >= step_mm:
            found.append((last, point, index))
            last = point
    return found
