"""Read the darkness of the pixels of a PNG or JPEG of any colour model.

Pillow decodes them. Here is decided what a pixel is: colours by their luminance, also CMYK; what
is transparent over white; 16 bits as they are; a camera held sideways as its EXIF says. The size
is looked at before anything is decoded."""

from __future__ import annotations

import io
import struct
import warnings
import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from camtool.errors import DrawingError

MAX_PIXELS = 24_000_000
"""Larger pictures are refused: each pixel takes some 40 bytes of memory, contours included."""

SQUARE_SHARE = 0.01
"""Pixels whose sides differ by more than this share are not square."""

Ink = npt.NDArray[np.float32]
"""(H, W) darkness of pixels, 0 white … 1 black; the first row is the top one."""

_BROKEN: tuple[type[Exception], ...] = (
    OSError,
    SyntaxError,
    ValueError,
    LookupError,
    TypeError,
    EOFError,
    OverflowError,
    struct.error,
    zlib.error,
)
"""The exceptions that Pillow raises for broken files."""


@dataclass(frozen=True, eq=False)
class PixelPicture:
    """A decoded picture: the darkness `ink` (H, W) of its pixels, 0 white to 1 black, and the
    pixels per inch that the file states, or None; `kind`: PNG or JPEG."""

    ink: Ink
    dpi: tuple[float, float] | None
    kind: str


def picture(data: bytes, file: str) -> PixelPicture:
    """Decode a PNG or JPEG; DrawingError where it is broken or too large."""
    from PIL import Image, ImageOps

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about sizes, which are looked at here, and odd metadata
        try:
            image: Any = Image.open(io.BytesIO(data), formats=("PNG", "JPEG"))
        except Image.DecompressionBombError as error:
            raise _too_large("far too many", file) from error
        except _BROKEN as error:
            raise _broken_file_error(file) from error
        width, height = image.size
        if width * height > MAX_PIXELS:
            raise _too_large(f"{width} x {height}", file)
        kind, dpi = str(image.format), image.info.get("dpi")
        try:
            image.load()
            ink = _ink(ImageOps.exif_transpose(image))
        except _BROKEN as error:
            raise _broken_file_error(file) from error
    return PixelPicture(ink, _dpi(dpi), kind)


def _ink(image: Any) -> Ink:
    """Return the darkness (H, W), 0 white to 1 black, of an image of any mode."""
    from PIL import Image

    if image.mode.startswith(("I", "F")):
        light = np.asarray(image, dtype=np.float32) / np.float32(65535.0)
        clear = image.info.get("transparency")
        if isinstance(clear, int):
            light[np.asarray(image) == clear] = 1.0
    else:
        if "A" in image.mode or "transparency" in image.info:
            image = image.convert("RGBA")
            image = Image.alpha_composite(Image.new("RGBA", image.size, "white"), image)
        if image.mode not in ("1", "L"):
            image = image.convert("RGB")
        light = np.asarray(image.convert("L"), dtype=np.float32) / np.float32(255.0)
    ink: Ink = np.clip(np.float32(1.0) - light, 0.0, 1.0)
    return ink


def _dpi(dpi: Any) -> tuple[float, float] | None:
    try:
        x, y = (float(one) for one in dpi)
    except (TypeError, ValueError, ZeroDivisionError):
        return None
    return (x, y) if 0.0 < x < np.inf and 0.0 < y < np.inf else None


def is_square(dpi: tuple[float, float]) -> bool:
    """Return True if the densities along x and y agree, so that pixels are square."""
    return abs(dpi[0] - dpi[1]) <= SQUARE_SHARE * max(dpi)


def _too_large(size: str, file: str) -> DrawingError:
    return DrawingError(
        f"has {size} pixels, more than {MAX_PIXELS // 1_000_000} million",
        file=file,
        mend="scale it down: half the pixels trace nearly as well",
    )


def _broken_file_error(file: str) -> DrawingError:
    return DrawingError(
        "is a broken PNG or JPEG", file=file, mend="save it again from the program that made it"
    )
