"""The meanings of words that move nothing, the same in all dialects of G-code here."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

MEANINGS: Final[Mapping[str, str]] = {
    "G17": "arcs in the XY plane",
    "G18": "arcs in the XZ plane",
    "G19": "arcs in the YZ plane",
    "G20": "numbers are inches",
    "G21": "numbers are millimetres",
    "G40": "no cutter compensation",
    "G41": "cutter compensation, the tool left of its path",
    "G42": "cutter compensation, the tool right of its path",
    "G43": "tool length offset on",
    "G49": "no tool length offset",
    "G53": "in machine coordinates, this block only",
    **{f"G{53 + number}": f"part zero {number}" for number in range(1, 7)},
    "G61": "corners met exactly",
    "G61.1": "a stop at each corner",
    "G64": "corners may be rounded",
    "G80": "no cycle",
    "G90": "positions are absolute",
    "G90.1": "centres of arcs are absolute",
    "G91": "positions are distances from the last one",
    "G91.1": "centres of arcs are distances from their start",
    "G93": "F is the inverse of a move's minutes",
    "G94": "F is units a minute",
    "G95": "F is units a turn of the spindle",
    "M0": "stop until the operator goes on",
    "M1": "stop here if the operator wants it",
    "M7": "mist on",
    "M8": "flood on",
    "M9": "coolant off",
    "M48": "overrides allowed",
    "M49": "overrides off",
}
