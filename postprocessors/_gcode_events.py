"""Events of a toolpath as the blocks that grbl and linuxcnc both know."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from camtool.errors import PostError
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.tools import mounted_before

from ._gcode_checks import place
from ._gcode_format import NumberStyle, say_number, values_of

VALUE: Final = NumberStyle(3, strip=True)
"""Spindle speeds and dwells are said to a thousandth."""

ROUNDING_PART: Final = 1e-9
"""A value said within this part of itself was not rounded."""

SPINDLE: Final = {Kind.SPINDLE_CW: "M3", Kind.SPINDLE_CCW: "M4"}

EventWords = Callable[["Event"], str]


@dataclass(frozen=True)
class Event:
    """A row that is no motion; `where` names it in errors. `mounted_before`: a tool change before
    the first move at a feed."""

    kind: Kind
    value: float
    where: str
    mounted_before: bool = False

    def refuse(self, message: str, mend: str = "") -> PostError:
        """The error that says why this event cannot be sent."""
        return PostError(message, where=self.where, mend=mend)


@dataclass(frozen=True)
class Events:
    """`blocks` of the rows that have one; rows whose value was `rounded`; `spindle_on` at the
    end of the program."""

    blocks: Mapping[int, str]
    rounded: tuple[int, ...]
    spindle_on: bool


def events_of(toolpath: Toolpath, words: EventWords) -> Events:
    """The blocks of all events but END and messages."""
    blocks: dict[int, str] = {}
    rounded: list[int] = []
    spindle_on = False
    mounted = mounted_before(toolpath)
    for row in (~toolpath.is_motion).nonzero()[0].tolist():
        event = Event(
            Kind(int(toolpath.kind[row])),
            float(toolpath.value[row]),
            place(toolpath, row),
            bool(mounted[row]),
        )
        if event.kind == Kind.END:
            if row != len(toolpath) - 1:
                raise event.refuse("moves follow the end of the program")
        elif event.kind == Kind.SET_ZERO:
            if toolpath.end[row].any():
                raise event.refuse(
                    "part zero can only be set at part zero", "set it first, before any move"
                )
        elif event.kind != Kind.MESSAGE:
            if block := words(event):
                blocks[row] = block
            spindle_on = (spindle_on or event.kind in SPINDLE) and event.kind != Kind.SPINDLE_OFF
            if _is_rounded(event):
                rounded.append(row)
    return Events(blocks, tuple(rounded), spindle_on)


def common_words(event: Event) -> str:
    """Dwell, spindle and homing; PostError for values that no block can say.

    Homing is a rapid in machine coordinates, `G53 G0`: G28 would go where the operator's memory
    of it points.
    """
    if event.kind == Kind.SPINDLE_OFF:
        return "M5"
    if event.kind == Kind.HOME_XY:
        return "G53 G0 X0 Y0"
    if event.kind == Kind.HOME_Z:
        return "G53 G0 Z0"
    if event.kind not in (*SPINDLE, Kind.DWELL):
        raise event.refuse(f"a {event.kind.name} has no block in this dialect")
    if event.kind in SPINDLE and math.isnan(event.value):
        return SPINDLE[event.kind]  # its speed is nobody's word
    if not (math.isfinite(event.value) and event.value >= 0.0):
        raise event.refuse(f"a {event.kind.name} without a value of 0 or more")
    said = say_number(event.value, VALUE)
    return f"G4 P{said}" if event.kind == Kind.DWELL else f"{SPINDLE[event.kind]} S{said}"


def tool_number(event: Event) -> int:
    """The tool of a change; PostError when it is no whole number from 0."""
    if not (event.value >= 0.0 and event.value == math.floor(event.value)):
        raise event.refuse(f"{event.value:g} is no tool number", "tools are 0, 1, 2 …")
    return int(event.value)


def _is_rounded(event: Event) -> bool:
    if math.isnan(event.value):
        return False
    said = float(values_of(round(event.value * 10.0**VALUE.decimals), VALUE.decimals))  # type: ignore[arg-type]
    return abs(said - event.value) > ROUNDING_PART * abs(event.value)
