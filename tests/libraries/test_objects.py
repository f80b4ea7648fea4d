"""Objects of ezdxf, shapely, svgpathtools, numpy and build123d are read as drawings."""

import io
import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import build123d
import ezdxf
import numpy as np
import pytest
import shapely
import svgpathtools
from shapely.geometry import LineString, Point, Polygon, box

import camtool
from camtool.geometry.measure import path_lengths, signed_areas
from camtool.libraries.read import LIBRARIES, library_of, read_objects

ROOT = Path(__file__).parents[2]


def areas(drawing: camtool.Drawing) -> list[float]:
    """Return the areas (mm²) of the closed paths, smallest first."""
    closed = drawing.paths.select(np.flatnonzero(drawing.paths.closed))
    return sorted(np.abs(signed_areas(closed)).tolist())


def document(**settings: Any) -> Any:
    """Return a document of ezdxf with a circle of radius 5 and a quarter of a circle."""
    made = ezdxf.new(**({"units": 4} | settings))
    space = made.modelspace()
    space.add_circle((0, 0), 5, dxfattribs={"layer": "HOLES"})
    space.add_arc((20, 0), 3, 0, 90, dxfattribs={"layer": "ENGRAVE"})
    return made


def text_of(made: Any) -> list[str]:
    """Return the lines of a document, without the times and numbers of its writing."""
    stream = io.StringIO()
    made.write(stream)
    return [line for line in stream.getvalue().splitlines() if "-" not in line]


def sketch() -> Any:
    """Return a plate of 20 × 10 mm with a round hole of radius 3."""
    with build123d.BuildSketch() as made:
        build123d.Rectangle(20, 10)
        build123d.Circle(3, mode=build123d.Mode.SUBTRACT)
    return made


PLATE = [9.0 * math.pi, 200.0]
SQUARE = [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0)]


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (box(0, 0, 4, 4), [16.0]),
        (box(0, 0, 4, 4).exterior, [16.0]),
        (box(0, 0, 8, 8).difference(box(1, 1, 3, 3)), [4.0, 64.0]),
        (shapely.MultiPolygon([box(0, 0, 1, 1), box(3, 3, 5, 5)]), [1.0, 4.0]),
        (shapely.GeometryCollection([Point(9, 9), box(0, 0, 1, 1)]), [1.0]),
        (np.array(SQUARE), [16.0]),
        (np.array(SQUARE, dtype=np.int32), [16.0]),
        (SQUARE, [16.0]),
        ([SQUARE, np.array(SQUARE) + 9.0], [16.0, 16.0]),
        (np.array([[0.0, 0.0, 1.0], [4.0, 0.0, 1.0], [0.0, 0.0, 0.0]]), [4.0 * math.pi]),
        (svgpathtools.parse_path("M0,0 H4 V4 H0 Z"), [16.0]),
        (svgpathtools.parse_path("M0,0 H4 V4 H0 Z M9,9 h1 v1 h-1 z"), [1.0, 16.0]),
        (svgpathtools.parse_path("M0,0 A2,2 0 0 1 4,0 A2,2 0 0 1 0,0"), [4.0 * math.pi]),
        (document(), [25.0 * math.pi]),
        (document().modelspace(), [25.0 * math.pi]),
        (sketch(), PLATE),
        (sketch().sketch, PLATE),
        (sketch().sketch.faces(), PLATE),
        (build123d.extrude(sketch().sketch, 5), PLATE),
        ([box(0, 0, 1, 1), np.array(SQUARE), build123d.Circle(1)], [1.0, math.pi, 16.0]),
    ],
)
def test_areas_are_those_of_the_object(value: Any, expected: list[float]) -> None:
    assert areas(camtool.read_drawing(value)) == pytest.approx(expected, rel=1e-12)


def test_arcs_stay_arcs() -> None:
    quarter = math.tan(math.pi / 8.0)
    from_dxf = camtool.read_drawing(document(), layers="ENGRAVE").paths
    assert from_dxf.vertices[0].tolist() == pytest.approx([23.0, 0.0, quarter], rel=1e-15)
    # Y runs down in path data: this arc rises in them, and falls in the drawing.
    arc = svgpathtools.Arc(0j, 5 + 5j, 0.0, False, True, 5 + 5j)
    from_svg = camtool.read_drawing(arc).paths
    assert from_svg.vertices[0].tolist() == pytest.approx([0.0, 0.0, -quarter], rel=1e-12)
    assert from_svg.vertices[1].tolist() == [5.0, -5.0, 0.0]
    with build123d.BuildLine() as line:
        build123d.CenterArc((0, 0), 3, 0, 90)
    from_solid = camtool.read_drawing(line).paths
    assert from_solid.vertices[0].tolist() == pytest.approx([3.0, 0.0, quarter], rel=1e-12)


def test_curves_are_fitted_within_the_tolerance() -> None:
    made = ezdxf.new(units=4)
    made.modelspace().add_spline([(0, 0), (5, 5), (10, 0), (15, 5)])
    curve = svgpathtools.CubicBezier(0j, 5 + 9j, 10 - 9j, 15 + 5j)
    for value in (made, curve, build123d.Ellipse(8, 3)):
        fine = camtool.read_drawing(value, tolerance_mm=0.0005)
        coarse = camtool.read_drawing(value, tolerance_mm=0.05)
        assert len(coarse.paths.vertices) < len(fine.paths.vertices)
        assert 0.0 < fine.fit.max_mm <= 0.0005 < coarse.fit.max_mm <= 0.05


def test_recognise_arcs_makes_arcs_of_buffers() -> None:
    disc = Point(1, 2).buffer(5, quad_segs=64)
    assert len(camtool.read_drawing(disc).paths.vertices) == 256
    round_again = camtool.read_drawing(disc, recognise_arcs=True)
    assert len(round_again.paths.vertices) == 2
    assert areas(round_again) == pytest.approx([25.0 * math.pi], rel=1e-9)


def test_a_document_is_read_as_its_file_is(tmp_path: Path) -> None:
    made = document(units=1)
    made.modelspace().add_ellipse((9, 9), (3, 0), 0.5)
    block = made.blocks.new("B")
    block.add_circle((0, 0), 1)
    made.modelspace().add_blockref("B", (30, 30), dxfattribs={"xscale": 2.0, "yscale": 2.0})
    made.modelspace().add_text("text")
    before = text_of(made)
    from_object = camtool.read_drawing(made)
    assert text_of(made) == before
    made.saveas(tmp_path / "a.dxf")
    from_file = camtool.read_drawing(tmp_path / "a.dxf")
    assert (from_object.paths.vertices == from_file.paths.vertices).all()
    for name in ("layers", "colours", "sources", "units", "used", "skipped", "findings"):
        assert getattr(from_object, name) == getattr(from_file, name), name
    assert from_object.units.name == "in"
    # Once saved, the document knows its file.
    assert camtool.read_drawing(made).file == str(tmp_path / "a.dxf")
    assert areas(camtool.read_drawing(block)) == pytest.approx([math.pi * 25.4**2])


def test_layouts_are_chosen_by_name_or_given() -> None:
    made = document()
    made.layout("Layout1").add_line((0, 0), (7, 0))
    for value, options in ((made, {"layout": "layout1"}), (made.layout("Layout1"), {})):
        assert path_lengths(camtool.read_drawing(value, **options).paths).tolist() == [7.0]


def test_keys_name_the_layers() -> None:
    drawing = camtool.read_drawing(
        {"CUT": [box(0, 0, 9, 9), box(20, 0, 30, 9)], "DRILL": Point(3, 3), "LINE": np.eye(2)}
    )
    assert drawing.layers == ("CUT", "CUT", "LINE")
    assert [(mark.layer, mark.at_mm) for mark in drawing.marks] == [("DRILL", (3.0, 3.0))]
    assert set(camtool.read_drawing({"ALL": document()}).layers) == {"ALL"}
    chosen = camtool.read_drawing({"CUT": box(0, 0, 9, 9), "X": box(1, 1, 2, 2)}, layers="CUT")
    assert set(chosen.layers) == {"CUT"}
    assert set(chosen.unchosen.layers) == {"X"}


def test_labels_and_colours_of_solids_are_kept() -> None:
    part = build123d.Box(3, 4, 5)
    part.label, part.color = "LID", build123d.Color("red")
    drawing = camtool.read_drawing(part)
    assert (drawing.layers, drawing.colours) == (("LID",), ("#ff0000",))


@pytest.mark.parametrize(
    "value",
    [
        box(0, 0, 1, 1),
        np.array(SQUARE) / 4.0,
        svgpathtools.parse_path("M0,0 H1 V1 H0 Z"),
        build123d.Rectangle(1, 1),
    ],
)
def test_units_say_what_the_numbers_are(value: Any) -> None:
    assert areas(camtool.read_drawing(value)) == pytest.approx([1.0])
    inches = camtool.read_drawing(value, units="in")
    assert areas(inches) == pytest.approx([25.4**2])
    assert inches.units.name == "in"


def test_sections_of_parts() -> None:
    cone = build123d.Cone(10, 0, 10)
    assert areas(camtool.read_drawing(cone, section_z_mm=0.0)) == pytest.approx([25.0 * math.pi])
    with pytest.raises(camtool.CamtoolError, match="misses the model"):
        camtool.read_drawing(cone, section_z_mm=50.0)


def test_everything_that_takes_a_drawing_takes_objects() -> None:
    plate = {"CUT": box(0, 0, 40, 30), "OTHER": box(50, 0, 60, 10)}
    job = camtool.job_of(layers="CUT", tool_diameter_mm=2.0, side="auto")
    run = camtool.post(plate, "grbl", job)
    assert run.drawing is not None
    assert set(run.drawing.layers) == {"CUT"}
    assert run.data.startswith(b"(camtool")
    verdict = camtool.verify(run.data, "grbl", against=plate, job=job)
    assert verdict.report == run.report or verdict.report is not None
    assert len(camtool.plan(plate, "grbl", job)) == len(run.wanted or ())
    assert "<svg" in camtool.preview(plate, run).svg
    with pytest.raises(camtool.CamtoolError, match="no layer matches 'CUTS'; did you mean CUT"):
        camtool.post(plate, "grbl", camtool.job_of(layers="CUTS"))


def test_check_says_what_the_command_says(tmp_path: Path) -> None:
    facts = camtool.check("samples/logo.dxf")
    done = subprocess.run(
        [sys.executable, "-m", "camtool", "check", "samples/logo.dxf", "--json", "-"],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
    )
    assert facts == json.loads(done.stdout)
    assert camtool.check(camtool.read_drawing("samples/logo.dxf")) == facts
    assert camtool.check({"CUT": box(0, 0, 4, 3)}, units="in")["size_mm"] == pytest.approx(
        [101.6, 76.2]
    )
    with pytest.raises(camtool.CamtoolError, match="drawing is read already"):
        camtool.check(camtool.read_drawing(box(0, 0, 1, 1)), units="in")


NAN = float("nan")


def with_nan() -> LineString:
    """Return a line with a number that is not finite, of which shapely warns."""
    with np.errstate(invalid="ignore"):
        return LineString([(0, 0), (NAN, 1)])


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (42, "drawing is of type int, which is no drawing; give a path, or objects of ezdxf"),
        (None, "drawing is of type NoneType"),
        (b"M0,0", "drawing is of type bytes"),
        ({"A": [box(0, 0, 1, 1), 3]}, r"drawing\['A'\]\[1\] is of type int"),
        ({"A": {"B": 1}}, r"drawing\['A'\] is of type dict"),
        ({1: box(0, 0, 1, 1)}, "drawing has the key 1, which names no layer"),
        ([["logo.dxf"]], r"drawing\[0\]\[0\] is of type str, which is no drawing"),
        ([], "drawing is empty; give geometry"),
        (Polygon(), "drawing is empty"),
        (svgpathtools.Path(), "drawing is empty"),
        (ezdxf.new(units=4), "drawing is empty"),
        (np.zeros((0, 2)), "drawing is empty"),
        (build123d.Compound(), "drawing: is empty; give a shape with edges"),
        (np.zeros((3, 2, 2)), r"drawing: is an array \(3, 2, 2\)"),
        (np.zeros((2, 7)), r"drawing: is an array \(2, 7\); transpose it"),
        (np.array([[1, 2j]]), "drawing: holds numbers of type complex128, no coordinates"),
        (np.array([[None, 2]]), "drawing: holds objects, no coordinates; give an array"),
        (np.array([[0, 0, 0], [1, 1, 5.0]]), "drawing: row 1: the third column is above 1"),
        (np.ma.masked_equal(np.array(SQUARE), 4), "drawing: has masked numbers; fill them"),
        (np.float64(3), r"drawing is a number of numpy \(float64\); give an array of points"),
        ([(0, 0), (1,)], "drawing is no list of points"),
        ([np.zeros((1, 2)), [(0, 0), (NAN, 0)]], r"drawing\[1\]: row 1: a number is not finite"),
        (Point(NAN, 1), "Point 1 of drawing: a point has a number that is not finite"),
        ({"A": with_nan()}, r"layer A, LineString 1 of drawing\['A'\]: a number is not finite"),
        (svgpathtools.Line(0, complex(NAN, 0)), "drawing: path 1: has the number"),
        (document().modelspace().query("CIRCLE"), "drawing is of type EntityQuery of ezdxf; give"),
        (build123d.Plane.XY, "drawing is of type Plane of build123d, and no shape"),
        (svgpathtools.parse_path, "drawing is of type function"),
        (
            [document(units=1), box(0, 0, 1, 1)],
            r"mixed units: drawing\[0\] counts in in .* say un",
        ),
        (1e12 * np.array(SQUARE), "a point lies 4e\\+12 mm away"),
    ],
)
def test_mistakes_are_one_line_that_names_the_argument(value: Any, message: str) -> None:
    with pytest.raises(camtool.CamtoolError, match=message) as caught:
        camtool.read_drawing(value)
    assert "\n" not in str(caught.value)


def test_a_list_in_itself_is_refused() -> None:
    endless: list[Any] = []
    endless.append(endless)
    with pytest.raises(camtool.CamtoolError, match="deeper than 8 lists"):
        camtool.read_drawing(endless)


def test_units_of_all_objects_may_be_given() -> None:
    mixed = [document(units=1), box(100, 0, 101, 1)]
    assert camtool.read_drawing(mixed, units="in").units.name == "in"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"format": "dxf"}, "format 'dxf' is for files; leave format out"),
        ({"threshold": 0.3}, "--threshold is for pictures of pixels"),
        ({"layout": "X"}, "drawing: has no layout 'X'; use one of Model, Layout1"),
    ],
)
def test_options_that_do_not_fit_are_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(camtool.CamtoolError, match=message):
        camtool.read_drawing(document(), **options)
    with pytest.raises(camtool.CamtoolError, match="drawing is a layout already"):
        camtool.read_drawing(document().modelspace(), layout="Model")


def test_a_drawing_is_not_read_again() -> None:
    drawing = camtool.read_drawing(box(0, 0, 1, 1))
    with pytest.raises(camtool.CamtoolError, match="drawing is read already"):
        camtool.read_drawing(drawing)


def test_a_class_of_a_class_is_of_its_library() -> None:
    class Plate(build123d.Box):
        pass

    library = library_of(Plate(1, 2, 3))
    assert library is not None
    assert library.value == LIBRARIES["build123d"]
    assert library_of("text") is None


def test_no_library_is_imported_to_find_the_type() -> None:
    code = (
        "import sys, numpy, camtool; camtool.read_drawing(numpy.eye(2)); "
        "print(*{m.split('.')[0] for m in sys.modules})"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    loaded = set(done.stdout.split())
    assert not loaded & {"ezdxf", "svgpathtools", "build123d", "OCP", "shapely", "scipy"}
    assert "numpy" in loaded


PLUG_IN = """
import numpy as np
from camtool.geometry.drawing import Units
from camtool.importers.assemble import Found
from camtool.importers.pieces import Piece

class Wire:
    def __init__(self, *points):
        self.points = points

def read(value, name, options):
    rows = np.array([[float(x), float(y), 0.0] for x, y in value.points])
    return Found([Piece(rows, False, "WIRE", "", f"wire of {name}")], Units("mm", 1.0, "wires"))
"""


def test_other_packages_add_libraries(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    metadata = tmp_path / "wires-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: wires\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text("[camtool.libraries]\nwires = wires\n")
    (tmp_path / "wires.py").write_text(PLUG_IN)
    monkeypatch.syspath_prepend(tmp_path)
    import wires  # type: ignore[import-not-found]

    drawing = read_objects([wires.Wire((0, 0), (3, 4)), box(9, 9, 10, 10)])
    assert path_lengths(drawing.paths).tolist() == [5.0, 4.0]
    assert drawing.layers == ("WIRE", "0")
    with pytest.raises(camtool.CamtoolError, match=r"the reader of 'wires' fails \(ValueError"):
        read_objects(wires.Wire((0, 0), ("a", 1)))
