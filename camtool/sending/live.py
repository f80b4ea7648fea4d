"""The page of `send --live`: the viewer's page, which shows how far the machine has come.

It is one self-contained HTML file, which a browser opens from the disk and which reloads itself;
no network port is opened for it. All but the state is made once."""

from __future__ import annotations

import html
import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from camtool.pictures.scene import Scene, by_feed
from camtool.pictures.viewer.page import viewer_page
from camtool.records import replace
from camtool.target.wire import Place
from camtool.toolpath.moves import Toolpath

if TYPE_CHECKING:
    from camtool.toolpath.program import Listing

RELOAD_S: Final = 1.0
"""Shortest interval at which the page is written and reloaded."""

BYTES_PER_S: Final = 4e6
"""Larger pages are written and reloaded less often: no more than this, on average."""

END_STATES: Final = ("finished", "stopped", "failed")
"""States in which the page is no longer reloaded."""

_MARK: Final = "<!--state-->"

_STATE: Final = """<div id="live"><p><b class="{state}">{state}</b>, {percent} %</p>
<progress max="100" value="{share:.1f}"></progress><dl>{facts}</dl><p>{why}</p></div>
<script type="application/json" id="sent">{sent}</script>
"""


class LivePage:
    """The page of one program; `decoded` is the toolpath that is sent, `listing` gives the lines
    of its blocks. It is written again every `every_s` seconds."""

    def __init__(
        self,
        file: Path,
        title: str,
        decoded: Toolpath,
        listing: Callable[[], Listing | None] | None = None,
    ) -> None:
        self.file, self._title = file, title
        path = decoded.first(decoded.executed_rows)
        run, lines = by_feed(path, math.inf), None if listing is None else listing()
        if lines is not None:
            run = replace(run, blocks=lines.blocks, binary=lines.binary)
        scene = Scene(title=title, toolpath=path, playback=lambda: run)
        page = viewer_page(scene, _MARK).decode("utf-8")
        self._before, self._after = page.split(_MARK)
        self.every_s = max(RELOAD_S, len(page) / BYTES_PER_S)
        self._blocks = np.maximum.accumulate(path.block)
        moves = np.flatnonzero(path.is_motion)
        self._feeds = np.where(path.is_feed, path.feed, math.inf)[moves]
        self._moves = moves

    def _feed_at(self, row: int) -> str:
        """Return the feed of the last feed move up to this row as text, "" if there is none."""
        index = int(np.searchsorted(self._moves, row, side="right")) - 1
        feed = float(self._feeds[index]) if index >= 0 else math.nan
        return "rapid" if feed == math.inf else f"{feed:g} mm/min" if feed == feed else ""

    def html(
        self,
        state: str,
        facts: Mapping[str, str],
        block: int,
        place: Place | None = None,
        *,
        share: float = 0.0,
        reason: str = "",
    ) -> str:
        """Return the page. `block`: the last acknowledged block of what is sent; `place` (x, y, z)
        of the tool; `share`: share of the time that is over, 0 to 1."""
        row = int(np.searchsorted(self._blocks, block, side="right")) - 1
        percent = math.floor(100.0 * share)  # 100 only at the end
        values = {
            "title": f"{percent} % {self._title}: {state}",
            "row": row,
            "place": place,
            "again_ms": 0 if state in END_STATES else round(1e3 * self.every_s),
        }
        rows = [
            f"<div><dt>{html.escape(name)}</dt><dd>{html.escape(text)}</dd></div>"
            for name, text in ({**facts, "feed": self._feed_at(row)}).items()
            if text
        ]
        shown = _STATE.format(
            state=html.escape(state),
            percent=percent,
            share=100.0 * share,
            facts="".join(rows),
            why=html.escape(reason),
            sent=json.dumps(values).replace("<", "\\u003c"),
        )
        return self._before + shown + self._after

    def write(self, page: str) -> None:
        """Replace the page's file atomically; OSError if it cannot be written."""
        new = self.file.with_name(f".{self.file.name}.new")
        new.write_text(page, encoding="utf-8")
        new.replace(self.file)
