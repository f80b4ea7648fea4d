"""Comments that LinuxCNC obeys: `(debug,…)`, and others that show, log or stop.

`#5` and `#<name>` in them are shown as numbers: with six decimals, or as `%d`, `%f` (four
decimals) and `%.2f` ask from there on."""

from __future__ import annotations

import re
from typing import Final

from ..gcode.faults import LineFault
from .parameters import DEBUG, MAX_PARAMETERS, Parameters

NEAR_ZERO: Final = 1e-4
"""Numbers nearer to 0 are shown as 0."""

UNKNOWN_SHOWN: Final = "######"

_PARTS: Final = re.compile(r"%d|%f|%\.(\d)f|#(\d+)|#<([^>]*)>")


def obey_comment(text: str, parameters: Parameters) -> str | None:
    """Execute a comment that is a command. Return the text shown to the operator, or None;
    LineFault for a comment that stops the program."""
    word, _, argument = text.partition(",")
    word = word.lower()
    if word == "debug":
        return (
            expand_parameters(argument, parameters)
            if parameters.stored_value(DEBUG) > 0.0
            else None
        )
    if word == "abort":
        raise LineFault(f"the program stops itself: {expand_parameters(argument, parameters)}")
    if word in ("py", "pyrun"):
        raise LineFault("Python of the machine's own, which only it can run")
    return None


def expand_parameters(text: str, parameters: Parameters) -> str:
    """Return the text with numbers in place of parameters."""
    decimals = 6

    def shown(match: re.Match[str]) -> str:
        nonlocal decimals
        part = match[0]
        if part[0] == "%":
            decimals = {"%d": 0, "%f": 4}.get(part, int(match[1] or 0))
            return ""
        value = _value(match, parameters)
        if value is None:
            return UNKNOWN_SHOWN
        return f"{0.0 if abs(value) < NEAR_ZERO else value:.{decimals}f}"

    return _PARTS.sub(shown, text)


def _value(match: re.Match[str], parameters: Parameters) -> float | None:
    try:
        if match[2] is not None:
            index = int(match[2])
            return parameters.value_of_number(index, 0) if 0 < index < MAX_PARAMETERS else None
        return parameters.value_of_name("".join(match[3].split()).lower(), 0)
    except LineFault:
        return None
