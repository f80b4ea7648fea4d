"""Drilling cycles: LinuxCNC's interpreter makes the moves that our reader makes of them, and the
holes that are written as cycles are those that were planned."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given
from hypothesis import strategies as st

from camtool.errors import ProgramError
from camtool.geometry.polylines import Polyline
from camtool.pipeline import post_drawing, verify_program
from camtool.planning.job import Job, Operation, Tool
from camtool.records import replace
from camtool.target.registry import load_target
from camtool.toolpath.moves import Kind, Toolpath
from tests.drawings import drawing_of
from tests.oracles.rs274 import PRINTED_MM, interpreted, motions, motions_of, needs_rs274
from tests.postprocessors.golden import GOLDEN, compare_golden
from tests.strategies import examples

HEAD = "G17 G21 G90 G94 F100\nG64 P0.01\n"


def read(text: str) -> Toolpath:
    target = load_target("linuxcnc")
    path: Toolpath = target.target.read(text.encode(), target.machine)
    return path


def moves(text: str) -> list[tuple[str, float, float, float]]:
    return [(each.kind.name, *each.end) for each in read(HEAD + text + "M2\n") if each.kind < 15]


def test_a_hole_and_the_next() -> None:
    assert moves("G0 Z5\nG98 G81 X1 Y2 Z-3 R1\nX4\nG80\n") == [
        ("RAPID", 0, 0, 5),
        ("RAPID", 1, 2, 5),
        ("RAPID", 1, 2, 1),
        ("LINE", 1, 2, -3),
        ("RAPID", 1, 2, 5),
        ("RAPID", 4, 2, 5),
        ("RAPID", 4, 2, 1),
        ("LINE", 4, 2, -3),
        ("RAPID", 4, 2, 5),
    ]


def test_a_wait_and_pecks() -> None:
    path = read(HEAD + "G0 Z2\nG99 G82 X1 Z-1 R2 P0.5\nG83 X2 Z-2 R1 Q1.5\nG80\nG0 Z5\nM2\n")
    assert [(each.kind.name, each.value) for each in path if each.value is not None] == [
        ("DWELL", 0.5)
    ]
    assert [each.end[2] for each in path if each.end[0] == 2] == pytest.approx(
        [2, 1, -0.5, 1, -0.246, -2, 1, 5, 5]
    )
    cycle = path.mode[path.end[:, 0] > 0]
    assert path.modes[int(cycle[0])].corners == "exact-path"
    assert path.modes[int(path.mode[-2])].corners == "blend"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("G81 X1 Z-1\n", "without the height R"),
        ("G81 X1 R1\n", "without the depth Z"),
        ("G82 X1 Z-1 R1\n", "without the dwell P"),
        ("G83 X1 Z-1 R1\n", "without the depth of a peck, Q"),
        ("G83 X1 Z-1 R1 Q0\n", "not above 0"),
        ("G82 X1 Z-1 R1 P-1\n", "below 0 s"),
        ("G81 X1 Z-1 R-2\n", "lies below Z"),
        ("G81 R1\n", "G81 without coordinates"),
        ("G81 X1 Z-1 R1 P2\n", "nothing in the block uses the P word"),
        ("G81 X1 Z-1 R1 L0\n", "repeated 0 times"),
        ("G81 X1 Z-1 R1 L500\n", "with the repeats of this cycle"),
        ("G81 X1 Z-1 R1\nR3\n", "nothing in the block uses the R word"),
        ("G81 X1 Z-1 R1\nG80\nG81 X2 Z-1\n", "without the height R"),
        ("G81 X1 Z-1 R1\nG0 X3\nG81 X2 Z-1\n", "without the height R"),
        ("G94\nG81 X1 Z-1 R1\n", "no feed"),
        ("G83 X1 Z-1 R1 Q1e-9\n", "E"),
        ("G83 X1 Z-9 R1 Q0.000001\n", "with its pecks"),
    ],
)
def test_what_is_no_cycle(text: str, words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("camtool.bounds.MAX_MOVES", 1000)
    with pytest.raises(ProgramError, match=words):
        read(HEAD + text + "M2\n")


def test_grbl_knows_no_cycles() -> None:
    target = load_target("grbl")
    with pytest.raises(ProgramError, match="G81 is unknown to grbl"):
        target.target.read(b"G81 X1 Z-1 R1 F9\nM2\n", target.machine)


@st.composite
def series(draw: st.DrawFn) -> str:
    """Cycles and plain moves of all sorts, in mm or inches."""
    number = st.integers(-60, 60).map(lambda tenths: f"{tenths / 10:g}")
    text = [f"{draw(st.sampled_from(['G20', 'G21']))} G90 G94 F50", f"G0 Z{draw(number)}"]
    for _ in range(draw(st.integers(1, 8))):
        what = draw(st.sampled_from(["G81", "G82", "G83", "again", "G0", "mode", "G80"]))
        words = draw(st.lists(st.sampled_from("XY"), unique=True))
        place = [f"{axis}{draw(number)}" for axis in words]
        if what == "again":
            text.append(" ".join(place))
        elif what == "mode":
            text.append(draw(st.sampled_from(["G98", "G99"])))
        elif what == "G80":
            text.append(what)
        elif what == "G0":
            text.append(f"G0 {' '.join(place)} Z{draw(number)}")
        else:
            depth = draw(st.integers(-60, 30))
            height = depth + draw(st.integers(0, 60))
            more = {"G81": "", "G82": "P0.25", "G83": f"Q{draw(st.integers(5, 40)) / 10:g}"}[what]
            text.append(f"{what} {' '.join(place)} Z{depth / 10:g} R{height / 10:g} {more}")
    return "\n".join([*text, "G80", "M2", ""])


def square(side: float) -> Polyline:
    corners = [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side)]
    return Polyline(np.array([(*corner, 0.0) for corner in corners]), closed=True)


def circle(x: float, y: float) -> Polyline:
    return Polyline(np.array([[x + 1.0, y, 1.0], [x - 1.0, y, 1.0]]), closed=True)


PLACES = [(8.0, 8.0), (20.0, 8.0), (20.0, 20.0), (9.0, 31.5)]
DRAWING = drawing_of([square(40.0), *(circle(x, y) for x, y in PLACES)])
DRILL = Tool(2.0, "drill", math.radians(118.0), number=2)
CYCLES = ("dialect.canned_cycles=true", "defaults.feed_z_mm=2")


def job(**hole: float) -> Job:
    bore = Operation("drill", "holes", tool=DRILL, depth_mm=4.0, plunge_feed_mm_min=90.0, **hole)
    edge = Operation(tool=Tool(3.0, number=1), select=("outer",), depth_mm=2.0, side="outside",
                     feed_mm_min=90.0, plunge_feed_mm_min=90.0)  # fmt: skip
    return Job((bore, edge), safe_z_mm=5.0)


def blocks(job: Job, *given: str) -> list[str]:
    run = post_drawing(DRAWING, job, load_target("linuxcnc", settings=[*CYCLES, *given]))
    assert not run.failed
    lines = run.data.decode().splitlines()
    return [line for line in lines if not line.startswith("(")]


@pytest.mark.parametrize(
    ("hole", "cycle"),
    [
        ({}, "G98 G81 X8.000 Y8.000 Z-4.000 R2.000 F90"),
        ({"dwell_s": 0.5}, "G98 G82 X8.000 Y8.000 Z-4.000 R2.000 P0.5 F90"),
        ({"peck_mm": 1.5}, "G98 G83 X8.000 Y8.000 Z-4.000 R2.000 Q1.333 F90"),
    ],
)
def test_holes_are_drilled_by_cycles(hole: dict[str, float], cycle: str) -> None:
    lines = blocks(job(**hole))
    at = lines.index(cycle)
    places = ["X20.000 Y8.000", "X20.000 Y20.000", "X9.000 Y31.500"]
    assert lines[at + 1 : at + 5] == [*places, "G80"]
    # What follows says its motion and both coordinates again.
    rest = lines[at + 5 :]
    across = next(line for line in rest if "X" in line)
    assert re.match(r"(G0 )?X\S+ Y\S+", across)
    assert any(line.startswith("G1 Z") for line in rest)


def test_another_feed_is_said_again_behind_cycles() -> None:
    """The same feed before and behind the holes, which are drilled at another one."""
    made = job()
    mill = replace(made.operations[1], tool=DRILL)
    bore = replace(made.operations[0], plunge_feed_mm_min=70.0)
    lines = blocks(replace(made, operations=(mill, bore, mill)))
    at = lines.index("G80")
    assert next(line for line in lines[at:] if line.startswith("G1")).endswith("F90")


def test_a_hole_with_a_wait_and_pecks_waits() -> None:
    lines = blocks(job(peck_mm=1.5, dwell_s=0.25))
    assert "G4 P0.25" in lines
    assert not any("G83" in line or "G82" in line for line in lines)


@st.composite
def hole_jobs(draw: st.DrawFn) -> tuple[Job, list[str]]:
    """Holes of any depth, peck and dwell, in mm or inches, with places for rapids to end."""
    depth = draw(st.floats(0.3, 12.0).map(lambda mm: round(mm, 3)))
    hole: dict[str, float] = {"depth_mm": depth}
    if draw(st.booleans()):
        hole["peck_mm"] = draw(st.floats(0.2, 5.0))
    if draw(st.booleans()):
        hole["dwell_s"] = 0.5
    made = job()
    bore = replace(made.operations[0], **hole)
    given = [f"dialect.units={draw(st.sampled_from(['mm', 'in']))}"]
    given += ["defaults.feed_z_mm=5"] if draw(st.booleans()) else []
    return replace(made, operations=(bore, made.operations[1])), given


@examples(15, 500)
@given(case=hole_jobs())
def test_cycles_drill_the_same_holes(case: tuple[Job, list[str]]) -> None:
    """To the same bottom at the same feed, in bites that are no deeper; and nothing else."""
    wanted, given = case
    target = load_target("linuxcnc", settings=[*CYCLES, *given])
    run = post_drawing(DRAWING, wanted, target)
    assert not run.failed
    bore = wanted.operations[0]
    bite = bore.peck_mm or 100.0
    assert run.decoded is not None
    path, unit = run.decoded, 25.4e-5 if "dialect.units=in" in given else 1e-3
    starts = path.starts
    for x, y in PLACES:
        here = np.hypot(path.end[:, 0] - x, path.end[:, 1] - y) < 2.0 * unit
        cut = here & path.is_feed
        assert path.end[here, 2].min() == pytest.approx(-float(bore.depth_mm or 0.0), abs=unit)
        assert (np.abs(path.feed[cut] - 90.0) < 0.03).all()
        deepest = np.minimum(np.minimum.accumulate(np.append(0.0, path.end[cut, 2]))[:-1], 0.0)
        assert (deepest - path.end[cut, 2] <= bite + 2.0 * unit).all()
        waits = here & (path.kind == Kind.DWELL)
        assert path.value[waits].sum() == bore.dwell_s
        # Rapids go down only into air: above the stock or where it was drilled already.
        low = starts[cut, 2]
        assert (low >= np.append(0.0, path.end[cut, 2])[:-1] - 1e-9).all()
    again = verify_program(run.data, target, source="a.ngc", drawing=DRAWING, job=wanted)
    assert not again.failed, again.findings


def test_a_shallower_cycle_is_found() -> None:
    target = load_target("linuxcnc", settings=list(CYCLES))
    run = post_drawing(DRAWING, job(), target)
    wrong = run.data.replace(b"Z-4.000 R2.000", b"Z-3.000 R2.000")
    assert wrong != run.data
    assert verify_program(wrong, target, source="a.ngc", drawing=DRAWING, job=job()).failed


@pytest.mark.parametrize("units", ["mm", "in"])
def test_program(units: str, bless: bool) -> None:
    given = [*CYCLES, f"dialect.units={units}", "dialect.comments=operations"]
    target = load_target("linuxcnc", settings=given)
    run = post_drawing(DRAWING, job(peck_mm=1.5), target, check=False)
    compare_golden(GOLDEN / f"linuxcnc-cycles-{units}.ngc", run.data, bless=bless)


class TestReferee:
    pytestmark = needs_rs274

    @pytest.mark.parametrize("hole", [{}, {"dwell_s": 0.5}, {"peck_mm": 1.5}])
    def test_our_cycles(self, hole: dict[str, float], tmp_path: Path) -> None:
        target = load_target("linuxcnc", settings=list(CYCLES))
        data = post_drawing(DRAWING, job(**hole), target, check=False).data
        theirs = motions(interpreted(data, tmp_path))
        ours = motions_of(target.target.read(data, target.machine))
        np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=PRINTED_MM)
        # Without pecks these are the very moves that were planned.
        plain = load_target("linuxcnc", settings=["defaults.feed_z_mm=2"])
        planned = post_drawing(DRAWING, job(**hole), plain, check=False)
        if "peck_mm" not in hole:
            np.testing.assert_allclose(
                theirs, motions(interpreted(planned.data, tmp_path)), rtol=1e-6, atol=PRINTED_MM
            )

    @examples(50, 2000, suppress_health_check=[HealthCheck.function_scoped_fixture])
    @given(text=series())
    def test_the_moves_are_theirs(self, text: str, tmp_path: Path) -> None:
        try:
            theirs = motions(interpreted(text.encode(), tmp_path))
        except ProgramError:
            with pytest.raises(ProgramError):
                read(text)
            return
        ours = motions_of(read(text))
        assert ours[:, 0].tolist() == theirs[:, 0].tolist()
        inch = 25.4 if "G20" in text else 1.0
        np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=PRINTED_MM * inch)
