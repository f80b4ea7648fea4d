"""Needs of the words of a block: its motion, and a use for each of its words (enhance_block,
check_g_codes and check_other_codes of LinuxCNC)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from ..gcode.faults import LineFault
from .lines import AXES, RELATIVE, LinuxcncBlock
from .state import InterpreterState

TURNS_TOLERANCE: Final = 1e-3
"""A P of turns that differs from a whole number by no more counts as it (rs274 takes 2.001)."""

MAX_TURNS: Final = 10_000
"""Turns of an arc, each of which is a move."""

AXIS_MODES: Final = (100, 280, 300, 520, 920)
"""Codes of one block whose axis words are no motion."""

WITHOUT_AXES: Final = (0, 10, 20, 30, 52, 700, 710, 711, 712, 720, 721, 722)
"""Motions that a block may ask for without axis words."""

LATHE_CYCLES: Final = (710, 711, 712, 720, 721, 722)
_CYCLES: Final = frozenset(range(810, 900, 10))

# Which codes use a letter: motions, codes of one block, M words, and codes of other groups.
Codes = frozenset[int]
USES: Final[Mapping[str, tuple[Codes, Codes, Codes, Codes]]] = {
    letter: (frozenset(motions), frozenset(once), frozenset(m), frozenset(others))
    for letter, motions, once, m, others in (
        ("d", (700, *LATHE_CYCLES), (), (), (410, 420, 411, 421, 960)),
        ("$", (760, 330, 331), (), (3, 4, 5, 19, 51), ()),
        ("e", (760, 330, 331, 700), (), (66, 67, 68), ()),
        ("h", (760,), (), (), (430, 432)),
        ("i", (20, 30, 50, 51, *LATHE_CYCLES, 760, 870, 331), (100,), (), ()),
        ("j", (20, 30, 50, 51, 760, 870), (100,), (), ()),
        ("k", (20, 30, 330, 331, 760, 870), (), (), ()),
        ("l", (*_CYCLES, 760, 52, 730), (100,), (66,), (410, 411, 420, 421)),
        (
            *("p", (760, 820, 860, 880, 890, 50, 52, 700, 20, 30, 740, 840), (100, 40)),
            *((50, 51, 52, 53, 62, 63, 64, 65, 66, 19), (640,)),
        ),
        ("q", (830, 730, 50, 760, 700, *LATHE_CYCLES), (100,), (66, 67, 68, 61, 19), (640,)),
        ("r", (20, 30, 760, *LATHE_CYCLES, *_CYCLES, 730, 740), (100,), (19,), (411, 421)),
    )
}


def motion_of(state: InterpreterState, block: LinuxcncBlock) -> int | None:
    """Return the motion code that a block executes (enhance_block); None if it does not move."""
    words, g = block.words, block.g
    polar = "@" in words or "^" in words
    axes = any(letter in words for letter in (*AXES, *RELATIVE))
    if polar and ("x" in words or "y" in words):
        raise LineFault("both polar coordinates and X or Y", "@")
    if polar and state.plane != 170:
        raise LineFault("polar coordinates in a plane other than that of G17", "@")
    one_shot, own_motion = g.get("one block"), g.get("motion")
    covets = one_shot in AXIS_MODES
    if one_shot in (520, 920) and not axes and (own_motion is None or own_motion == 800):
        raise LineFault(f"G{one_shot // 10} without an axis", "g", "write the axes that it sets")
    if own_motion is not None:
        if own_motion == 800:
            if (axes or polar) and not covets:
                raise LineFault("coordinates beside G80", "g")
        elif covets:
            raise LineFault("two G words that both use the coordinates", "g")
        elif not axes and not polar and own_motion not in WITHOUT_AXES:
            raise LineFault(f"G{own_motion / 10:g} without coordinates", "g")
        return own_motion
    if covets:
        return None
    if axes or polar:
        length = g.get("tool length")
        if state.motion in (None, 800) and length not in (431, 432):
            raise LineFault("coordinates, but no motion word in force", mend="write G0 or G1")
        return None if length == 431 or state.motion == 800 else state.motion
    if state.motion in (20, 30) and ("i" in words or "j" in words or "k" in words):
        return state.motion
    return None


def check(state: InterpreterState, block: LinuxcncBlock, motion: int | None) -> None:
    """Refuse words that lack others which they need (check_g_codes, check_other_codes)."""
    words, g, m = block.words, block.g, block.m
    one_shot = g.get("one block")
    if one_shot is not None:
        _check_once(state, block, one_shot, motion)
    from_user = "user" in m
    if not from_user:
        for letter in words:
            if letter in USES and not (letter == "q" and words[letter] == -1.0):
                _check_use(letter, block, motion)
    if motion is not None and 700 <= motion < 900 and motion != 760:
        for letter in "abc":
            if letter in words and motion >= 730 and motion != 800:
                raise LineFault(f"a cycle with a {letter.upper()} word", letter)
    if "p" in words and (motion in (20, 30) or m.get("spindle") == 19):
        _check_turns(words["p"], motion)
    if g.get("spindle mode") == 960 and "s" not in words:
        raise LineFault("G96 without S", "g")
    if motion in (330, 331):
        if "k" not in words:
            raise LineFault(f"G{motion / 10:g} without K", "g")
        if "f" in words:
            raise LineFault(f"F beside G{motion / 10:g}", "f")
    if motion == 760:
        for letter in "pijk":
            if letter not in words or (letter == "p" and words["p"] == -1.0):
                raise LineFault(f"G76 without {letter.upper()}", "g")


def _check_once(
    state: InterpreterState, block: LinuxcncBlock, one_shot: int, motion: int | None
) -> None:
    words = block.words
    if one_shot == 40:
        if words.get("p", -1.0) == -1.0:
            raise LineFault("a dwell without P", "g", "write G4 P1.5 for 1.5 s")
        if block.g.get("motion") in (20, 30):
            raise LineFault("a dwell beside an arc: both use P", "g")
        if words["p"] < 0.0:
            raise LineFault("a dwell below 0 s", "p")
    elif one_shot == 53:
        if block.g.get("motion") not in (None, 52):
            raise LineFault("another motion between G5.2 and G5.3", "g")
    elif one_shot == 100:
        _check_g10(words)
    elif one_shot == 530:
        if motion not in (0, 10):
            raise LineFault("G53 without G0 or G1", "g")
        distance = block.g.get("distance", 900 if state.absolute else 910)
        if distance == 910:
            raise LineFault("G53 with G91", "g", "write G90")


def _check_g10(words: dict[str, float]) -> None:
    kind, value = words.get("l", -1.0), words.get("p", -1.0)
    if kind not in (0, 1, 2, 10, 11, 20):
        raise LineFault("G10 wants L0, L1, L2, L10, L11 or L20", "g")
    number = math.trunc(value + (0.5 if value >= 0 else -0.5))
    if value + 1e-4 - number > 2e-4:
        raise LineFault("the P of G10 is a whole number", "p")
    if kind in (2, 20) and not 0 <= number <= 9:
        raise LineFault("the P of G10 L2 and L20 is from 0 to 9", "p")
    if kind in (1, 10, 11) and number < 1:
        raise LineFault("the P of G10 is the number of a tool", "p")


def _check_use(letter: str, block: LinuxcncBlock, motion: int | None) -> None:
    """Raise LineFault where nothing in the block uses a letter."""
    motions, one_shots, m, other_codes = USES[letter]
    is_used = (
        motion in motions
        or block.g.get("one block") in one_shots
        or any(code in m for code in block.m.values())
        or any(code in other_codes for code in block.g.values())
        or (letter == "$" and "s" in block.words)
    )
    if not is_used:
        raise LineFault(f"nothing in the block uses the {letter.upper()} word", letter)


def _check_turns(value: float, motion: int | None) -> None:
    turns = round(value)
    if abs(value - turns) > TURNS_TOLERANCE or (motion in (20, 30) and turns < 1):
        raise LineFault("the turns of an arc are a whole number from 1", "p")
    if turns > MAX_TURNS:
        raise LineFault(f"an arc of more than {MAX_TURNS} turns", "p")
