"""What a job asks for, the program is held against: each fault by hand, on every side of it."""

import re
from collections.abc import Callable

import numpy as np
import pytest

from camtool.findings import Code, Severity
from camtool.geometry.polylines import Polyline
from camtool.pipeline import post_drawing, verify_program
from camtool.planning.job import Job, Operation, Tool, job_of
from camtool.target.registry import LoadedTarget, load_target
from camtool.toolpath.findings import ProgramCode
from camtool.verification.findings import VerificationCode
from camtool.verification.verify import Verification
from tests.drawings import drawing_of

FULL = 1.0  # the bulge of half a circle


def circle(x: float, y: float, radius: float) -> Polyline:
    """Counter-clockwise from the right."""
    return Polyline(np.array([[x + radius, y, FULL], [x - radius, y, FULL]]), closed=True)


def square(x: float, y: float, side: float) -> Polyline:
    """Counter-clockwise."""
    corners = [(x, y), (x + side, y), (x + side, y + side), (x, y + side)]
    return Polyline(np.array([(*corner, 0.0) for corner in corners]), closed=True)


LINE = Polyline(np.array([[40.0, 0.0, 0.0], [50.0, 8.0, 0.0], [60.0, 3.0, 0.0]]), closed=False)
DRAWING = drawing_of([square(0, 0, 20), circle(10, 10, 4), LINE])
ASKED = job_of(
    feed_mm_min=120.0,
    plunge_feed_mm_min=60.0,
    spindle_rpm=1000.0,
    safe_z_mm=5.0,
    depth_mm=1.0,
    tool_diameter_mm=1.0,
)
GCODE = ("grbl", "linuxcnc")

both = pytest.mark.parametrize("target", [load_target(name) for name in GCODE], ids=GCODE)


def program(target: LoadedTarget, job: Job = ASKED) -> str:
    made = post_drawing(DRAWING, job, target, check=False).program
    assert made is not None
    return made.data.decode()


def held(text: str, target: LoadedTarget, job: Job = ASKED) -> Verification:
    return verify_program(
        text.encode(), target, source="a.nc", drawing=DRAWING, job=job
    ).verification


def errors(verification: Verification) -> list[Code]:
    return [each.code for each in verification.findings if each.severity is Severity.ERROR]


def told(verification: Verification) -> list[Code]:
    return [
        each.code
        for each in verification.findings
        if each.severity < Severity.ERROR and each.code >= VerificationCode.FEED_DIFFERS
    ]


@both
def test_the_own_program_is_as_asked(target: LoadedTarget) -> None:
    verification = held(program(target), target)
    assert errors(verification) == []
    assert told(verification) == []
    asked = verification.report.asked
    assert asked is not None
    assert asked.alike == asked.moves > 6
    assert asked.off_um == 0.0
    assert asked.limit_um == pytest.approx(1.5)


def times(word: str, factor: int) -> Callable[[str], str]:
    return lambda text: re.sub(
        rf"\b{word}(\d+)", lambda match: f"{word}{int(match[1]) * factor}", text
    )


def without(*lines: str) -> Callable[[str], str]:
    return lambda text: "".join(
        line for line in text.splitlines(keepends=True) if line.strip() not in lines
    )


FAULTS: dict[str, tuple[Callable[[str], str], Code]] = {
    "feeds × 3": (times("F", 3), VerificationCode.FEED_DIFFERS),
    "one feed": (lambda text: text.replace("F120", "F121", 1), VerificationCode.FEED_DIFFERS),
    "the plunge's feed": (
        lambda text: text.replace("F60", "F120", 1),
        VerificationCode.FEED_DIFFERS,
    ),
    "no M3": (
        lambda text: re.sub(r"M3 S1000\n|S1000 M3\n", "", text),
        VerificationCode.SPINDLE_DIFFERS,
    ),
    "M4": (lambda text: text.replace("M3", "M4"), VerificationCode.SPINDLE_DIFFERS),
    "S × 20": (times("S", 20), VerificationCode.SPINDLE_DIFFERS),
    "no M2": (without("M2"), VerificationCode.END_DIFFERS),
    "rapids on the stock": (
        lambda text: text.replace("Z5.000", "Z0.000"),
        VerificationCode.CLEARANCE_LOW,
    ),
    "rapids too low": (
        lambda text: text.replace("Z5.000", "Z4.900"),
        VerificationCode.CLEARANCE_LOW,
    ),
    "one rapid on the stock": (
        lambda text: "Z0.000".join(text.rsplit("Z5.000", 1)),
        VerificationCode.CLEARANCE_LOW,
    ),
}


@both
@pytest.mark.parametrize("fault", FAULTS)
def test_a_setting_that_the_job_names_is_held(target: LoadedTarget, fault: str) -> None:
    damage, code = FAULTS[fault]
    text = program(target)
    damaged = damage(text)
    assert damaged != text
    if code is VerificationCode.END_DIFFERS and target.machine.target.name == "linuxcnc":
        names = {each.code.name for each in held(damaged, target).findings}
        assert {"linuxcnc.NO_END", "END_DIFFERS"} <= names
        damaged = f"%\n{damaged}%\n"  # an end, and yet no M2
    found = [each for each in held(damaged, target).findings if each.code is code]
    assert found
    assert found[0].severity is Severity.ERROR
    assert "block" in found[0].where
    if code is not VerificationCode.END_DIFFERS:
        assert found[0].measured != found[0].limit
        assert found[0].unit


def test_corners_are_rounded_no_farther_than_asked() -> None:
    target = load_target("linuxcnc")
    text = program(target)
    assert "G64 P0.010\n" in text or "G64 P0.01\n" in text

    def under(mode: str) -> list[Code]:
        return errors(held(re.sub(r"G64 P\S+", mode, text), target))

    assert under("G64 P1") == under("G64") == [VerificationCode.SETTING_DIFFERS]
    assert under("G64 P0.005") == under("G61") == under("") == []
    exact = load_target("linuxcnc", settings=["dialect.path=exact-path"])
    assert "G61\n" in program(exact)
    damaged = program(exact).replace("G61\n", "G64 P0.01\n")
    assert errors(held(damaged, exact)) == [VerificationCode.SETTING_DIFFERS]


def test_the_tool_and_the_wait_at_the_bottom_of_a_hole() -> None:
    """LinuxCNC: T1 M6 before what T2 is asked for; G4 shorter than asked, or left out."""
    target = load_target("linuxcnc")
    drill = Tool(diameter_mm=1.0, kind="drill", tip_angle_rad=2.0, number=2)
    bore = Operation(kind="drill", tool=drill, depth_mm=1.0, dwell_s=0.5, max_hole_mm=20.0)
    ring = Operation(tool=Tool(diameter_mm=1.0, number=1), depth_mm=1.0)
    job = Job((ring, bore), safe_z_mm=5.0)
    text = program(target, job)
    assert errors(held(text, target, job)) == []
    assert "T2 M6\n" in text
    assert "G4 P0.5\n" in text
    for wrong in (text.replace("T2 M6", "T3 M6"), text.replace("T2 M6\n", "")):
        assert VerificationCode.SETTING_DIFFERS in errors(held(wrong, target, job))
    for wrong in (text.replace("G4 P0.5", "G4 P0.4", 1), text.replace("G4 P0.5\n", "", 1)):
        assert errors(held(wrong, target, job)) == [VerificationCode.SETTING_DIFFERS]
    assert errors(held(text.replace("G4 P0.5", "G4 P0.7"), target, job)) == []


def test_coolant_that_is_asked_for_runs() -> None:
    cooled = load_target("linuxcnc", settings=["coolant.mist=true", "coolant.flood=true"])
    each = [Operation(coolant=kind, depth_mm=1.0) for kind in ("flood", "both", "off")]
    job = Job(tuple(each))
    text = program(cooled, job)
    assert errors(held(text, cooled, job)) == []
    alone = Job((each[0],))
    ours = program(cooled, alone)
    for wrong in (ours.replace("M8\n", ""), ours.replace("M8\n", "M7\n")):
        assert errors(held(wrong, cooled, alone)) == [VerificationCode.SETTING_DIFFERS]
    dry = Job((each[2],))
    wet = program(cooled, dry).replace("G0 Z5.000", "M7\nG0 Z5.000", 1)
    assert errors(held(wet, cooled, dry)) == []
    assert told(held(wet, cooled, dry)) == [VerificationCode.SETTING_DIFFERS]


@both
def test_what_nobody_asked_for_is_told(target: LoadedTarget) -> None:
    plain = job_of(depth_mm=1.0, tool_diameter_mm=1.0)
    text = program(target, plain)
    assert told(held(text, target, plain)) == []
    faster = held(times("F", 2)(text), target, plain)
    assert errors(faster) == []
    assert told(faster) == [VerificationCode.FEED_DIFFERS]
    lower = held(text.replace("Z5.000", "Z2.000"), target, plain)
    assert errors(lower) == []
    assert VerificationCode.CLEARANCE_LOW in told(lower)
    on_stock = held(text.replace("Z5.000", "Z0.000"), target, plain)
    assert VerificationCode.CLEARANCE_LOW in errors(on_stock)
    turning = held(text.replace("G0 Z5.000", "M3 S500\nG0 Z5.000", 1), target, plain)
    assert errors(turning) == []
    assert told(turning) == [VerificationCode.SPINDLE_DIFFERS]


@both
def test_the_other_way_round(target: LoadedTarget) -> None:
    """Whole programs climb where conventional is asked for, and one full circle alone."""
    climb, conventional = (
        job_of(tool_diameter_mm=1.0, depth_mm=1.0, direction=way)
        for way in ("climb", "conventional")
    )
    judged = held(program(target, climb), target, conventional)
    assert (
        errors(judged) == [VerificationCode.CUT_OTHER_WAY] * 2
    )  # the open line may run either way
    text = program(target)
    (arc,) = re.findall(r"^G[23] .*\n", text, re.MULTILINE)[:1]
    turned = text.replace(arc, arc.replace("G3", "G4").replace("G2", "G3").replace("G4", "G2"), 1)
    assert errors(held(turned, target)) != []


@both
def test_a_shift_of_a_few_units_is_found(target: LoadedTarget) -> None:
    """3 µm in one word, less than the machine's own errors; 1 µm is rounding."""
    text = program(target)
    assert "X20.500 " in text
    near = held(text.replace("X20.500 ", "X20.501 "), target)
    assert errors(near) == []
    assert near.report.asked is not None
    assert 0.9 < near.report.asked.off_um < 1.1
    far = held(text.replace("X20.500 ", "X20.503 "), target)
    assert errors(far) == [VerificationCode.EXTRA_CUT]
    deeper = held(text.replace("Z-1.000", "Z-1.003", 1), target)
    assert set(errors(deeper)) == {VerificationCode.CONTOUR_MISSING, VerificationCode.EXTRA_CUT}


@both
@pytest.mark.parametrize("tool", [0.0, 1.0])
def test_a_plunge_as_a_rapid_runs_through_the_stock(target: LoadedTarget, tool: float) -> None:
    job = job_of(tool_diameter_mm=tool, depth_mm=1.0)
    text = program(target, job)
    down = re.findall(r"^G1 Z-1.000 F\d+$", text, re.MULTILINE)
    assert ProgramCode.RAPID_IN_STOCK not in errors(held(text, target, job))
    damaged = text.replace(down[0], "G0 Z-1.000", 1).replace("\nG3 X", "\nG3 F200 X", 1)
    assert ProgramCode.RAPID_IN_STOCK in errors(held(damaged, target, job))


@both
def test_a_circle_cut_twice(target: LoadedTarget) -> None:
    text = program(target)
    circles = re.findall(r"^G[23] X\S+ Y\S+ I\S+ J0.000 F120\n", text, re.MULTILINE)
    assert len(circles) == 1
    twice = held(text.replace(circles[0], circles[0] * 2), target)
    assert errors(twice) == [VerificationCode.EXTRA_CUT]
    assert "cut 2 times" in next(each.message for each in twice.findings if each.severity > 1)


@both
def test_another_start_and_order_are_as_asked(target: LoadedTarget) -> None:
    """The circle from another side in two halves, and the line from its other end."""
    text = program(target)
    head, _, rest = text.partition("G0 Z5.000\n")
    assert rest
    own = """M3 S1000
G0 Z5
X60 Y3
G1 Z-1 F60
X50 Y8 F120
X40 Y0
G0 Z6
X10 Y13.5
G1 Z-1 F60
G3 X10 Y6.5 J-3.5 F120
X10 Y13.5 J3.5
G0 Z5
X20 Y-.5
G1 Z-1 F60
G3 X20.5 Y0 J.5 F120
G1 Y20
G3 X20 Y20.5 I-.5
G1 X0
G3 X-.5 Y20 J-.5
G1 Y10
Y0
G3 X0 Y-.5 I.5
G1 X20
G0 Z5
M30
"""
    header = re.sub(r"M3.*\n|S1000.*\n", "", head)
    found = held(header + own, target)
    assert errors(found) == []
    assert set(told(found)) <= {VerificationCode.END_DIFFERS}  # it does not go home
