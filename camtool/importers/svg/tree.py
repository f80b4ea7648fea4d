"""The bytes of an SVG file to a tree of nodes, each knowing its line and its parent.

The tree is read as a stream over defusedxml. Document types are accepted (old programs write one),
and so are short entities that stand for plain text (Adobe Illustrator writes them for its
namespaces); entities made of entities or of files are an error, as their expansion can be endless.
"""

from __future__ import annotations

import codecs
import gzip
import re
import zlib
from io import BytesIO
from typing import TYPE_CHECKING, Any
from xml.sax import SAXException, SAXParseException
from xml.sax.handler import ContentHandler, feature_external_ges, feature_namespaces
from xml.sax.xmlreader import InputSource

from msgspec import Struct, field

from camtool.errors import DrawingError

if TYPE_CHECKING:
    from collections.abc import Iterator


SVG = "http://www.w3.org/2000/svg"
XLINK = "http://www.w3.org/1999/xlink"
XML = "http://www.w3.org/XML/1998/namespace"
INKSCAPE = "http://www.inkscape.org/namespaces/inkscape"

MAX_DEPTH = 150
"""Deeper nesting than any drawing has; it also bounds the recursion of the walk."""

MAX_ELEMENTS = 500_000

MAX_ENTITY_SIGNS = 256
"""An entity in the document type may stand for at most this many characters of plain text, the
length of a namespace."""

MAX_REFERENCES = 10_000

_WRONG_PREFIX = "unbound prefix"


class Node(Struct, eq=False):
    """An SVG element: `tag` without namespace; foreign elements have the tag "". Attributes
    of SVG itself by name, those of others as "xlink:href", "xml:space", "inkscape:label".
    `text` is what a sheet holds, or the letters in front of the first child of an element within
    a text; `tail` the letters behind such an element."""

    tag: str
    attributes: dict[str, str]
    line: int
    parent: Node | None = None
    children: list[Node] = field(default_factory=list)
    text: str = ""
    tail: str = ""

    @property
    def label(self) -> str:
        """The name in messages and sources: "path outline" or "path at line 12"."""
        name = self.get("id")
        return f"{self.tag} {name}" if name else f"{self.tag} at line {self.line}"

    def get(self, name: str, default: str = "") -> str:
        """Return an attribute without blanks around it, or `default`."""
        value = self.attributes.get(name)
        return default if value is None else value.strip()

    def walk(self) -> Iterator[Node]:
        """Yield this node and all below it, in document order."""
        pending = [self]
        while pending:
            node = pending.pop()
            yield node
            pending.extend(reversed(node.children))


def parse_tree(data: bytes) -> Node:
    """Return the root of an SVG document, given as by `as_safe_utf8`; DrawingError when it is no
    XML, no SVG, or not safe."""
    from defusedxml.common import DefusedXmlException

    handler = _Builder()
    source = InputSource()
    source.setByteStream(BytesIO(data))
    parser = _parser(handler, data)
    try:
        parser.parse(source)
    except DefusedXmlException as error:
        raise DrawingError(
            "declares XML entities, which can be endless or refer to other files",
            mend="save it as plain SVG, without <!ENTITY ...>",
        ) from error
    except SAXParseException as error:
        where = f"line {error.getLineNumber()}, column {(error.getColumnNumber() or 0) + 1}"
        reason = error.getMessage()
        mend = "declare it with xmlns:...=" if reason == _WRONG_PREFIX else ""
        raise DrawingError(f"is no XML: {reason}", where=where, mend=mend) from error
    except (SAXException, LookupError, UnicodeError) as error:
        raise DrawingError(f"is no XML: {error}") from error
    except DrawingError:
        raise
    except ValueError as error:  # an encoding that expat does not know
        raise DrawingError(f"is no XML: {error}", mend="save it in UTF-8") from error
    root = handler.root
    if root is None or root.tag != "svg":
        raise DrawingError(f"is XML, but no SVG: its root is {handler.root_name!r}")
    return root


def _parser(builder: _Builder, data: bytes) -> Any:
    """Return a parser of defusedxml that accepts a few entities which are short and plain text.

    It takes all data in one go: expat before 2.6 begins a long attribute anew with each portion.

    Elements go to the builder as expat gives them: the way through SAX's own records of names and
    attributes takes longer than all the rest."""
    from defusedxml.expatreader import DefusedExpatParser

    entities = data.count(b"&") <= MAX_REFERENCES

    class Parser(DefusedExpatParser):  # type: ignore[misc]  # the base is untyped
        def start_element_ns(self, name: str, attributes: dict[str, str]) -> None:
            builder.start(name, attributes, self.getLineNumber())

        def end_element_ns(self, name: str) -> None:
            builder.end()

        def defused_entity_decl(self, name: str, is_parameter: bool, value: str | None,
                                *outside: str | None) -> None:  # fmt: skip
            """Accept a short internal entity of plain text; refuse every other one."""
            text = value or ""
            is_safe = len(text) <= MAX_ENTITY_SIGNS and not any(sign in text for sign in "&<%")
            if not (entities and is_safe) or is_parameter or value is None:
                super().defused_entity_decl(name, is_parameter, value, *outside)

    parser = Parser(bufsize=len(data) + 1)
    parser.setFeature(feature_namespaces, True)
    parser.setFeature(feature_external_ges, False)
    parser.setContentHandler(builder)
    return parser


class _Builder(ContentHandler):
    """The handler of parser events that builds the tree of nodes; `root_name` is the name of the
    root element, also of one that is no SVG."""

    def __init__(self) -> None:
        super().__init__()
        self.root: Node | None = None
        self.root_name = ""
        self._open: list[Node] = []
        self._sheet: list[str] = []
        self._letters: list[str] = []
        self._texts = 0
        self._count = 0

    def start(self, name: str, attributes: dict[str, str], line: int) -> None:
        """Handle a start tag. The parser gives names as "namespace name prefix", separated by
        spaces, or bare without a namespace."""
        self._count += 1
        if len(self._open) >= MAX_DEPTH or self._count > MAX_ELEMENTS:
            is_too_deep = len(self._open) >= MAX_DEPTH
            raise DrawingError(
                f"is nested deeper than {MAX_DEPTH} elements"
                if is_too_deep
                else f"has more than {MAX_ELEMENTS} elements",
                where=f"line {line}",
                mend="ungroup the drawing" if is_too_deep else "save it in parts",
            )
        if self._letters:
            self._put_letters()
        space, tag = _split_name(name)
        above = self._open[-1] if self._open else None
        node = Node(tag if space in (SVG, "") else "", _attributes(attributes), line, above)
        if above is not None:
            above.children.append(node)
        elif self.root is None:
            self.root, self.root_name = node, tag
        self._open.append(node)
        self._texts += node.tag == "text"

    def end(self) -> None:
        """Handle an end tag, which closes the innermost open element."""
        if self._letters:
            self._put_letters()
        node = self._open.pop()
        self._texts -= node.tag == "text"
        if node.tag == "style":
            node.text = "".join(self._sheet)
            self._sheet = []

    def _put_letters(self) -> None:
        """Store the characters since the last tag in the open element: as its text, or as the tail
        of its last child."""
        node = self._open[-1]
        letters = "".join(self._letters)
        self._letters = []
        if node.children:
            node.children[-1].tail = letters
        else:
            node.text = letters

    def skippedEntity(self, name: str) -> None:
        """Raise DrawingError for an external entity: without it, text or attributes would silently
        lack words."""
        raise DrawingError(f"refers to {name[:40]!r}, which stands in no file that may be read",
                           mend="save it as plain SVG")  # fmt: skip

    def characters(self, content: str) -> None:
        if self._open[-1].tag == "style":
            self._sheet.append(content)
        elif self._texts:
            self._letters.append(content)


def _split_name(name: str) -> tuple[str, str]:
    """Return the namespace ("" for none) and the local name; the prefix, which has no meaning, is
    dropped."""
    words = name.split(" ")
    return ("", name) if len(words) == 1 else (words[0], words[1])


_PREFIXES = {SVG: "", XLINK: "xlink:", XML: "xml:", INKSCAPE: "inkscape:"}


def _attributes(attributes: dict[str, str]) -> dict[str, str]:
    """Return attributes of SVG by name, those of XML, XLink and Inkscape with a prefix such as
    "xlink:", and none of other namespaces."""
    named: dict[str, str] = {}
    for name, value in attributes.items():
        if " " in name:
            space, name = _split_name(name)
            if space not in _PREFIXES:
                continue
            name = _PREFIXES[space] + name
        named[name] = value
    return named


# The bytes of an SVG file, made ready for the XML parser.
#
#     gzip (.svgz)            unpacked, up to MAX_BYTES
#     UTF-16, Shift-JIS, ...  decoded by what the file says of itself, and given on as UTF-8
#     <!DOCTYPE ... "url">    the reference to the outside is blotted out: nothing may be fetched,
#                             and an entity that only the outside could define is an error then,
#                             where expat would have left it out of an attribute without a word

MAX_BYTES = 100_000_000
"""A larger SVG file (unpacked) is refused: its tree would not fit into memory."""

GZIP = b"\x1f\x8b"

_HEAD_BYTES = 65_536
"""Bytes in which the XML declaration and the document type are searched."""

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


def as_safe_utf8(data: bytes) -> bytes:
    """Return the document unpacked, in UTF-8 or another encoding that expat reads, and without
    references to files outside.

    DrawingError for one that is too large or cannot be decoded."""
    if data.startswith(GZIP):
        data = _unpack(data)
    if len(data) > MAX_BYTES:
        raise _too_large(len(data))
    data = _decode(data)
    head = _DOCTYPE.sub(_blot_document_type, data[:_HEAD_BYTES], count=1)
    return head + data[_HEAD_BYTES:]


def writer_dpi(head: bytes) -> tuple[str, float] | None:
    """Return the program that wrote the file and its px per inch, where that is not 96; else None.

    Old versions of Inkscape used 90, Adobe Illustrator uses 72."""
    head = head[:_HEAD_BYTES]
    inkscape = _OLD_INKSCAPE.search(head)
    if inkscape is not None:
        return f"Inkscape 0.{inkscape[1].decode()}", 90.0
    return ("Adobe Illustrator", 72.0) if _ILLUSTRATOR.search(head) else None


def _unpack(data: bytes) -> bytes:
    """Return the content of a gzip file, no more than MAX_BYTES of it."""
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


def _decode(data: bytes) -> bytes:
    """Return the text encoded as UTF-8; unchanged if expat knows its encoding. DrawingError for an
    unknown or wrong encoding."""
    name = next((name for mark, name in _MARKS.items() if data.startswith(mark)), "")
    if not name:
        declared = _DECLARED.match(data[:_HEAD_BYTES])
        name = declared[1].decode("ascii") if declared else "utf-8"
        if name.lower() in _NATIVE:
            return data
    try:
        encoding = codecs.lookup(name).name
    except LookupError:
        encoding = ""
    if not encoding or encoding in _NO_CHARSETS:
        raise DrawingError(f"names the encoding {name!r}", mend="save it in UTF-8")
    try:
        text = data.decode(encoding)
    # A codec that makes no text (base64, zlib) may raise anything of these.
    except (UnicodeError, LookupError, ValueError, zlib.error, OSError) as error:
        raise DrawingError(
            f"is not written in {name}, the encoding that it names", mend="save it in UTF-8"
        ) from error
    text = text.removeprefix("\ufeff")
    # Lone surrogates (from UTF-7 or the like) become signs that expat refuses with their place.
    return _DECLARATION.sub(r"\1", text, count=1).encode("utf-8", errors="replace")


def _blot_document_type(match: re.Match[bytes]) -> bytes:
    """Return the document type without its reference to a file, with as many line feeds, so that
    lines keep their numbers."""
    return match[1] + b"\n" * match[2].count(b"\n")
