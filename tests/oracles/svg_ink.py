"""Where resvg, a renderer that is not ours, puts the ink of an SVG: the extents of all pixels
that are not clear, in px of the page.

Rendered without smoothing, a pixel has ink when its centre lies inside, so that an extent is right
to half a pixel of the rendered picture.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import resvg_py

from camtool.arrays import Bools
from tests.oracles.png import SIGNATURE

Extents = tuple[float, float, float, float]


@dataclass(frozen=True)
class Picture:
    """`inked` (height, width): where there is ink; `zoom` of its pixels make a px of the page."""

    inked: Bools
    zoom: int

    @property
    def canvas(self) -> tuple[float, float]:
        """Width and height in px of the page."""
        return self.inked.shape[1] / self.zoom, self.inked.shape[0] / self.zoom

    @property
    def extents(self) -> Extents | None:
        """left, top, right, bottom of the ink in px of the page; None when it stays clear."""
        columns = np.flatnonzero(self.inked.any(axis=0))
        rows = np.flatnonzero(self.inked.any(axis=1))
        if not len(columns):
            return None
        ends = (columns[0], rows[0], columns[-1] + 1, rows[-1] + 1)
        left, top, right, bottom = (int(end) / self.zoom for end in ends)
        return left, top, right, bottom


def ink(svg: str, zoom: int, fonts: tuple[str, ...] = ()) -> Picture:
    """Render the page with resvg at `zoom` times its size, its text in these font files."""
    data = bytes(
        resvg_py.svg_to_bytes(
            svg_string=svg,
            dpi=96,
            zoom=zoom,
            skip_system_fonts=True,
            shape_rendering="crisp_edges",
            text_rendering="optimize_speed",
            font_files=list(fonts),
        )
    )
    return Picture(decode(data)[:, :, 3] > 0, zoom)


def decode(data: bytes) -> npt.NDArray[np.uint8]:
    """(height, width, 4) of an RGBA PNG of 8 bits: like `png.decode`, compiled."""
    assert data.startswith(SIGNATURE)
    at, packed, header = len(SIGNATURE), [], b""
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8 : at + 8 + length]
        header = body if kind == b"IHDR" else header
        if kind == b"IDAT":
            packed.append(body)
        at += 12 + length
    width, height, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", header)
    assert (depth, colour, interlaced) == (8, 6, 0)
    raw = np.frombuffer(zlib.decompress(b"".join(packed)), np.uint8)
    rows = raw.reshape(height, 1 + 4 * width)
    return _unfiltered(rows).reshape(height, width, 4)


def _unfiltered(rows: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """The filters of each row undone (PNG specification, §9.2), 4 bytes a pixel."""
    out = np.zeros((len(rows), rows.shape[1] - 1), np.uint8)
    above = np.zeros(out.shape[1], np.uint8)
    for y, row in enumerate(rows):
        kind, line = row[0], row[1:]
        if kind == 1:
            sums = line.reshape(-1, 4).astype(np.int64).cumsum(axis=0) & 255
            line = sums.astype(np.uint8).reshape(-1)
        elif kind == 2:
            line = line + above
        elif kind > 2:
            line = np.frombuffer(_guessed(line.tolist(), above.tolist(), kind == 4), np.uint8)
        out[y] = above = line
    return out


def _guessed(line: list[int], above: list[int], paeth: bool) -> bytes:
    """A row whose bytes are told from those to the left and above."""
    for x, up in enumerate(above):
        left, corner = (line[x - 4], above[x - 4]) if x >= 4 else (0, 0)
        guess = (left + up) // 2
        if paeth:
            a, b, c = abs(up - corner), abs(left - corner), abs(left + up - 2 * corner)
            guess = left if a <= b and a <= c else (up if b <= c else corner)
        line[x] = (line[x] + guess) & 255
    return bytes(line)
