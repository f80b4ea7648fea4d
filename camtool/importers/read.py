"""One door for every drawing: which format it is, and its reader.

The content decides; the extension of the name is a hint for content that says nothing:

    binary DXF   the sentinel of AutoCAD Binary DXF
    ASCII DXF    the first line is a group code alone: 0 or 999
    SVG          the first sign is `<`
    points       JSON (`[` or `{`), or a first line of two numbers
"""

from __future__ import annotations

import importlib
import re
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, cast

from camtool.errors import DrawingError
from camtool.importers.options import DEFAULTS, FORMATS, ReadOptions

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing

BINARY_DXF = b"AutoCAD Binary DXF\r\n\x1a\x00"

_EXTENSIONS = {
    ".dxf": "dxf",
    ".svg": "svg",
    ".csv": "points",
    ".tsv": "points",
    ".txt": "points",
    ".dat": "points",
    ".xy": "points",
    ".json": "points",
}

_OTHERS = {
    b"\x1f\x8b": ("is compressed with gzip", "unpack it first (gunzip)"),
    b"PK\x03\x04": ("is a ZIP archive", "unpack it first"),
    b"%PDF": ("is a PDF", "export SVG or DXF from the program that made it"),
    b"AC10": ("is a DWG", "save it as DXF"),
    b"\x89PNG": ("is a picture of pixels", "trace it and save SVG or DXF"),
    b"\xff\xd8\xff": ("is a picture of pixels", "trace it and save SVG or DXF"),
    b"%!PS": ("is PostScript", "export SVG or DXF from the program that made it"),
}
"""First bytes of what people hand over by mistake, and what to do about it."""

_HEAD_BYTES = 4096
"""How much of a file decides on its format."""

_DXF_START = re.compile(r"\s*(?:0|999)[ \t]*\r?\n")
_TWO_FIELDS = re.compile(r"[^\S\n]*[-+.\w]+[^\S\n]*[,;\s][^\S\n]*[-+.\w]+")


class _Reader(Protocol):
    def read(self, data: bytes, file: str, options: ReadOptions) -> Drawing:
        """The Drawing in `data`."""


def read_drawing(path: Path, *, options: ReadOptions = DEFAULTS) -> Drawing:
    """The Drawing in a DXF, SVG or points file, in mm; DrawingError when it has none."""
    file = str(path)
    data = _bytes(path)
    name = options.format or find_format(data, path.suffix, file)
    module = importlib.import_module(f"camtool.importers.{name}")
    return cast(_Reader, module).read(data, file, options)


def find_format(data: bytes, suffix: str, file: str) -> str:
    """One of FORMATS for this content; DrawingError when it is none of them."""
    if data.startswith(BINARY_DXF):
        return "dxf"
    for magic, (what, mend) in _OTHERS.items():
        # A text may begin with such letters as well: then its extension says so.
        if data.startswith(magic) and suffix.lower() not in _EXTENSIONS:
            raise DrawingError(what, file=file, mend=mend)
    head = text_head(data)
    if _DXF_START.match(head):
        return "dxf"
    start = head.lstrip()[:1]
    if start == "<":
        return "svg"
    if start in ("[", "{"):
        return "points"
    hint = _EXTENSIONS.get(suffix.lower())
    if hint is not None:
        return hint
    if _looks_like_points(head):
        return "points"
    raise DrawingError(
        "is no drawing that camtool knows",
        file=file,
        mend=f"give DXF, SVG or points, or name the format ({', '.join(FORMATS)})",
    )


def text_head(data: bytes) -> str:
    """The first characters of a text in UTF-8 or UTF-16 (by its mark), whatever bytes follow."""
    head = data[:_HEAD_BYTES]
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return head.decode("utf-16", errors="replace").lstrip("\ufeff")
    return head.decode("utf-8", errors="replace").lstrip("\ufeff")


def _looks_like_points(head: str) -> bool:
    """Whether the first line that is no comment holds two fields, and all of it is text."""
    if "\x00" in head or "\ufffd" in head:
        return False
    for line in head.splitlines():
        if line.strip() and not line.lstrip().startswith("#"):
            return _TWO_FIELDS.match(line) is not None and any(sign.isdigit() for sign in head)
    return False


def _bytes(path: Path) -> bytes:
    """The file's content; DrawingError when there is none."""
    file = str(path)
    try:
        data = path.read_bytes()
    except FileNotFoundError as error:
        raise DrawingError("there is no such file", file=file, mend="check the path") from error
    except IsADirectoryError as error:
        raise DrawingError(
            "is a directory", file=file, mend="give a drawing, or use camtool batch"
        ) from error
    except (OSError, ValueError) as error:  # ValueError: a name with a null character
        reason = getattr(error, "strerror", None) or error
        raise DrawingError(f"cannot be read ({reason})", file=file) from error
    if not data.strip():
        raise DrawingError("is empty", file=file, mend="export the drawing again")
    return data
