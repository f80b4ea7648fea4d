"""grbl's programs as its parser takes them: frames, homes, planes, lengths of tools, jogs, feeds
of inverse time. What it refuses, and by which error, stands in `gcode/test_read.py`."""

import numpy as np
import pytest
from camtool_postprocessors.grbl.controller import stops_of
from camtool_postprocessors.grbl.findings import PLACE_UNKNOWN
from camtool_postprocessors.grbl.parser import WHY

from camtool.errors import ProgramError
from camtool.findings import Severity
from camtool.target.registry import load_target
from camtool.toolpath.moves import Kind, Toolpath


def read(text: str, *settings: str) -> Toolpath:
    target = load_target("grbl", settings=settings)
    path: Toolpath = target.target.read(text.encode(), target.machine)
    return path


def ends(text: str, *settings: str) -> list[tuple[float, ...]]:
    path = read(text, *settings)
    return [tuple(row) for row in path.end[path.is_motion].round(9).tolist()]


def said(path: Toolpath) -> list[tuple[str, Severity]]:
    return [(finding.code.name, finding.severity) for finding in path.findings]


def test_offsets_move_the_frame() -> None:
    assert ends("G0 X1\nG92 X0\nX5\nG92.1\nX5") == [(1, 0, 0), (6, 0, 0), (5, 0, 0)]
    assert ends("G92 X10\nG0 X12") == [(12, 0, 0)]  # part zero is that of the first move
    assert ends("G0 X1\nG92 X3\nG20 X1") == [(1, 0, 0), (23.4, 0, 0)]


def test_frames() -> None:
    path = read("G54 G0 X1\nG55 X2\n")
    (finding,) = path.findings
    assert (finding.code, finding.severity) == (PLACE_UNKNOWN, Severity.ERROR)
    assert finding.where == "block 2"
    offsets = "dialect.work_offsets_mm={G54=[10,0,0], G55=[30,5,0]}"
    assert ends("G54 G0 X1\nG55 X2 Y0", offsets) == [(1, 0, 0), (22, 5, 0)]
    assert ends("G0 X1\nG10 L20 P2 X0 Y0 Z0\nG55 X5") == [(1, 0, 0), (6, 0, 0)]
    assert said(read("G0 X1\nG10 L20 P2 X0 Y0 Z0\nG55 X5")) == []


def test_homes_and_machine_coordinates() -> None:
    path = read("G0 X1 Z2\nG28 Z5\n")
    assert path.end.tolist() == [[1, 0, 2], [1, 0, 5], [1, 0, 0]]
    assert said(path) == [("grbl.PLACE_UNKNOWN", Severity.WARNING)]
    assert ends("G28", "dialect.homes_mm={G28=[4,5,6]}") == [(4, 5, 6)]
    zero = "controller.machine_zero_mm=[-5,0,7]"
    assert ends("G28", zero, "dialect.homes_mm={G28=[4,5,6]}") == [(-1, 5, 13)]
    assert ends("G0 X1\nG53 X10 Y2", zero) == [(1, 0, 0), (5, 2, 0)]
    assert ends("G0 X1\nG28.1\nX9\nG28 X20") == [(1, 0, 0), (9, 0, 0), (20, 0, 0), (1, 0, 0)]


def test_the_length_of_a_tool_leaves_its_tip_where_it_is_programmed() -> None:
    assert ends("G0 Z5\nG43.1 Z2\nZ5\nG53 G1 F9 Z1\nG49\nG0 Z3") == [
        (0, 0, 5),
        (0, 0, 5),
        (0, 0, -1),
        (0, 0, 3),
    ]


def test_arcs_of_other_planes_are_chords() -> None:
    path = read("F90 G18 G2 X10 Z0 I5\n")
    np.testing.assert_allclose(np.hypot(path.end[:, 0] - 5, path.end[:, 2]), 5, atol=1e-9)
    assert path.end[-1].tolist() == [10, 0, 0]
    assert path.kind.tolist() == [Kind.LINE] * len(path)
    assert said(path) == [("grbl.NOT_SIMULATED", Severity.INFO)]


def test_a_dwell_and_a_move_in_one_block() -> None:
    path = read("G4 P0.5 X1\n")
    assert path.kind.tolist() == [Kind.DWELL, Kind.RAPID]


def test_inverse_time() -> None:
    path = read("G93\nG1 X10 F2\nG3 X10 Y10 J5 F1\nG94\nG1 X0 F50\n")
    assert path.feed.tolist() == pytest.approx([20.0, 5.0 * np.pi, 50.0])


def test_jogs_change_no_mode() -> None:
    path = read("G0 X1\n$J=G91 G21 X2 F30\nX5\n")
    assert path.kind.tolist() == [Kind.RAPID, Kind.LINE, Kind.RAPID]
    assert path.end[:, 0].tolist() == [1, 3, 5]
    assert said(path) == [("grbl.NOT_SIMULATED", Severity.WARNING)]


def test_what_grbl_does_otherwise_than_it_looks() -> None:
    path = read("/G0 X1\nG0 Y1 (hold!)\n")
    assert len(path) == 2
    assert said(path) == [("grbl.NOT_SIMULATED", Severity.WARNING)] * 2


def kinds(text: str, *settings: str) -> list[str]:
    return [Kind(kind).name for kind in read(text, *settings).kind if kind > Kind.ARC_CCW]


@pytest.mark.parametrize(
    ("lines", "stops"),
    [
        ("M3 S9|G1 X1 F99|M3|X2|M3 S9|X3|S9|X4", 0),
        ("M5|G1 X1 F99|M5 S3|X2|G54|X3|G49|X4|M1|X5|M9|X6", 0),
        ("M3 S9|G1 X1 F99|S8|X2 S7|M4|X3|M4 S7|X4|M5|X5", 3),
        ("M8|G1 X1 F99|M8|X2|M9|X3|M9|X4", 1),
    ],
)
def test_what_says_nothing_new_stops_nothing(lines: str, stops: int) -> None:
    target = load_target("grbl", settings=("coolant.flood=true",))
    path = target.target.read(lines.replace("|", "\n").encode(), target.machine)
    moves = np.flatnonzero(path.is_motion)
    waits = np.cumsum(stops_of(path, target.machine.controller).rows)[moves]
    assert np.count_nonzero(np.diff(waits)) == stops


@pytest.mark.parametrize(
    "line", ["M0", "G55", "G92 X1", "G92.1", "G10 L2 P3 X1", "G28.1", "G43.1 Z1"]
)
def test_where_grbl_waits_for_its_buffer_the_machine_stops(line: str) -> None:
    known = "dialect.work_offsets_mm={G54=[0,0,0], G55=[0,0,0]}"
    path = read(f"G0 X1\n{line}\nG0 X2\n", known)
    assert path.kind.tolist() == [Kind.RAPID, Kind.DWELL, Kind.RAPID]
    assert path.value[1] == 0.0


def test_laser_mode() -> None:
    """Power that comes with a move does not stop it; what grbl does at once is behind a stop."""
    laser = "controller.laser_mode=true"
    head = "M3 S9\nG1 X1 F99\n"
    assert kinds(head + "X2 S8\nG0 X3 S7", laser) == ["SPINDLE_CW"] * 3
    assert kinds(head + "S8", laser) == ["SPINDLE_CW", "DWELL", "SPINDLE_CW"]
    assert kinds(head + "G0\nG1\nG0 X1\nG1 X2", laser) == ["SPINDLE_CW", "DWELL", "DWELL"]
    assert kinds(head.replace("M3", "M4") + "G0\nG1\nX5", laser) == ["SPINDLE_CCW"]
    assert kinds(head + "G28 X1 S5", laser) == ["SPINDLE_CW", "DWELL", "SPINDLE_CW"]


def test_every_error_is_grbl_s_own() -> None:
    assert set(WHY) <= set(range(1, 39))
    with pytest.raises(ProgramError, match=r"\(error:25\)") as caught:
        read("N7 G0 X1 X2\n")
    assert caught.value.where == "block 1, line 1, column 10"
