"""Sessions at the line of a grbl: what is sent to it, at random from a seed, and what it answers.

The firmware (`grbl_firmware`) and the virtual controller play the same ones. At rest all bytes
are compared. Where the moment of a byte counts, because something moves or was stopped while it
moved, places and speeds in reports may differ by what the firmware's step buffer explains
(`NEAR`); such a group of bytes ends with a move to a known place, behind which all is compared
again. A group in which another word depends on 60 ms (or 0.3 s, which grbl may lose when it goes
on after a hold) is left out (`robust`).
"""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

from camtool.target.twin import Twin
from tests.oracles.grbl_firmware import Played, Sent, Switch

BYTE_S = 1389 / 16e6
"""What a byte takes on the line, in ticks of the board."""

HOME = "G90G53G0X-5Y-5Z-1"
"""Behind it grbl stands at a known place, unless it is locked."""

NEAR = {"MPos": 0.25, "WPos": 0.25, "FS": 90.0, "Bf": 15.0, "PRB": 0.02}
"""How far numbers may differ while something moves: mm, mm/min, places. Pieces of 10 ms, of which
five are fixed already, make 50 ms at 8.3 mm/s or 10 mm/s²."""

LOST_STEP_MM = 0.0041
"""A reset while something moves: the firmware counts a step one interrupt before it puts it out
(stepper.c), and may forget that one. Its slides are then a step beside the place that it shows,
and so is the place at which it next meets a switch, until it homes."""

LATE_MM = 2.2
"""The same after a hold, which grbl may leave 0.25 s later than the virtual controller, at up to
8.4 mm/s: what is left of a step before it stood is added to its first piece."""

PROBE_STEPS, STEPS_PER_MM = -750, 250
TRAVEL_STEPS = 200 * STEPS_PER_MM
SWITCHES = tuple(Switch(pin, axis, -TRAVEL_STEPS - 1, 1) for axis, pin in enumerate("XYZ"))
PROBE = Switch("P", 2, PROBE_STEPS)

Draw = random.Random


def line(text: str) -> Sent:
    """A line, when it stands."""
    return Sent(text.encode("latin-1") + b"\n")


def key(octets: str, after_s: float | None = None) -> Sent:
    """Real-time bytes."""
    return Sent(octets.encode("latin-1"), after_s)


def number(draw: Draw, low: float, high: float, decimals: int = 3) -> str:
    return f"{draw.uniform(low, high):.{decimals}f}"


def axes(draw: Draw, low: float, high: float) -> str:
    return "".join(f"{axis}{number(draw, low, high)}" for axis in "XYZ" if draw.random() < 0.6)


PLAIN = """$$|$#|$G|$G|$I|$N|$|?|?|?|$X|$C|$C|$SLP|$H|$HX|$HQ|$L|$Q|$x|$J|$J=|$RST=$|$RST=#|$RST=*
$RST=x|$RST|$S|$SL|$GG|$$1|$##|$I=a new one|$I=x|$I|$Ix|$N0=|$N0=G21|$N0=G54 G20|$N1=G91|$N0=G77
$N0|$N=|$N1=|$N5|$N0=M3 S50|$N0|$10=|$10|$10=x|$99=1|$255=1|$256=1|$-1=1|$0=-1|$130=10x|$1.5=30
$0=2|$0=10|$1=25|$1=255|$1=0|$2=3|$2=0|$3=5|$3=0|$4=1|$4=0|$5=1|$5=0|$6=1|$6=0|$10=0|$10=1|$10=2
$10=3|$10=255|$11=0.02|$12=0.005|$13=1|$13=0|$13=0|$20=1|$20=0|$21=1|$21=0|$22=0|$23=1|$23=0|$24=50
$25=500|$26=10|$27=2|$27=1|$30=1000|$30=12000|$31=100|$31=0|$32=1|$32=0|$32=0|$110=400|$111=500.4
$120=20|$130=150|$131=200|$132=1e5|$100=250|G54|G55|G56|G57|G58|G59|G59.1|G54|G54|G20|G21|G21|G90
G90|G91|G90|G93|G94|G94|G17|G18|G19|G17|G40|G41|G43|G43.1Z1.5|G43.1Z-2|G43.1X1|G49|G49|G61|G61.1
G80|G0|G1|G64|G92X0Y0Z0|G92X5|G92Z1.25|G92.1|G92.2|G92|G10L2P1X-10Y2|G10L2P2Z3|G10L20P1X5
G10L20P0X0Y0Z0|G10L20P3Y1|G10L2P7X1|G10L3P1X1|G10P1|G10X1|G10L2P1X1R2|G28.1|G30.1|G28|G30|G28Z0
G30X1|G28.2|M3S500|M3|M4S200|M5|M3S0|M7|M8|M9|M3.5|M6|M56|T3|T4M6|T256|T-1|S100|S2000|S-1|F100
F250.5|F0|F-1|M0|M1|M2|M30|N5|N99999999|N1N2|G4P0.1|G4|G4P-1|G4P0|G1X1|G1X2F200|G0X1Y1|G2X1Y0I0.5
G2X0Y0I0.5J0|G3X2Y2R2|G2X1|G2X1Y1|G2X5Y5R1|G2X1Y1R0|G3Y1J1|G18G2X1Z0I0.5|G5|G77|M77|G|X|X--1
X1.2.3|G1X1X2|G1G0X1|M3M4|G54G55|P5|L1|I5|R1|H1|A1|D1|Q1|E1|#1=2|%|[1]|*|(only a comment)|;other
 |/G0X2|(a)G0(b)X1.5;c|g1 x1.25 y 2 f150|G0X0(open|G53X1|G53G0X-1|G53G2X1|G53G1X-2F100|G38.2
G38.2X1|G38.6Z-1|G38.9X1|G38.2F100|$J=X1|$J=X1F0|$J=G91X1F200|$J=G91Y-1.5F300|$J=G20G91X0.05F10
$J=G53X-1F200|$J=M3X1F100|$J=X1F100S5|$J=G2X1F100|$J=F100|$J=G90|$J=G93X1F5|$J=X1.1Y1F5000|?
G20G0X0.125|G21G0X0.002|G0X0.006Y0.01Z0.05|G91G0X0.1|G91X0.333Y-0.001|G90X3.3335|X1Y2Z-1|G0Z0
G93G1X1F10|G94G1X2F300|G1X1F1000000000|G0X-1.2345678901|X-000000000001|X1.00000000001|X-.5|X+.25|X."""
"""Lines, of which a session draws."""

POOL = re.split(r"[|\n]", PLAIN)

OVERRIDES = "\x90\x91\x92\x93\x94\x95\x96\x97\x99\x9a\x9b\x9c\x9d\x9e\xa0\xa1\x86\xff"


def plain(draw: Draw) -> Iterator[Sent]:
    """A line of any kind, when it stands."""
    which = draw.random()
    if which < 0.72:
        text = draw.choice(POOL)
        if text == "?":
            yield key("?")
        elif text in ("$SLP", "$RST=*", "$RST=#", "$RST=$"):
            yield line(text)
            if draw.random() < 0.6:
                yield key("?")
            yield key("\x18")
            yield line("$X")
        elif text in ("M0", "$HQ", "$HX"):
            yield line(text)
            yield key("?")
            yield key("~" if text == "M0" else "\x18")
            yield line("$X")
        else:
            yield line(text)
    elif which < 0.86:
        low, high = (-9.0, 0.0) if draw.random() < 0.7 else (-9.0, 9.0)
        yield line(f"{draw.choice(('G0', 'G1', 'G1F300', '', 'G53G0'))}{axes(draw, low, high)}")
    elif which < 0.9:
        yield key(draw.choice(("!", "~", "\x18", "\x84", "\x85", "!~", "?!?~?", "~!?")))
        yield key("?")
        yield key("~")
    elif which < 0.96:
        yield key("".join(draw.choice(OVERRIDES) for _ in range(draw.randint(1, 4))))
    elif which < 0.98:
        yield line(draw.choice("GX") + "".join(draw.choice("0123456789") for _ in range(90)))
    else:
        yield Sent(draw.choice((b"\r\n", b"\n\n", b"G0X1\r\n?", b"G90\rG21\n", b"\t \n")))


def moving(draw: Draw) -> Iterator[Sent]:
    """A move that something happens to, and what brings it to a known place again."""
    yield line("G90G21G94")
    jogs = draw.random() < 0.35
    far = draw.choice(("X-25", "Y-20Z-4", "X-12Y-9", "Z-8"))
    yield line(
        f"$J=G53{far}F{draw.randint(100, 600)}" if jogs else f"G53G1{far}F{draw.randint(80, 600)}"
    )
    for _ in range(draw.randint(1, 4)):
        octets = draw.choice(
            ("?", "?", "!", "~", "\x85", "\x84", "\x91", "\x92", "\x96", "\x9b", "\xa0")
        )
        yield key(octets, draw.uniform(0.05, 0.7))
    if draw.random() < 0.25:
        yield key("\x18", draw.uniform(0.05, 0.4))
    yield key("?")
    yield key("\x18" if draw.random() < 0.3 else "~")
    yield key("~")
    yield key("?")
    yield line("$X")
    yield line(HOME)


def probing(draw: Draw) -> Iterator[Sent]:
    """To the probe and away from it, or past it."""
    yield line("G90G21G94G53G0Z-1")
    word = draw.choice(("G38.2", "G38.3", "G38.4", "G38.5"))
    if word in ("G38.4", "G38.5"):
        yield line("G53G0Z-4")
    depth = draw.choice(("Z-6", "Z-2", "Z-2.5", "X-3", "Z-1.5"))
    yield line("G92.1")
    yield line("G49")
    yield line(f"{word}{depth}F{draw.randint(30, 300)}")
    yield key("?")
    yield line("$#")
    yield line("$G")
    yield line("$X")
    yield line(HOME)
    yield line("$#")


def homing(draw: Draw) -> Iterator[Sent]:
    """Home it, with bytes that come meanwhile."""
    yield line(draw.choice(("$23=0", "$23=1", "$23=3", "$27=1", "$27=2.5", "$25=500", "$24=100")))
    yield line("$H")
    which = draw.random()
    if which < 0.5:
        yield key(draw.choice(("?", "??", "!", "~", "\x91")), draw.uniform(0.1, 0.5))
    elif which < 0.7:
        yield key(draw.choice(("\x18", "\x84")), draw.uniform(0.1, 0.4))
    yield key("?")
    yield key("\x18")
    yield line("$X")
    yield line("$22=1")
    yield line("$H")
    yield key("?")
    yield line("$#")
    yield line(HOME)


def limits(draw: Draw) -> Iterator[Sent]:
    """Against the switches, and against soft limits."""
    yield line(draw.choice(("$21=1", "$20=1")))
    yield line(
        draw.choice(("G90G53G0X5", "G53G0Z3", "$J=G53X4F300", "G53G1Y-500F500", "G91G0X-1"))
    )
    yield key("?")
    yield line("G0X-1")
    yield key("\x18")
    yield key("?")
    yield line("$X")
    yield line("$20=0")
    yield line("$21=0")
    yield line(HOME)
    yield line("$X")
    yield line(HOME)


def session(seed: int, count: int, *, switched: bool) -> list[Sent]:
    """A session of at least so many entries."""
    draw = random.Random(seed)
    sent = [line("$X"), key("?"), line("$10=1"), line(HOME), line("F300")]
    kinds = [plain] * 12 + [moving]
    if switched:
        kinds = [plain] * 6 + [moving, probing, probing, homing, limits]
    while len(sent) < count:
        if draw.random() < 0.06:
            sent += [line("$RST=*"), line("$22=1" if switched else "$22=0"), line("$X")]
        sent += list(draw.choice(kinds)(draw))
    return sent


SHIFTS = ((0.06, 0.06), (-0.06, -0.06), (0.06, -0.06), (0.3, 0.3))
"""What moments are shifted by, in turn, s."""


def robust(
    play: Callable[[Sequence[Sent]], list[str]], sent: Sequence[Sent]
) -> tuple[list[Sent], list[str]]:
    """The session without the groups whose words depend on their moments, and its answers."""
    kept = list(sent)
    while True:
        said = play(kept)
        for shifts in SHIFTS:
            other = play([_shifted(each, shifts[k % 2]) for k, each in enumerate(kept)])
            pairs = zip(said, other, strict=True)
            apart = [k for k, (a, b) in enumerate(pairs) if not _says_the_same(a, b)]
            if apart:
                first, last = _group(kept, apart[0] - 1)
                del kept[first:last]
                break
        else:
            return kept, said


def _shifted(each: Sent, by_s: float) -> Sent:
    after_s = None if each.after_s is None else max(each.after_s + by_s, 0.001)
    return Sent(each.data, after_s)


def _group(sent: Sequence[Sent], at: int) -> tuple[int, int]:
    """Return the range (first, behind the last) of the bytes before an entry, or at it."""
    first = at
    while sent[first].after_s is None:
        first -= 1
    last = first + 1
    while first > 0 and sent[first - 1].after_s is not None:
        first -= 1
    return first, last


def _says_the_same(one: str, other: str) -> bool:
    """True if two answers have the same words; numbers may differ."""
    return _FIELD.sub(r"\1", one) == _FIELD.sub(r"\1", other)


def answers(twin: Twin, sent: Sequence[Sent]) -> list[str]:
    """Return the answers of the virtual controller before the first entry and after each."""
    said, now = [twin.connect(0.0)], 0.0
    for each in (*sent, None):
        if each is None or each.after_s is None:
            while (at := twin.wake_s()) is not None:
                now = max(now, at)
                said[-1] += twin.advance(now)
            at_s = now
        else:
            at_s = now + each.after_s
            said[-1] += twin.advance(at_s)
        if each is None:
            break
        said.append(b"")
        for k, octet in enumerate(each.data):
            now = at_s + k * BYTE_S
            said[-1] += twin.receive(bytes([octet]), now)
    return [text.decode("latin-1") for text in said]


_FIELD = re.compile(r"([A-Za-z]+):(-?[\d.]+(?:,-?[\d.]+)*)")


def differences(
    sent: Sequence[Sent], wanted: Sequence[str], found: Sequence[str]
) -> Iterator[str]:
    """Return the entries at which two lists of answers differ."""
    loose = held = beside = False
    for k, (one, other) in enumerate(zip(wanted, found, strict=True)):
        data = b"" if k == 0 else sent[k - 1].data
        timed = (k > 0 and sent[k - 1].after_s is not None) or b"G38" in data
        timed = timed or (k < len(sent) and sent[k].after_s is not None)
        loose = loose or timed
        moving = "<Run|" in one or "<Jog|" in one
        held = held or data in (b"!", b"\x84")
        beside = (beside or (data == b"\x18" and timed)) and data != b"$H\n"
        near = {**NEAR, **({"MPos": LATE_MM, "WPos": LATE_MM} if held else {})}
        if not (loose or moving):
            near = {"MPos": LOST_STEP_MM, "WPos": LOST_STEP_MM} if beside else {}
        if one != other and not (near and _is_near(one, other, near)):
            yield f"entry {k - 1} {data!r}\n  firmware {one!r}\n  twin     {other!r}"
        if data == HOME.encode() + b"\n" and one == "ok\r\n":
            loose = held = False


def _is_near(one: str, other: str, near: Mapping[str, float]) -> bool:
    first, second = _FIELD.findall(one), _FIELD.findall(other)
    if not _says_the_same(one, other):
        return False
    for (name, numbers), (_, others) in zip(first, second, strict=True):
        a, b = ([float(each) for each in text.split(",")] for text in (numbers, others))
        if len(a) != len(b) or any(
            abs(x - y) > near.get(name, 0.0) for x, y in zip(a, b, strict=True)
        ):
            return False
    return True


# Recordings: `> text` is an entry when it stands, `+0.25 text` one so many seconds later; what
# follows up to the next one was answered.


def recorded(sent: Sequence[Sent], said: Sequence[str], head: str) -> str:
    """A session as the text of a recording."""
    rows = [f"# {row}" for row in head.splitlines()]
    for k, text in enumerate(said):
        if k:
            each = sent[k - 1]
            data = each.data.decode("latin-1").encode("unicode_escape").decode("ascii")
            rows.append(f"> {data}" if each.after_s is None else f"+{each.after_s!r} {data}")
        rows += [f"< {row}".rstrip() if row else "<" for row in text.split("\r\n")[:-1]]
        assert text == "" or text.endswith("\r\n"), text
    return "\n".join(rows) + "\n"


def read(file: Path) -> tuple[list[Sent], list[str]]:
    """A recording: what was sent, and what was said before the first entry and after each."""
    sent, said = list[Sent](), [""]
    for row in file.read_text(encoding="ascii").splitlines():
        mark, _, rest = row.partition(" ")
        if mark == "<":
            said[-1] += f"{rest}\r\n"
        elif mark != "#":
            data = rest.encode("ascii").decode("unicode_escape").encode("latin-1")
            sent.append(Sent(data, None if mark == ">" else float(mark)))
            said.append("")
    return sent, said


def said_by(played: Played) -> list[str]:
    """Return the answers of the firmware, in the same form."""
    return ["".join(text for _, text in each) for each in played.said]
