"""The sample drawings: the same bytes every time, and what is in them."""

from __future__ import annotations

import subprocess
import sys
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from camtool.findings import Severity
from camtool.geometry.drawing import Drawing
from camtool.geometry.measure import extents, path_lengths, sample, signed_area
from camtool.geometry.polylines import Polyline, Segments
from camtool.importers.findings import DrawingCode
from camtool.importers.read import read_drawing

SAMPLES = Path(__file__).parents[2] / "samples"
NAMES = (
    "logo.dxf",
    "logo.svg",
    "star.csv",
    "coupon.dxf",
    "plate.dxf",
    "mount.dxf",
    "mount.svg",
    "sign.svg",
    "tray.svg",
    "board.dxf",
    "screw.dxf",
)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("samples") / "new"
    script = SAMPLES / "make_samples.py"
    subprocess.run([sys.executable, "-B", str(script), str(folder)], check=True)
    return folder


@pytest.fixture(scope="module", params=["logo.dxf", "logo.svg"])
def logo(request: pytest.FixtureRequest) -> Drawing:
    return read_drawing(SAMPLES / request.param)


@pytest.mark.parametrize("name", NAMES)
def test_the_files_are_what_the_script_writes(made: Path, name: str):
    assert (SAMPLES / name).read_bytes() == (made / name).read_bytes()


def test_the_script_writes_these_files_and_no_others(made: Path):
    assert sorted(path.name for path in made.iterdir()) == sorted(NAMES)


def test_the_board_is_what_its_script_writes(tmp_path: Path):
    subprocess.run([sys.executable, "-B", str(SAMPLES / "make_led.py"), str(tmp_path)], check=True)
    assert (SAMPLES / "led.zip").read_bytes() == (tmp_path / "led.zip").read_bytes()


@pytest.mark.parametrize("name", ["logo.dxf", "coupon.dxf", "plate.dxf", "mount.dxf", "board.dxf"])
def test_ezdxf_finds_nothing_to_repair(name: str):
    import ezdxf
    from ezdxf import recover

    document, auditor = recover.readfile(SAMPLES / name)
    assert [entry.message for entry in (*auditor.errors, *auditor.fixes)] == []
    assert document.dxfversion == "AC1015"
    assert not ezdxf.readfile(SAMPLES / name).audit().has_issues


def test_the_emblem_is_in_millimetres_and_five_of_them(logo: Drawing):
    assert logo.units.name == "mm"
    assert logo.units.mm_per_unit == 1.0
    assert extents(logo.paths) == pytest.approx(np.array([[0.06, 4.94], [0.06, 4.94]]))
    assert set(logo.layers) == {"CUT", "ENGRAVE"}
    assert logo.skipped == ()
    assert logo.findings == ()
    assert 0.0 < logo.fit.max_mm <= 0.0005


def _gears(logo: Drawing) -> list[Polyline]:
    """Closed paths with as many lines as arcs, and many of them."""
    return [
        path for path in logo.paths if path.closed and (path.vertices[:, 2] == 0.0).sum() >= 24
    ]


def test_the_gears_have_their_teeth(logo: Drawing):
    gears = _gears(logo)
    assert [len(gear) for gear in gears] == [4 * 24, 4 * 16]
    for gear, (tip, root) in zip(gears, [(2.36, 2.1), (1.1, 0.94)], strict=True):
        arcs = Segments.of(gear)[gear.vertices[:, 2] != 0.0]
        assert np.unique(np.round(arcs.radius, 6)).tolist() == sorted([root, tip])
        assert arcs.centre == pytest.approx(2.5, abs=1e-6)
        assert signed_area(gear) > 0.0


def test_the_emblem_has_circles_down_to_150_micrometres(logo: Drawing):
    rows = Segments.of(logo.paths)
    whole = np.isclose(np.abs(rows.bulge), 1.0) & logo.paths.closed[rows.path]
    radii = np.round(rows.radius[whole], 9)
    # Two halves each; the slots' ends are half circles of 0.1 mm as well.
    counts = {float(radius): int((radii == radius).sum()) for radius in np.unique(radii)}
    assert counts == {0.1: 12, 0.15: 24, 1.22: 2, 1.9: 2}


def test_the_emblem_has_open_strokes_and_mirrored_corners(logo: Drawing):
    strokes = [path for path in logo.paths if not path.closed]
    assert len(strokes) == 9
    corners = [path for path in strokes if len(path) == 3]
    assert len(corners) == 8
    for path in corners:
        flipped = path.vertices * [1.0, -1.0, -1.0] + [0.0, 5.0, 0.0]
        assert any(
            other.vertices[:, :2] == pytest.approx(flipped[way, :2])
            for other in corners
            for way in (slice(None), slice(None, None, -1))
        )


def test_nothing_in_the_emblem_touches(logo: Drawing):
    import shapely

    lines = [
        shapely.LineString(np.vstack([dots, dots[:1]]) if path.closed else dots)
        for path in logo.paths
        for dots in [sample(path, 0.01)]
    ]
    assert all(line.is_simple for line in lines)
    assert min(a.distance(b) for a, b in combinations(lines, 2)) > 0.09


def test_dxf_and_svg_hold_the_same_emblem():
    dxf, svg = (read_drawing(SAMPLES / name) for name in ("logo.dxf", "logo.svg"))
    assert dxf.layers == svg.layers
    # The ellipse and the spline are fitted anew from what each format says: equal to half a
    # micrometre, not arc for arc. All else is exact in both.
    lengths = zip(path_lengths(dxf.paths), path_lengths(svg.paths), strict=True)
    assert [abs(one - other) < 1e-4 for one, other in lengths] == [True] * len(dxf.paths)
    for one, other, source in zip(dxf.paths, svg.paths, dxf.sources, strict=True):
        assert one.closed == other.closed
        exact = not source.startswith(("ELLIPSE", "SPLINE")) and len(one) == len(other)
        if exact and np.allclose(one.start, other.start, atol=1e-6):
            assert one.vertices == pytest.approx(other.vertices, abs=2e-6)
    kinds = {"LINE", "ARC", "CIRCLE", "LWPOLYLINE", "ELLIPSE", "SPLINE", "INSERT"}
    assert set(dxf.used) == kinds


def test_the_star_is_the_one_of_the_router():
    star = read_drawing(SAMPLES / "star.csv")
    [path] = list(star.paths)
    assert len(path.vertices) == 11
    assert path.vertices[[0, 1, -1], :2].tolist() == [[15.1, 8.6], [40.0, 26.5], [15.3, 8.6]]
    assert path_lengths(star.paths)[0] == pytest.approx(327.61, abs=0.005)


def test_the_coupon_has_two_parallel_lines_for_each_axis():
    coupon = read_drawing(SAMPLES / "coupon.dxf")
    assert coupon.layers == ("X", "Y")
    for axis, path, distance in zip((0, 1), coupon.paths, (2.5, 1.2), strict=True):
        assert not path.closed
        assert len(path) == 3
        chords = np.diff(path.vertices[:, :2], axis=0)
        assert chords[0] == pytest.approx(-chords[2])
        assert chords[0, axis] == 0.0
        assert chords[1, axis] == pytest.approx(distance)
    box = extents(coupon.paths)
    assert (box[:, 0] > 0.0).all()
    assert (box[:, 1] < [10.0, 7.0]).all()
    assert [one for one in coupon.findings if one.severity > Severity.INFO] == []
    assert DrawingCode.GAP_CLOSED not in [one.code for one in coupon.findings]
