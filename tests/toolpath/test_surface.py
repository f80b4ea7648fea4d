"""Toolpaths that follow a measured surface, against dense samples of moves and surface."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.arrays import Floats
from camtool.errors import InputError, PostError
from camtool.findings import Severity
from camtool.pipeline import convert_program
from camtool.records import replace
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Kind, Toolpath, read_only
from camtool.toolpath.surface import (
    Surface,
    filled,
    follow,
    surface_error,
    surface_of_text,
    text_of_surface,
)
from tests.strategies import examples

TOLERANCE_MM = 0.002


def height_at(surface: Surface, x: float, y: float) -> float:
    """The bilinear height, written out."""
    i = max(k for k in range(len(surface.x) - 1) if k == 0 or surface.x[k] <= x)
    j = max(k for k in range(len(surface.y) - 1) if k == 0 or surface.y[k] <= y)
    u = (x - surface.x[i]) / (surface.x[i + 1] - surface.x[i])
    v = (y - surface.y[j]) / (surface.y[j + 1] - surface.y[j])
    z = surface.z
    return float(
        (1 - u) * (1 - v) * z[j, i]
        + u * (1 - v) * z[j, i + 1]
        + (1 - u) * v * z[j + 1, i]
        + u * v * z[j + 1, i + 1]
    )


def sampled(path: Toolpath) -> list[tuple[float, float, float]]:
    """Places on all cuts, dense, each move by itself."""
    found = []
    for move in path:
        if move.kind not in (Kind.LINE, Kind.ARC_CW, Kind.ARC_CCW):
            continue
        (x0, y0, z0), (x1, y1, z1) = move.start, move.end
        for k in range(41):
            t = k / 40
            x, y = x0 + t * (x1 - x0), y0 + t * (y1 - y0)
            if move.centre is not None:
                cx, cy = move.centre
                a0, a1 = math.atan2(y0 - cy, x0 - cx), math.atan2(y1 - cy, x1 - cx)
                sense = 1.0 if move.kind == Kind.ARC_CCW else -1.0
                turn = math.fmod(sense * (a1 - a0), 2 * math.pi)
                turn += 2 * math.pi if turn <= 1e-12 else 0.0
                r = math.hypot(x0 - cx, y0 - cy)
                angle = a0 + sense * t * turn
                x, y = cx + r * math.cos(angle), cy + r * math.sin(angle)
            found.append((x, y, z0 + t * (z1 - z0)))
    return found


def random_surface(seed: int, nodes: int) -> Surface:
    some = np.random.default_rng(seed)
    x = np.sort(some.uniform(-1.0, 31.0, nodes - 2))
    x = np.concatenate([[-20.0], x, [60.0]])
    y = np.concatenate([[-20.0], np.sort(some.uniform(-1.0, 31.0, nodes - 2)), [60.0]])
    return Surface(x, y, some.normal(0.0, 0.2, (nodes, nodes)))


def random_path(seed: int) -> Toolpath:
    some = np.random.default_rng(seed)
    builder = ToolpathBuilder().rapid(0.0, 0.0, 5.0).line(0.0, 0.0, -1.0, feed=100.0)
    x, y = 0.0, 0.0
    for _ in range(8):
        nx, ny = some.uniform(0.0, 30.0, 2).tolist()
        if some.random() < 0.5:
            builder.line(nx, ny, feed=100.0)
        else:
            # A centre on the middle perpendicular of both ends.
            by = some.uniform(-0.4, 0.4)
            cx, cy = 0.5 * (x + nx) - by * (ny - y), 0.5 * (y + ny) + by * (nx - x)
            builder.arc(nx, ny, centre=(cx, cy), ccw=some.random() < 0.5, feed=100.0)
        x, y = nx, ny
    return builder.rapid(z=5.0).rapid(0.0, 0.0).finish()


@examples(40)
@given(seed=st.integers(0, 2**32), nodes=st.integers(2, 9))
def test_cuts_keep_their_depth_below_the_surface(seed: int, nodes: int) -> None:
    surface, path = random_surface(seed, nodes), random_path(seed)
    warped = follow(path, surface, TOLERANCE_MM)
    wanted = {(round(x, 6), round(y, 6)) for x, y, _ in sampled(path)}
    assert wanted
    first = next(k for k, move in enumerate(warped) if move.kind == Kind.LINE)
    for x, y, z in sampled(warped)[41:]:  # behind the plunge
        assert z == pytest.approx(-1.0 + height_at(surface, x, y), abs=1.01 * TOLERANCE_MM)
    assert warped.end[first, 2] == pytest.approx(-1.0 + height_at(surface, 0.0, 0.0))
    # Arcs stay arcs, about their centres; the path seen from above is the same.
    arcs = {move.centre for move in path if move.centre is not None}
    assert {move.centre for move in warped if move.centre is not None} == arcs
    assert length_of(warped) == pytest.approx(length_of(path), abs=1e-6)
    assert (warped.end[warped.kind == Kind.RAPID, 2] >= 5.0 + surface.range_mm[1] - 1e-12).all()
    assert surface_error(path, warped, surface)[0] <= 1.01 * TOLERANCE_MM


@examples(40)
@given(seed=st.integers(0, 2**32), nodes=st.integers(2, 9))
def test_a_cut_that_does_not_follow_is_found(seed: int, nodes: int) -> None:
    surface, path = random_surface(seed, nodes), random_path(seed)
    warped = follow(path, surface, TOLERANCE_MM)
    rows = np.flatnonzero(warped.is_feed)
    row = int(rows[seed % (len(rows) - 1) + 1])
    end = warped.end.copy()
    end[row, 2] += 0.5
    error_mm, place = surface_error(path, replace(warped, end=read_only(end)), surface)
    assert 0.25 < error_mm <= 0.5 + TOLERANCE_MM  # some place lies within half of a move
    assert place in (row, row + 1)
    with pytest.raises(PostError, match="runs"):
        surface_error(path, warped.first(1), surface)


def test_a_hole_that_does_not_follow_is_found() -> None:
    nodes = np.array([0.0, 10.0])
    surface = Surface(nodes, nodes, np.array([[0.0, 0.0], [0.4, 0.4]]))
    holes = ToolpathBuilder()
    for y in (0.0, 5.0, 10.0):
        holes.rapid(3.0, y, 2.0).line(z=-1.0, feed=50.0).rapid(z=2.0)
    path = holes.finish()
    warped = follow(path, surface, TOLERANCE_MM)
    assert surface_error(path, warped, surface)[0] < 1e-9
    end = warped.end.copy()
    end[4, 2] -= 0.1
    error_mm, place = surface_error(path, replace(warped, end=read_only(end)), surface)
    assert place == 4
    assert error_mm == pytest.approx(0.1)


def length_of(path: Toolpath) -> float:
    """The length of all cuts, seen from above."""
    found = 0.0
    starts, sweeps = path.starts, path.sweeps()
    for row in np.flatnonzero(path.is_feed).tolist():
        begin, end = starts[row], path.end[row]
        if sweeps[row]:
            found += abs(sweeps[row]) * float(np.hypot(*(begin[:2] - path.centre[row])))
        else:
            found += float(np.hypot(*(end - begin)[:2]))
    return found


def test_a_plane_divides_only_arcs() -> None:
    x = np.array([0.0, 40.0])
    surface = Surface(x, x, np.array([[0.0, 0.4], [0.8, 1.2]]))
    line = ToolpathBuilder().rapid(0.0, 0.0, 1.0).line(30.0, 20.0, 0.0, feed=9.0).finish()
    assert len(follow(line, surface, TOLERANCE_MM)) == 2
    arc = (
        ToolpathBuilder()
        .rapid(10.0, 0.0, 1.0)
        .arc(10.0, 20.0, centre=(10.0, 10.0), ccw=True, feed=9.0)
        .finish()
    )
    # The sagitta of a sine of amplitude 10 · √(0.01² + 0.02²) within the tolerance.
    parts = math.pi * math.sqrt(10.0 * math.hypot(0.01, 0.02) / (8.0 * TOLERANCE_MM))
    assert len(follow(arc, surface, TOLERANCE_MM)) - 1 <= 2.0 * math.ceil(parts)


def test_a_cut_beside_the_surface_is_refused() -> None:
    surface = Surface(np.array([0.0, 10.0]), np.array([0.0, 10.0]), np.zeros((2, 2)))
    path = ToolpathBuilder().rapid(20.0, 0.0, 1.0).line(10.5, 0.0, 0.0, feed=9.0).finish()
    with pytest.raises(PostError, match=r"X10\.500 Y0\.000.*probe a larger area"):
        follow(path, surface, TOLERANCE_MM)


def test_nodes_that_were_not_probed_lie_between_their_neighbours() -> None:
    z = np.array([[0.0, 1.0, 2.0], [1.0, math.nan, 3.0], [2.0, 3.0, 4.0]])
    nodes = np.array([0.0, 1.0, 2.0])
    assert filled(nodes, nodes, z).z[1, 1] == pytest.approx(2.0, abs=1e-6)
    with pytest.raises(ValueError, match="no node"):
        filled(nodes, nodes, np.full((3, 3), math.nan))


@given(seed=st.integers(0, 2**32), nodes=st.integers(2, 9))
def test_a_file_holds_a_surface(seed: int, nodes: int) -> None:
    surface = random_surface(seed, nodes)
    again = surface_of_text(text_of_surface(surface), "map.csv")
    assert again.x == pytest.approx(surface.x, rel=1e-5)
    assert again.z == pytest.approx(surface.z, abs=1e-4)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "0,1\n0,1\n",
        "HEAD\n,0,1\n0,1,2\n",
        "HEAD\n,0,1\n0,1,2\n1,x,2\n",
        "HEAD\n,0,1\n0,1,2\n1,2\n",
        "HEAD\n,1,0\n0,1,2\n1,1,2\n",
        "HEAD\n,0,1\n0,,\n1,,\n",
        "HEAD\n,0,inf\n0,1,2\n1,1,2\n",
        "HEAD\n,0,1\n0,inf,2\n1,1,2\n",
    ],
)
def test_files_that_are_no_surface_are_refused(text: str) -> None:
    with pytest.raises(InputError):
        surface_of_text(text.replace("HEAD", "# camtool surface 1"), "map.csv")


def test_a_program_follows_its_surface() -> None:
    """Read back as the controller decodes it."""
    nodes = np.array([-10.0, 0.0, 7.0, 15.0, 40.0])
    surface = Surface(nodes, nodes, np.random.default_rng(1).normal(0.0, 0.1, (5, 5)))
    grbl = load_target("grbl")
    program = (
        b"G21 G90\nM3 S1000\nG0 X1 Y1 Z3\nG1 Z-0.2 F100\nX9 Y2\nG2 X19 Y12 I5 J5\nG0 Z3\nM5\nM30\n"
    )
    run = convert_program(program, grbl, grbl, file="part.nc", surface=surface)
    assert run.decoded is not None
    assert not run.failed, run.findings
    places: Floats = np.array(sampled(run.decoded)[41:])
    wanted = [-0.2 + height_at(surface, x, y) for x, y, _ in places.tolist()]
    tolerance = grbl.machine.defaults.fit_tolerance_mm + 0.001
    [finding] = [each for each in run.findings if each.code == ProgramCode.SURFACE_FOLLOWED]
    assert finding.severity == Severity.INFO
    assert finding.measured is not None
    assert 0.0 < finding.measured <= tolerance == finding.limit
    assert np.abs(places[:, 2] - wanted).max() <= tolerance


def test_a_program_that_does_not_follow_is_not_written(monkeypatch: pytest.MonkeyPatch) -> None:
    nodes = np.array([0.0, 40.0])
    surface = Surface(nodes, nodes, np.array([[0.0, 0.1], [0.2, 0.5]]))
    grbl = load_target("grbl")
    program = b"G21 G90\nM3 S1000\nG0 X1 Y1 Z3\nG1 Z-0.2 F100\nX9 Y2\nG0 Z3\nM5\nM30\n"
    monkeypatch.setattr("camtool.pipeline.follow", lambda path, *_: path)
    run = convert_program(program, grbl, grbl, file="part.nc", surface=surface)
    assert run.failed
    [finding] = [each for each in run.findings if each.code == ProgramCode.SURFACE_FOLLOWED]
    assert finding.severity == Severity.ERROR
    assert "block" in str(finding.where)


def test_a_program_is_turned_about_part_zero() -> None:
    grbl = load_target("grbl")
    program = (
        b"G21 G90\nM3 S1000\nG0 X10 Y0 Z3\nG1 Z-0.2 F100\nG3 X0 Y10 I-10 J0\nG0 Z3\nM5\nM30\n"
    )
    run = convert_program(program, grbl, grbl, file="part.nc", turn_deg=30.0)
    assert run.decoded is not None
    assert not run.failed, run.findings
    path = run.decoded
    [arc] = np.flatnonzero(path.is_arc)
    angle = math.radians(30.0)
    assert path.end[arc, :2] == pytest.approx(
        [-10.0 * math.sin(angle), 10.0 * math.cos(angle)], abs=0.002
    )
    assert path.centre[arc] == pytest.approx([0.0, 0.0], abs=0.002)
    pic = load_target("pic-mmh")
    with pytest.raises(PostError, match="machine zero"):
        convert_program(b"G28X0Y0;M30;", pic, pic, file="part.pic", turn_deg=30.0)
