"""What an SVG element looks like, as far as it decides whether and as what it is drawn.

Read are stroke, fill, color, display and visibility, from attributes, from `<style>` sheets with
simple selectors (`path`, `.cut`, `#outline`, `path.cut`) and from the style attribute, each over
the one before. Source: Cascading Style Sheets 2.1, chapters 5 and 6.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from camtool.importers.svg_colours import NAMES
from camtool.importers.svg_tree import Node

_PROPERTIES = ("stroke", "fill", "color", "display", "visibility")
_INHERITED = ("stroke", "fill", "color", "visibility")

_COMMENT = re.compile(r"/\*.*?\*/|<!--|-->", re.DOTALL)
_RULE = re.compile(r"([^{}]+)\{([^{}]*)\}")
_SELECTOR = re.compile(r"(\*|[\w-]+)?(?:\.([\w-]+))?(?:#([\w-]+))?")
_HEX = re.compile(r"#([0-9a-f]{3,4}|[0-9a-f]{6}|[0-9a-f]{8})")
_RGB = re.compile(r"rgba?\(\s*([\d.]+%?)[\s,]+([\d.]+%?)[\s,]+([\d.]+%?)\s*(?:[,/][^)]*)?\)")
_SHORT_HEX = 4


@dataclass(frozen=True)
class Style:
    """The properties of one element, after inheritance."""

    stroke: str = "none"
    fill: str = "black"
    color: str = "black"
    visibility: str = "visible"
    display: str = "inline"

    @property
    def is_painted(self) -> bool:
        """Whether there is a stroke or a fill to be seen."""
        return any(paint not in ("none", "transparent") for paint in (self.stroke, self.fill))

    @property
    def colour(self) -> str:
        """ "#rrggbb" of the stroke, else of the fill; "" when it is none of its own."""
        paint = self.stroke if self.stroke not in ("none", "transparent") else self.fill
        return parse_colour(self.color if paint == "currentcolor" else paint)


@dataclass(frozen=True)
class _Rule:
    tag: str
    name: str
    id: str
    declarations: dict[str, str]

    @property
    def weight(self) -> tuple[bool, bool, bool]:
        return bool(self.id), bool(self.name), bool(self.tag)

    def matches(self, node: Node) -> bool:
        return (
            self.tag in ("", node.tag)
            and (not self.name or self.name in node.get("class").split())
            and (not self.id or self.id == node.get("id"))
        )


class Sheet:
    """The rules of all `<style>` elements; selectors that are not simple are left out."""

    def __init__(self, root: Node) -> None:
        rules: list[_Rule] = []
        for node in root.walk():
            if node.tag == "style":
                rules.extend(_rules(node.text))
        # Sorting is stable: of equal weights the later rule stays the later.
        self._rules = sorted(rules, key=lambda rule: rule.weight)

    def style(self, node: Node, above: Style) -> Style:
        """The element's style under its parent's."""
        values = {name: node.get(name) for name in _PROPERTIES if node.get(name)}
        for rule in self._rules:
            if rule.matches(node):
                values.update(rule.declarations)
        values.update(_declarations(node.get("style")))
        if not values:
            return above if above.display == "inline" else _under(above, {})
        return _under(above, values)


def _under(above: Style, values: dict[str, str]) -> Style:
    """The style of these values; what they do not say, or say "inherit", comes from above."""
    lower = {name: value.lower() for name, value in values.items()}
    own = {name: value for name, value in lower.items() if value != "inherit"}
    inherited = {name: getattr(above, name) for name in _INHERITED}
    return Style(**{**inherited, **own})


def _rules(text: str) -> list[_Rule]:
    rules: list[_Rule] = []
    for selectors, body in _RULE.findall(_COMMENT.sub(" ", text)):
        declarations = _declarations(body)
        for selector in selectors.split(","):
            match = _SELECTOR.fullmatch(selector.strip())
            if match is not None and declarations:
                tag, name, id_ = (group or "" for group in match.groups())
                rules.append(_Rule("" if tag == "*" else tag, name, id_, declarations))
    return rules


def _declarations(text: str) -> dict[str, str]:
    """The properties that matter of "name: value; ..."."""
    found: dict[str, str] = {}
    for item in text.split(";"):
        name, colon, value = item.partition(":")
        name = name.strip().lower()
        if colon and name in _PROPERTIES:
            found[name] = value.replace("!important", "").strip()
    return {name: value for name, value in found.items() if value}


def parse_colour(text: str) -> str:
    """A CSS colour as "#rrggbb"; "" for what is none of a known form (gradients, hsl).

    >>> parse_colour("red"), parse_colour("#0af"), parse_colour("rgb(100%, 0%, 16)")
    ('#ff0000', '#00aaff', '#ff0010')
    """
    text = text.strip().lower()
    if text in NAMES:
        return NAMES[text]
    if match := _HEX.fullmatch(text):
        digits = match[1]
        if len(digits) <= _SHORT_HEX:
            digits = "".join(digit * 2 for digit in digits)
        return "#" + digits[:6]
    if match := _RGB.fullmatch(text):
        parts = [_channel(part) for part in match.groups()]
        return "#" + "".join(f"{part:02x}" for part in parts)
    return ""


def _channel(text: str) -> int:
    try:
        value = float(text.rstrip("%"))
    except ValueError:  # "1.2.3"
        return 0
    if text.endswith("%"):
        value = value * 255.0 / 100.0
    return int(min(max(value, 0.0), 255.0) + 0.5)
