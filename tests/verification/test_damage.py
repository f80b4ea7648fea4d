"""Random damage of programs, on every target: nearly all of it is found by `verify --against`.

What makes no difference is no damage, and what no reader takes is none that reaches the machine:
both are thrown again. The flags are those of the post, and no limit is raised for the machine's
own errors.
"""

import math
import re
from collections import Counter
from functools import cache
from pathlib import Path
from random import Random

import numpy as np
import pytest

from camtool.errors import CamtoolError, ProgramError
from camtool.findings import Code, Severity, worst
from camtool.geometry.drawing import Drawing
from camtool.geometry.polylines import Polyline
from camtool.pipeline import post_drawing, verify_program
from camtool.planning.job import Job, job_of
from camtool.target.registry import LoadedTarget, load_target
from camtool.verification.findings import VerificationCode
from tests.drawings import drawing_of
from tests.fuzz.program_damage import KINDS, MOTION, Whole, damaged, motors
from tests.oracles.changed import makes_a_difference

SAMPLE = Path(__file__).parents[2] / "samples" / "i8751-sample.toml"

CASES: dict[str, tuple[float, float, dict[str, float]]] = {
    "grbl": (1.0, 0.001, {"feed": 400.0, "plunge": 100.0, "spindle": 8000.0, "safe": 4.0}),
    "linuxcnc": (1.0, 0.001, {"feed": 400.0, "plunge": 100.0, "spindle": 8000.0, "safe": 4.0}),
    "flashcut": (0.1, 0.001, {"feed": 3.0, "safe": 0.4, "depth": 0.02}),
    "pic-mmh": (0.05, 0.00014, {"feed": 0.8, "plunge": 0.6, "safe": 0.2, "depth": 0.02}),
    "valcnc": (1.0, 0.0008, {"safe": 4.0}),
    "i8751": (1.0, 0.0125, {"safe": 2.0}),
    "matlab-router": (2.0, 0.2, {"feed": 150.0}),
}
"""How large the part is (1: 52 mm), the finest difference that the dialect says (mm), and what
the job names."""

NAMES = {
    "feed": "feed_mm_min",
    "plunge": "plunge_feed_mm_min",
    "spindle": "spindle_rpm",
    "safe": "safe_z_mm",
    "depth": "depth_mm",
}
APART_UNITS = 3.0
"""A damage is one when it moves the tool by more than so many units."""

OF_50 = 48


def part(scale: float) -> Drawing:
    """A plate, a star, holes, a shape of arcs, and an open line."""
    quarter = math.tan(math.pi / 8.0)
    plate = [
        (5, 3, 0),
        (41, 3, quarter),
        (43, 5, 0),
        (43, 31, quarter),
        (41, 33, 0),
        (5, 33, quarter),
        (3, 31, 0),
        (3, 5, quarter),
    ]
    spokes = [(7.0 if k % 2 else 3.5, 0.2 * math.pi * k) for k in range(10)]
    star = [(15 + r * math.cos(turn), 18 + r * math.sin(turn), 0) for r, turn in spokes]
    blob = [(27, 11, 0.3), (35, 12, -0.2), (37, 23, 0.4), (30, 26, 0.1), (26, 19, -0.3)]
    holes = [
        [(x + r, y, 1), (x - r, y, 1)] for x, y, r in ((8, 29, 1.5), (38, 29, 1.5), (30, 17, 1.2))
    ]
    line = [(48, 5, 0), (53, 15, 0.5), (49, 28, 0), (55, 31, 0)]
    size = np.array([scale, scale, 1.0])
    closed = [Polyline(np.array(path) * size, True) for path in (plate, star, blob, *holes)]
    return drawing_of([*closed, Polyline(np.array(line) * size, False)])


@cache
def sound(name: str) -> tuple[Whole, Drawing, Job]:
    """The program of the part on a target, and what it was posted from."""
    scale, unit_mm, said = CASES[name]
    machine = SAMPLE if name == "i8751" else None
    target: LoadedTarget = load_target(name, machine_file=machine)
    flags = {NAMES[key]: value for key, value in said.items()}
    job = job_of(tool_diameter_mm=scale, **flags)
    posted = post_drawing(part(scale), job, target, check=False)
    assert posted.program is not None
    whole = Whole(target, posted.program.data, posted.wanted, unit_mm)
    return whole, part(scale), job


def throw(name: str, kind: str, random: Random) -> bytes | None:
    """Draw a damaged program that can be read and differs; None if there is no such damage."""
    whole = sound(name)[0]
    read, machine = whole.target.target.read, whole.target.machine
    before = read(whole.data, machine)
    for _ in range(40):
        try:
            data = damaged(whole, kind, random)
            if data is None or data == whole.data:
                continue
            after = read(data, machine)
        except CamtoolError:
            continue
        apart = APART_UNITS * whole.unit_mm
        feed = 0.6 * machine.feed.unit_mm_min
        if makes_a_difference(before, after, apart_mm=apart, feed=feed):
            return data
    return None


def found(name: str, data: bytes) -> bool:
    """True if `verify --against` would end with exit code 1 (or 2)."""
    whole, drawing, job = sound(name)
    try:
        run = verify_program(data, whole.target, source="damaged", drawing=drawing, job=job)
    except ProgramError:  # the controller's model cannot follow it
        return True
    return worst(run.findings) is Severity.ERROR


def missed(name: str, seed: int, count: int) -> list[str]:
    """Return the damages, of so many, that were not found: kind and changed part."""
    random = Random(f"{name} {seed}")
    lost: list[str] = []
    thrown: Counter[str] = Counter()
    while sum(thrown.values()) < count:
        kind = KINDS[sum(thrown.values()) % len(KINDS)]
        data = throw(name, kind, random)
        if data is None:  # the dialect has no arcs, or no feeds
            kind = "shifted"
            data = throw(name, kind, random)
        assert data is not None
        thrown[kind] += 1
        if not found(name, data):
            lost.append(f"{kind}: {_changed(sound(name)[0].data, data)}")
    return lost


def _changed(before: bytes, after: bytes) -> str:
    """The first place where two programs differ."""
    at = next(
        (k for k, (a, b) in enumerate(zip(before, after, strict=False)) if a != b), len(before)
    )
    low = max(at - 30, 0)
    return f"{before[low : at + 40]!r} became {after[low : at + 40]!r}"


# Damage that spoils no part, or perhaps not: a warning at least.


@pytest.mark.parametrize("kind", ["home deleted", "home at a feed", "retract at a feed"])
@pytest.mark.parametrize("name", ["grbl", "linuxcnc", "flashcut"])
def test_what_spoils_no_part_is_a_warning(name: str, kind: str) -> None:
    """In the dialects that say a rapid: others have no word for these."""
    whole = sound(name)[0]
    text = whole.data.decode()
    blocks = text.splitlines(keepends=True)
    feed = "G01" if name == "flashcut" else "G1"
    moving = [k for k, block in enumerate(blocks) if MOTION.match(block)]
    if kind == "retract at a feed":
        up = [k for k in moving if re.match(r"G0?0 Z(?!-)", blocks[k])]
        at = Random(name).choice(up[1:])
        after = [*blocks[:at], re.sub("0 Z", "1 Z", blocks[at]), *blocks[at + 1 :]]
    else:
        at = max(k for k in moving if re.search("X", blocks[k]))
        home = "" if kind == "home deleted" else re.sub("^(G0?0 )?", f"{feed} ", blocks[at])
        after = [*blocks[:at], home, *blocks[at + 1 :]]
    new = _new_findings(name, "".join(after).encode())
    assert max(severity for _, severity in new) == Severity.WARNING, new


def _new_findings(name: str, data: bytes) -> list[tuple[Code, Severity]]:
    """Code and severity of what `verify --against` says of a program, and not of the sound one."""
    return list((_findings(name, data) - _findings(name, sound(name)[0].data)).elements())


@cache
def _findings(name: str, data: bytes) -> Counter[tuple[Code, Severity]]:
    """Count what `verify --against` says of a program, by code and severity."""
    whole, drawing, job = sound(name)
    run = verify_program(data, whole.target, source="damaged", drawing=drawing, job=job)
    return Counter((finding.code, finding.severity) for finding in run.findings)


LEAST = {
    "grbl": (r"(?<=\nX)\d+\.\d{3}", 0.001),
    "linuxcnc": (r"(?<=\nX)\d+\.\d{3}", 0.001),
    "flashcut": (r"(?<=\nG01 X)\d+\.\d+", 0.001),
}
"""A coordinate of a cut, and the least by which it can differ."""


@pytest.mark.parametrize("name", LEAST)
def test_the_last_digit_of_a_cut_is_a_warning(name: str) -> None:
    text, (what, by) = sound(name)[0].data.decode(), LEAST[name]
    place = Random(name).choice(list(re.finditer(what, text)))
    other = f"{float(place[0]) + by:.3f}"
    data = (text[: place.start()] + other + text[place.end() :]).encode()
    assert (VerificationCode.MOVES_CHANGED, Severity.WARNING) in _new_findings(name, data)


@pytest.mark.parametrize("seed", range(4))
def test_bytes_of_packets_are_reported(seed: int) -> None:
    """Of the 8751: a motor by one step, and a wait where none is."""
    whole, random = sound("i8751")[0], Random(seed)
    listing = whole.target.target.listing(whole.data, whole.target.machine)  # type: ignore[attr-defined]
    blocks = [bytearray.fromhex(block) for block in listing.blocks]
    records = [k for k, block in enumerate(blocks) if len(block) > 6 and list(motors(block))]
    for change in ("step", "wait"):
        done = [bytearray(block) for block in blocks]
        block = done[random.choice(records[len(records) // 4 : -len(records) // 4])]
        if change == "step":
            block[random.choice(list(motors(block))) + 3] ^= 1
        else:
            block[12 if block[-1] != 0x45 else len(block) - 2] = random.choice((1, 16, 240))
        try:
            new = _new_findings("i8751", b"".join(map(bytes, done)))
        except ProgramError:
            continue
        assert max((severity for _, severity in new), default=Severity.INFO) >= Severity.WARNING


@pytest.mark.parametrize("seed", range(4))
def test_the_speed_of_one_slave_is_reported(seed: int) -> None:
    """Of the router, also where the job names no feed."""
    whole, drawing, job = sound("matlab-router")
    unasked = job_of(tool_diameter_mm=2.0)
    posted = post_drawing(drawing, unasked, whole.target, check=False).program
    assert posted is not None
    for data, asked in ((whole.data, job), (posted.data, unasked)):
        text, random = data.decode(), Random(seed)
        table = random.choice(list(re.finditer(r"velxy = \[\n([^\]]*)\];", text)))
        speeds = [each for each in re.finditer(r"-?\d+", table[1]) if abs(int(each[0])) > 60]
        speed = random.choice(speeds)
        slower = int(speed[0]) + (-40 if int(speed[0]) > 0 else 40)
        at = table.start(1) + speed.start()
        other = text[:at] + str(slower) + text[at + len(speed[0]) :]
        found = verify_program(
            other.encode(), whole.target, source="damaged", drawing=drawing, job=asked
        ).findings
        codes = {
            VerificationCode.FEED_DIFFERS,
            VerificationCode.EXTRA_CUT,
            VerificationCode.CONTOUR_MISSING,
        }
        assert codes & {each.code for each in found if each.severity >= Severity.WARNING}


@pytest.mark.parametrize("name", CASES)
def test_a_sound_program_is_as_asked(name: str) -> None:
    assert not found(name, sound(name)[0].data)


@pytest.mark.parametrize("name", CASES)
def test_damage_is_found(name: str) -> None:
    lost = missed(name, 0, len(KINDS))
    assert lost == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1, 4))
@pytest.mark.parametrize("name", CASES)
def test_of_50_damages_48_are_found(name: str, seed: int) -> None:
    lost = missed(name, seed, 50)
    assert 50 - len(lost) >= OF_50, "\n".join(lost)
