"""The reader's grammar of a pic-mmh block: the patterns that match one, and the words that say
where a block goes wrong.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

SHOWN_CHARS: Final = 48
"""An error message shows no more of a block than this."""

Shape = tuple[tuple[str, str], ...]
"""The words behind a code: letter and kind of value ("c" is a coordinate)."""

_ARC: Final[Shape] = (("X", "c"), ("Y", "c"), ("I", "c"), ("J", "c"), ("F", "2"))

# Annex A.1, L3265-3471; Z blocks by the same rule (the decoder takes any axis letter, L1817-1849).
SHAPES: Final[dict[str, tuple[Shape, ...]]] = {
    "G00": ((("X", "c"), ("Y", "c")), (("Z", "c"),)),
    "G01": ((("X", "c"), ("Y", "c"), ("F", "2")), (("Z", "c"), ("F", "2"))),
    "G02": (_ARC,),
    "G03": (_ARC,),
    "G04": ((("P", "2"),),),
    "G28": ((("X", "0"), ("Y", "0")), (("Z", "0"),)),
    "G54": ((),),
    "G90": ((),),
    "M03": ((("S", "4"),),),
    "M04": ((("S", "4"),),),
    "M05": ((),),
    "M06": ((("T", "2"),),),
    "M30": ((),),
}

# The routine of the sign asks for "-" and takes anything else for the other sense (L1765-1768);
# "JX+;" shows it a "+" (L1730), so that the example form may have one too.
_COORDINATES: Final = {"example": r"([+-]?\d{5})\.(\d\d)", "annex": r"([+-]\d{5})()"}
_COORDINATE_WORDS: Final = {
    "example": "five digits, a point and two digits (in front of them a sign or none)",
    "annex": "a sign and five digits",
}
_VALUES: Final = {"2": r"(\d\d)", "4": r"(\d{4})", "0": "0"}
_VALUE_WORDS: Final = {"2": "two digits", "4": "four digits", "0": "the digit 0"}

# The interactive commands of the annex (L3474-3505): the operator's, not a program's.
_INTERACTIVE: Final = re.compile(
    r"A|H|Q|W|V|J[XYZ][+-]|&(?:[XYZ][+-]){2,3}|P[XYZ][+-]\d{4}|B[XYZ]\d{3}|F[XYZ][+-]\d{3}"
)

Patterns = dict[str, tuple[tuple[str, re.Pattern[str]], ...]]


@dataclass(frozen=True)
class Fault:
    """Where a block goes wrong (column from 1), how, and what mends it."""

    column: int
    message: str
    mend: str = ""


def patterns(form: str) -> Patterns:
    """For each code its shapes: their letters ("XYF") and the pattern of what is behind the code.

    A coordinate has two groups, digits before and after the point; other values have one.
    """
    return {
        code: tuple(
            (
                "".join(letter for letter, _ in shape),
                re.compile("".join(letter + _value(kind, form) for letter, kind in shape)),
            )
            for shape in shapes
        )
        for code, shapes in SHAPES.items()
    }


def fault_of(text: str, form: str) -> Fault:
    """Why a block (without its `;`) is none in this form."""
    if not text:
        return Fault(1, "an empty block", "remove the ; that has nothing before it")
    if _INTERACTIVE.fullmatch(text):
        return Fault(1, f"{text!r} is an interactive command, not part of a program", "remove it")
    if small := re.search("[a-z]", text[: SHOWN_CHARS * 2]):
        return Fault(
            small.start() + 1, "this controller takes no small letters", "write capital letters"
        )
    if text[0] not in "GM":
        return Fault(1, f"{_shown(text)} is no block: it begins with neither G nor M")
    if not re.match(r"\d\d", text[1:3]):
        return Fault(2, f"{_shown(text)}: wanted two digits after {text[0]}")
    shapes = SHAPES.get(text[:3])
    if shapes is None:
        known = " ".join(SHAPES)
        return Fault(1, f"this controller does not know {text[:3]}", f"it knows {known}")
    for other in _COORDINATES:
        if any(pattern.fullmatch(text, 3) for _, pattern in patterns(other)[text[:3]]):
            return Fault(5, f"the block is in the {other} form", f"use --set dialect.form={other}")
    return max((_walk(text, shape, form) for shape in shapes), key=lambda fault: fault.column)


def _value(kind: str, form: str) -> str:
    return _COORDINATES[form] if kind == "c" else _VALUES[kind]


def _walk(text: str, shape: Shape, form: str) -> Fault:
    """The first word of the shape that the block does not have."""
    at = 3
    for letter, kind in shape:
        match = re.compile(letter + _value(kind, form)).match(text, at)
        if match is None:
            at += text.startswith(letter, at)
            words = _COORDINATE_WORDS[form] if kind == "c" else _VALUE_WORDS[kind]
            return Fault(at + 1, f"{_shown(text)}: wanted {letter} with {words}")
        at = match.end()
    return Fault(at + 1, f"{_shown(text)}: wanted ; after the last word of {text[:3]}")


def _shown(text: str) -> str:
    return repr(text if len(text) <= SHOWN_CHARS else f"{text[:SHOWN_CHARS]}…")
