"""Layer, colour and line type of DXF entities, with BYLAYER and BYBLOCK resolved.

An entity in a block that lies on layer 0, or is coloured or dashed BYBLOCK, takes after the
INSERT, as in CAD.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from camtool.importers.dxf.blocks import block_key
from camtool.importers.dxf.load import printable

FOREGROUND = "#000000"
"""White on black screens, black on paper: black here."""

CONTINUOUS = "Continuous"
"""The line type of layers that name none."""

_BYBLOCK, _BYLAYER, _WHITE = 0, 256, 7


@dataclass(frozen=True)
class Look:
    """What an entity is drawn with; `hidden` says why it is not shown ("" shown).

    `frozen`: an INSERT on its layer shows nothing at all; on one that is merely off it still
    shows what its block has on other layers.
    """

    layer: str = "0"
    colour: str = FOREGROUND
    line_type: str = CONTINUOUS
    hidden: str = ""
    frozen: bool = False


@dataclass
class Looks:
    """The looks of all entities of a document, by what these say of themselves."""

    layers: dict[str, Look]
    _known: dict[tuple[Any, ...], Look] = field(default_factory=dict)

    @classmethod
    def of(cls, document: Any) -> Looks:
        """With the layers of the document's table."""
        return cls({block_key(layer.dxf.name): _layer(layer) for layer in document.layers})

    def of_entity(self, said: dict[str, Any], block: Look | None) -> Look:
        """The look of an entity that says these attributes, in a block placed with `block`."""
        wanted = tuple(said.get(name) for name in ("layer", "color", "true_color", "linetype"))
        key = (*wanted, block)
        look = self._known.get(key)
        if look is None:
            look = self._known[key] = self._resolved(said, block or Look(), block is not None)
        return look

    def _resolved(self, said: dict[str, Any], block: Look, inside: bool) -> Look:
        name = printable(str(said.get("layer") or "0"))
        if inside and name == "0":
            name = block.layer
        on = self.layers.get(block_key(name), Look(name))
        line_type = printable(str(said.get("linetype") or "BYLAYER"))
        by = {"BYLAYER": on.line_type, "BYBLOCK": block.line_type}
        return Look(
            on.layer,
            _colour(said.get("color"), said.get("true_color"), on.colour, block.colour),
            by.get(line_type.upper(), line_type),
            on.hidden,
            on.frozen,
        )


def _layer(layer: Any) -> Look:
    """The look that a layer gives."""
    said = vars(layer.dxf)
    name, frozen = printable(str(layer.dxf.name)), bool(layer.is_frozen())
    state = "frozen" if frozen else "off" if layer.is_off() else ""
    return Look(
        name,
        _colour(said.get("color"), said.get("true_color"), FOREGROUND, FOREGROUND),
        printable(str(said.get("linetype", CONTINUOUS))),
        f"layer {name} is {state}" if state else "",
        frozen,
    )


def _colour(index: Any, true: Any, by_layer: str, by_block: str) -> str:
    """ "#rrggbb" of a colour index or a true colour."""
    from ezdxf.colors import aci2rgb

    if true is not None:
        return f"#{int(true) & 0xFFFFFF:06x}"
    number = _BYLAYER if index is None else abs(int(index))
    if number == _BYBLOCK:
        return by_block
    if number >= _BYLAYER:
        return by_layer
    return FOREGROUND if number == _WHITE else "#{:02x}{:02x}{:02x}".format(*aci2rgb(number))
