"""LinuxCNC's programs, as they are read: subs and their files, frames, tools, compensation,
splines, findings, and the bounds of programs that never end. `test_language` compares with
LinuxCNC."""

import math
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from camtool_postprocessors.linuxcnc import findings as said
from camtool_postprocessors.linuxcnc.splines import pieces_of
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import ProgramError
from camtool.findings import Severity
from camtool.pipeline import read_program
from camtool.target.registry import load_target
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Kind, Toolpath


def read(text: str, *settings: str, folder: Path | None = None) -> Toolpath:
    target = load_target("linuxcnc", settings=settings)
    return target.target.read_in(text.encode(), target.machine, folder)


def ends(text: str, *settings: str) -> list[tuple[float, ...]]:
    path = read(text + "\nM2\n", *settings)
    return [tuple(row) for row in path.end[path.is_motion].round(9).tolist()]


def test_parameters_and_expressions() -> None:
    assert ends("#1=2 #2=[#1*3]\nG0 X#1 Y#2\n#1=5 X#1\nX[#1+#[#1-4]]") == [
        (2, 0, 0),  # a line's settings hold behind it
        (2, 0, 0),
        (10, 0, 0),
    ]
    assert ends("#<r>=4\nG0 X[#<r>**2/8] Y[fix[2*sin[30]]] Z-[2**3**2]") == [(2, 1, -64)]
    assert ends("G0 X[exists[#<a>]] #<a>=1\nY[exists[#<a>]]") == [(0, 0, 0), (0, 1, 0)]


def test_branches_and_loops() -> None:
    assert ends("#1=0\no1 while [#1 lt 3]\n#1=[#1+1]\nG0 X#1\no1 endwhile") == [
        (1, 0, 0),
        (2, 0, 0),
        (3, 0, 0),
    ]
    assert ends("o1 if [1 gt 2]\nG0 X1\no1 elseif [2 gt 1]\nG0 X2\no1 else\nG0 X3\no1 endif") == [
        (2, 0, 0)
    ]
    assert len(ends("o1 repeat [4]\nG91 G0 X1\no1 endrepeat")) == 4


SLOT = "o<slot> sub\nG0 X#1 Y#2\no<slot> endsub [#1+#2]\n"


def test_a_sub_in_the_program_and_its_value() -> None:
    path = read(f"{SLOT}o<slot> call [3] [4]\nG0 Z#<_value>\nM2\n")
    assert path.end[0].tolist() == [3, 4, 0]
    assert path.end[1].tolist() == [3, 4, 7]
    assert path.block.tolist() == [1, 4, 5]
    assert [path.text(row) for row in range(3)] == ["o<slot> called in line 4", "", ""]


def test_a_sub_in_a_file_of_the_folder(tmp_path: Path) -> None:
    (tmp_path / "slot.ngc").write_text(SLOT)
    text = "G0 Z5\no<slot> call [3] [4]\nM2\n"
    path = read(text, folder=tmp_path)
    assert path.end[:2].tolist() == [[0, 0, 5], [3, 4, 5]]
    assert path.block.tolist() == [0, 1, 2]
    assert path.text(1) == "slot.ngc: o<slot> called in line 2"
    program = tmp_path / "main.ngc"
    program.write_text(text)
    run = read_program(text.encode(), load_target("linuxcnc"), source=str(program))
    assert run.decoded is not None
    assert len(run.decoded) == len(path)


def test_a_fault_names_the_call_and_the_file(tmp_path: Path) -> None:
    (tmp_path / "slot.ngc").write_text("o<slot> sub\nG1 X#1\no<slot> endsub\n")
    with pytest.raises(ProgramError, match="no feed yet") as caught:
        read("o9 sub\no<slot> call [1]\no9 endsub\no9 call\nM2\n", folder=tmp_path)
    assert caught.value.where == (
        "file slot.ngc, line 2, column 1, in o<slot> called in line 2, o<9> called in line 4"
    )


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ("o<nowhere> call", "there is no sub o<nowhere>"),
        ("o<../outside> call", "outside of the program's folder"),
        ("o</etc/passwd> call", "outside of the program's folder"),
        ("o<link> call", "outside of the program's folder"),
        ("o<folder> call", "there is no sub o<folder>"),
        ("o<empty> call", "there is no sub o<empty>"),
    ],
)
def test_what_is_no_file_of_a_sub(call: str, message: str, tmp_path: Path) -> None:
    home = tmp_path / "home"
    home.mkdir()
    (tmp_path / "outside.ngc").write_text("o<outside> sub\nG0 X1\no<outside> endsub\n")
    (home / "link.ngc").symlink_to(tmp_path / "outside.ngc")
    (home / "folder.ngc").mkdir()
    (home / "empty.ngc").write_text("")
    with pytest.raises(ProgramError, match=message) as caught:
        read(f"G0 X1\n{call}\nM2\n", folder=home)
    assert "line 2" in str(caught.value.where)


ENDLESS = {
    "while": "o1 while [1]\no1 endwhile\n",
    "moves": "F9\no1 while [1]\nG1 X1\nX2\no1 endwhile\n",
    "do": "o1 do\no1 while [1]\n",
    "repeat": "o1 repeat [1000000000]\nG0 X1\no1 endrepeat\n",
    "call": "o1 sub\no1 call\no1 endsub\no1 call\n",
    "calls": "o1 sub\no2 call\no1 endsub\no2 sub\no1 call\no2 endsub\no1 call\n",
    "turns": "F9\no1 while [1]\nG2 I1 P10000\no1 endwhile\n",
    "cycle": "F9 G91 G81 X1 Z-1 R1 L1000000000\n",
    "pecks": "F9 G83 X1 Z-1 R1 Q0.0000001\n",
    "cycles": "F9\no1 while [1]\nG81 X1 Z-1 R1 L9000\nG80\no1 endwhile\n",
    "peckings": "F9\no1 while [1]\nG83 X1 Z-1 R1 Q0.001\nG80\no1 endwhile\n",
    "beside": "F9 G42.1 D1\no1 while [1]\nG1 X1\nY1\nX0\nY0\no1 endwhile\n",
    "chords": "G18 F9\no1 while [1]\nG2 I9999 K0 P100\no1 endwhile\n",
    "thread": "M3 S9 G76 P1 Z-1 I-1 J0.0000001 K1\n",
}
BOUNDS = "more than|calls within calls"


@pytest.mark.parametrize("kind", ENDLESS)
def test_a_program_without_end_is_stopped(kind: str) -> None:
    with pytest.raises(ProgramError, match=BOUNDS):
        read(ENDLESS[kind] + "M2\n", "dialect.most_lines=20000")


@pytest.mark.parametrize("kind", ["cycles", "peckings", "beside"])
def test_what_takes_longer_counts_as_more_lines(kind: str) -> None:
    with pytest.raises(ProgramError, match="more than 20000 lines"):
        read(ENDLESS[kind] + "M2\n", "dialect.most_lines=20000")


def test_the_bound_of_lines_is_for_those_that_are_interpreted() -> None:
    text = "F9\n" + "G1 X1\nX2 Y3\n" * 500 + "M2\n"
    assert len(read(text, "dialect.most_lines=20")) == 1001


def codes(path: Toolpath) -> list[tuple[str, Severity]]:
    return [(finding.code.name, finding.severity) for finding in path.findings]


def test_frames_that_the_program_places() -> None:
    text = "G54 G0 X1 Y0\nG10 L20 P2 X0 Y0 Z0\nG55 G0 X5\nG10 L2 P2 R90\nX7 Y0\nM2\n"
    path = read(text)
    assert path.end[path.is_motion].round(9).tolist() == [[1, 0, 0], [6, 0, 0], [1, 7, 0]]
    assert codes(path) == []


def test_frames_that_only_the_machine_knows() -> None:
    path = read("G54 G0 X1\nG55 X2\nM2\n")
    (finding,) = path.findings
    assert (finding.code, finding.severity) == (said.PLACE_UNKNOWN, Severity.ERROR)
    assert finding.where == "block 2"
    known = "dialect.work_offsets_mm={G54=[10,0,0], G55=[30,5,0,90]}"
    path = read("G54 G0 X1\nG55 X2 Y0\nM2\n", known)
    assert path.end[path.is_motion][1].round(9).tolist() == [20, 7, 0]
    assert path.findings == ()


@pytest.mark.parametrize(
    ("words", "waits"),
    [
        *((word, True) for word in ("G55", "G92 X1", "G92.1", "G52 X1", "G43 H1", "G49")),
        *((word, True) for word in ("G10 L2 P1 X1", "M8", "M64 P0", "M68 E0 Q1", "M66 P0")),
        *((word, False) for word in ("G54", "G10 L2 P2 X1", "M62 P0", "M67 E0 Q1", "G20")),
    ],
)
def test_the_machine_rests_before_what_changes_where_it_is(words: str, waits: bool) -> None:
    """LinuxCNC's task waits for the motion before it sets an offset or switches coolant or an
    output: the corner there is not rounded (emcTaskCheckPreconditions)."""
    path = read(f"F9 G1 X1\n{words}\nG1 Y1\nM2\n", "dialect.work_offsets_mm={G55=[1,0,0]}")
    assert (Kind.DWELL in path.kind.tolist()) == waits
    alone = read(f"{words}\n{words}\nF9 G1 X1\nM2\n", "dialect.work_offsets_mm={G55=[1,0,0]}")
    assert Kind.DWELL not in alone.kind.tolist()


def test_offsets_move_the_frame() -> None:
    assert ends("G0 X1\nG92 X0\nX5\nG92.1\nX5") == [(1, 0, 0), (6, 0, 0), (5, 0, 0)]
    assert ends("G92 X10\nG0 X12") == [(12, 0, 0)]  # part zero is that of the first move
    assert ends("G0 X1\nG52 X3\nX5\nG20 X1") == [(1, 0, 0), (8, 0, 0), (28.4, 0, 0)]


def test_homes() -> None:
    path = read("G0 X1 Z2\nG28 Z5\nM2\n")
    assert path.end[:3].tolist() == [[1, 0, 2], [1, 0, 5], [1, 0, 0]]
    assert codes(path) == [("linuxcnc.PLACE_UNKNOWN", Severity.WARNING)]
    path = read("G0 X1\nG28.1\nG0 X9\nG28\nM2\n")
    assert path.end[3].tolist() == [1, 0, 0]
    assert codes(path) == []
    path = read("G28\nM2\n", "dialect.homes_mm={G28=[4,5,6]}")
    assert path.end[1].tolist() == [4, 5, 6]


def test_tool_lengths_count_on_the_machine_alone() -> None:
    tools = "dialect.tools.1={length_mm=40, diameter_mm=6}"
    assert ends("T1 M6\nG43 G0 Z5\nG53 G0 X0 Z0", tools) == [(0, 0, 5), (0, 0, -40)]
    with pytest.raises(ProgramError, match="tool 2 is not in the tool table"):
        read("T2 M6\nM2\n", tools)


CUTS = "T1 M6\n{0}F9 G0 Z5\nG1 Z-1\nG0 Z5\nT2 M6\n{1}G0 Z5\nG1 Z-1\nG0 Z5\nM2\n"
TABLE = ("dialect.tools.1.length_mm=40", "dialect.tools.2.length_mm=55.5")


@pytest.mark.parametrize(
    ("lengths", "table", "severity", "block"),
    [
        (("G43 H1\n", "G43 H2\n"), (), None, 0),
        (("", ""), (), Severity.WARNING, 1),
        (("G43\n", ""), (), Severity.WARNING, 6),
        (("G43 H1\n", "G43 H1\n"), (), Severity.WARNING, 7),
        (("G43 H1\n", "G49\n"), (), Severity.WARNING, 7),
        (("G43.1 Z7\n", "G43.1 Z9\n"), (), None, 0),
        (("G43 H1\n", "G43 H2\n"), TABLE, None, 0),
        (("", ""), TABLE, Severity.ERROR, 5),
        (("G43\n", ""), TABLE, Severity.ERROR, 6),  # M6 leaves the length of tool 1 in force
        (("G43.1 Z30\n", "G43.1 Z45.5\n"), TABLE, None, 0),  # both 10 mm low
        (("", ""), [each.replace("55.5", "40") for each in TABLE], None, 0),
    ],
)
def test_tools_that_cut_without_their_length_are_found(
    lengths: tuple[str, str], table: tuple[str, ...], severity: Severity | None, block: int
) -> None:
    found = [
        each
        for each in read(CUTS.format(*lengths), *table).findings
        if each.code == said.TOOL_LENGTH
    ]
    assert [each.severity for each in found] == ([severity] if severity else [])
    assert all(each.where == f"block {block}" for each in found)
    assert not found or severity == Severity.WARNING or found[0].measured == 15.5


@pytest.mark.parametrize(
    ("second", "centre", "radius"),
    [("G3 X12 Y12 I0 J-8", (20.0, 12.0), 7.0), ("G2 X20 Y36 I0 J8", (20.0, 28.0), 9.0)],
)
def test_compensated_arcs_end_where_their_offsets_meet(
    second: str, centre: tuple[float, float], radius: float
) -> None:
    """A cutter 2 mm wide on the left, at X20 Y20, where the path turns left: the end of the first
    arc is on both offset circles, and of their two meetings the one at the corner."""
    path = read(f"F9\nG41.1 D2\nG1 X10 Y10\nG3 X20 Y20 I0 J10\n{second}\nG40 G1 X0\nM2\n")
    arcs = np.flatnonzero(path.is_arc)
    x, y = path.end[arcs[-2], :2].tolist()  # behind the small arc about X10 Y10
    assert math.dist((x, y), (10.0, 20.0)) == pytest.approx(9.0, abs=1e-9)
    assert math.dist((x, y), centre) == pytest.approx(radius, abs=1e-9)
    assert math.dist((x, y), (20.0, 20.0)) < 2.0


def test_compensated_arcs_about_one_centre_are_refused() -> None:
    with pytest.raises(ProgramError, match="about one centre"):
        read("F9\nG41.1 D2\nG1 X10 Y10\nG3 X20 Y20 I0 J10\nG2 X10 Y30 I-10 J0\nM2\n")


def test_an_input_of_the_machine_comes_at_once() -> None:
    text = "G0 X1\nM66 P0 L3 Q2\no1 if [#5399 eq 0]\nG0 X2\no1 endif\nM66 E1 L0\nM66 P2\nM2\n"
    path = read(text)
    assert path.end[path.is_motion, 0].tolist() == [1, 2]
    assert codes(path) == [("linuxcnc.NOT_SIMULATED", Severity.WARNING)]
    assert "3 blocks read an input" in str(path.findings[0])


@pytest.mark.parametrize("words", ["", "P-1", "P1 E1", "P1 L3", "P1 L3 Q0", "E1 L3 Q1", "E-1"])
def test_an_input_that_linuxcnc_refuses(words: str) -> None:
    with pytest.raises(ProgramError, match="M66"):
        read(f"M66 {words}\nM2\n")


def test_a_known_machine_zero_places_the_first_frame() -> None:
    """Though it is 0 on some axes: G55 is then where `work_offsets_mm` says."""
    zero = "controller.machine_zero_mm=[0,-2,0]"
    offset = "dialect.work_offsets_mm={G55=[7,0,0]}"
    path = read("G0 X1 Y1\nG55 G0 X1 Y1\nM2\n", zero, offset)
    assert path.end[path.is_motion].tolist() == [[1, 1, 0], [8, -1, 0]]
    assert codes(path) == []
    path = read("G0 X1 Y1\nG55 G0 X1 Y1\nM2\n", offset)
    assert codes(path) == [("linuxcnc.PLACE_UNKNOWN", Severity.ERROR)]


def test_one_tool_needs_no_length() -> None:
    assert codes(read("T1 M6\nF9 G1 Z-1\nT1 M6\nG1 X3\nT2 M6\nG0 X9\nM2\n")) == []


def test_other_findings() -> None:
    path = read("/G0 X1\nG0 X#100\nM62 P1\nG18 F9 G2 I5 K0\nA5 G0\nM2\n")
    names = [name for name, _ in codes(path)]
    assert names == [
        "WORDS_PASSED_OVER",
        "linuxcnc.NOT_SIMULATED",
        "linuxcnc.NOT_SIMULATED",
        "linuxcnc.NOT_SIMULATED",
        "linuxcnc.VALUE_UNKNOWN",
    ]
    assert path.findings[0].code == ProgramCode.WORDS_PASSED_OVER
    assert len(read("/G0 X1\nG0 Y1\nM2\n", "dialect.block_delete=true")) == 2


@given(
    radius=st.floats(0.1, 3.0),
    side=st.sampled_from((41, 42)),
    corners=st.lists(st.sampled_from((-150, -90, -40, 40, 90, 150)), min_size=1, max_size=3),
)
def test_the_cutter_goes_beside_the_path(radius: float, side: int, corners: list[int]) -> None:
    """Its centre is nowhere nearer to the programmed path than its radius, and as near at the
    middle of each line."""
    points, angle = [(0.0, 0.0)], 0.0
    for corner in [0, *corners]:
        angle += math.radians(corner)
        x, y = points[-1]
        points.append((x + 40 * math.cos(angle), y + 40 * math.sin(angle)))
    lines = [f"X{x:.6f} Y{y:.6f}" for x, y in points]
    text = f"F100 G0 X-20 Y0\nG{side}.1 D{2 * radius:.6f} G1 {lines[0]}\n" + "\n".join(lines[1:])
    path = read(f"{text}\nG40 G0 Z5\nM2\n")
    rows = np.flatnonzero(path.is_feed)[1:]
    way = 1.0 if side == 41 else -1.0
    for row in rows:
        begin, end = path.end[row - 1, :2], path.end[row, :2]
        if path.kind[row] != Kind.LINE:
            np.testing.assert_allclose(np.hypot(*(begin - path.centre[row])), radius, atol=1e-5)
            continue
        middle = (begin + end) / 2.0
        best = min(
            (_aside(middle, np.array(a), np.array(b), way) for a, b in pairwise(points)),
            key=lambda far: abs(far - radius),
        )
        assert best == pytest.approx(radius, abs=1e-4)


def _aside(point: np.ndarray, a: np.ndarray, b: np.ndarray, way: float) -> float:
    """Signed distance of a point from a line."""
    x, y = (b - a) / np.hypot(*(b - a))
    return float(way * (x * (point[1] - a[1]) - y * (point[0] - a[0])))


@given(
    st.lists(st.tuples(st.integers(-9, 9), st.integers(-9, 9), st.floats(0.3, 3.0)), min_size=4),
    st.integers(3, 4),
)
def test_arcs_of_a_spline_end_on_it(points: list[tuple[int, int, float]], order: int) -> None:
    """de Boor's algorithm in rational form, point by point, is the oracle."""
    control = [(float(x), float(y), w) for x, y, w in points[:9]]
    try:
        pieces = list(pieces_of(control, order))
    except Exception as fault:
        assert "turns back" in str(fault)  # noqa: PT017 - anything else is a failure
        return
    most = len(control) - order + 1
    count = 4 * len(control)
    wanted = [_de_boor(control, order, most * k / count) for k in range(1, count + 1)]
    found = [piece.end for piece in pieces[1::2]]
    np.testing.assert_allclose(found, wanted, atol=1e-9)


def _de_boor(
    control: list[tuple[float, float, float]], order: int, at: float
) -> tuple[float, float]:
    last = len(control) - 1
    knots = [min(max(k - order + 1, 0), last - order + 2) for k in range(last + order + 1)]
    span = max(k for k in range(order - 1, last + 1) if knots[k] <= at and knots[k] < knots[k + 1])
    d = [np.array([x * w, y * w, w]) for x, y, w in control[span - order + 1 : span + 1]]
    for r in range(1, order):
        for j in range(order - 1, r - 1, -1):
            low = knots[j + span - order + 1]
            share = (at - low) / (knots[j + 1 + span - r] - low)
            d[j] = (1.0 - share) * d[j - 1] + share * d[j]
    x, y, w = d[order - 1]
    return float(x / w), float(y / w)


def test_a_plain_program_loads_no_cycles_and_no_compensation() -> None:
    code = (
        "import sys\nfrom camtool.target.registry import load_target\n"
        "t = load_target('linuxcnc')\n"
        "t.target.read(b'G21 G90 F100\\nG0 X1\\nG1 Y2\\nG2 X-1 I-1\\nM2\\n', t.machine)\n"
        "parts = ('cycles', 'compensation', 'splines', 'modes', 'comments')\n"
        "print([p for p in parts if f'camtool_postprocessors.linuxcnc.{p}' in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"
