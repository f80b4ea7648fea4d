"""An SVG file as a tree of nodes, each knowing its line; entities and references are refused.

The tree is read as a stream over defusedxml. A document type is let pass (old programs write
one) but never fetched; any `<!ENTITY` is an error: its expansion can be endless or a file.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from io import BytesIO
from typing import TYPE_CHECKING, Any
from xml.sax import SAXException, SAXParseException
from xml.sax.handler import ContentHandler, feature_external_ges, feature_namespaces
from xml.sax.xmlreader import InputSource

from camtool.errors import DrawingError

if TYPE_CHECKING:
    from collections.abc import Iterator

SVG = "http://www.w3.org/2000/svg"
XLINK = "http://www.w3.org/1999/xlink"
INKSCAPE = "http://www.inkscape.org/namespaces/inkscape"

MAX_DEPTH = 150
"""Deeper nesting than any drawing has; it also bounds the recursion of the walk."""


@dataclass(eq=False)
class Node:
    """One SVG element: `tag` without namespace; foreign elements have the tag "". Attributes
    of SVG itself by name, those of XLink and Inkscape as "xlink:href", "inkscape:label"."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Node] = field(default_factory=list)
    text: str = ""

    @property
    def label(self) -> str:
        """How messages and sources name it: "path outline" or "path at line 12"."""
        name = self.attributes.get("id", "").strip()
        return f"{self.tag} {name}" if name else f"{self.tag} at line {self.line}"

    def get(self, name: str, default: str = "") -> str:
        """An attribute without blanks around it."""
        return self.attributes.get(name, default).strip()

    def walk(self) -> Iterator[Node]:
        """This node and all below it, in document order."""
        pending = [self]
        while pending:
            node = pending.pop()
            yield node
            pending.extend(reversed(node.children))


def parse_tree(data: bytes) -> Node:
    """The root of an SVG document; DrawingError when it is no XML, no SVG, or not safe."""
    from defusedxml import sax
    from defusedxml.common import DefusedXmlException

    handler = _Builder()
    parser = sax.make_parser()
    parser.setContentHandler(handler)
    parser.setFeature(feature_namespaces, True)
    # The standard document type names its file on the web: let pass, and never fetched.
    parser.forbid_external = False
    parser.setFeature(feature_external_ges, False)
    source = InputSource()
    source.setByteStream(BytesIO(data))
    try:
        parser.parse(source)
    except DefusedXmlException as error:
        raise DrawingError(
            "declares XML entities, which can be endless or refer to other files",
            mend="save it as plain SVG, without <!ENTITY ...>",
        ) from error
    except SAXParseException as error:
        where = f"line {error.getLineNumber()}, column {(error.getColumnNumber() or 0) + 1}"
        raise DrawingError(f"is no XML: {error.getMessage()}", where=where) from error
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


class _Builder(ContentHandler):
    """Collects nodes; `root_name` is the name of the root, whatever it is."""

    def __init__(self) -> None:
        super().__init__()
        self.root: Node | None = None
        self.root_name = ""
        self._open: list[Node] = []
        self._locator: Any = None

    def setDocumentLocator(self, locator: Any) -> None:
        self._locator = locator

    def startElementNS(self, name: tuple[str | None, str], qname: str | None, attrs: Any) -> None:
        line = int(self._locator.getLineNumber())
        if len(self._open) >= MAX_DEPTH:
            raise DrawingError(
                f"is nested deeper than {MAX_DEPTH} elements",
                where=f"line {line}",
                mend="ungroup the drawing",
            )
        space, tag = name
        node = Node(tag if space in (SVG, None) else "", _attributes(attrs), line)
        if self._open:
            self._open[-1].children.append(node)
        elif self.root is None:
            self.root, self.root_name = node, tag
        self._open.append(node)

    def endElementNS(self, name: tuple[str | None, str], qname: str | None) -> None:
        self._open.pop()

    def characters(self, content: str) -> None:
        if self._open[-1].tag == "style":
            self._open[-1].text += content


_PREFIXES = {None: "", "": "", SVG: "", XLINK: "xlink:", INKSCAPE: "inkscape:"}


def _attributes(attrs: Any) -> dict[str, str]:
    return {
        _PREFIXES[space] + name: str(value)
        for (space, name), value in attrs.items()
        if space in _PREFIXES
    }
