"""Ways in which programs come to harm between the post and the machine, in each dialect's own
text or bytes, by a seeded generator.

A program is taken apart into blocks (lines, `;` blocks, records of bytes, columns of arrays), one
thing is done to them, and they are put together again. What concerns a whole contour (cut the
other way round) is done to the moves and written anew. A damage may be unreadable, or make no
difference: who asks for one tries again.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from random import Random
from typing import TypeVar

import numpy as np

from camtool.records import replace
from camtool.target.registry import LoadedTarget
from camtool.toolpath.moves import Kind, Toolpath

Block = TypeVar("Block")

KINDS = ("shifted", "deleted", "turned", "reversed", "circle", "doubled", "swapped", "feed")
"""What is done: a word shifted, a block deleted, G2 for G3 (or a sign), a closed contour the other
way round, a full circle the other way round, a block twice, two blocks swapped, another feed."""

WORD = re.compile(r"([XYZIJ])([+-]?)(\d+)(?:\.(\d*))?")
FEED = re.compile(r"F(\d+)(\.\d+)?")
MOTION = re.compile(r"[GXYZ]")


@dataclass(frozen=True)
class Whole:
    """A sound program of a target, as bytes and as the moves that it was written from."""

    target: LoadedTarget
    data: bytes
    wanted: Toolpath
    unit_mm: float


def damaged(whole: Whole, kind: str, random: Random) -> bytes | None:
    """The program with one damage of this kind; None when the dice fell on none."""
    if kind in ("reversed", "circle"):
        return _rewritten(whole, random, circles=kind == "circle")
    name = whole.target.machine.target.name
    if name == "i8751":
        return _records(whole, kind, random)
    if name == "matlab-router":
        return _columns(whole, kind, random)
    return _text(whole, kind, random)


def _rewritten(whole: Whole, random: Random, *, circles: bool) -> bytes | None:
    """A closed contour, or a full circle, the other way round."""
    path = whole.wanted
    cuts = path.is_feed & (path.starts[:, 2] < 0.0) & (path.end[:, 2] < 0.0)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], cuts.astype(int), [0]])))
    runs = [
        (begin, end)
        for begin, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
        if np.allclose(path.starts[begin], path.end[end - 1]) and circles == (end - begin == 1)
    ]
    if not runs:
        return None
    begin, end = random.choice(runs)
    order = np.arange(len(path))
    order[begin:end] = order[begin:end][::-1]
    places = path.end.copy()
    places[begin:end] = path.starts[begin:end][::-1]
    kinds = path.kind[order].copy()
    inner = kinds[begin:end]
    other = np.where(inner == Kind.ARC_CW, int(Kind.ARC_CCW), int(Kind.ARC_CW))
    kinds[begin:end] = np.where(inner == Kind.LINE, int(Kind.LINE), other)
    turned = replace(
        path, kind=kinds, end=places, centre=path.centre[order], feed=path.feed[order]
    )
    return bytes(whole.target.target.write(turned, whole.target.machine).data)


def _text(whole: Whole, kind: str, random: Random) -> bytes | None:
    """Lines, or blocks that end with a semicolon."""
    text = whole.data.decode()
    mark = ";" if whole.target.machine.target.name == "pic-mmh" else "\n"
    blocks = text.split(mark)
    moves = [at for at, block in enumerate(blocks) if MOTION.match(block.strip())]
    scale = {"pic-mmh": 1000.0, "valcnc": 0.125}.get(whole.target.machine.target.name, 1.0)
    if kind == "shifted":
        done = _shifted(blocks, moves, random, whole.unit_mm, scale)
    elif kind == "turned":
        done = _replaced(blocks, random, re.compile(r"G0?[23](?!\d)"), _other_arc)
    elif kind == "feed":
        done = _replaced(blocks, random, FEED, lambda match: _other_feed(match, random))
    else:
        done = _moved_about(blocks, moves, kind, random)
    return None if done is None else mark.join(done).encode()


def _shifted(
    blocks: list[str], moves: Sequence[int], random: Random, unit_mm: float, scale: float
) -> list[str] | None:
    """Shift one coordinate by a few units of the dialect, by more units, or by millimetres."""
    at = random.choice(moves)
    words = list(WORD.finditer(blocks[at]))
    if not words:
        return None
    word = random.choice(words)
    letter, sign, whole, part = word.groups()
    decimals = len(part) if part else (0 if part is None else 1)
    decimals = max(decimals, 3) if scale == 1.0 else decimals
    by_mm = _distance(random, unit_mm)
    value = float(f"{sign}{whole}.{part or 0}") + by_mm * scale
    said = f"{abs(value):0{len(whole) + 1 + decimals}.{decimals}f}"
    if part is None:
        said = f"{round(abs(value)):0{len(whole)}d}"
    before = "-" if value < 0.0 else sign.replace("-", "")
    new = f"{letter}{before}{said}"
    done = list(blocks)
    done[at] = blocks[at][: word.start()] + new + blocks[at][word.end() :]
    return done


def _distance(random: Random, unit_mm: float) -> float:
    """mm, in either direction: a few units, tens of them, or up to 3 mm."""
    size = random.choice(
        (
            random.randint(4, 9) * unit_mm,
            random.randint(10, 60) * unit_mm,
            random.uniform(100.0 * unit_mm, 3.0),
        )
    )
    return random.choice((-1.0, 1.0)) * size


def _other_arc(match: re.Match[str]) -> str:
    word = match[0]
    return word[:-1] + ("3" if word[-1] == "2" else "2")


def _other_feed(match: re.Match[str], random: Random) -> str:
    number = match[1] + (match[2] or "")
    other = float(number) * random.choice((0.25, 0.5, 1.5))
    if match[2] is None:
        return f"F{max(round(other), 1):0{len(match[1])}d}"
    return f"F{other:.{len(match[2]) - 1}f}"


def _replaced(
    blocks: list[str], random: Random, what: re.Pattern[str], by: Callable[[re.Match[str]], str]
) -> list[str] | None:
    """Replace one match of the pattern, in a block that is no comment."""
    places = [
        (at, match)
        for at, block in enumerate(blocks)
        if MOTION.match(block.strip())
        for match in what.finditer(block)
    ]
    if not places:
        return None
    at, match = random.choice(places)
    done = list(blocks)
    done[at] = blocks[at][: match.start()] + by(match) + blocks[at][match.end() :]
    return done


def _moved_about(
    blocks: list[Block], moves: Sequence[int], kind: str, random: Random
) -> list[Block] | None:
    """A block deleted, doubled, or swapped with one a little farther on."""
    done, at = list(blocks), random.choice(moves)
    if kind == "deleted":
        del done[at]
    elif kind == "doubled":
        done.insert(at, done[at])
    elif kind == "swapped":
        rank = moves.index(at)
        other = moves[min(rank + random.randint(1, 4), len(moves) - 1)]
        done[at], done[other] = done[other], done[at]
    else:
        return None
    return done


MOTOR, FORWARD, BACKWARD = 4, 0x03, 0x04


def _records(whole: Whole, kind: str, random: Random) -> bytes | None:
    """The 8751's bytes: record by record, a motor as `01 03 00 64`."""
    listing = whole.target.target.listing(whole.data, whole.target.machine)  # type: ignore[attr-defined]
    blocks = [bytes.fromhex(block) for block in listing.blocks]
    assert b"".join(blocks) == whole.data
    moves = [at for at, block in enumerate(blocks) if len(block) > 6]
    if kind in ("shifted", "turned"):
        at = random.choice(moves)
        block = bytearray(blocks[at])
        places = list(motors(block))
        if not places:
            return None
        place = random.choice(places)
        if kind == "turned":
            block[place + 1] = FORWARD + BACKWARD - block[place + 1]
        else:
            steps = 256 * block[place + 2] + block[place + 3]
            steps += round(_distance(random, whole.unit_mm) / whole.unit_mm)
            if not 0 < steps < 65536:
                return None
            block[place + 2], block[place + 3] = divmod(steps, 256)
        blocks[at] = bytes(block)
        return b"".join(blocks)
    done = _moved_about(blocks, moves, kind, random)
    return None if done is None else b"".join(done)


def motors(block: bytearray) -> list[int]:
    """Return the offsets of the motors that move in a record: X, Y, a wait, Z, a wait."""
    places, at = [], block.index(0x01)
    for motor in (1, 2, 0, 3, 0):
        if motor == 0:
            at += 2
            continue
        if block[at + 1] in (FORWARD, BACKWARD):
            places.append(at)
            at += MOTOR
        else:
            at += 2
    return places


TABLE = re.compile(r"(xy|lxy|velxy) = \[\n([^\]]*)\];\n")
JOB = re.compile(r"%% job[^\n]*\n(?:(?!%% job)[^\n]*\n)*")


def _columns(whole: Whole, kind: str, random: Random) -> bytes | None:
    """The router's arrays: a column of lengths and speeds is a line; its points stand between."""
    text = whole.data.decode()
    job = random.choice(list(JOB.finditer(text)))
    tables = {
        match[1]: [[int(word) for word in row.split()] for row in match[2].splitlines()]
        for match in TABLE.finditer(job[0])
    }
    lines = list(zip(*tables["lxy"], *tables["velxy"], strict=True))
    at = random.randrange(len(lines))
    lx, ly, vx, vy = lines[at]
    if kind == "shifted":
        by = 2 * round(_distance(random, whole.unit_mm) / whole.unit_mm)
        lines[at] = random.choice([(abs(lx + by), ly, vx, vy), (lx, abs(ly + by), vx, vy)])
    elif kind == "turned":
        lines[at] = random.choice([(lx, ly, -vx, vy), (lx, ly, vx, -vy)])
    elif kind == "feed":
        lines[at] = (lx, ly, vx // 2, vy // 2)
    else:
        done = _moved_about(lines, range(len(lines)), kind, random)
        if not done:
            return None
        lines = done
    first = tuple(row[0] for row in tables["xy"])
    points = [first]
    for lx, ly, vx, vy in lines:
        x, y = points[-1]
        points.append((x + lx * (vx > 0) - lx * (vx < 0), y + ly * (vy > 0) - ly * (vy < 0)))
    new = {"xy": zip(*points, strict=True), "lxy": list(zip(*lines, strict=True))[:2]}
    new["velxy"] = list(zip(*lines, strict=True))[2:]
    said = job[0]
    for name, rows in new.items():
        body = "".join(" ".join(str(number) for number in row) + "\n" for row in rows)
        said = re.sub(rf"\b{name} = \[\n[^\]]*\];\n", f"{name} = [\n{body}];\n", said, count=1)
    said = re.sub(r"size_of_array = \d+;", f"size_of_array = {len(lines)};", said)
    return (text[: job.start()] + said + text[job.end() :]).encode()
