"""What a sample program of a controller shows of its dialect, as keys of a machine file; what it
leaves open becomes a question with a default.

Nothing is guessed silently: each value says what in the program shows it."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Final

from msgspec import Struct, field

from camtool.errors import ProgramError
from camtool.target.contract import ControllerSetting, OpenKey, SampledDialect

from .lines import NUMBER

_WORD: Final = re.compile(rf"([A-Z])\s*({NUMBER})")
_COMMENT: Final = re.compile(r"\([^)]*\)?|;.*")
_BLOCK_NUMBER: Final = re.compile(r"\s*N(\d+)\s*")
_PROGRAM_NUMBER: Final = re.compile(r"\s*[O:](\d+)\s*")
_CYCLES: Final = {81: "drill", 82: "dwell", 83: "peck", 73: "chip", 85: "bore", 84: "tap"}
_LENGTHS: Final = "XYZIJKR"

ENOUGH: Final = 0.9
"""Part of the blocks that makes a habit of the program."""

DIFFERENCE_MM: Final = 0.01
"""What the radii of an arc may differ by, unless the last decimal is worth too much for that."""

MS_FROM: Final = 50.0
"""A dwell of a whole number from here on counts milliseconds: nobody waits a minute."""


class _Line(Struct, frozen=True):
    """A block: its text without comments and number, in capitals and as it stands, and its
    words."""

    text: str
    raw: str
    words: list[tuple[str, str]]

    def number(self, letter: str) -> float | None:
        """Return the number behind a letter; None where the block does not have it."""
        return next((float(text) for own, text in self.words if own == letter), None)

    def codes(self, letter: str) -> list[float]:
        """Return the numbers of all G or M codes in the block."""
        return [float(text) for own, text in self.words if own == letter]

    @property
    def axes(self) -> str:
        """Letters of X, Y and Z in the block."""
        return "".join(letter for letter, _ in self.words if letter in "XYZ")


class _Sample(Struct):
    """The settings and questions collected from a sample program."""

    settings: list[ControllerSetting] = field(default_factory=list)
    questions: list[OpenKey] = field(default_factory=list)

    def say(self, key: str, value: float | int | str | Sequence[str], reason: str) -> None:
        """Record the value of a key and what in the program shows it."""
        self.settings.append(ControllerSetting(key, value, reason))

    def ask(self, key: str, text: str, default: float | int | str, *choices: str) -> None:
        """Record a question that the program leaves open, with its default and choices."""
        is_list = key.startswith("dialect.events.")
        self.questions.append(OpenKey(key, text, default, choices, is_list))


def sampled_dialect(data: bytes) -> SampledDialect:
    """Return the keys that a program shows, and the questions that it leaves open; ProgramError
    for data that are no program in G-code."""
    text = data.decode("latin-1")
    sample = _Sample()
    lines = list(_lines(text))
    if data and not _motions(lines):
        raise ProgramError(
            "has no move such as G1 X1: it is no program of G-code",
            mend="give a program that the controller has run",
        )
    _see_lines(text, lines, sample)
    if lines:
        motions = _motions(lines)
        _see_words(lines, motions, sample)
        _see_arcs(lines, sample)
        _see_frame(lines, motions, sample)
        _see_events(lines, sample)
        _see_cycles(lines, sample)
    _ask_what_is_open(sample)
    return SampledDialect(tuple(sample.settings), tuple(sample.questions))


def _lines(text: str) -> Iterator[_Line]:
    """Yield the blocks of a program."""
    for raw in text.splitlines():
        block = _COMMENT.sub("", raw).strip()
        if not block or block == "%" or _PROGRAM_NUMBER.fullmatch(block):
            continue
        block = _BLOCK_NUMBER.sub("", block, count=1)
        if block:
            capitals = block.upper()
            is_text = capitals.startswith(("M117 ", "M0 "))
            words = [] if is_text else _WORD.findall(capitals)
            yield _Line(capitals, block, words)


def _motions(lines: Sequence[_Line]) -> list[tuple[int, int]]:
    """Return (index, code) of the blocks that move: those with axis words while G0 to G3 is in
    force."""
    motion, moves = -1, []
    for index, line in enumerate(lines):
        codes = line.codes("G")
        has_single_code = any(code in (28.0, 30.0, 53.0, 92.0, 10.0, 4.0) for code in codes)
        for code in codes:
            if code in (0.0, 1.0, 2.0, 3.0):
                motion = int(code)
            elif code == 80.0 or (code >= 73.0 and code < 90.0):
                motion = -1
        if motion >= 0 and line.axes and not has_single_code:
            moves.append((index, motion))
    return moves


def _see_lines(text: str, lines: Sequence[_Line], sample: _Sample) -> None:
    ends = {"crlf": text.count("\r\n")}
    ends["lf"], ends["cr"] = text.count("\n") - ends["crlf"], text.count("\r") - ends["crlf"]
    if any(ends.values()):
        end = max(ends, key=lambda name: ends[name])
        sample.say("dialect.lines.end", end, f"{ends[end]} lines end so")
    longest = max((len(line) for line in text.splitlines()), default=0)
    if longest > 256:
        sample.say("dialect.lines.max_chars", longest, "the longest line")
    matches = filter(None, map(_BLOCK_NUMBER.match, text.splitlines()))
    numbers = [int(match[1]) for match in matches]
    if lines and len(numbers) >= ENOUGH * len(lines) and len(numbers) > 1:
        steps = Counter(b - a for a, b in pairwise(numbers) if b > a)
        sample.say("dialect.lines.numbers", True, f"{len(numbers)} blocks have N")
        sample.say("dialect.lines.first", numbers[0], "the first N")
        if steps:
            sample.say("dialect.lines.step", steps.most_common(1)[0][0], "from N to N")
        texts = re.findall(r"^\s*N(\d+)", text, re.MULTILINE)
        digits = min(map(len, texts))
        if any(each.startswith("0") and len(each) > 1 for each in texts):
            sample.say("dialect.lines.digits", digits, "digits of N")
        sample.say("dialect.lines.highest", max(99_999, *numbers), "the highest N, or five digits")
    semicolons = len(re.findall(r";", re.sub(r"\([^)]*\)", "", text)))
    parentheses = text.count("(")
    if parentheses and parentheses >= semicolons:
        sample.say("dialect.comments.style", "parentheses", f"{parentheses} comments")
        if semicolons:
            sample.say("dialect.comments.reads", ["semicolon"], f"{semicolons} comments")
    elif semicolons:
        sample.say("dialect.comments.style", "semicolon", f"{semicolons} comments")
        if parentheses:
            sample.say("dialect.comments.reads", ["parentheses"], f"{parentheses} comments")
    elif lines:
        sample.ask(
            "dialect.comments.style",
            "How are comments written (the program has none)",
            "none",
            "parentheses",
            "semicolon",
            "none",
        )
    if re.search(r"^\s*%\s*$", text, re.MULTILINE):
        sample.say("dialect.program.frame", "%", "a line of its own")


def _see_words(
    lines: Sequence[_Line], motions: Sequence[tuple[int, int]], sample: _Sample
) -> None:
    cells = [text for line in lines for letter, text in line.words if letter in _LENGTHS]
    pointed = [cell for cell in cells if "." in cell]
    if pointed:
        behind = [len(cell.partition(".")[2]) for cell in pointed]
        decimals = max(max(behind), 1)
        inches = _has(lines, "G", 20.0)
        keeps_zeros = sum(count == decimals for count in behind) >= ENOUGH * len(behind)
        if not keeps_zeros:  # then trailing zeros may have been dropped
            decimals = max(decimals, 4 if inches else 3)
        key = "dialect.words.inch_decimals" if inches else "dialect.words.decimals"
        sample.say(key, min(decimals, 6), f"of {len(pointed)} lengths")
        if inches:
            sample.say("dialect.words.decimals", max(decimals - 1, 1), "one less than in inches")
        sample.say("dialect.words.trailing_zeros", keeps_zeros, "of lengths")
        bare = [cell for cell in pointed if re.match(r"[+-]?\.", cell)]
        if bare:
            sample.say("dialect.words.leading_zero", False, f"such as {bare[0]}")
        if any(cell.endswith(".") for cell in pointed):
            sample.say("dialect.words.point", "always", "numbers end with it")
    elif cells:
        sample.say("dialect.words.point", "never", "no length has one")
        sample.ask("dialect.words.decimals", "How many decimals has X1000", 3)
        sample.say("dialect.words.whole_letters", "XYZIJKRQ", "lengths without a point")
    if any(cell.startswith("+") for cell in cells):
        sample.say("dialect.words.plus_sign", True, "of lengths")
    codes = [text for line in lines for letter, text in line.words if letter == "G"]
    if any(re.fullmatch(r"0\d", code) for code in codes):
        sample.say("dialect.words.code_digits", 2, "such as G01")
    joined = sum(bool(re.search(r"\d[A-Z]", line.text)) for line in lines)
    if joined > len(lines) / 2:
        sample.say("dialect.words.blanks", False, "between words")
    if len(motions) > 2:
        named = sum(any(c in (0, 1, 2, 3) for c in lines[k].codes("G")) for k, _ in motions)
        if named >= ENOUGH * len(motions):
            sample.say("dialect.words.motion", "all", f"{named} of {len(motions)} moves say it")
        full = sum(len(lines[k].axes) == 3 for k, _ in motions)
        if full >= ENOUGH * len(motions):
            sample.say("dialect.words.coordinates", "all", f"{full} of {len(motions)} moves")
        cuts = [k for k, code in motions if code > 0]
        fed = sum(lines[k].number("F") is not None for k in cuts)
        if cuts and fed >= ENOUGH * len(cuts) and len(cuts) > 2:
            sample.say("dialect.words.feed", "all", f"{fed} of {len(cuts)} cuts have F")
        rapid = [k for k, code in motions if code == 0 and lines[k].number("F") is not None]
        if rapid:
            sample.say("dialect.feeds.rapids", "programmed", f"{len(rapid)} of G0 have F")
    feeds = [text for line in lines for letter, text in line.words if letter == "F"]
    if feeds:
        digits = max(len(cell.partition(".")[2].rstrip("0")) for cell in feeds)
        sample.say("feed.unit_mm_min", 10.0 ** -min(digits, 3), "decimals of F")


def _has(lines: Sequence[_Line], letter: str, code: float) -> bool:
    return any(code in line.codes(letter) for line in lines)


def _see_arcs(lines: Sequence[_Line], sample: _Sample) -> None:
    """Distinguish offsets from centres by the radii at start and end of arcs, and recognise full
    circles and helices."""
    place, motion = {"X": 0.0, "Y": 0.0, "Z": 0.0}, 0.0
    misses = {"offsets": 0.0, "centre": 0.0}
    by_radius = by_centre = circles = helices = 0
    for line in lines:
        motion = next((c for c in line.codes("G") if c in (0.0, 1.0, 2.0, 3.0)), motion)
        end = {axis: _or(line.number(axis), place[axis]) for axis in "XYZ"}
        i, j, radius = line.number("I"), line.number("J"), line.number("R")
        if motion in (2.0, 3.0) and (i is not None or j is not None):
            by_centre += 1
            for name, (x, y) in {
                "offsets": (place["X"] + _or(i, 0.0), place["Y"] + _or(j, 0.0)),
                "centre": (_or(i, place["X"]), _or(j, place["Y"])),
            }.items():
                r1 = math.hypot(place["X"] - x, place["Y"] - y)
                r2 = math.hypot(end["X"] - x, end["Y"] - y)
                # A radius of 0 is no arc, however well both ends agree.
                misses[name] += abs(r1 - r2) if r1 > 0.0 else math.inf
            circles += (end["X"], end["Y"]) == (place["X"], place["Y"])
            helices += end["Z"] != place["Z"]
        elif motion in (2.0, 3.0) and radius is not None and line.axes:
            by_radius += 1
            helices += end["Z"] != place["Z"]
        place = end
    if by_centre and misses["offsets"] == misses["centre"]:
        sample.ask(
            "dialect.arcs.form",
            "Are I and J offsets from the start of an arc, or its centre",
            "offsets",
            "offsets",
            "centre",
        )
    elif by_centre:
        form = min(misses, key=lambda name: misses[name])
        sample.say("dialect.arcs.form", form, f"the radii of {by_centre} arcs agree so")
    elif by_radius:
        sample.say("dialect.arcs.form", "radius", f"{by_radius} arcs have R")
        sample.say("dialect.arcs.full_circles", "halves", "R cannot say a circle")
    else:
        sample.ask(
            "dialect.arcs.form",
            "How are arcs said (the program has none)",
            "chords",
            "offsets",
            "centre",
            "radius",
            "chords",
        )
    if by_centre and not circles:
        sample.say("dialect.arcs.full_circles", "halves", "no arc ends where it starts")
    if (by_centre or by_radius) and not helices:
        sample.say("dialect.arcs.helices", False, "no arc changes Z")


def _or(value: float | None, default: float) -> float:
    return default if value is None else value


def _see_frame(
    lines: Sequence[_Line], motions: Sequence[tuple[int, int]], sample: _Sample
) -> None:
    """Record units and mode of feeds, the blocks before the first move (head) and those behind the
    last one (foot), without events."""
    inches = _has(lines, "G", 20.0)
    sample.say(
        "dialect.program.units", "in" if inches else "mm", "G20" if inches else "no G20 is there"
    )
    mode = {95.0: "per-revolution", 93.0: "inverse-time"}
    for code, name in mode.items():
        if _has(lines, "G", code):
            sample.say("dialect.feeds.mode", name, f"G{code:g}")
    first = motions[0][0] if motions else len(lines)
    last = motions[-1][0] + 1 if motions else len(lines)
    head = [each for line in lines[:first] if (each := _without_events(line))]
    foot = [each for line in lines[last:] if (each := _without_events(line))]
    sample.say("dialect.program.head", head, f"the {first} blocks before the first move")
    end = next((f"M{c:g}" for line in lines for c in line.codes("M") if c in (2.0, 30.0)), "")
    sample.say("dialect.program.end", end, "the last block" if end else "no M2 or M30 is there")
    foot = [each for each in foot if each not in ("M2", "M30", "M02")]
    if motions:
        sample.say("dialect.program.foot", foot, "the blocks behind the last move")


_UNITS: Final = {
    20.0: "{units}",
    21.0: "{units}",
    93.0: "{feeds}",
    94.0: "{feeds}",
    95.0: "{feeds}",
}


def _without_events(line: _Line) -> str:
    """Return a block of the head or foot as text; "" for a block that starts, stops or changes
    something that has a key of its own."""
    if any(code in (2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 30.0) for code in line.codes("M")):
        return ""
    codes = line.codes("G")
    events = {"T", "S"} & {letter for letter, _ in line.words}
    if events or (any(code in (4.0, 43.0, 0.0, 1.0) for code in codes) and 53.0 not in codes):
        return ""
    words = [
        _UNITS.get(float(text), f"G{text}") if letter == "G" else f"{letter}{text}"
        for letter, text in line.words
    ]
    return " ".join(words)


def _see_events(lines: Sequence[_Line], sample: _Sample) -> None:
    """Record the blocks that switch spindle and coolant, change tools, and wait."""
    starts = {}
    for code, key in ((3.0, "spindle_cw"), (4.0, "spindle_ccw")):
        block = next((line for line in lines if code in line.codes("M")), None)
        if block is not None:
            starts[key] = _filled(block, {"S": "{rpm}"}, keep="SM")
            sample.say(f"dialect.events.{key}", [starts[key]], "where the spindle starts")
    if len(starts) == 1:
        key, text = next(iter(starts.items()))
        missing = "spindle_ccw" if key == "spindle_cw" else "spindle_cw"
        turned = re.sub(r"M0?[34]\b", "M4" if missing == "spindle_ccw" else "M3", text)
        sample.say(f"dialect.events.{missing}", [turned], f"as {key}")
    if any(line.text.startswith("M117 ") for line in lines):
        sample.say("dialect.events.message", "M117 {text}", "lines of M117")
    stops = [line for line in lines if re.fullmatch(r"M0?0 .*[A-Z]+ \d+", line.text)]
    for index, line in enumerate(lines):
        if stops:
            text = re.sub(r"\d+$", "{tool}", stops[0].raw)
            sample.say(
                "dialect.events.tool_change", [text], "a stop whose text ends with a number"
            )
            sample.say("dialect.events.first_tool", "by-hand", "a stop is no change of tools")
            break
        if 6.0 in line.codes("M") or (line.number("T") is not None and not _has(lines, "M", 6.0)):
            blocks = [_filled(line, {"T": "{tool}"}, keep="TM")]
            following = lines[index + 1] if index + 1 < len(lines) else None
            if line.number("T") is None and index:
                blocks.insert(0, _filled(lines[index - 1], {"T": "{tool}"}, keep="TM"))
            if following is not None and 43.0 in following.codes("G"):
                blocks.append("G43 H{tool}")
            if "{tool}" in " ".join(blocks):
                sample.say("dialect.events.tool_change", blocks, "where a tool is changed")
                break
    else:
        sample.say("dialect.events.first_tool", "by-hand", "the program names no tool")
    dwell = next((line for line in lines if 4.0 in line.codes("G")), None)
    if dwell is None:
        _ask_dwell(sample)
        return
    letter = next((each for each, _ in dwell.words if each in "PXSU"), "P")
    text = next((text for each, text in dwell.words if each == letter), "0")
    unit = "ms" if "." not in text and float(text) >= MS_FROM else "s"
    wait = f"G4 {letter}{{{unit}}}"
    if "." in text or float(text) >= MS_FROM:
        sample.say("dialect.events.dwell", [wait], f"{letter}{text}")
    else:
        sample.ask(
            "dialect.events.dwell",
            f"Does {letter}{text} wait seconds {{s}} or milliseconds {{ms}}",
            wait,
            f"G4 {letter}{{s}}",
            f"G4 {letter}{{ms}}",
        )


def _filled(line: _Line, fields: dict[str, str], keep: str) -> str:
    """Return the words of these letters in a block, with fields in place of numbers."""
    words = [
        f"{letter}{fields.get(letter, text.lstrip('0') or '0')}"
        for letter, text in line.words
        if letter in keep
    ]
    return " ".join(words)


def _ask_dwell(sample: _Sample) -> None:
    """Ask how a dwell is written."""
    sample.ask(
        "dialect.events.dwell",
        "How is a dwell said: {s} are seconds, {ms} milliseconds",
        "G4 P{s}",
        "G4 P{s}",
        "G4 P{ms}",
        "G4 X{s}",
        "G4 S{s}",
    )


def _see_cycles(lines: Sequence[_Line], sample: _Sample) -> None:
    """Record the cycles of holes, with the letters of the block that begins each."""
    names = {"X": "{x}", "Y": "{y}", "Z": "{z}", "R": "{r}", "Q": "{q}", "F": "{f}", "P": "{ms}"}
    has_drill = False
    for code, kind in _CYCLES.items():
        block = next((line for line in lines if float(code) in line.codes("G")), None)
        letters = {letter for letter, _ in block.words} if block else set()
        needed = {*"XYZR", *("Q" if kind in ("peck", "chip") else "")}
        if block is None or not needed <= letters:
            continue
        words = [
            f"{letter}{names.get(letter, text)}"
            for letter, text in block.words
            if letter in "GXYZRF"
            or (letter == "Q" and "Q" in needed)
            or (letter == "P" and kind == "dwell")
        ]
        if "F" not in letters:
            words.append("F{f}")
        if not {"98", "99"} & {text for letter, text in block.words if letter == "G"}:
            words.insert(0, "G98")
        sample.say(f"dialect.cycles.{kind}", " ".join(words), f"G{code} of the program")
        has_drill |= kind == "drill"
    if has_drill:
        sample.say("dialect.cycles.use", True, "holes are drilled so")


def _ask_what_is_open(sample: _Sample) -> None:
    """Ask the questions that programs do not answer."""
    values = {each.key: each.value for each in sample.settings}
    if values.get("dialect.words.point") == "always":
        sample.ask(
            "dialect.words.whole_letters",
            "Letters whose numbers without a point count the last decimal (X1000 is 1 mm)",
            "XYZIJKRQF",
            "XYZIJKRQF",
            "",
        )
    if not values:
        sample.ask("dialect.words.decimals", "Decimals of lengths in mm", 3)
        sample.ask(
            "dialect.comments.style",
            "How are comments written",
            "parentheses",
            "parentheses",
            "semicolon",
            "none",
        )
        sample.ask(
            "dialect.arcs.form",
            "How are arcs said: I and J as offsets, I and J as the centre, R, or no arcs",
            "offsets",
            "offsets",
            "centre",
            "radius",
            "chords",
        )
        sample.ask("dialect.program.end", "The last block", "M30", "M2", "M30", "")
        sample.ask("dialect.lines.end", "How lines end", "lf", "lf", "crlf", "cr")
        _ask_dwell(sample)
    inches = values.get("dialect.program.units") == "in"
    decimals = values.get("dialect.words.inch_decimals" if inches else "dialect.words.decimals", 3)
    unit_mm = (25.4 if inches else 1.0) * 10.0 ** -float(str(decimals))
    if unit_mm > DIFFERENCE_MM / 2.0:
        sample.say(
            "dialect.arcs.difference_mm", round(2.5 * unit_mm, 6), "2.5 times the last decimal"
        )
