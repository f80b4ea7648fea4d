"""One block of pic-mmh for one motion."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from camtool.errors import PostError
from camtool.machine.model import Machine
from camtool.toolpath.moves import Kind, Move, Toolpath

from ._pic_mmh_format import SAY
from ._pic_mmh_numbers import numbers_of
from ._pic_mmh_options import dialect_of

WORD: Final = {Kind.RAPID: "G00", Kind.LINE: "G01", Kind.ARC_CW: "G02", Kind.ARC_CCW: "G03"}


def format_block(move: Move, machine: Machine) -> str:
    """One motion as the block that says it, without planning where its arc would end.

    PostError when the move is no motion, or needs two blocks (XY and Z).
    """
    single = Toolpath(
        kind=np.array([move.kind]),
        end=np.array([move.end]),
        centre=np.array([move.centre or (math.nan, math.nan)]),
        feed=np.array([math.nan if move.feed is None else move.feed]),
        value=np.array([math.nan]),
        source=np.array([-1]),
        block=np.array([-1]),
        start=np.zeros(3),
    )
    flat, tall = move.end[:2] != move.start[:2], move.end[2] != move.start[2]
    if move.kind > Kind.ARC_CCW or (tall and (flat or move.centre)):
        raise PostError("this is not one block", where=f"move {move.index}")
    dialect = dialect_of(machine)
    numbers = numbers_of(single, machine, dialect)
    say = SAY[dialect.form]
    x, y, z = (say(units) for units in numbers.end_units[0])
    tail = numbers.feed_words[0]
    if tall:
        return f"{WORD[move.kind]}Z{z}{tail};"
    centre = "".join(
        f"{name}{say(units)}" for name, units in zip("IJ", numbers.centre_units[0], strict=True)
    )
    return f"{WORD[move.kind]}X{x}Y{y}{centre if move.centre else ''}{tail};"
