"""Which rows grbl and linuxcnc are sent, and the modal text of each, by whole columns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from camtool.toolpath.moves import Kind, Toolpath

from ._gcode_arcs import Arcs
from ._gcode_format import Ints, NumberStyle, say_units
from ._gcode_options import GcodeDialect

Bools = npt.NDArray[np.bool_]

WORD: Final = np.array([" G0", " G1", " G2", " G3"], dtype=object)


@dataclass(frozen=True, eq=False)
class Sent:
    """The rows to send, events among them: kind (M,), end (M, 3) and offset (M, 2) in units,
    feed (M,) in units of the F word, row (M,) of the toolpath; `says` (M, 3): which coordinates
    are said; `forget` (M,): homing came since the last motion. `dropped` moves were too small."""

    kind: Ints
    end: Ints
    offset: Ints
    feed: Ints
    row: Ints
    says: Bools
    forget: Bools
    dropped: int

    @property
    def is_motion(self) -> Bools:
        """(M,) true for motions."""
        return np.asarray(self.kind <= Kind.ARC_CCW)


def sent_rows(toolpath: Toolpath, arcs: Arcs, feeds: Ints) -> Sent:
    """All rows with pieces in place of arcs, without moves that move nothing."""
    many = np.ones(len(toolpath), dtype=np.int64)
    for row, pieces in arcs.pieces.items():
        many[row] = len(pieces)
    of = np.repeat(np.arange(len(toolpath)), many)
    kind, end, offset = arcs.kind[of], arcs.end[of], arcs.offset[of]
    first = np.cumsum(many) - many
    for row, pieces in arcs.pieces.items():
        sunk = int(arcs.end[row - 1, 2]) if row else 0
        rise = int(arcs.end[row, 2]) - sunk
        for at, piece in enumerate(pieces, int(first[row])):
            height = sunk + round(rise * piece.share)
            kind[at], end[at], offset[at] = piece.kind, (*piece.end, height), piece.offset
    before = np.concatenate([np.zeros((1, 3), dtype=np.int64), end])[: len(end)]
    motion = kind <= Kind.ARC_CCW
    is_arc = motion & (kind >= Kind.ARC_CW)
    says = (end != before) & motion[:, None]
    home_xy, home_z = kind == Kind.HOME_XY, kind == Kind.HOME_Z
    flat = says[:, :2].any(axis=1) | is_arc
    # A rapid to where X and Y should be already is not left out before they were ever said.
    still = (kind == Kind.RAPID) & ~says.any(axis=1)
    still &= _unsaid(flat, home_xy) & ~_unsaid(says[:, 2], home_z)
    still &= _unsaid(flat | still, home_xy)
    both = is_arc | still | (flat & _unsaid(flat | still, home_xy))
    says[both, :2] = True
    wanted = (toolpath.end != toolpath.starts).any(axis=1)[of]
    kept = ~motion | says.any(axis=1)
    homes = np.cumsum(home_xy | home_z)[kept]
    return Sent(
        kind[kept],
        end[kept],
        offset[kept],
        feeds[of][kept],
        of[kept],
        says[kept],
        np.diff(_at_motions(homes, motion[kept]), prepend=0) > 0,
        int((~kept & wanted).sum()) + arcs.counts.dropped,
    )


def _unsaid(said: Bools, home: Bools) -> Bools:
    """(M,) true where nothing was said before the row since the start, or since homing."""
    rows = np.arange(len(said))
    last_said = np.maximum.accumulate(np.where(said, rows, -1))
    last_home = np.maximum.accumulate(np.where(home, rows, -1))
    before = np.concatenate([[-1], last_said])[: len(said)]
    return np.asarray(before <= last_home)


def _at_motions(homes: Ints, motion: Bools) -> Ints:
    """(M,) `homes` of the motion last passed: it grows only where a motion follows homing."""
    return np.maximum.accumulate(np.where(motion, homes, 0)) if len(homes) else homes


def block_texts(sent: Sent, dialect: GcodeDialect, feed_decimals: int) -> list[str]:
    """The blocks of the motions among the rows."""
    take = sent.is_motion
    kind, end, says = sent.kind[take], sent.end[take], sent.says[take]
    number = NumberStyle(dialect.decimals, strip=dialect.strip_zeros)
    is_arc = kind >= Kind.ARC_CW
    is_feed = kind >= Kind.LINE
    feed = sent.feed[take]
    columns = [
        _words(kind, (np.diff(kind, prepend=-1) != 0) | sent.forget[take]),
        *(_said(f" {axis}", end[:, at], says[:, at], number) for at, axis in enumerate("XYZ")),
        *(
            _said(f" {axis}", sent.offset[take][:, at], is_arc, number)
            for at, axis in enumerate("IJ")
        ),
        _said(" F", feed, _changes(feed, is_feed), NumberStyle(feed_decimals, strip=True)),
    ]
    return ["".join(words)[1:] for words in zip(*columns, strict=True)]


def _words(kind: Ints, said: Bools) -> list[str]:
    words: list[str] = np.where(said, WORD[kind], "").tolist()
    return words


def _changes(values: Ints, counts: Bools) -> Bools:
    """(M,) true where a row that counts has another value than the last one that counted."""
    rows = np.flatnonzero(counts)
    changed = np.zeros(len(values), dtype=bool)
    changed[rows] = np.diff(values[rows], prepend=-1) != 0
    return changed


def _said(letter: str, units: Ints, said: Bools, style: NumberStyle) -> list[str]:
    """(M,) the word of a letter where it is said, "" elsewhere."""
    rows = np.flatnonzero(said)
    words = [""] * len(units)
    for row, text in zip(rows.tolist(), say_units(units[rows], style), strict=True):
        words[row] = letter + text
    return words
