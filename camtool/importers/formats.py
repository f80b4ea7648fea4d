"""Detect the format of a file by its content; its extension is a hint where that is silent.

    binary DXF   the sentinel of AutoCAD Binary DXF
    ASCII DXF    the first line is a group code alone: 0 or 999
    SVG          XML whose first element is `svg`, plain or packed by gzip
    solid        STEP (ISO-10303-21), BREP of OpenCASCADE; a script by its extension .py
    bitmap       PNG, JPEG
    board        Gerber (%FS, %MO, %TF), Excellon (M48), or a ZIP archive of such files
    points       NumPy's .npy and .npz, JSON (`[` or `{`), the router's arrays (`xy = `), or a
                 first line of two numbers

What is known to be something else (G-code, a mesh, PDF, DWG, other pictures of pixels, other XML
and other archives) is refused with what to do about it."""

from __future__ import annotations

import io
import re
import zlib

from camtool.errors import DrawingError
from camtool.importers.options import FORMATS

BINARY_DXF = b"AutoCAD Binary DXF\r\n\x1a\x00"

HEAD_BYTES = 4096

MAX_ENTRIES = 100
"""A ZIP archive is taken for a board if one of its first entries, so many, is a file of a
board."""

XML_HEAD_BYTES = 1 << 20
"""The first element of an XML file is searched for in this many bytes, after comments and a
DOCTYPE."""

_EXTENSIONS = {
    "dxf": ".dxf",
    "svg": ".svg .svgz",
    "points": ".csv .tsv .txt .dat .xy .json .npy .npz .m",
    "solid": ".step .stp .brep .brp .py",
    "bitmap": ".png .jpg .jpeg",
    "board": ".gbr .ger .gtl .gbl .gko .gm1 .drl .xln .exc",
}
_FORMAT_BY_SUFFIX = {
    suffix: name for name, suffixes in _EXTENSIONS.items() for suffix in suffixes.split()
}

_PICTURES = (b"\x89PNG", b"\xff\xd8\xff")
_GZIP = b"\x1f\x8b"
NPY_START = b"\x93NUMPY"
ZIP_START = b"PK\x03\x04"
_EXPORT = "export SVG or DXF from the program that made it"
_AS_PNG = "save it as PNG"

_OTHERS = {
    rb"PK[\x05\x07]": ("is an empty or split ZIP archive", "unpack it first"),
    rb"%PDF-": ("is a PDF", _EXPORT),
    rb"AC10\d\d": ("is a DWG", "save it as DXF"),
    rb"GIF8|II\*\x00|MM\x00\*|BM.{4}\x00\x00\x00\x00": (
        "is a picture of pixels of another kind than PNG and JPEG",
        _AS_PNG,
    ),
    rb"RIFF.{4}WEBP": ("is a picture of pixels of another kind than PNG and JPEG", _AS_PNG),
    rb"%!PS": ("is PostScript", _EXPORT),
    rb"\xd0\xcf\x11\xe0": (
        "is a file of a CAD or office program's own",
        "export STEP or DXF from the program that made it",
    ),
    rb"solid[ \t][^\n]*\n\s*facet\b": ("is a mesh (STL)", "export STEP, or a DXF of its outline"),
    rb"(?:IN|PU|PD|PA|SP\d)[\d,; ]*;": ("is a plotter file (HPGL)", _EXPORT),
    rb"\*\*ABCDEFGHIJKLMNOPQRSTUVWXYZ|PS\x00\x00": (
        "is a Parasolid file (.x_t, .x_b)",
        "export STEP from the program that made it",
    ),
    rb"[^\n]{72}S {0,6}\d{1,7}\s": ("is IGES", "export STEP from the program that made it"),
}
"""First bytes of files that are often given by mistake, and what to do about them."""

_ZIPPED = {
    b"word/": ("is a document", _EXPORT),
    b"xl/": ("is a spreadsheet", "save it as CSV"),
    b"Document.xml": ("is a FreeCAD file", "export STEP or DXF from FreeCAD"),
    b"3D/": ("is a mesh (3MF)", "export STEP, or a DXF of its outline"),
}

_DXF_START = re.compile(r"\s*(?:0|999)[ \t]*(?:\r\n|\n|\r)")
_STEP_START = re.compile(r"\s*(?:/\*(?:(?!\*/).)*\*/\s*)*ISO-10303-21\s*;", re.DOTALL)
_BREP_START = re.compile(r"\s*(?:DBRep_DrawableShape|CASCADE Topology V\d|Open CASCADE Topology)")
_GERBER_START = re.compile(r"^[^\S\n]*%(?:FS[LTD]?[AI]?X\d|MO(?:MM|IN)\*|TF\.)", re.MULTILINE)
# Where two repeated parts could match the same blanks, the time grows with their power: 40 blank
# lines would take hours.
_EXCELLON_START = re.compile(r"(?:\s|;[^\n]*\n|%[^\S\n]*\n)*M48\b")
_ROUTER = re.compile(
    r"^[ \t]*(?:l?xy|velxy|[xy]_points|l[xy]|vel[xy]|size_of_array|first_point[xy])[ \t]*=",
    re.MULTILINE,
)
_COMMENT = re.compile(r"[ \t]*(?:[#%;(][^\n]*)?(?:\n|$)")
_G_BLOCK = re.compile(r"\s*(?:/\s*)?(?:[NO]\d+|[GM]\s?\d{1,3}(?!\d)|[XYZIJFST]-?\d)", re.I)
_G_CODE = re.compile(
    r"^[^\S\n]*(?:/\s*)?(?:[NO]\d+\s*)?[GM]\s?\d{1,3}(?!\w*[ \t]*[,\t])", re.I | re.M
)
_TWO_FIELDS = re.compile(r"[^\S\n]*[-+.\w]+[^\S\n]*[,;\s][^\S\n]*[-+.\w]+")
_XML_BEFORE = re.compile(r"\s+|<\?.*?\?>|<!--.*?-->|<!DOCTYPE(?:[^\[>]|\[.*?\]\s*(?=>))*>", re.S)
_XML_ELEMENT = re.compile(r"<(?:[\w.-]+:)?([A-Za-z_][\w.-]*)")


class NoDrawingError(DrawingError):
    """The content is a machine program, or of no format that is known."""


def find_format(data: bytes, suffix: str, file: str) -> str:
    """Return the name of the format in FORMATS; NoDrawingError if the content is none of them."""
    suffix = suffix.lower()
    name = _by_bytes(data, file) or _by_text(data, suffix, file)
    if name is None:
        raise NoDrawingError(
            "is no drawing that camtool knows",
            file=file,
            mend="give DXF, SVG, points, STEP, BREP, PNG or JPEG, "
            f"or name the format: --format ({', '.join(FORMATS)})",
        )
    return name


def _by_bytes(data: bytes, file: str) -> str | None:
    """Return the format whose first bytes these are, None if none; DrawingError for what is
    certainly no drawing."""
    if data.startswith(BINARY_DXF):
        return "dxf"
    if data.startswith(NPY_START) or is_npz(data):
        return "points"
    if data.startswith(_PICTURES):
        return "bitmap"
    if data.startswith(_GZIP):
        if _xml_root(text_head(_unpacked_head(data))) == "svg":
            return "svg"
        raise DrawingError("is compressed with gzip", file=file, mend="unpack it first (gunzip)")
    if data.startswith(ZIP_START):
        if _is_board_archive(data):
            return "board"
        complaint, mend = next(
            (answer for sign, answer in _ZIPPED.items() if sign in data[:HEAD_BYTES]),
            ("is a ZIP archive", "unpack it first"),
        )
        raise DrawingError(complaint, file=file, mend=mend)
    for pattern, (complaint, mend) in _OTHERS.items():
        if re.match(pattern, data[:HEAD_BYTES], re.DOTALL):
            raise DrawingError(complaint, file=file, mend=mend)
    return None


def _by_text(data: bytes, suffix: str, file: str) -> str | None:
    """Return the format of a text, by its first characters and then by the extension; None if
    unknown."""
    head = text_head(data)
    if _DXF_START.match(head):
        return "dxf"
    if is_gerber(head) or is_excellon(head):
        return "board"
    if is_step(head) or is_brep(head):
        return "solid"
    start = head.lstrip()[:1]
    if start == "<":
        return _xml(text_head(data, XML_HEAD_BYTES), file)
    if suffix == ".py":
        return "solid"
    if start in ("[", "{") or _ROUTER.search(head):
        return "points"
    _refuse_program(head, file)
    if suffix in _FORMAT_BY_SUFFIX:
        return _FORMAT_BY_SUFFIX[suffix]
    return "points" if _looks_like_points(head) else None


def is_npz(data: bytes) -> bool:
    """Return True if the first member of this ZIP archive is an array of NumPy."""
    length = int.from_bytes(data[26:28], "little")
    return data.startswith(ZIP_START) and data[30 : 30 + length].endswith(b".npy")


def is_step(head: str) -> bool:
    """Return True if the text begins with the header of STEP."""
    return _STEP_START.match(head) is not None


def is_gerber(head: str) -> bool:
    """Return True if the text begins as Gerber does: with its number format or its unit."""
    return _GERBER_START.search(head) is not None


def is_excellon(head: str) -> bool:
    """Return True if the text begins with the head of Excellon."""
    return _EXCELLON_START.match(head) is not None


def zip_faults() -> tuple[type[Exception], ...]:
    """Return the exceptions of zipfile for a bad archive, a password, an unknown compression, and
    damaged data. DrawingError is a ValueError, and so one of them."""
    import zipfile

    return (
        zipfile.BadZipFile,
        zlib.error,
        EOFError,
        OSError,
        OverflowError,
        RuntimeError,
        ValueError,
    )


def _is_board_archive(data: bytes) -> bool:
    """Return True if a ZIP archive holds a Gerber or Excellon file."""
    import zipfile

    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            for entry in archive.infolist()[:MAX_ENTRIES]:
                with archive.open(entry) as file:
                    head = text_head(file.read(HEAD_BYTES))
                if is_gerber(head) or is_excellon(head):
                    return True
    except zip_faults():
        return False  # what it is instead, the caller says
    return False


def is_brep(head: str) -> bool:
    """Return True if the text begins with the header of OpenCASCADE's BREP."""
    return _BREP_START.match(head) is not None


def text_head(data: bytes, size: int = HEAD_BYTES) -> str:
    """Return the first characters of a text in UTF-8 or UTF-16 (by its byte-order mark); bytes
    that cannot be decoded become U+FFFD."""
    head = data[:size]
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return head.decode("utf-16", errors="replace").lstrip("\ufeff")
    # XML in UTF-16 may go without a mark.
    if head.startswith((b"<\x00", b"\x00<")):
        name = "utf-16-le" if head[0] else "utf-16-be"
        return head.decode(name, errors="replace")
    return head.decode("utf-8", errors="replace").lstrip("\ufeff")


def _xml(head: str, file: str) -> str:
    """Return "svg"; DrawingError if the first element of the XML is another one."""
    root = _xml_root(head)
    if root in ("svg", None):
        return "svg"
    raise DrawingError(
        f"is XML of another kind (its first element is {root!r}), no SVG", file=file, mend=_EXPORT
    )


def _xml_root(head: str) -> str | None:
    """Return the name of the first element, without its prefix; None if none is within this
    head."""
    offset = 0
    while match := _XML_BEFORE.match(head, offset):
        offset = match.end()
    element = _XML_ELEMENT.match(head, offset)
    # A head that was cut within a comment or a DOCTYPE shows no element.
    return element[1].lower() if element else None


def _unpacked_head(data: bytes) -> bytes:
    """Return the first bytes of a gzip file, unpacked; b"" if it is damaged."""
    try:
        return zlib.decompressobj(31).decompress(data[: 16 * HEAD_BYTES], XML_HEAD_BYTES)
    except zlib.error:
        return b""


def _refuse_program(head: str, file: str) -> None:
    """Raise DrawingError if the first line that is no comment is a block of a machine program."""
    offset = 0
    while offset < len(head) and (comment := _COMMENT.match(head, offset)):
        if comment.end() == offset:
            break
        offset = comment.end()
    if _G_BLOCK.match(head, offset) and _G_CODE.search(head):
        raise NoDrawingError(
            "is a machine program (G-code), no drawing",
            file=file,
            mend="camtool verify judges programs; give the drawing that it was made from",
        )


def _looks_like_points(head: str) -> bool:
    """Return True if the content is text, and its first line that is no comment begins with two
    fields."""
    if "\x00" in head or "\ufffd" in head:
        return False
    for line in head.splitlines():
        if line.strip() and not line.lstrip().startswith(("#", "%")):
            return _TWO_FIELDS.match(line) is not None and any(sign.isdigit() for sign in head)
    return False
