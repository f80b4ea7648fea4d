"""Solid models: sections and faces against what geometry says, STEP and BREP, scripts."""

import json
import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from camtool.errors import DrawingError
from camtool.geometry.drawing import Drawing
from camtool.geometry.measure import extents, path_lengths
from camtool.geometry.polylines import Segments
from camtool.importers.findings import DrawingCode
from camtool.importers.options import ReadOptions
from camtool.importers.read import read_bytes, read_drawing
from camtool.importers.solid import reader as solid
from camtool.importers.solid import reader as solid_process
from camtool.importers.solid import worker as solid_worker
from camtool.importers.solid.reader import run_worker, step_unit

b = pytest.importorskip("build123d")


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The worker works in this process: build123d is loaded once."""

    def found(data: bytes, wanted: dict[str, Any], file: str) -> dict[str, Any]:
        source = tmp_path / "source"
        source.write_bytes(data)
        try:
            result = solid_worker.find_outlines(wanted | {"source": str(source)})
        except DrawingError as error:
            raise DrawingError(
                error.message, file=file, where=error.where, mend=error.mend
            ) from error
        result = json.loads(json.dumps(result))
        return result | {"complaint": ""}

    monkeypatch.setattr(solid, "run_worker", found)
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.setattr(sys, "argv", list(sys.argv))


def step(shape: Any, folder: Path, unit: str = "MM") -> bytes:
    """STEP by OpenCASCADE itself, which writes the real unit."""
    from OCP.Interface import Interface_Static
    from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer

    writer = STEPControl_Writer()
    before = Interface_Static.CVal_s("write.step.unit")
    Interface_Static.SetCVal_s("write.step.unit", unit)
    try:
        writer.Transfer(shape.wrapped, STEPControl_StepModelType.STEPControl_AsIs)
        writer.Write(str(folder / "one.step"))
    finally:
        Interface_Static.SetCVal_s("write.step.unit", before)
    return (folder / "one.step").read_bytes()


def named(shape: Any, folder: Path) -> bytes:
    """STEP with names and colours."""
    b.export_step(shape, str(folder / "named.step"))
    return (folder / "named.step").read_bytes()


def brep(shape: Any, folder: Path) -> bytes:
    b.export_brep(shape, str(folder / "one.brep"))
    return (folder / "one.brep").read_bytes()


def drawn(data: bytes, name: str = "p", **options: Any) -> Drawing:
    return read_bytes(data, name, ReadOptions(**options))


def script(text: str, **options: Any) -> Drawing:
    return drawn(
        f"from build123d import *\n{text}".encode(), "p.py", allow_scripts=True, **options
    )


def arcs(drawing: Drawing) -> list[tuple[float, ...]]:
    """Centre and radius of each circle that any arc lies on, to a nanometre."""
    segments = Segments.of(drawing.paths)[Segments.of(drawing.paths).is_arc]
    rows = np.column_stack([segments.centre, segments.radius])
    return sorted({tuple(row) for row in (np.round(rows, 6) + 0.0).tolist()})


@pytest.mark.usefixtures("here")
def test_a_box_gives_its_rectangle_from_every_format(tmp_path: Path) -> None:
    box = b.Box(20, 10, 6)
    for data in (step(box, tmp_path), named(box, tmp_path), brep(box, tmp_path)):
        for height in (None, 0.0, 3.0, -3.0, 1.2345):
            drawing = drawn(data, section_z_mm=height)
            assert drawing.paths.closed.tolist() == [True]
            found = {tuple(row) for row in np.round(drawing.paths.vertices, 9).tolist()}
            assert found == {(x, y, 0.0) for x in (-10.0, 10.0) for y in (-5.0, 5.0)}
            note = drawing.findings[0]
            assert note.code == DrawingCode.SECTION_CHOSEN
            assert "z = -3 to 3 mm" in note.message
            assert note.measured == pytest.approx(3.0 if height is None else height)


@pytest.mark.usefixtures("here")
def test_fillets_and_bores_stay_arcs(tmp_path: Path) -> None:
    box = b.Box(20, 10, 6)
    plate = b.fillet(box.edges().filter_by(b.Axis.Z), 2) - b.Pos(3, 1, 0) * b.Cylinder(1.5, 20)
    corners = [(x, y, 2.0) for x in (-8.0, 8.0) for y in (-3.0, 3.0)]
    for data in (step(plate, tmp_path), brep(plate, tmp_path)):
        for height in (None, 0.5):
            drawing = drawn(data, section_z_mm=height)
            assert drawing.paths.closed.tolist() == [True, True]
            assert arcs(drawing) == sorted([*corners, (3.0, 1.0, 1.5)])
            assert drawing.fit.max_mm == 0.0
            assert sum(path_lengths(drawing.paths)) == pytest.approx(
                2 * (16 + 6) + 4 * math.pi + 3 * math.pi
            )


@pytest.mark.usefixtures("here")
def test_sections_of_round_bodies() -> None:
    cone = script("part = Pos(1, 2, 0) * Cone(6, 2, 8)", section_z_mm=1.0)
    assert arcs(cone) == [(1.0, 2.0, 3.5)]
    sphere = script("part = Pos(0, 0, 10) * Sphere(5)", section_z_mm=13.0)
    assert arcs(sphere) == [(0.0, 0.0, 4.0)]
    torus = script("part = Torus(8, 2)", section_z_mm=0.0)
    assert arcs(torus) == [(0.0, 0.0, 6.0), (0.0, 0.0, 10.0)]
    tube = script("part = Cylinder(5, 4) - Cylinder(3, 4)")
    assert arcs(tube) == [(0.0, 0.0, 3.0), (0.0, 0.0, 5.0)]


@pytest.mark.usefixtures("here")
def test_a_tilted_cylinder_is_cut_in_a_fitted_ellipse() -> None:
    drawing = script("part = Rot(60, 0, 0) * Cylinder(5, 60)", section_z_mm=0.0, tolerance_mm=1e-3)
    assert drawing.paths.closed.tolist() == [True]
    assert 0.0 < drawing.fit.max_mm <= 1e-3
    x, y = drawing.paths.vertices[:, 0], drawing.paths.vertices[:, 1]
    # Half axes 5 and 5 / cos 60° = 10.
    np.testing.assert_allclose((x / 5.0) ** 2 + (y / 10.0) ** 2, 1.0, atol=1e-3)
    np.testing.assert_allclose(extents(drawing.paths), [[-5.0, 5.0], [-10.0, 10.0]], atol=1e-3)


def dense_length(edge: Any) -> float:
    """By many chords: OpenCASCADE's own length of a rational curve is 0.2 % wrong."""
    from OCP.BRepAdaptor import BRepAdaptor_Curve

    curve = BRepAdaptor_Curve(edge.wrapped)
    rows = [
        (point.X(), point.Y())
        for at in np.linspace(curve.FirstParameter(), curve.LastParameter(), 4000).tolist()
        for point in [curve.Value(at)]
    ]
    return float(np.hypot(*np.diff(rows, axis=0).T).sum())


@pytest.mark.usefixtures("here")
def test_splines_and_beziers_of_a_sketch_are_fitted() -> None:
    text = """
with BuildSketch() as sketch:
    with BuildLine():
        curve = {curve}
        Line(curve @ 1, curve @ 0)
    make_face()
"""
    for curve in (
        "Bezier((0, 0), (5, 9), (15, -4), (20, 0.5))",
        "Bezier((0, 0), (5, 9), (20, 0), weights=(1, 3, 1))",
        "Spline((0, 0), (4, 5), (9, 3), (20, 0))",
        "EllipticalCenterArc((0, 0), 10, 4, start_angle=10, arc_size=190)",
        "ThreePointArc((0, 0), (4, 5), (20, 0))",
    ):
        text_here = text.format(curve=curve)
        drawing = script(text_here, tolerance_mm=1e-3)
        assert drawing.paths.closed.tolist() == [True]
        names: dict[str, Any] = {}
        exec("from build123d import *\n" + text_here, names)
        assert path_lengths(drawing.paths)[0] == pytest.approx(
            sum(map(dense_length, names["sketch"].sketch.edges())), rel=1e-4
        )
        assert drawing.fit.max_mm <= 1e-3
        assert (drawing.fit.max_mm == 0.0) == ("ThreePoint" in curve)


@pytest.mark.usefixtures("here")
def test_an_offset_curve_is_asked_for_points() -> None:
    drawing = script(
        "from OCP.Geom import Geom_OffsetCurve, Geom_Ellipse\n"
        "from OCP.gp import gp_Ax2, gp_Pnt, gp_Dir\n"
        "from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge\n"
        "oval = Geom_Ellipse(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), 10, 5)\n"
        "curve = Geom_OffsetCurve(oval, 1.0, gp_Dir(0, 0, 1))\n"
        "result = Edge(BRepBuilderAPI_MakeEdge(curve).Edge())\n",
        tolerance_mm=1e-3,
    )
    assert drawing.used == {"edge": 1}
    # A parallel curve of a convex one is longer by 2π times its distance.
    around = 48.44224110273838
    assert path_lengths(drawing.paths)[0] == pytest.approx(around + 2 * math.pi, abs=0.01)


@pytest.mark.usefixtures("here")
def test_each_solid_gives_its_own_highest_face(tmp_path: Path) -> None:
    low, high = b.Box(4, 4, 2), b.Pos(20, 0, 5) * b.Cylinder(3, 2)
    low.label, low.color = "base plate", b.Color("red")
    high.label = "top"
    group = b.Compound(label="group", children=[low, high])
    group.color = b.Color(0x336699)
    moved = b.Pos(0, 100, 0) * b.Compound(
        label="all", children=[group, b.Pos(50, 0, 0) * b.Sphere(1)]
    )
    drawing = drawn(named(moved, tmp_path))
    assert [layer.replace("_", " ") for layer in drawing.layers] == ["base plate", "top"]
    assert drawing.colours == ("#ff0000", "#336699")
    assert np.round(drawing.paths[0].vertices[:, :2].mean(axis=0), 6).tolist() == [0.0, 100.0]
    assert arcs(drawing) == [(20.0, 100.0, 3.0)]
    assert drawing.skipped[0].reason == "has no level face that looks up"
    assert "z = 1 to 6 mm" in drawing.findings[0].message
    (tmp_path / "assembly.py").write_text(
        "from build123d import *\nlow, high = Box(4, 4, 2), Pos(20, 0, 5) * Cylinder(3, 2)\n"
        "low.label, high.label = 'base', 'top'\n"
        "part = Pos(0, 100, 0) * Compound(children=[low, high])\n"
    )
    told = read_drawing(tmp_path / "assembly.py", options=ReadOptions(allow_scripts=True))
    assert told.layers == ("base", "top")
    assert arcs(told) == [(20.0, 100.0, 3.0)]


@pytest.mark.usefixtures("here")
def test_a_step_file_in_inches(tmp_path: Path) -> None:
    data = step(b.Box(25.4, 50.8, 6), tmp_path, "INCH")
    assert b"CONVERSION_BASED_UNIT" in data
    drawing = drawn(data)
    assert np.ptp(drawing.paths.vertices, axis=0).round(9).tolist() == [25.4, 50.8, 0.0]
    assert "counts in inch" in drawing.units.why
    # The caller says that the numbers are mm: what was 1 inch is 1 mm.
    told = drawn(data, units="mm", section_z_mm=0.1)
    assert np.ptp(told.paths.vertices, axis=0).round(9).tolist() == [1.0, 2.0, 0.0]
    assert told.units.why == "as asked"
    wide = drawn(brep(b.Box(1, 2, 3), tmp_path), units="in")
    assert np.ptp(wide.paths.vertices, axis=0).round(9).tolist() == [25.4, 50.8, 0.0]


def test_units_of_a_step_file_are_read_or_left_open() -> None:
    unit = b"#1=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(%s.METRE.));"
    text = unit + b"#2=(GLOBAL_UNIT_ASSIGNED_CONTEXT((#1)));"
    assert step_unit(text % b"$,").mm == 1000.0
    assert step_unit(text % b".MICRO.,").mm == 0.001
    assert step_unit(text % b".PICO.,").mm is None
    assert step_unit(b"").mm is None
    with pytest.raises(DrawingError, match="no single unit"):
        step_unit(b"").scale(ReadOptions(units="in"), "f")


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("text", "used"),
    [
        ("part = Box(1, 2, 3)", {"face": 1}),
        ("with BuildPart() as part:\n    Box(1, 2, 3)", {"face": 1}),
        ("sketch = Rectangle(3, 2)", {"face": 1}),
        ("sketch = Pos(0, 0, 7) * Rectangle(3, 2) - Circle(0.5)", {"face": 1}),
        ("with BuildSketch(Plane.XY.offset(3)) as sketch:\n    Circle(2)", {"face": 1}),
        ("sketch = Circle(1)\npart = extrude(sketch, 3)", {"face": 1}),
        ("result = [Box(1, 2, 3), Pos(9, 0, 0) * Rectangle(3, 2)]", {"face": 2}),
        ("with BuildLine() as result:\n    Polyline((0, 0), (3, 0), (3, 3))", {"edge": 2}),
        ("result = Wire([Line((0, 0), (3, 0)), Line((3, 0), (3, 3))])", {"wire": 1}),
        ("part = Compound([Box(1, 2, 3), Face(Wire.make_circle(9))])", {"face": 2}),
        (
            "a = Box(1, 2, 3)\npart = Compound([a, Edge.make_line((9, 0), (9, 1))])",
            {"face": 1, "edge": 1},
        ),
        ("part = Box(1, 2, 3).shell()", {"face": 1}),
        ("import sys\npart = Box(1, 2, 3)\nsys.exit(0)", {"face": 1}),
        ("result = Cylinder(3, 2).faces().sort_by(Axis.Z)[-1]", {"face": 1}),
    ],
)
def test_what_a_script_may_leave(text: str, used: dict[str, int]) -> None:
    assert script(text).used == used


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("text", "where", "message"),
    [
        ("x = 1 / 0", "line 2", "stopped with ZeroDivisionError"),
        ("\ndef f():\n    raise ValueError('no\\nway')\nf()", "line 4", "ValueError: no way"),
        ("import nothing_like_it", "line 2", "ModuleNotFoundError"),
        ("import sys\nsys.exit(3)", "line 3", "ended itself: 3"),
        ("part = (", "line 2", "is no Python"),
        ("x = Box(1, 2, 3)", None, "leaves no model; let it assign part, sketch or result"),
        ("part = 3", None, "part is of type int, no shape"),
        ("part = []", None, "part is empty"),
        ("with BuildPart() as part:\n    pass", None, "part is empty"),
        ("part = Sphere(2)", None, "holds no lines or curves, only 1 body (has no level face"),
        ("sketch = Plane.XZ * Circle(2)", None, "has no level face"),
        ("result = Line((0, 0, 0), (1, 1, 1))", None, "only 1 body (is not level)"),
        ("fillet(Box(1, 1, 1).edges(), 3)", "line 2", "stopped with"),
    ],
)
def test_faults_of_a_script_name_its_line(text: str, where: str | None, message: str) -> None:
    with pytest.raises(DrawingError) as caught:
        script(text)
    assert message in str(caught.value)
    assert caught.value.where == where
    assert caught.value.file == "p.py"


def test_scripts_are_not_run_unasked(tmp_path: Path) -> None:
    path = tmp_path / "part.py"
    path.write_text(f"open({str(tmp_path / 'ran')!r}, 'w')")
    with pytest.raises(DrawingError, match=r"runs with all your rights.*--allow-scripts"):
        read_drawing(path)
    with pytest.raises(DrawingError, match="runs with all your rights"):
        drawn(path.read_bytes(), "<stdin>", format="solid")
    assert not (tmp_path / "ran").exists()


def test_what_is_no_model_is_no_script() -> None:
    for data, name in ((b"words", "a.step"), (b"words", "a.BREP"), (b"\x00\x01", "a.py")):
        with pytest.raises(DrawingError, match="neither STEP nor BREP"):
            drawn(data, name, format="solid", allow_scripts=True)


@pytest.mark.usefixtures("here")
def test_sections_beside_the_model_are_refused_with_its_range(tmp_path: Path) -> None:
    data = brep(b.Pos(0, 0, 1) * b.Box(2, 2, 2), tmp_path)
    for height in (-0.1, 2.1):
        with pytest.raises(DrawingError, match=r"spans z = 0 to 2; give a --section-z"):
            drawn(data, section_z_mm=height)
    with pytest.raises(DrawingError, match="spans z = 0 to 0"):
        script("sketch = Circle(3)", section_z_mm=1.0)
    assert script("sketch = Circle(3)", section_z_mm=0.0).used == {"face": 1}


@pytest.mark.slow
def test_the_worker_runs_in_a_process_of_its_own(tmp_path: Path, capfd: Any) -> None:
    box = b.Box(4, 3, 2)
    assert drawn(step(box, tmp_path)).used == {"face": 1}
    capfd.readouterr()
    (tmp_path / "beside.py").write_text("SIZE = 4\n")
    path = tmp_path / "part.py"
    path.write_text(
        "import os\nprint('made')\nos.system('echo below')\nfrom build123d import Box\n"
        "from beside import SIZE\npart = Box(SIZE, SIZE, SIZE)\n"
    )
    allowed = ReadOptions(allow_scripts=True)
    assert read_drawing(path, options=allowed).used == {"face": 1}
    said = capfd.readouterr()
    assert said.out == ""
    assert "made" in said.err
    assert "below" in said.err
    path.write_text("import os\nos._exit(7)\n")
    with pytest.raises(DrawingError, match="ended the interpreter"):
        read_drawing(path, options=allowed)


@pytest.mark.slow
def test_damaged_files_are_refused_or_read_without_a_word(tmp_path: Path, capfd: Any) -> None:
    box = b.fillet(b.Box(8, 6, 4).edges().filter_by(b.Axis.Z), 1)
    data = named(box, tmp_path)
    with pytest.raises(DrawingError, match="its end is missing"):
        drawn(data[: len(data) // 2])
    lines = data.split(b"\n")
    rng = np.random.default_rng(3)
    capfd.readouterr()
    said = []
    for row in rng.integers(8, len(lines) - 3, size=6).tolist():
        damaged = b"\n".join([*lines[:row], b"garbage ;( '", *lines[row + 1 :]])
        try:
            drawing = drawn(damaged)
        except DrawingError as error:
            said.append(str(error))
        else:
            said.append(
                "" if DrawingCode.FILE_REPAIRED in {f.code for f in drawing.findings} else "!"
            )
    assert "!" not in said
    assert capfd.readouterr() == ("", "")


def test_complaints_of_the_reader_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    says = "print('\\x1b[32;1m*** ERR StepFile : Fails Count : 1 ***\\x1b[0m');"
    answers = "open(json.load(open(sys.argv[1]))['answer'], 'w').write('{}')"
    wanted = {"kind": "step", "file": "f", "height": None, "tolerance": 1e-3}
    monkeypatch.setattr(solid_process, "START", f"import json, sys; {says} {answers}")
    assert run_worker(b"", wanted, "f") == {"complaint": "ERR StepFile : Fails Count : 1"}
    monkeypatch.setattr(solid_process, "START", f"import json, sys; print('fine'); {answers}")
    assert run_worker(b"", wanted, "f") == {"complaint": ""}


def test_a_worker_that_dies_or_hangs_is_a_clean_error(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    wanted = {"kind": "step", "file": "f", "height": None, "tolerance": 1e-3}
    monkeypatch.setattr(solid_process, "START", "import os; os.abort()")
    with pytest.raises(DrawingError, match="damaged so badly that OpenCASCADE fails"):
        run_worker(b"", wanted, "f")
    monkeypatch.setattr(solid_process, "START", "import time; time.sleep(60)")
    monkeypatch.setattr(solid_process, "FILE_SECONDS", 0.2)
    with pytest.raises(DrawingError, match="is not read after 0 s"):
        run_worker(b"", wanted, "f")
    monkeypatch.undo()
    with pytest.raises(RuntimeError, match="KeyError"):
        run_worker(b"", {"kind": "script"}, "f")


def test_nothing_of_opencascade_is_loaded_by_the_reader() -> None:
    code = (
        "import sys, camtool.importers.solid.reader;"
        "sys.exit(any(name.split('.')[0] in ('OCP', 'build123d') for name in sys.modules))"
    )
    assert subprocess.run([sys.executable, "-c", code], env=dict(os.environ)).returncode == 0
