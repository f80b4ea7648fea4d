"""Drawings, offsets, toolpaths and predicted paths as objects of other libraries, and back."""

import math
from typing import Any

import ezdxf
import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

import camtool
from camtool.geometry.measure import path_lengths, signed_areas
from camtool.geometry.polylines import Polyline, Polylines
from camtool.run import ShownDrawing
from tests.strategies import contours, examples, open_contours

LOGO = "samples/logo.dxf"
CHORD_MM = 0.001
GRID_MM = 50.0


@st.composite
def drawings(draw: st.DrawFn) -> ShownDrawing:
    """Contours, open and closed, apart from each other, some with a ring of a hole, on layers."""
    paths: list[Polyline] = []
    layers: list[str] = []
    for number in range(draw(st.integers(1, 4))):
        path = draw(st.one_of(contours(), open_contours()))
        shift = (GRID_MM * number, 0.0, 0.0)
        layer = draw(st.sampled_from(["CUT", "ENGRAVE", "à b"]))
        paths.append(Polyline(path.vertices + shift, path.closed))
        layers.append(layer)
        if path.closed and draw(st.booleans()):
            # It lies within: the contour comes no nearer to its middle than 0.3 mm.
            hole = path.vertices * (0.05, 0.05, 1.0) + shift
            paths.append(Polyline(hole, True))
            layers.append(layer)
    columns = {"colours": ("#ff0000",) * len(paths), "sources": ("x",) * len(paths)}
    units = camtool.read_drawing(np.eye(2)).units
    lines = Polylines.of(paths)
    return ShownDrawing(lines, tuple(layers), **columns, file="<made>", units=units)


def sums(drawing: Any) -> dict[str, tuple[float, float, int, int]]:
    """Return for each layer: length and area (mm, mm²) of all paths, closed and open ones."""
    found = {}
    for layer in set(drawing.layers):
        paths = drawing.paths.select([k for k, of in enumerate(drawing.layers) if of == layer])
        closed = paths.select(np.flatnonzero(paths.closed))
        found[layer] = (
            float(path_lengths(paths).sum()),
            float(np.abs(signed_areas(closed)).sum()),
            len(closed),
            len(paths) - len(closed),
        )
    return found


def assert_alike(one: Any, other: Any, share: float) -> None:
    before, after = sums(one), sums(other)
    assert before.keys() == after.keys()
    for layer, numbers in before.items():
        assert after[layer] == pytest.approx(numbers, rel=share, abs=share)


@given(drawings())
@examples(40, 2000)
def test_ezdxf_gives_the_drawing_back(drawing: ShownDrawing) -> None:
    document = drawing.to_ezdxf()
    assert not document.audit().errors
    back = camtool.read_drawing(document, gap_mm=0.0)
    assert_alike(drawing, back, 1e-9)
    assert set(back.colours) == {"#ff0000"}
    order = [k for k, _ in sorted(enumerate(drawing.layers), key=lambda item: item[0])]
    assert np.abs(back.paths.vertices - drawing.paths.select(order).vertices).max() < 1e-9


@given(drawings())
@examples(40, 2000)
def test_svgpathtools_gives_the_drawing_back(drawing: ShownDrawing) -> None:
    paths = drawing.to_svgpathtools()
    assert_alike(drawing, camtool.read_drawing(paths, gap_mm=0.0), 1e-6)


@given(drawings())
@examples(40, 2000)
def test_shapely_gives_the_drawing_back_within_its_chords(drawing: ShownDrawing) -> None:
    geometries = drawing.to_shapely(CHORD_MM)
    for layer, (length, _, closed, _) in sums(drawing).items():
        geometry = geometries[layer]
        assert shapely.is_valid(geometry)
        polygons = [part for part in geometry.geoms if part.geom_type == "Polygon"]
        rings = sum(1 + len(polygon.interiors) for polygon in polygons)
        assert rings == closed
        # Each polygon has its region on its left: counter-clockwise, with holes clockwise.
        assert all(polygon.exterior.is_ccw for polygon in polygons)
        assert not any(ring.is_ccw for polygon in polygons for ring in polygon.interiors)
        assert geometry.length <= length * (1 + 1e-12)
        # A chord c that is s off its arc is shorter by less than 8 s²/3c; arcs are 0.5 mm or more.
        assert geometry.length == pytest.approx(length, rel=1e-2)
        # What is lost lies between the chords and the arcs.
        parts = np.flatnonzero([of == layer for of in drawing.layers])
        signed = signed_areas(drawing.paths.select(parts))
        outer = np.abs(signed[drawing.paths.closed[parts]])
        assert geometry.area <= outer.sum() + CHORD_MM * length
    back = camtool.read_drawing(geometries, gap_mm=0.0)
    assert {layer: found[2:] for layer, found in sums(back).items()} == {
        layer: found[2:] for layer, found in sums(drawing).items()
    }


@pytest.mark.parametrize("tolerance_mm", [0.1, 0.01, 0.001])
def test_chords_lie_within_their_tolerance(tolerance_mm: float) -> None:
    ring = np.array([[5.0, 0.0, 1.0], [-5.0, 0.0, 1.0], [5.0, 0.0, 0.0]])
    disc = camtool.read_drawing(ring).to_shapely(tolerance_mm)["0"]
    distance = shapely.hausdorff_distance(disc.boundary, shapely.Point(0, 0), 0.001)
    assert distance == pytest.approx(5.0, rel=1e-12)
    inner = shapely.distance(disc.boundary, shapely.Point(0, 0))
    assert 5.0 - tolerance_mm <= inner < 5.0
    assert disc.area == pytest.approx(25.0 * math.pi, abs=10.0 * math.pi * tolerance_mm)


def test_thin_lenses_still_enclose_an_area() -> None:
    lens = np.array([[0.0, 0.0, 1e-5], [10.0, 0.0, 1e-5], [0.0, 0.0, 0.0]])
    geometry = camtool.read_drawing(lens).to_shapely(1.0)["0"]
    assert geometry.area > 0.0


@pytest.mark.parametrize("tolerance_mm", [0.0, -1.0, float("nan")])
def test_a_tolerance_must_be_above_nothing(tolerance_mm: float) -> None:
    with pytest.raises(camtool.CamtoolError, match="tolerance_mm is"):
        camtool.read_drawing(np.eye(2)).to_shapely(tolerance_mm)


def test_circles_points_and_names_of_layers_in_a_document() -> None:
    made = ezdxf.new(units=4)
    made.modelspace().add_circle((3, 4), 2, dxfattribs={"layer": "A", "linetype": "DASHED"})
    made.modelspace().add_point((1, 1), dxfattribs={"layer": "B"})
    document = camtool.read_drawing(made).to_ezdxf()
    circle, point = document.modelspace()
    assert (circle.dxftype(), circle.dxf.radius, circle.dxf.linetype) == ("CIRCLE", 2, "DASHED")
    assert (point.dxftype(), point.dxf.layer) == ("POINT", "B")
    odd = camtool.read_drawing({'a/b:"c"': shapely.box(0, 0, 1, 1)}).to_ezdxf()
    assert camtool.read_drawing(odd).layers == ("a_b__c_",)
    assert document.units == 4


def test_the_logo_goes_round() -> None:
    drawing = camtool.read_drawing(LOGO)
    document = camtool.read_drawing(drawing.to_ezdxf())
    assert np.abs(document.paths.vertices - drawing.paths.vertices).max() < 1e-12
    assert document.layers == drawing.layers
    assert document.colours == drawing.colours
    paths = drawing.to_svgpathtools()
    for layer, (length, *_) in sums(drawing).items():
        assert sum(path.length() for path in paths[layer]) == pytest.approx(length, rel=1e-6)
    for geometries in (drawing.to_shapely(1e-5), paths):
        assert_alike(drawing, camtool.read_drawing(geometries), 1e-4)


def test_moves_have_heights_and_lengths_of_their_own() -> None:
    toolpath = camtool.plan(LOGO, "pic-mmh")
    lines = toolpath.to_shapely(1e-5)
    assert lines["cuts"].has_z
    # Each line of cuts is one run: down, along a contour, and up at a rapid.
    assert len(lines["cuts"].geoms) == 32
    starts = toolpath.starts
    length = np.linalg.norm(toolpath.end - starts, axis=1)
    arcs = toolpath.is_arc
    radius = np.hypot(*(starts[arcs, :2] - toolpath.centre[arcs]).T)
    length[arcs] = np.hypot(
        radius * toolpath.sweeps()[arcs], toolpath.end[arcs, 2] - starts[arcs, 2]
    )
    feed = toolpath.is_feed
    total = sum(
        np.linalg.norm(
            np.diff(shapely.get_coordinates(line, include_z=True), axis=0), axis=1
        ).sum()
        for line in lines["cuts"].geoms
    )
    assert total == pytest.approx(length[feed].sum(), rel=1e-4)
    assert np.isfinite(shapely.get_coordinates(lines["rapids"], include_z=True)).all()


def test_helices_go_down_evenly() -> None:
    ring = np.array([[5.0, 0.0, 1.0], [-5.0, 0.0, 1.0], [5.0, 0.0, 0.0]])
    job = camtool.job_of(kind="pocket", tool_diameter_mm=2.0, depth_mm=2.0, entry="helix")
    points = shapely.get_coordinates(
        camtool.plan(ring, "linuxcnc", job).to_shapely()["cuts"], include_z=True
    )
    assert len(np.unique(points[:, 2])) > 20
    assert points[:, 2].min() == -2.0


def test_a_run_gives_what_the_slides_cut() -> None:
    run = camtool.post(shapely.box(0, 0, 3, 2), "pic-mmh")
    lines = run.to_shapely()
    assert list(lines) == ["cuts", "rapids", "predicted"]
    assert run.report is not None
    most_mm = run.report.error_um.total.max / 1000.0
    wanted, cut = shapely.force_2d(lines["cuts"]), lines["predicted"]
    assert 0.0 < shapely.hausdorff_distance(cut, wanted, 0.01) <= most_mm + 0.1
    assert list(camtool.post(shapely.box(0, 0, 3, 2), "grbl", check=False).to_shapely()) == [
        "cuts",
        "rapids",
    ]


def test_offsets_are_exact_with_arcs() -> None:
    plate = {"CUT": shapely.box(0, 0, 30, 20).difference(shapely.box(5, 5, 10, 10))}
    grown = camtool.offset(plate, 1.0)
    outer = 30 * 20 + 2 * (30 + 20) + math.pi
    assert np.abs(signed_areas(grown.paths)) == pytest.approx([outer, 9.0], rel=1e-12)
    assert set(grown.layers) == {"CUT"}
    assert grown.to_shapely(1e-5)["CUT"].area == pytest.approx(outer - 9.0, rel=1e-6)
    expected = plate["CUT"].buffer(1.0, quad_segs=256)
    assert grown.to_shapely()["CUT"].symmetric_difference(expected).area < 0.01
    sharp = camtool.offset(plate, 1.0, joins="sharp")
    assert np.abs(signed_areas(sharp.paths)) == pytest.approx([32 * 22, 9.0])
    assert camtool.post(grown, "grbl").program is not None
    for distance_mm, joins, message in (
        (-20.0, "round", "an offset of -20 mm leaves nothing"),
        (1.0, "cut", "unknown joins 'cut'"),
        (float("nan"), "round", "not finite"),
    ):
        with pytest.raises(camtool.CamtoolError, match=message):
            camtool.offset(plate, distance_mm, joins=joins)  # type: ignore[arg-type]
