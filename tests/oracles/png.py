"""A PNG decoder for what camtool and its pages have: 8 bits a channel, RGB, RGBA or a palette
(which becomes RGBA), not interlaced."""

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
    at, packed, header, palette = len(SIGNATURE), b"", b"", b""
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8 : at + 8 + length]
        (crc,) = struct.unpack_from(">I", data, at + 8 + length)
        if crc != zlib.crc32(kind + body):
            raise ValueError(f"checksum of {kind!r}")
        header = body if kind == b"IHDR" else header
        palette = body if kind == b"PLTE" else palette
        packed += body if kind == b"IDAT" else b""
        at += 12 + length
    width, height, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", header)
    channels = {2: 3, 3: 1, 6: 4}.get(colour)
    if depth != 8 or channels is None or interlaced:
        raise ValueError("not 8-bit RGB, RGBA or palette")
    packed, step = zlib.decompress(packed), 1 + width * channels
    above = bytes(width * channels)
    out = []
    for begin in range(0, height * step, step):
        above = _unfiltered(packed[begin], packed[begin + 1 : begin + step], above, channels)
        out.append(above)
    pixels = np.frombuffer(b"".join(out), np.uint8).reshape(height, width, channels)
    if colour != 3:
        return pixels
    colours = np.frombuffer(palette, np.uint8).reshape(-1, 3)
    opaque = np.full((len(colours), 1), 255, dtype=np.uint8)
    return np.hstack([colours, opaque])[pixels[:, :, 0]]


def _unfiltered(kind: int, line: bytes, above: bytes, channels: int) -> bytes:
    """Undo the filter of a row (PNG specification, §9.2); all arithmetic modulo 256."""
    if kind == 0:
        return line
    # The bytes of the pixels to the left and above left begin with those of an empty pixel.
    left, corner = [0] * channels, [0] * channels
    out = bytearray()
    for index, (value, up) in enumerate(zip(line, above, strict=True)):
        at = index % channels
        a, c = left[at], corner[at]
        if kind == 1:
            guess = a
        elif kind == 2:
            guess = up
        elif kind == 3:
            guess = (a + up) // 2
        else:
            guess = _paeth(a, up, c)
        left[at], corner[at] = (value + guess) & 255, up
        out.append(left[at])
    return bytes(out)


def _paeth(a: int, b: int, c: int) -> int:
    """Return whichever of left, up and corner is nearest to left + up − corner."""
    guess = a + b - c
    to_a, to_b, to_c = abs(guess - a), abs(guess - b), abs(guess - c)
    if to_a <= to_b and to_a <= to_c:
        return a
    return b if to_b <= to_c else c
