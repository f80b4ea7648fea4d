"""Blocks of grbl, linuxcnc and flashcut made one after the other, word by word."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """A row in whole units of the last decimal: kind (0 to 3 for moves), end, offset of the
    centre, feed; which coordinates a modal block has, and whether it repeats its motion word."""

    kind: int
    end: tuple[int, int, int]
    offset: tuple[int, int] = (0, 0)
    feed: int = 0
    written: tuple[bool, bool, bool] = (True, True, True)
    forget: bool = False


def number(units: int, decimals: int, kept: int) -> str:
    """Whole units as a decimal number, of whose decimals so many stay where they are 0."""
    digits = f"{abs(units):0{decimals + 1}d}"
    whole, part = digits[: len(digits) - decimals], digits[len(digits) - decimals :]
    while len(part) > kept and part[-1] == "0":
        part = part[:-1]
    return f"{'-' if units < 0 else ''}{whole}{'.' if part else ''}{part}"


def modal_block(row: Row, before: Row | None, feed: int, decimals: tuple[int, int, int]) -> str:
    """A block of grbl or linuxcnc; `before`: the motion before it; `feed`: that in force, or −1;
    decimals of coordinates, how many of these are kept, decimals of a feed."""
    places, kept, of_feed = decimals
    words = []
    if before is None or before.kind != row.kind or row.forget:
        words.append(f"G{row.kind}")
    for axis, units, has in zip("XYZ", row.end, row.written, strict=True):
        if has:
            words.append(axis + number(units, places, kept))
    if row.kind >= 2:
        for axis, units in zip("IJ", row.offset, strict=True):
            words.append(axis + number(units, places, kept))
    if row.kind >= 1 and row.feed != feed:
        words.append("F" + number(row.feed, of_feed, 0))
    return " ".join(words)


@dataclass(frozen=True)
class Flashcut:
    """The options of the dialect flashcut, and the decimals of a feed."""

    decimals: int
    kept: int
    feed_decimals: int
    ahead: bool
    """A feed that changes before an arc or a move of Z is set by a block of its own."""
    one_axis: bool
    z_sign: int = 1


def flashcut_blocks(
    rows: Sequence[Row], events: Mapping[int, str], dialect: Flashcut
) -> list[tuple[str, int]]:
    """The blocks with the index of their row, `events` among them."""
    at, feed = (0, 0, 0), 0
    found: list[tuple[str, int]] = []

    def said(letters: str, units: Sequence[int]) -> str:
        texts = (number(one, dialect.decimals, dialect.kept) for one in units)
        return " ".join(letter + text for letter, text in zip(letters, texts, strict=True))

    for index, row in enumerate(rows):
        if row.kind > 3:
            if index in events:
                found.append((events[index], index))
            continue
        if row.kind < 2 and row.end == at:
            continue
        flat = row.kind >= 2 or row.end[:2] != at[:2]
        target = said("XY", row.end[:2]) if flat else said("Z", [row.end[2] * dialect.z_sign])
        if row.kind >= 2:
            target += " " + said("IJ", row.offset)
        turns = row.end[0] != at[0] and row.end[1] != at[1]
        if row.kind == 0 and turns and dialect.one_axis and row.end[2] >= 0:
            found.append((f"G00 {said('XY', (row.end[0], at[1]))}", index))
        tail = ""
        if row.kind > 0 and row.feed != feed:
            shown = max(1, dialect.feed_decimals)
            units = row.feed * 10 ** (shown - dialect.feed_decimals)
            tail, feed = f" F{number(units, shown, shown)}", row.feed
            if dialect.ahead and not (row.kind == 1 and flat):
                found.append((f"G01 {said('XY', at[:2])}{tail}", index))
                tail = ""
        found.append((f"G0{row.kind} {target}{tail}", index))
        at = row.end
    return found
