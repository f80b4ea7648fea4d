"""LinuxCNC's own interpreter as the referee: what `rs274 -g` makes of a program must be what our
readers make of it, and what our writers were given. Skipped where LinuxCNC is not installed."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given

from camtool.errors import ProgramError
from camtool.findings import Severity
from camtool.importers.read import read_drawing
from camtool.planning.job import job_of
from camtool.planning.plan import plan
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from tests.operations import adaptive_programs
from tests.oracles.rs274 import NO_LENGTHS, compare, interpreted, motions, needs_rs274, run_rs274
from tests.postprocessors.gcode.parts import part, toolpaths
from tests.strategies import examples

pytestmark = needs_rs274

TARGETS = ("grbl", "linuxcnc")


@pytest.mark.parametrize("name", TARGETS)
def test_our_programs_are_what_was_wanted(name: str, tmp_path: Path) -> None:
    target = load_target(name)
    wanted = part(tools=name == "linuxcnc")
    program = target.target.write(wanted, target.machine)
    decoded = target.target.read(program.data, target.machine)
    compare(wanted, program.data, tmp_path)
    compare(decoded, program.data, tmp_path)


def test_events_are_canonical_calls_too(tmp_path: Path) -> None:
    target = load_target("linuxcnc")
    program = target.target.write(part(tools=True), target.machine)
    calls = interpreted(program.data, tmp_path)
    names = [name for name, _, _ in calls]
    said = {(name, *values) for name, _, values in calls}
    assert {("SELECT_TOOL", 1.0), ("CHANGE_TOOL", 1.0), ("DWELL", 2.0)} <= said
    assert names.index("CHANGE_TOOL") < names.index("START_SPINDLE_CLOCKWISE")
    assert "START_SPINDLE_COUNTERCLOCKWISE" in names
    assert "MESSAGE" in names
    assert names[-3:].count("PROGRAM_END") == 1


@pytest.mark.parametrize("path", ["blend", "exact-path", "exact-stop"])
def test_the_path_mode_is_the_one_asked_for(path: str, tmp_path: Path) -> None:
    target = load_target("linuxcnc", settings=[f"dialect.path={path}", "dialect.percent=true"])
    program = target.target.write(part(), target.machine)
    run = run_rs274("-g", "/dev/stdin", input=program.data.decode(), cwd=tmp_path)
    mode = {
        "blend": "CONTINUOUS, 0.010000",
        "exact-path": "EXACT_PATH",
        "exact-stop": "EXACT_STOP",
    }
    assert f"SET_MOTION_CONTROL_MODE(CANON_{mode[path]}" in run.stdout


@pytest.mark.parametrize("name", TARGETS)
def test_the_logo(name: str, tmp_path: Path) -> None:
    target = load_target(name)
    drawing = read_drawing(Path(__file__).parents[3] / "samples" / "logo.dxf")
    program = target.target.write(plan(drawing, job_of(), target.machine), target.machine)
    compare(target.target.read(program.data, target.machine), program.data, tmp_path)


@pytest.mark.parametrize(
    ("name", "shape"), list(zip(TARGETS, adaptive_programs.SHAPES, strict=True))
)
def test_adaptive_pockets(shape: str, name: str, tmp_path: Path) -> None:
    """Hundreds of short arcs: none is refused, and all end where they should."""
    paths, lift_mm = adaptive_programs.SHAPES[shape], adaptive_programs.LIFT_MM[shape]
    run = adaptive_programs.posted(paths, 1.7, math.radians(65.0), name, tmp_path, lift_mm)
    assert sum(run.decoded.is_arc) > 300
    compare(run.decoded, run.data, tmp_path)
    ends = motions(interpreted(run.data, tmp_path, table=NO_LENGTHS))[:, 1:4]
    wanted = run.wanted.end[run.wanted.is_motion]
    np.testing.assert_allclose(ends[-1], wanted[-1], atol=2e-3)


@pytest.mark.parametrize("name", TARGETS)
@examples(20, 2000, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(path=toolpaths())
def test_random_programs(name: str, path: Toolpath, tmp_path: Path) -> None:
    target = load_target(name)
    program = target.target.write(path, target.machine)
    compare(target.target.read(program.data, target.machine), program.data, tmp_path)


FOREIGN = [
    "g21 g1 f100 x1 y2\ny3 (note)\nx4 z-1 ; note\nm2",
    "%\nG20\nG1 F10 X1 Y.5\nG2 X2 Y.5 I.5 J0\nG21 G0 X1\nm30\n%\n",
    "G91 G0 X1 Y1\nX1\nG1 F50 X-.5 Z-1\nG3 X2 Y0 I1 J0\nG90 G0 X0 Y0 Z5\nM2",
    "G0 X10\nG2 X0 Y10 R10 F100\nG3 X10 Y0 R10\nG2 X0 Y10 R-10\nG3 X10 Y0 R-10\nM2",
    "F100 G1 X10 G91.1\nG3 X10 I-5\nG2 I-5 J0 X10\nX10 Y0 I5\nG80\nG0 X0\nM2",
    "N10 G 1 X 1 2 . 5 F 1 0 0\nN20 Y0\nM2",
    "G17 G40 G49 G80 G90 G94 G54\nG61\nG0X1Y1Z1\nG1F1X2\nM2",
    "S100 M3\nG0 X1\nS200\nM4\nM5\nG4 P.5\nM2",
    "G53 G0 Z0\nG53 X0 Y0\nG1 X1 F10\nM2",
]
ONLY_LINUXCNC = [
    "G90.1 F100 G0 X10 Y5\nG2 X0 Y5 I5 J5\nG91.1 G3 X10 Y5 I5\nM2",
    "G21 G17 F100\nG0 X1 Y1\nG2 I0.5 J0.5\nG3 J-2\nG1 X3\nM2",
    "G21 F100 (Fräsen µ ⌀)\nG1 X3 ; größer\nM2",
    "G64 P.02 Q.01 G0 X1\nG97 S100 M3\nG98 X2\nM2",
    "G21 F100 G2 I5 J0 P2\nG3 X10 Y0 I5 P3 Z-2\nG2 X0 Y0 R7 P2 Z1\nM2",
    "M3\nG21 G0 X1\nS500\nM2",
    "G21 F10 G1 X1\nG20 F20 X2\nX3\nM2",
    "%\nG0 X1\n%\nX5 nothing\n",
    "F60 G94\nG1 X1\nM2",
    "F60\nG94 F50\nG1 X1\nM2",
    "N1.5 G8 G0 X1\nM2\nG0 X7 never\n",
    "G21 F100 G2 Z-1 I5\nM2",
]


@pytest.mark.parametrize("text", FOREIGN)
@pytest.mark.parametrize("name", TARGETS)
def test_programs_of_other_hands(name: str, text: str, tmp_path: Path) -> None:
    target = load_target(name)
    # LinuxCNC knows no motion before a motion word, grbl no %.
    program = text.replace("%\n", "") if name == "grbl" else text
    compare(target.target.read(program.encode(), target.machine), program.encode(), tmp_path)


@pytest.mark.parametrize("text", ONLY_LINUXCNC)
def test_programs_that_grbl_has_no_words_for(text: str, tmp_path: Path) -> None:
    target = load_target("linuxcnc")
    compare(target.target.read(text.encode(), target.machine), text.encode(), tmp_path)


@pytest.mark.parametrize("name", TARGETS)
def test_helices_are_theirs(name: str, tmp_path: Path) -> None:
    text = b"G0 X10 Z2\nG3 X0 Y10 Z0 I-10 J0 F100\nG2 X0 Y10 Z-1 I0 J-5\nG2 X5 Y5 R5 Z1\nM2"
    target = load_target(name)
    compare(target.target.read(text, target.machine), text, tmp_path)
    assert motions(interpreted(text, tmp_path))[1:4, 3].tolist() == [0.0, -1.0, 1.0]


EDGES = [
    # The three regions of a radius difference: r, difference.
    *((r, d) for r in (1.0, 20.0) for d in (0.0282, 0.0284)),
    *((r, d) for r in (100.0, 1000.0) for d in (0.099 * r / 100, 0.101 * r / 100)),
    *((10_000.0, d) for d in (2.82, 2.84)),
    # The least radius.
    *((r, 0.0) for r in (0.0012, 0.0013, 0.01)),
]


def judged(text: str, folder: Path) -> tuple[bool, bool]:
    """True each if our reader takes the program without an error, and if LinuxCNC does."""
    target = load_target("linuxcnc")

    def ours() -> bool:
        found = target.target.read(text.encode(), target.machine).findings
        return all(each.severity is not Severity.ERROR for each in found)

    def theirs() -> bool:
        interpreted(text.encode(), folder)
        return True

    verdicts = []
    for judge in (ours, theirs):
        try:
            verdicts.append(judge())
        except ProgramError:
            verdicts.append(False)
    return verdicts[0], verdicts[1]


@pytest.mark.parametrize(("radius", "difference"), EDGES)
def test_the_rule_for_arcs_is_theirs(radius: float, difference: float, tmp_path: Path) -> None:
    i = radius - difference / 2.0
    ours, theirs = judged(f"G21 F100\nG2 X{2.0 * radius:.6f} Y0 I{i:.6f} J0\nM2", tmp_path)
    assert ours == theirs


@pytest.mark.parametrize("short", [0.0, 0.00126, 0.00128, 0.02])
def test_the_slack_of_a_radius_is_theirs(short: float, tmp_path: Path) -> None:
    ours, theirs = judged(f"G21 F100\nG2 X2 R{1.0 - short:.6f}\nM2", tmp_path)
    assert ours == theirs


@pytest.mark.parametrize(
    "text",
    [
        "X1\nM2",
        "G1 X1\nM2",
        "F100\nG2 X1\nM2",
        "F100\nG2 I1\nX5\nM2",
        "F100\nG2 X1 R1 I1\nM2",
        "F100\nG2 X0 Y0 R1\nM2",
        "G0 G1 X1 F1\nM2",
        "G0 X1 X2\nM2",
        "G4\nM2",
        "G4 P-1\nM2",
        "F-1 G1 X1\nM2",
        "S-1 M3\nM2",
        "M3 M4\nM2",
        "T1.5 M6\nM2",
        "G0 X\nM2",
        "G0 X1 (a\nM2",
        "G0 X1,5\nM2",
        "G77 X1\nM2",
        "M77\nM2",
        "G1.5 X1\nM2",
        "G0 Q1\nM2",
        "P1\nM2",
        "G90.1 F100\nG2 X1 I1\nM2",
        "G53 G1 X0 Y0 F100 P2\nM2",
        "G0 X1\n",
        "%\nG0 X1\n",
        "G0 X1\n%\n",
        "(c)\n%\nG0 X1\nM2\n%\n",
        "% foo\nG0 X1\n%\n",
        "%\nG0 X1\n% foo\nM2\n",
        "F9 G2 X1 I1 P0\nM2",
        "F9 G2 X1 I1 P1.5\nM2",
        "G61 P1\nM2",
        "F60\nG94\nG1 X1\nM2",
        "F60 G1 X1\nG94 G90\nX2\nM2",
        "G1\nF5 X1\nM2",
        "M8 M9\nM2",
        "M7 M8\nM2",
    ],
)
def test_what_they_refuse_we_refuse(text: str, tmp_path: Path) -> None:
    ours, theirs = judged(text, tmp_path)
    assert (ours, theirs) == (False, False)


@pytest.mark.parametrize("length", [252, 253])
def test_their_longest_line_is_ours(length: int, tmp_path: Path) -> None:
    text = f"G21\nG0 X1 ({'a' * (length - 8)})\nM2"
    ours, theirs = judged(text, tmp_path)
    assert ours == theirs == (length == 252)


def test_the_referee_can_fail(tmp_path: Path) -> None:
    path = ToolpathBuilder().rapid(1.0, 2.0).event(Kind.END).finish()
    with pytest.raises(AssertionError):
        compare(path, b"G0 X1 Y2.001\nM2", tmp_path)
    with pytest.raises(AssertionError):
        compare(path, b"F10 G1 X1 Y2\nM2", tmp_path)
