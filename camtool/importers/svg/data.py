"""The bytes of an SVG file, made ready for the XML parser.

gzip (.svgz)           unpacked, up to MAX_BYTES
UTF-16, Shift-JIS, ...  decoded by what the file says of itself, and given on as UTF-8
<!DOCTYPE ... "url">   the reference to the outside is blotted out: nothing may be fetched, and
                       an entity that only the outside could define is an error then, where
                       expat would have left it out of an attribute without a word
"""

from __future__ import annotations

import codecs
import gzip
import re
import zlib
from io import BytesIO

from camtool.errors import DrawingError

MAX_BYTES = 200_000_000
"""A larger SVG file (unpacked) is refused: its tree would not fit into memory."""

GZIP = b"\x1f\x8b"

_HEAD_BYTES = 65_536
"""Where the XML declaration and the document type are looked for."""

_MARKS = {
    b"\xef\xbb\xbf": "utf-8",
    b"\xff\xfe": "utf-16",
    b"\xfe\xff": "utf-16",
    b"<\x00?\x00": "utf-16-le",
    b"\x00<\x00?": "utf-16-be",
}
_NATIVE = ("utf-8", "us-ascii", "iso-8859-1")
_NO_CHARSETS = ("idna", "punycode", "unicode-escape", "raw-unicode-escape", "utf-7", "undefined")
_DECLARED = re.compile(rb"""\s*<\?xml\s[^>]*?encoding\s*=\s*["']([A-Za-z0-9._-]+)["']""")
_DECLARATION = re.compile(r"(\s*<\?xml\s[^>]*?)encoding\s*=\s*[\"'][^\"']*[\"']")
_DOCTYPE = re.compile(
    rb"""(<!DOCTYPE\s+[^\s\[>]+)(\s+(?:PUBLIC\s+(?:"[^"]*"|'[^']*')|SYSTEM)"""
    rb"""\s*(?:"[^"]*"|'[^']*')?)"""
)

# Inkscape took 90 px an inch before 0.92, Illustrator takes points.
_OLD_INKSCAPE = re.compile(rb"""inkscape:version=["']0\.([0-8]?[0-9]|9[01])(?![0-9])""")
_ILLUSTRATOR = re.compile(rb"Generator: Adobe Illustrator")


def ready(data: bytes) -> bytes:
    """UTF-8 (or what expat reads itself) without outside references; DrawingError."""
    if data.startswith(GZIP):
        data = _unpacked(data)
    if len(data) > MAX_BYTES:
        raise _too_large(len(data))
    data = _decoded(data)
    head = _DOCTYPE.sub(_blotted, data[:_HEAD_BYTES], count=1)
    return head + data[_HEAD_BYTES:]


def writer_dpi(head: bytes) -> tuple[str, float] | None:
    """The program that wrote the file and the px an inch that it means, where that is not 96."""
    head = head[:_HEAD_BYTES]
    inkscape = _OLD_INKSCAPE.search(head)
    if inkscape is not None:
        return f"Inkscape 0.{inkscape[1].decode()}", 90.0
    return ("Adobe Illustrator", 72.0) if _ILLUSTRATOR.search(head) else None


def _unpacked(data: bytes) -> bytes:
    """The content of a gzip file, no more than MAX_BYTES of it."""
    try:
        with gzip.GzipFile(fileobj=BytesIO(data)) as packed:
            content = packed.read(MAX_BYTES + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise DrawingError(
            f"is a broken gzip file ({error})", mend="save the drawing again, or as .svg"
        ) from error
    if len(content) > MAX_BYTES:
        raise _too_large(len(content))
    return content


def _too_large(size: int) -> DrawingError:
    return DrawingError(
        f"has {size / 1e6:.0f} MB or more; at most {MAX_BYTES / 1e6:.0f} MB are read",
        mend="take out what is not to be cut, or save it in parts",
    )


def _decoded(data: bytes) -> bytes:
    """The same text as UTF-8, unless expat knows its encoding."""
    name = next((name for mark, name in _MARKS.items() if data.startswith(mark)), "")
    if not name:
        declared = _DECLARED.match(data[:_HEAD_BYTES])
        name = declared[1].decode("ascii") if declared else "utf-8"
        if name.lower() in _NATIVE:
            return data
    try:
        known = codecs.lookup(name).name
    except LookupError:
        known = ""
    if not known or known in _NO_CHARSETS:
        raise DrawingError(f"names the encoding {name!r}", mend="save it in UTF-8")
    try:
        text = data.decode(known)
    # A codec that makes no text (base64, zlib) may raise anything of these.
    except (UnicodeError, LookupError, ValueError, zlib.error, OSError) as error:
        raise DrawingError(
            f"is not written in {name}, the encoding that it names", mend="save it in UTF-8"
        ) from error
    text = text.removeprefix("\ufeff")
    # Lone surrogates (from UTF-7 or the like) become signs that expat refuses with their place.
    return _DECLARATION.sub(r"\1", text, count=1).encode("utf-8", errors="replace")


def _blotted(match: re.Match[bytes]) -> bytes:
    """The document type without its reference; lines keep their numbers."""
    return match[1] + b"\n" * match[2].count(b"\n")
