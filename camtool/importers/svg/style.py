"""Styles of SVG elements, as far as they decide whether and as what an element is drawn.

Each over the one before: what is inherited, attributes, rules of `<style>` sheets by their weight,
the style attribute; what is `!important` over all. Source: Cascading Style Sheets 2.1, chapter 6.
"""

from __future__ import annotations

import re
from functools import cached_property
from typing import Any

from msgspec import Struct
from msgspec.structs import asdict

from camtool.importers.svg.colours import parse_colour
from camtool.importers.svg.css import CssRules, parse_declarations
from camtool.importers.svg.transform import NUMBER
from camtool.importers.svg.tree import Node
from camtool.records import replace
from camtool.units import MM_PER_UNIT

FONT_PX = 16.0
"""Default font size, the base of em and ex."""

LIMITS = {
    "clip-path": "is not applied: it is drawn whole",
    "mask": "is not applied: it is drawn whole",
    "filter": "is not applied: it is an effect on pixels",
    "marker-start": "is not drawn",
    "marker-mid": "is not drawn",
    "marker-end": "is not drawn",
    "marker": "is not drawn",
    "shape-inside": "is not applied: lines break where tspans begin them",
    "inline-size": "is not applied: lines break where tspans begin them",
}
"""Properties that would hide or add something, with the words for their findings."""

PLAIN_TEXT: dict[str, tuple[str, ...]] = {
    "letter-spacing": ("normal", "0"),
    "word-spacing": ("normal", "0"),
    "writing-mode": ("horizontal-tb", "lr", "lr-tb"),
    "direction": ("ltr",),
    "baseline-shift": ("baseline", "0"),
    "dominant-baseline": ("auto", "alphabetic", "use-script", "no-change", "reset-size"),
    "alignment-baseline": ("auto", "baseline", "alphabetic"),
    "font-variant": ("normal", "none"),
    "font-stretch": ("normal", "100%"),
    "font-size-adjust": ("none",),
    "text-transform": ("none",),
}
"""Properties of text that are not applied, with the values that change nothing."""

_NOT_INHERITED = ("display", "transform", "transform-origin", "transform-box", "overflow",
                  "limits")  # fmt: skip
_SHEET_ONLY = ("transform", "transform-origin", "transform-box")
_FONT_SIZE = re.compile(rf"({NUMBER.pattern})(px|pt|pc|mm|cm|in|q|em|rem|ex|%)?", re.ASCII)
_FONT_WORDS = {
    "xx-small": 9.0, "x-small": 10.0, "small": 13.0, "medium": FONT_PX, "large": 18.0,
    "x-large": 24.0, "xx-large": 32.0,
}  # fmt: skip
_FONT_STEPS = {"smaller": 1.0 / 1.2, "larger": 1.2}
_FONT_PARTS = 5  # a size and four words before it
_ZERO = re.compile(r"[+-]?0+(\.0*)?[a-z%]*", re.ASCII)
_FURTHEST_FONT_PX = 1e6
_UNSEEN = ("none", "transparent")


class SvgStyle(Struct, frozen=True, dict=True):
    """The properties of one element, after inheritance; `transform` and its like only where a
    style says them, for attributes of that name are read by the walk. `limits`: the properties of
    LIMITS that the element itself has. `odd`: those of PLAIN_TEXT, and "font-size", that ask for
    what is not done. `decoration`: lines along text, of the element and of those around it."""

    stroke: str = "none"
    fill: str = "black"
    color: str = "black"
    visibility: str = "visible"
    dash: str = "none"
    font_px: float = FONT_PX
    family: str = ""
    slope: str = "normal"
    weight: str = "normal"
    anchor: str = "start"
    blanks: str = ""
    decoration: frozenset[str] = frozenset()
    odd: frozenset[str] = frozenset()
    display: str = "inline"
    transform: str = ""
    transform_origin: str = ""
    transform_box: str = ""
    overflow: str = ""
    limits: tuple[str, ...] = ()

    @property
    def is_painted(self) -> bool:
        """True if there is a visible stroke or fill."""
        return self.stroke not in _UNSEEN or self.fill not in _UNSEEN

    @cached_property
    def colour(self) -> str:
        """ "#rrggbb" of the stroke, else of the fill; "" when it is none of its own."""
        paint = self.stroke if self.stroke not in _UNSEEN else self.fill
        return parse_colour(self.color if paint == "currentcolor" else paint)

    @property
    def line_type(self) -> str:
        """ "DASHED" for a dashed stroke, else ""."""
        dashed = self.dash != "none" and any(sign in "123456789" for sign in self.dash)
        return "DASHED" if dashed and self.stroke not in _UNSEEN else ""


_FIELDS = {
    "font-size": "font_px",
    "font-family": "family",
    "font-style": "slope",
    "font-weight": "weight",
    "text-anchor": "anchor",
    "white-space": "blanks",
    "stroke-dasharray": "dash",
    "transform-origin": "transform_origin",
    "transform-box": "transform_box",
}
_NAMES = ("stroke", "fill", "color", "visibility", "stroke-dasharray", "font-size",
          "font-family", "font-style", "font-weight", "text-anchor", "white-space",
          "text-decoration", "text-decoration-line", *PLAIN_TEXT,
          "display", "transform", "transform-origin", "transform-box", "overflow",
          *LIMITS)  # fmt: skip
_PROPERTIES = frozenset((*_NAMES, "font"))
_ATTRIBUTES = tuple(name for name in _NAMES if name not in _SHEET_ONLY)
_INITIAL = asdict(SvgStyle())
_BLANK = {_FIELDS.get(name, name): _INITIAL[_FIELDS.get(name, name)] for name in _NOT_INHERITED}


class StyleSheet:
    """The styles of a document's elements; `left_out` counts rules that are not applied."""

    def __init__(self, root: Node) -> None:
        self._rules = CssRules()
        self._known: dict[tuple[SvgStyle, tuple[tuple[str, str], ...]], SvgStyle] = {}
        for node in root.walk():
            if node.tag == "style" and node.get("type", "text/css") in ("text/css", ""):
                self._rules.read(node.text, _PROPERTIES)

    @property
    def left_out(self) -> int:
        """Rules and blocks whose selectors are not understood."""
        return self._rules.left_out

    def style(self, node: Node, above: SvgStyle) -> SvgStyle:
        """Return the style of an element, given that of its parent.

        DrawingError when the sheets would take too long to apply."""
        attributes = node.attributes
        values = {name: attributes[name] for name in _ATTRIBUTES if name in attributes}
        strong: dict[str, str] = {}
        sheets = self._rules.holding(node)
        attribute = attributes.get("style")
        if attribute:
            sheets.append(parse_declarations(attribute, _PROPERTIES))
        for declarations in sheets:
            for name, (value, important) in declarations.items():
                target = strong if important else values
                if name == "font":
                    target.update(_longhands(value))
                else:
                    target[name] = value
        values.update(strong)
        key = above, tuple(values.items())
        style = self._known.get(key)
        if style is None:
            style = self._known[key] = _under(above, values)
        return style


def _under(above: SvgStyle, values: dict[str, str]) -> SvgStyle:
    """Return the style that these property values give to an element; missing ones and "inherit"
    come from `above`, its parent's style."""
    fields: dict[str, Any] = dict(_BLANK)
    for name, written in values.items():
        value = written.strip().lower()
        if name in LIMITS:
            if value not in ("none", "inherit", "initial", "unset", ""):
                fields["limits"] = (*fields["limits"], name)
            continue
        if name in PLAIN_TEXT or name.startswith("text-decoration"):
            _text_property(name, value, above, fields)
            continue
        target = _FIELDS.get(name, name)
        if value == "inherit" or (value == "unset" and name not in _NOT_INHERITED):
            fields[target] = getattr(above, target)
        elif value in ("initial", "unset"):
            fields[target] = _INITIAL[target]
        elif name == "font-size":
            px = _font_px(value, above.font_px)
            fields[target] = above.font_px if px is None else px
            fields["odd"] = fields.get("odd", above.odd) - {name} | (
                {name} if px is None else set()
            )
        elif name == "font-family":
            fields[target] = written.strip()
        elif value:
            fields[target] = value
    return replace(above, **fields)


def _text_property(name: str, value: str, above: SvgStyle, fields: dict[str, Any]) -> None:
    """Store in `fields`, in place, a property of PLAIN_TEXT (as odd unless plain), or
    text-decoration, which adds to that of the elements around."""
    if value in ("inherit", "unset", ""):
        return
    if name in PLAIN_TEXT:
        is_default = value == "initial" or value in PLAIN_TEXT[name]
        is_default = is_default or ("0" in PLAIN_TEXT[name] and _ZERO.fullmatch(value) is not None)
        fields["odd"] = fields.get("odd", above.odd) - {name} | (set() if is_default else {name})
    else:
        fields["decoration"] = above.decoration | {*value.split()}


def _longhands(text: str) -> dict[str, str]:
    """Split `font: [style, variant, weight or stretch] size[/line-height] family` into its single
    properties.

    The size is "?" for a system font and for text that is no font."""
    longhands = {"font-style": "normal", "font-weight": "normal", "font-variant": "normal",
            "font-stretch": "normal", "font-size": "?", "font-family": ""}  # fmt: skip
    if text.lower() in ("inherit", "initial", "unset"):
        return dict.fromkeys(longhands, text)
    words = text.split()
    for place, word in enumerate(words[:_FONT_PARTS]):
        size = word.lower().partition("/")[0]
        if not size.isdigit() and _font_px(size, FONT_PX) is not None:
            longhands["font-size"], longhands["font-family"] = size, " ".join(words[place + 1 :])
            break
        if size in ("italic", "oblique"):
            longhands["font-style"] = size
        elif size in ("bold", "bolder", "lighter") or size.isdigit():
            longhands["font-weight"] = size
        elif size == "small-caps":
            longhands["font-variant"] = size
        elif size != "normal":
            longhands["font-stretch"] = size
    return longhands


def _font_px(text: str, above: float) -> float | None:
    """Return a font size in px, None for text that is no size; `above` is the size of the parent,
    px."""
    if text in _FONT_WORDS:
        return _FONT_WORDS[text]
    if text in _FONT_STEPS:
        return above * _FONT_STEPS[text]
    match = _FONT_SIZE.fullmatch(text)
    if match is None:
        return None
    value, unit = float(match[1]), match[2] or "px"
    relative = {"em": above, "ex": above / 2.0, "%": above / 100.0, "rem": FONT_PX}
    size = value * relative.get(unit, MM_PER_UNIT.get(unit, 0.0) / MM_PER_UNIT["px"])
    return size if 0.0 <= size <= _FURTHEST_FONT_PX else None
