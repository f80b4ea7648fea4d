"""Canned cycles (G73, G74, G76, G81 to G89) and thread cutting: the moves that LinuxCNC makes of
them (interp_cycles.cc, interp_convert.cc).

A cycle goes over its hole at the height at which the series of cycles began, or at R; down to R as
a rapid; drills; and comes back to R, or with G98 to the height. All of that stands in the plane of
G17, G18 or G19, whose normal is the axis of the hole. Corners are met exactly."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from msgspec import Struct

from camtool import bounds
from camtool.toolpath.moves import Kind, PathMode

from ..gcode.faults import LineFault
from ..gcode.part_moves import PLANES, too_many
from .lines import AXES, LinuxcncBlock
from .state import InterpreterState, Series

BACK_MM: Final = 0.254
"""Between two pecks of G73 and G83 the drill comes back to this above where it was: 0.010 inch."""

EXACT_PATH: Final = PathMode("exact-path")

WANTS_DWELL: Final = (820, 860, 880, 890)
WANTS_PECK: Final = (730, 830)
TAPS: Final = (740, 840)
WANTS_SPINDLE: Final = (860, 870, 880)

MAX_PASSES: Final = 100_000
"""Passes of a thread."""


class _Hole(Struct):
    """Heights and place of a hole, in (first, second, normal) of the plane."""

    at: list[float]
    r: float
    clear: float
    bottom: float


def drill(machine: InterpreterState, block: LinuxcncBlock, motion: int) -> None:
    """Execute a canned cycle: all holes of a block."""
    words = block.words
    if machine.feed_mm == 0.0:
        raise LineFault("a cycle, and no feed yet", mend="write F first")
    if machine.feed_mode == 930:
        raise LineFault("a cycle with feeds of inverse time (G93)")
    if machine.compensation.side:
        raise LineFault("a cycle while the cutter's radius is compensated")
    is_repeat = machine.motion == motion
    if machine.series is None:
        machine.series = Series()
    series = machine.series
    inherited = series.words if is_repeat else {}
    axes = PLANES[machine.plane]
    names = [AXES[axis] for axis in axes]
    r = _word(words, inherited, "r", "the height R")
    depth = _word(words, inherited, names[2], f"the depth {names[2].upper()}", key="depth")
    times = int(words.get("l", 1.0))
    if times == 0:
        raise LineFault("a cycle repeated 0 times", "l")
    start = [machine.position[axis] for axis in axes]
    height = series.height if series.height is not None else start[2]
    series.height = height
    place, step = list(start), [0.0, 0.0]
    radius = angle = 0.0
    if machine.absolute:
        place = _place(machine, words, names, start)
        top, bottom = r, depth
    else:
        step = [words.get(name, 0.0) for name in names[:2]]
        radius, angle = words.get("@", 0.0), math.radians(words.get("^", 0.0))
        top = r + height
        bottom = top + depth
    if top < bottom:
        raise LineFault(
            f"R {r:g} lies below {names[2].upper()} {depth:g}", "r", "write a higher R"
        )
    hole = _Hole(place, top, top if machine.to_r else max(height, top), bottom)
    run, kept_now = _motion_of(machine, block, motion, is_repeat, hole)
    _bound(machine, times, hole, motion, kept_now)
    kept_now |= {"r": r, "depth": depth}
    mode, canon = machine.canon.path.mode, machine.canon
    level = start[2]
    if height < top:
        machine.go(Kind.RAPID, axes, [start[0], start[1], top])
        level = top
    canon.path.mode = EXACT_PATH
    for time in range(times):
        hole.at[0] += step[0]
        hole.at[1] += step[1]
        if radius or angle:
            _polar_step(hole.at, radius, angle)
        next_height = level if time == 0 and level > top else hole.clear
        machine.go(Kind.RAPID, axes, [*hole.at[:2], next_height])
        if next_height > top:
            machine.go(Kind.RAPID, axes, [*hole.at[:2], top])
        run(hole)
    canon.path.mode = mode
    end = [*hole.at[:2], hole.clear]
    for axis, value in zip(axes, end, strict=True):
        machine.position[axis] = value
    series.words = {**series.words, **kept_now}
    machine.motion = motion


def _series_words(machine: InterpreterState) -> dict[str, float]:
    return machine.series.words if machine.series is not None else {}


def _word(
    words: dict[str, float], inherited: dict[str, float], letter: str, name: str, key: str = ""
) -> float:
    """Return the number of a word, or that of the last block of the series that had it."""
    value = words.get(letter, inherited.get(key or letter))
    if value is None:
        raise LineFault(f"a cycle without {name}", "g", f"write {letter.upper()}")
    return value


def _place(
    machine: InterpreterState, words: dict[str, float], names: list[str], start: list[float]
) -> list[float]:
    """Return the place of the first hole of an absolute cycle."""
    if "@" in words or "^" in words:
        x, y = machine.position[:2]
        radius = words.get("@", math.hypot(y, x))
        angle = math.radians(words["^"]) if "^" in words else math.atan2(y, x)
        return [radius * math.cos(angle), radius * math.sin(angle), start[2]]
    return [words.get(name, value) for name, value in zip(names, start, strict=True)]


def _polar_step(place: list[float], radius: float, angle: float) -> None:
    """Change `place` by a step in polar coordinates."""
    if place[0] == 0.0 and place[1] == 0.0:
        raise LineFault("a polar step from zero, which has no direction", "@")
    length = math.hypot(place[1], place[0]) + radius
    angle += math.atan2(place[1], place[0])
    place[:2] = length * math.cos(angle), length * math.sin(angle)


def _bound(
    machine: InterpreterState, times: int, hole: _Hole, motion: int, inherited: dict[str, float]
) -> None:
    """Raise LineFault where the holes would be more moves than a program may have, or more strokes
    than `most_lines`."""
    pecks = 1.0
    if motion in WANTS_PECK:
        pecks = max((hole.r - hole.bottom) / inherited["q"], 1.0)
    if len(machine.canon.path) + times * (3.0 * pecks + 3.0) > bounds.MAX_MOVES:
        by_pecks = pecks > times
        subject = "its pecks" if by_pecks else "the repeats of this cycle"
        mend = "write a larger Q" if by_pecks else bounds.SPLIT_PROGRAM
        raise LineFault(too_many(subject), "q" if by_pecks else "l", mend)
    strokes = int(times * pecks)  # each takes as long to simulate as a line
    if strokes > machine.most_lines:
        raise LineFault(
            f"a cycle of more than {machine.most_lines} strokes",
            "g",
            "if that is meant, raise --set dialect.most_lines=…",
        )
    machine.effort += strokes


def _motion_of(
    machine: InterpreterState, block: LinuxcncBlock, motion: int, is_repeat: bool, hole: _Hole
) -> tuple[Callable[[_Hole], None], dict[str, float]]:
    """Return the function that makes a hole, from R until the tool is out again, and the words
    that the next hole inherits."""
    words, series = block.words, _series_words(machine)
    axes = PLANES[machine.plane]
    inherited: dict[str, float] = {}

    def feed(hole: _Hole, level: float) -> None:
        machine.go(Kind.LINE, axes, [*hole.at[:2], level])

    def rapid(hole: _Hole, level: float) -> None:
        machine.go(Kind.RAPID, axes, [*hole.at[:2], level])

    dwell = 0.0
    if motion in WANTS_DWELL:
        dwell = inherited["p"] = _word(words, series if is_repeat else {}, "p", "the dwell P")
    elif motion in TAPS:
        dwell = inherited["p"] = words.get("p", series.get("p", 0.0))
    if dwell < 0.0:
        raise LineFault("a dwell below 0 s", "p")
    if motion in WANTS_PECK:
        peck = inherited["q"] = _word(
            words, series if is_repeat else {}, "q", "the depth of a peck, Q"
        )
        if peck <= 0.0:
            raise LineFault("a peck that is not above 0", "q")
    spindle = machine.spindle
    if motion in (*WANTS_SPINDLE, *TAPS) and spindle is None:
        raise LineFault(f"G{motion // 10} while the spindle stands", "g", "start it with M3 or M4")
    if motion in TAPS:
        direction = Kind.SPINDLE_CCW if motion == 740 else Kind.SPINDLE_CW
        if spindle != direction:
            raise LineFault(f"the spindle turns the wrong way for G{motion // 10}", "g")
        machine.notes.tapping.append(machine.block_index)

    def simple(hole: _Hole) -> None:
        feed(hole, hole.bottom)
        if motion in (820, 890):
            machine.dwell(dwell)
        if motion == 850:
            feed(hole, hole.r)
        (feed if motion == 890 else rapid)(hole, hole.clear)

    def pecked(hole: _Hole) -> None:
        retract, level = BACK_MM / machine.canon.mm, hole.r - inherited["q"]
        while level > hole.bottom:
            feed(hole, level)
            if motion == 830:
                rapid(hole, hole.r)
            rapid(hole, level + retract)
            level -= inherited["q"]
        feed(hole, hole.bottom)
        rapid(hole, hole.clear)

    def tap(hole: _Hole, level: float) -> None:
        # LinuxCNC 2.9 turns the coordinates of these two cycles once too often in G18 and G19.
        place = [*hole.at[:2], level]
        if machine.plane != 170:
            machine.notes.swapped.append(machine.block_index)
            first, second, depth = place
            place = [depth, first, second] if machine.plane == 190 else [second, depth, first]
        machine.go(Kind.LINE, axes, place)

    def tapped(hole: _Hole) -> None:
        tap(hole, hole.bottom)
        machine.turn(Kind.SPINDLE_CCW if motion == 840 else Kind.SPINDLE_CW)
        machine.dwell(dwell)
        tap(hole, hole.clear)
        machine.turn(Kind.SPINDLE_CW if motion == 840 else Kind.SPINDLE_CCW)

    def bored(hole: _Hole) -> None:
        feed(hole, hole.bottom)
        machine.dwell(dwell)
        machine.turn(Kind.SPINDLE_OFF)
        if motion == 880:
            machine.notes.pauses.append(machine.block_index)
        else:
            rapid(hole, hole.clear)
        machine.turn(spindle or Kind.SPINDLE_CW)

    if motion == 870:
        return _back_bore(machine, words, is_repeat, inherited), inherited
    if motion in WANTS_PECK:
        return pecked, inherited
    if motion in TAPS:
        return tapped, inherited
    return (bored if motion in (860, 880) else simple), inherited


def _back_bore(
    machine: InterpreterState,
    words: dict[str, float],
    is_repeat: bool,
    inherited: dict[str, float],
) -> Callable[[_Hole], None]:
    """Return the function that makes a hole of G87: go down through the hole beside its centre,
    move to the centre, and bore upwards with the spindle turning."""
    series = _series_words(machine) if is_repeat else {}
    for letter in "ijk":
        inherited[letter] = _word(words, series, letter, letter.upper())
    axes, spindle = PLANES[machine.plane], machine.spindle or Kind.SPINDLE_CW

    def bored(hole: _Hole) -> None:
        x, y = hole.at[:2]
        offset_place = [x + inherited["i"], y + inherited["j"]]
        top = inherited["k"] if machine.absolute else hole.bottom + inherited["k"]
        machine.go(Kind.RAPID, axes, [*offset_place, hole.r])
        machine.turn(Kind.SPINDLE_OFF)
        machine.go(Kind.RAPID, axes, [*offset_place, hole.bottom])
        machine.go(Kind.RAPID, axes, [x, y, hole.bottom])
        machine.turn(spindle)
        machine.go(Kind.LINE, axes, [x, y, top])
        machine.go(Kind.LINE, axes, [x, y, hole.bottom])
        machine.turn(Kind.SPINDLE_OFF)
        machine.go(Kind.RAPID, axes, [*offset_place, hole.bottom])
        machine.go(Kind.RAPID, axes, [*offset_place, hole.clear])
        machine.go(Kind.RAPID, axes, [x, y, hole.clear])
        machine.turn(spindle)

    return bored


# Threads


def follow_spindle(
    machine: InterpreterState, block: LinuxcncBlock, end: list[float], motion: int
) -> None:
    """Execute G33, or G33.1 there and back: a move whose feed is K for each turn of the
    spindle."""
    canon = machine.canon
    _need_spindle(machine, motion)
    feed, canon.feed = canon.feed, block.words["k"] * machine.speed * canon.mm
    _need_feed(machine, motion)
    canon.line(*end)
    if motion == 331:
        canon.line(*machine.position)
    else:
        machine.position[:] = end
    canon.feed = feed


def thread(machine: InterpreterState, block: LinuxcncBlock, end: list[float]) -> None:
    """Execute G76: passes along Z, each deeper in X, at the angle Q, with tapers of length E at
    the ends that L names."""
    words, canon, mm = block.words, machine.canon, machine.canon.mm
    _need_spindle(machine, 760)
    if machine.compensation.side:
        raise LineFault("G76 while the cutter's radius is compensated", "g")
    peak, first, full_depth = words["i"], words["j"], words["k"]
    if peak == 0.0 or first <= 0.0 or full_depth <= first:
        raise LineFault("G76 wants an I that is not 0, J above 0, and K above J", "g")
    if machine.diameters:
        peak, first, full_depth = peak / 2.0, first / 2.0, full_depth / 2.0
    start = list(machine.position)
    pitch = words["p"]
    direction = -1.0 if end[2] > start[2] else 1.0
    slope = math.tan(direction * math.radians(words.get("q", 0.0)))
    degression = max(words.get("r", 1.0), 1.0)
    taper = max(words.get("e", 0.0), 0.0)
    tapered = pitch * math.hypot(taper, full_depth) / taper if taper else pitch
    taper *= direction
    ends = int(words.get("l", 0.0))
    side = 1.0 if peak > 0.0 else -1.0
    offset, deepest = abs(peak), full_depth + abs(peak)
    target = end[2] + full_depth * slope
    feed = canon.feed

    def cut(x: float, z: float, lead: float) -> None:
        canon.feed = lead * machine.speed * mm
        _need_feed(machine, 760)
        canon.line(x, start[1], z)

    def one(depth: float) -> None:
        shift = (depth - offset) * slope
        outside, bottom = start[0] + side * (depth - deepest), start[0] + side * depth
        raised = start[0] + side * (depth - full_depth)
        canon.rapid(outside, start[1], start[2] - shift)
        if taper and ends & 1:
            cut(raised, start[2] - shift, tapered)
            cut(bottom, start[2] - shift - taper, tapered)
        else:
            canon.rapid(bottom, start[1], start[2] - shift)
        if taper and ends & 2:
            cut(bottom, target - shift + taper, pitch)
            cut(raised, target - shift, tapered)
        else:
            cut(bottom, target - shift, pitch)
        canon.rapid(outside, start[1], target - shift)

    depth, number = offset + first, 1
    while depth < deepest:
        one(depth)
        number += 1
        if number > MAX_PASSES:
            raise LineFault(f"a thread of more than {MAX_PASSES} passes", "j", "write a larger J")
        depth = offset + first * number ** (1.0 / degression)
    for _ in range(min(max(int(words.get("h", 0.0)), 0), MAX_PASSES) + 1):
        one(deepest)
    canon.rapid(*end)
    canon.feed = feed
    machine.position[:] = end


def _need_spindle(machine: InterpreterState, motion: int) -> None:
    machine.notes.tapping.append(machine.block_index)
    if machine.spindle is None:
        name = f"G{motion / 10:g}"
        raise LineFault(f"{name} while the spindle stands", "g", "start it with M3 or M4")


def _need_feed(machine: InterpreterState, motion: int) -> None:
    if machine.canon.feed <= 0.0:
        name = f"G{motion / 10:g}"
        raise LineFault(f"{name} at a speed of the spindle of 0, which never ends", "g", "write S")
