"""A PNG decoder for what resvg writes: 8 bits a channel, RGB or RGBA, not interlaced."""

from __future__ import annotations

import struct
import zlib

import numpy as np
import numpy.typing as npt

SIGNATURE = b"\x89PNG\r\n\x1a\n"


def decode(data: bytes) -> npt.NDArray[np.uint8]:
    """(height, width, channels) of a PNG; ValueError when it is broken or of another kind."""
    if not data.startswith(SIGNATURE):
        raise ValueError("no PNG signature")
    at, packed, header = len(SIGNATURE), b"", b""
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8 : at + 8 + length]
        (crc,) = struct.unpack_from(">I", data, at + 8 + length)
        if crc != zlib.crc32(kind + body):
            raise ValueError(f"checksum of {kind!r}")
        header = body if kind == b"IHDR" else header
        packed += body if kind == b"IDAT" else b""
        at += 12 + length
    width, height, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", header)
    if depth != 8 or colour not in (2, 6) or interlaced:
        raise ValueError("not 8-bit RGB or RGBA")
    channels = 3 if colour == 2 else 4
    rows = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, 1 + width * channels)
    out = np.zeros((height, width, channels), np.uint8)
    above = np.zeros((width, channels), np.uint8)
    for index, row in enumerate(rows):
        line = row[1:].reshape(width, channels)
        above = out[index] = _unfiltered(int(row[0]), line, above)
    return out


def _unfiltered(
    kind: int, line: npt.NDArray[np.uint8], above: npt.NDArray[np.uint8]
) -> npt.NDArray[np.uint8]:
    """One row with its filter undone (PNG specification, §9.2); all arithmetic modulo 256."""
    if kind == 0:
        return line
    if kind == 1:
        return np.cumsum(line, axis=0, dtype=np.uint8)
    if kind == 2:
        return line + above
    out = np.zeros_like(line).astype(np.int64)
    left = np.zeros(line.shape[1], np.int64)
    corner = np.zeros(line.shape[1], np.int64)
    for x in range(len(line)):
        up = above[x].astype(np.int64)
        guess = (left + up) // 2 if kind == 3 else _paeth(left, up, corner)
        left = (line[x] + guess) % 256
        out[x], corner = left, up
    return out.astype(np.uint8)


def _paeth(
    left: npt.NDArray[np.int64], up: npt.NDArray[np.int64], corner: npt.NDArray[np.int64]
) -> npt.NDArray[np.int64]:
    guess = left + up - corner
    to_left, to_up, to_corner = abs(guess - left), abs(guess - up), abs(guess - corner)
    near = np.where(to_up <= to_corner, up, corner)
    return np.where((to_left <= to_up) & (to_left <= to_corner), left, near)
