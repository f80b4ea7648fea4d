"""The sheets of coupons: within their size, on the machine's grid, with run-ups, two formats."""

from __future__ import annotations

import io
import tomllib
from collections import Counter
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.calibration.coupons import KINDS, CouponSheet, Kind, dxf, sheet, skeleton, svg
from camtool.calibration.coupons import SheetPath as Line
from camtool.calibration.measurements import read_measurements
from camtool.errors import InputError, OptionError
from camtool.geometry.measure import extents, path_lengths
from camtool.importers.read import read_drawing
from camtool.target.registry import load_target

SIDES = st.floats(2.0, 2000.0)


def straight(line: Line) -> np.ndarray:
    return np.array(line.vertices)[:, :2]


@given(kind=st.sampled_from(KINDS), width=SIDES, height=SIDES, columns=st.integers(1, 4))
def test_a_sheet_stays_within_its_size_or_is_refused(
    kind: Kind, width: float, height: float, columns: int
) -> None:
    regions = (columns, 2) if kind == "lines" else (1, 1)
    made = sheet(kind, (width, height), regions)
    for line in made.paths:
        points = straight(line)
        if line.vertices[0][2]:  # two half circles
            radius = 0.5 * np.linalg.norm(points[0] - points[1])
            points = points.mean(axis=0) + radius * np.array([[1.0, 1.0], [-1.0, -1.0]])
        assert (points > 0.0).all()
        assert (points < [width, height]).all()
    assert len(made.tables) == len(made.paths)


@pytest.mark.parametrize("kind", ["lines", "steps", "squares"])
def test_the_run_ups_take_up_the_play_from_either_end(kind: Kind) -> None:
    """The run-up to the first measured edge goes in + by more than play and compensation."""
    machine = load_target("flashcut").machine
    lost = max(machine.axes.x.compensation_mm, machine.axes.y.compensation_mm)
    for line, (_, table) in zip(*_parts(sheet(kind, (40.0, 45.0), machine=machine)), strict=True):
        both = (straight(line), straight(line)[::-1])
        for points in both:
            way = points[1] - points[0]
            axis = "xy".index(table.get("axis", "x")) if kind != "squares" else None
            if axis is not None:
                assert way[axis] > 2.0 * lost
                assert way[1 - axis] == 0.0
            else:  # + along X at one end, − along Y at the other
                assert way[0] > lost or way[1] < -lost


def _parts(
    made: CouponSheet,
) -> tuple[tuple[Line, ...], tuple[tuple[str, dict[str, object]], ...]]:
    return made.paths, made.tables


def test_lines_are_as_long_as_they_are_said_to_be() -> None:
    for line, (_, table) in zip(*_parts(sheet("lines", (10.0, 7.0), (3, 3))), strict=True):
        points = straight(line)
        assert np.linalg.norm(points[3] - points[2]) == pytest.approx(table["nominal_mm"])
        assert np.linalg.norm(points[5] - points[4]) == pytest.approx(table["nominal_mm"])
        assert (points[5] == points[2]).any()  # the marks are at one place of the axis


def test_rulers_have_their_marks_where_they_are_said_to_be() -> None:
    for line, (_, table) in zip(*_parts(sheet("steps", (60.0, 40.0))), strict=True):
        axis = "xy".index(str(table["axis"]))
        strokes = Counter(
            round(float(a[axis]), 6) for a, b in pairwise(straight(line)) if a[axis] == b[axis]
        )
        places = sorted(strokes)
        zero = places[0]
        assert places[1:11] == pytest.approx([zero + n for n in table["nominal_mm"]])  # type: ignore[attr-defined]
        assert [strokes[place] for place in places] == [2] * 11 + [1]  # and the far end


def test_regions_are_cells_of_the_table() -> None:
    made = sheet("lines", (9.0, 6.0), (3, 2))
    assert made.regions["x_mm"] == [0.0, 3.0, 6.0, 9.0]
    assert made.regions["y_mm"] == [0.0, 3.0, 6.0]
    assert made.regions["names"] == [["A1", "B1", "C1"], ["A2", "B2", "C2"]]
    for line, (_, table) in zip(*_parts(made), strict=True):
        column, row = ord(str(table["region"])[0]) - ord("A"), int(str(table["region"])[1]) - 1
        points = straight(line)
        assert (points > [3.0 * column, 3.0 * row]).all()
        assert (points < [3.0 * column + 3.0, 3.0 * row + 3.0]).all()
    assert sheet("lines", (9.0, 6.0)).regions == {}


def test_a_machine_of_coarse_places_gets_them(tmp_path: Path) -> None:
    machine = load_target("matlab-router").machine
    for kind in ("lines", "squares", "steps"):
        for line in sheet(kind, (50.0, 40.0), machine=machine).paths:  # type: ignore[arg-type]
            units = straight(line) / 0.2
            assert units == pytest.approx(np.round(units), abs=1e-6)


@pytest.mark.parametrize(
    ("kind", "size", "regions", "words"),
    [
        ("lines", (10.0, 7.0), (10, 1), "10x1 regions"),
        ("lines", (10.0, 7.0), (0, 1), "0x1 regions"),
        ("squares", (10.0, 7.0), (2, 1), "leave --regions out"),
        ("lines", (5.0, 3.5), (9, 9), "do not fit"),
        ("squares", (1.0, 0.7), (1, 1), "do not fit"),
    ],
)
def test_what_does_not_fit_is_refused(
    kind: Kind, size: tuple[float, float], regions: tuple[int, int], words: str
) -> None:
    with pytest.raises(OptionError, match=words):
        sheet(kind, size, regions, load_target("pic-mmh").machine)


@pytest.mark.parametrize("kind", KINDS)
def test_dxf_and_svg_are_the_sheet(kind: Kind, tmp_path: Path) -> None:
    made = sheet(kind, (60.0, 40.0))
    (tmp_path / "a.dxf").write_bytes(dxf(made))
    (tmp_path / "a.svg").write_bytes(svg(made))
    drawings = [read_drawing(tmp_path / name) for name in ("a.dxf", "a.svg")]
    for drawing in drawings:
        assert drawing.units.name == "mm"
        assert len(drawing.paths) == len(made.paths)
        for path, line in zip(drawing.paths, made.paths, strict=True):
            assert path.closed == line.closed
            assert path.vertices[:, :2] == pytest.approx(straight(line), abs=1e-6)
    one, other = drawings
    assert path_lengths(one.paths) == pytest.approx(path_lengths(other.paths), abs=1e-6)
    assert extents(one.paths) == pytest.approx(extents(other.paths), abs=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_the_same_bytes_come_every_time_and_nothing_is_to_be_repaired(kind: Kind) -> None:
    from ezdxf import recover

    made = sheet(kind, (60.0, 40.0))
    assert dxf(made) == dxf(made)
    document, auditor = recover.read(io.BytesIO(dxf(made)))
    assert [each.message for each in (*auditor.errors, *auditor.fixes)] == []
    assert document.units == 4


@pytest.mark.parametrize("kind", KINDS)
def test_the_file_to_fill_in_names_every_length(kind: Kind, tmp_path: Path) -> None:
    machine = load_target("pic-mmh").machine
    regions = (2, 2) if kind == "lines" else (1, 1)
    text = skeleton(sheet(kind, (20.0, 14.0), regions, machine), machine)
    file = tmp_path / "m.toml"
    file.write_text(text)
    assert tomllib.loads(text)["compensation_mm"] == {"x": 0.204, "y": 0.178}
    with pytest.raises(InputError, match="nothing was measured"):
        read_measurements(file)  # nothing in it is a measurement yet
    filled = {
        "lines": "first_mm",
        "squares": "dx_mm",
        "circles": "diameters_mm",
        "steps": "forward_mm",
    }
    for table in tomllib.loads(text)[kind]:
        nominal = table["nominal_mm"]
        key = filled[kind]
        assert key in table
        reading = {
            "lines": nominal,
            "squares": nominal[0] if kind == "squares" else None,
            "circles": [nominal] * 8,
            "steps": nominal,
        }[kind]
        old = f"nominal_mm = {nominal}"
        assert old in text
        text = text.replace(f"{key} = {table[key]}", f"{key} = {reading}", 1)
    file.write_text(text)
    said = read_measurements(file)
    assert len(said.coupons) == len(tomllib.loads(text)[kind])
    assert (said.regions.x is not None) == (kind == "lines")
