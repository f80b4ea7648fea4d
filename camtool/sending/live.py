"""A page that shows how far a program is: the predicted path, and what of it is acknowledged.

One self-contained HTML file, which a browser opens from the disk and which asks to be loaded again
every second. Nothing listens for it, and whoever writes it needs no more than a list of texts that
was made beforehand: what is drawn anew is a part of that list.
"""

from __future__ import annotations

import html
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.target.wire import Place
from camtool.toolpath.moves import PolarArcs, Toolpath

EVERY_S: Final = 1.0
"""The page is written, and loaded, so often."""

MOST_POINTS: Final = 12_000
"""Of longer paths only so many points are drawn, evenly spread, so that a page takes
milliseconds."""

ARC_PARTS: Final = 24
"""An arc is drawn as so many chords."""

WIDTH: Final = 900
"""Of the picture, pixels."""

MARGIN: Final = 0.04
"""Around the path, as a part of its larger side."""

ENDS: Final = ("finished", "stopped", "failed")
"""States behind which the page is not loaded again."""

_PAGE: Final = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8">{refresh}<title>{title}</title>
<style>body{{font:16px sans-serif;margin:1em;color:#222;background:#fff}}
b{{font-size:1.3em}}.failed,.stopped{{color:#b00020}}
svg{{border:1px solid #ccc;max-width:100%;height:auto}}
path{{fill:none;vector-effect:non-scaling-stroke}}.way{{stroke:#bbb;stroke-width:1.2}}
.rapid{{stroke:#ccc;stroke-width:.8;stroke-dasharray:4 4}}
.done{{stroke:#0b63b5;stroke-width:2.2}}.place{{fill:#d9480f}}</style></head><body>
<p><b class="{state}">{state}</b> </p><p>{facts}</p>
<svg viewBox="{box}" width="{width}" role="img" aria-label="the path of the tool from above">
<path class="rapid" d="{rapids}"/><path class="way" d="{cuts}"/><path class="done" d="{done}"/>
{place}</svg>
<p>grey: predicted; blue: acknowledged; orange: where the machine says that it is</p></body></html>
"""


class _Drawn(Struct, frozen=True, eq=False):
    """A path from above as pieces of SVG, each with the block that it belongs to (K,)."""

    pieces: list[str]
    block: Ints

    def until(self, block: int) -> str:
        """All that belongs to blocks up to this one."""
        return "".join(self.pieces[: int(np.searchsorted(self.block, block, side="right"))])


class LivePage:
    """The page of one program; `decoded` is what is sent."""

    def __init__(self, file: Path, title: str, decoded: Toolpath) -> None:
        self.file, self._title = file, title
        path = decoded.first(decoded.running)
        points, row = _points(path)
        low, high = (
            (points[:, :2].min(axis=0), points[:, :2].max(axis=0))
            if len(points)
            else (np.zeros(2), np.zeros(2))
        )
        side = max(float((high - low).max()), 1e-3)
        x, y = (low - MARGIN * side).tolist()
        w, h = (high - low + 2.0 * MARGIN * side).tolist()
        self._box = f"{x:.4f} {-y - h:.4f} {w:.4f} {h:.4f}"
        self._radius = 0.008 * max(w, h)
        self._cuts = _drawn(path, points, row, path.is_feed)
        rapids = _drawn(path, points, row, path.is_motion & ~path.is_feed)
        self._ways = "".join(rapids.pieces), "".join(self._cuts.pieces)

    def html(
        self, state: str, facts: Mapping[str, str], block: int, place: Place | None = None
    ) -> str:
        """The page; `block`: the last of what is sent that is acknowledged; `place` (x, y, z)."""
        rapids, cuts = self._ways
        dot = ""
        if place is not None:
            dot = f'<circle class="place" cx="{place[0]:.4f}" cy="{-place[1]:.4f}" '
            dot += f'r="{self._radius:.4f}"/>'
        seconds = f'<meta http-equiv="refresh" content="{EVERY_S:g}">'
        rows = [f"{html.escape(name)} {html.escape(text)}" for name, text in facts.items() if text]
        return _PAGE.format(
            refresh="" if state in ENDS else seconds,
            title=html.escape(f"{self._title}: {state}"),
            state=html.escape(state),
            facts=" · ".join(rows),
            box=self._box,
            width=WIDTH,
            rapids=rapids,
            cuts=cuts,
            done=self._cuts.until(block),
            place=dot,
        )

    def write(self, page: str) -> None:
        """Put the page in the place of the one before, at once; OSError when it cannot be."""
        new = self.file.with_name(f".{self.file.name}.new")
        new.write_text(page, encoding="utf-8")
        new.replace(self.file)


def _points(path: Toolpath) -> tuple[Floats, Ints]:
    """(K, 3) mm: points of the moves in order, and the row (K,) that each ends or belongs to."""
    arms = PolarArcs(path, path.is_arc)
    share = np.arange(1, ARC_PARTS) / ARC_PARTS
    which = np.repeat(np.arange(len(arms.row)), len(share))
    inner = arms.points(which, np.tile(share, len(arms.row)))
    moves = np.flatnonzero(path.is_motion)
    points = np.concatenate([inner, path.end[moves]])
    row = np.concatenate([arms.row[which], moves])
    order = np.argsort(row, kind="stable")
    return points[order], row[order]


def _drawn(path: Toolpath, points: Floats, row: Ints, chosen: Bools) -> _Drawn:
    """The moves of the chosen rows (N,)."""
    mine = chosen[row]
    before = np.concatenate([path.start[None, :], points[:-1]]) if len(points) else points
    stride = max(-(-int(mine.sum()) // MOST_POINTS), 1)
    pieces, blocks, at = [], [], -1
    kept = np.flatnonzero(mine)
    joined = np.diff(kept, prepend=-2) == 1
    for k, (point, follows) in enumerate(zip(kept.tolist(), joined.tolist(), strict=True)):
        last = k + 1 == len(kept) or not joined[k + 1]
        if follows and k % stride and not last:
            continue
        begin = "" if follows else f"M{before[point, 0]:.4f} {0.0 - before[point, 1]:.4f}"
        pieces.append(f"{begin}L{points[point, 0]:.4f} {0.0 - points[point, 1]:.4f}")
        at = max(at, int(path.block[row[point]]))
        blocks.append(at)
    return _Drawn(pieces, np.array(blocks, dtype=np.int64))
