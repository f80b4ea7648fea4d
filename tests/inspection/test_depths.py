"""Depths of floors: closed forms, dense points of the slow twin, and verdicts of posted parts."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import camtool
from camtool.arrays import Floats
from camtool.errors import InputError
from camtool.geometry.polylines import Polyline, Polylines
from camtool.inspection.depths import Floor, depths_of, proposed_floors
from camtool.inspection.dimensions import Dimension, Kind, Limits, Place
from camtool.inspection.inspector import Inspector
from camtool.inspection.tolerances import read_tolerances
from camtool.inspection.verdicts import Tolerances, inspect
from camtool.run import Run
from camtool.stock.cutters import CutterProfile
from camtool.stock.wanted import ABOUT, INSIDE, WantedLayer, WantedSolid
from tests.oracles import stock_heights as slow
from tests.stock.cuts import moves_of

CERTAIN = (
    "uncertainty.z_zero_mm=0.0",
    "uncertainty.stock_thickness_mm=0.0",
    "uncertainty.z.backlash_mm=0.0",
    "uncertainty.z.scale=0.0",
    "uncertainty.process_mm=0.0",
    "uncertainty.temperature_k=0.0",
)
SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="60mm" height="40mm" viewBox="0 0 60 40">
<g fill="none" stroke="#ff0000"><rect x="5" y="5" width="30" height="30"/>
<circle cx="15" cy="15" r="4"/><rect x="40" y="5" width="12" height="12"/></g>
<g fill="none" stroke="#00ff00"><circle cx="28" cy="28" r="3"/></g>
<g fill="none" stroke="#0000ff"><path d="M40 25 H55"/><circle cx="55" cy="35" r="3"/></g>
</svg>"""
JOB = """
safe_z = "5mm"
feed = "400mm/min"
plunge_feed = "100mm/min"
spindle = 1000
[stock]
thickness = "8mm"
[tools.mill]
diameter = "3mm"
[[operations]]
name = "clear"
kind = "pocket"
colours = ["#ff0000"]
tool = "mill"
depth = "3mm"
step_down = "1.2mm"
[[operations]]
name = "deeper"
kind = "pocket"
colours = ["#00ff00"]
tool = "mill"
depth = "5mm"
step_down = "1mm"
[[operations]]
name = "groove"
kind = "engrave"
colours = ["#0000ff"]
tool = "mill"
depth = "1.5mm"
"""


def floor(layer: WantedLayer, depth: float, at: Place, *, is_line: bool = False) -> Floor:
    solid = WantedSolid((layer,), (), 0.05)
    return Floor(at, layer, solid, 0.0, np.empty((0, 3)), depth, is_line)


def square(side: float, depth: float) -> WantedLayer:
    """A square pocket with a corner at (0, 0)."""
    corners = np.array([[0, 0, 0], [side, 0, 0], [side, side, 0], [0, side, 0]], dtype=np.float64)
    lines = Polylines.of([Polyline(corners, closed=True)])
    return WantedLayer("pocket", lines, INSIDE, 0.0, depth, 0.0, depth)


def passes(cutter: CutterProfile, step: float, z: Floats) -> tuple[Floats, Floats]:
    """Passes along X over a square of 10 mm and beyond it; z (2,): at their ends."""
    y = np.arange(-2.0, 12.0, step)
    start = np.column_stack([np.full(len(y), -3.0), y, np.full(len(y), z[0])])
    return start, start + np.array([16.0, 0.0, z[1] - z[0]])


@pytest.mark.parametrize("step", [0.2, 0.7, 1.5])
def test_a_ball_leaves_scallops(step: float) -> None:
    ball = CutterProfile(3.0, 0.0, 3.0)
    moves = moves_of(*passes(ball, step, np.array([-2.0, -2.0])), 0, ball)
    (found,) = depths_of([floor(square(10.0, 2.0), 2.0, (5.0, 5.0))], moves)
    assert found is not None
    scallop = 3.0 - math.sqrt(9.0 - 0.25 * step**2)
    assert found.least_mm == pytest.approx(2.0 - scallop, abs=1.1e-4)
    assert found.least_mm <= 2.0 - scallop
    assert found.greatest_mm == pytest.approx(2.0, abs=1e-9)


def test_a_floor_that_slopes_is_as_deep_as_its_ends() -> None:
    flat = CutterProfile(1.0, 1.0)
    moves = moves_of(*passes(flat, 0.5, np.array([-1.0, -2.6])), 0, flat)
    (found,) = depths_of([floor(square(10.0, 2.0), 2.0, (5.0, 5.0))], moves)
    assert found is not None
    # z = −1 − 0.1 (x + 3 + radius) under the front edge, between 0.05 and 9.95 beyond the walls;
    # beside an axis it is the edge of the disc, no nearer than half a pass.
    off = math.sqrt(1.0 - 0.25**2)
    assert found.greatest_mm == pytest.approx(1.0 + 0.1 * (9.95 + 3.0 + 1.0), abs=2e-4)
    assert 1.0 + 0.1 * (0.05 + 3.0 + off) - 2e-4 <= found.least_mm
    assert found.least_mm <= 1.0 + 0.1 * (0.05 + 3.0 + 1.0)


@pytest.mark.parametrize("seed", range(3))
def test_no_dense_point_lies_beyond_the_bounds(seed: int) -> None:
    """Random moves over a floor, with gaps: the bounds hold every point of the slow twin, and some
    come near them."""
    rng = np.random.default_rng(seed)
    cutter = (CutterProfile(1.5, 1.5), CutterProfile(1.5, 0.7, 0.8), CutterProfile(1.5, 0.0, 1.5))
    start = np.column_stack([rng.uniform(0, 6, (40, 2)), rng.uniform(-2.0, -1.0, 40)])
    end = start + rng.normal(0.0, 2.0, (40, 3)) * [1.0, 1.0, 0.1]
    moves = moves_of(start, end, 0, cutter[seed % 3])
    (found,) = depths_of([floor(square(6.0, 2.0), 2.0, (3.0, 3.0))], moves)
    assert found is not None
    place = np.linspace(0.06, 5.94, 19)
    points = np.stack(np.meshgrid(place, place), axis=-1).reshape(-1, 2)
    depth = -slow.heights(moves, points)
    assert depth.min() >= found.least_mm - 1e-7
    assert depth.max() <= found.greatest_mm + 1e-7
    assert depth.max() >= found.greatest_mm - 0.05


def test_a_pointed_groove_is_looked_at_along_its_line() -> None:
    bit = CutterProfile(2.0, 0.0, rise=1.0)
    moves = moves_of([[0.0, 0.0, -1.0]], [[10.0, 0.0, -1.5]], 0, bit)
    line = Polylines.of([Polyline(np.array([[1.0, 0.0, 0.0], [9.0, 0.0, 0.0]]))])
    # The deepest within 0.05 mm, where the line falls by 1 in 20.
    groove = WantedLayer("groove", line, ABOUT, 1.5, 0.0, 1.0, 1.5)
    (found,) = depths_of([floor(groove, 1.5, (5.0, 0.4), is_line=True)], moves)
    assert found is not None
    assert (found.here_mm, found.least_mm, found.greatest_mm) == pytest.approx(
        (1.2525, 1.0525, 1.4525), abs=1e-6
    )


def posted(folder: Path, *settings: str) -> Run:
    drawing, job = folder / "part.svg", folder / "part.toml"
    drawing.write_text(SVG)
    job.write_text(JOB)
    target = camtool.load_target("grbl", settings=[*CERTAIN, *settings])
    return camtool.post(drawing, target, camtool.read_job(job))


def dimension(
    kind: Kind, place: Place, limits: tuple[float, float] | None = (-0.02, 0.02)
) -> Dimension:
    said = None if limits is None else Limits(*limits, "limits")
    return Dimension(f"{kind} at {place}", kind, (place,), "test", limits=said)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    found = posted(tmp_path_factory.mktemp("part"))
    assert not found.failed
    return found


def test_floors_of_a_part_are_as_deep_as_its_operations(run: Run) -> None:
    """Y points up: the island is at (15, 25), the deeper pocket at (28, 12), a groove at Y 15."""
    asked = {
        (7.0, 20.0): 3.0,  # around the island and the deeper pocket, which are not of it
        (28.0, 12.0): 5.0,
        (46.0, 29.0): 3.0,
        (48.0, 15.0): 1.5,
        (52.0, 5.0): 1.5,
    }
    every = [dimension("depth", place) for place in asked]
    every += [dimension("thickness", place) for place in asked]
    report = inspect(run, Tolerances(tuple(every))).report
    assert report is not None
    assert [each.verdict for each in report.inspection] == ["in"] * 10
    for each, deep in zip(report.inspection, [*asked.values()] * 2, strict=True):
        size = deep if each.kind == "depth" else 8.0 - deep
        assert each.nominal_mm == size
        assert (each.low_mm, each.fit_mm, each.high_mm) == pytest.approx((size,) * 3, abs=6e-4)
        assert each.low_mm <= size <= each.high_mm
        assert each.standard_um == 0.0


def test_what_is_no_floor_is_not_inspected(run: Run) -> None:
    places = [(15.0, 25.0), (1.0, 1.0), (100.0, 0.0), (55.0, 5.0)]
    every = Tolerances(tuple(dimension("depth", place) for place in places), require="in")
    found = inspect(run, every)
    assert found.report is not None
    assert not found.report.inspection
    errors = [each.message for each in found.findings if "cuts no floor" in each.message]
    assert len(errors) == 4
    assert found.failed


def test_z_that_is_off_shows_in_every_depth(run: Run, tmp_path: Path) -> None:
    """Backlash of Z is taken up downwards; a screw that goes 1 % too far cuts 1 % too deep."""
    longer = posted(tmp_path, "axes.z.real_step_mm=0.00404", "axes.z.coded_step_mm=0.004")
    (found,) = Inspector(longer, [dimension("depth", (28.0, 12.0))]).sizes()
    assert found.fit_mm == pytest.approx(5.05, abs=1e-3)
    report = inspect(longer, Tolerances((dimension("depth", (28.0, 12.0)),))).report
    assert report is not None
    assert report.inspection[0].verdict == "out"


def test_tabs_are_not_of_the_floor(tmp_path: Path) -> None:
    drawing, job = tmp_path / "part.svg", tmp_path / "part.toml"
    drawing.write_text(SVG)
    groove = """[[operations]]
name = "groove"
kind = "profile"
side = "outside"
colours = ["#ff0000"]
select_size = "29mm.."
tool = "mill"
depth = "2mm"
tabs = "2:4mm:0.5mm"
"""
    job.write_text(JOB[: JOB.index("[[operations]]")] + groove)
    target = camtool.load_target("grbl", settings=CERTAIN)
    run = camtool.post(drawing, target, camtool.read_job(job))
    (size,) = Inspector(run, [dimension("depth", (20.0, 3.5))]).sizes()
    assert (size.low_mm, size.high_mm) == pytest.approx((2.0, 2.0), abs=6e-4)


def test_proposed_floors_are_those_of_the_job(run: Run, tmp_path: Path) -> None:
    assert run.drawing is not None
    assert run.job is not None
    found = list(proposed_floors(run.drawing, run.job, run.target.machine))
    sizes = sorted((each.kind, each.nominal_mm) for each in found)
    wanted = {"depth": [1.5, 1.5, 3.0, 3.0, 5.0], "thickness": [3.0, 5.0, 5.0]}
    assert sizes == [(kind, size) for kind, every in wanted.items() for size in every]
    assert len({each.name for each in found}) == 8
    report = inspect(run, Tolerances(tuple(found))).report
    assert report is not None
    for each, size in zip(found, report.inspection, strict=True):
        assert size.fit_mm == pytest.approx(each.nominal_mm, abs=6e-4)


def test_uncertainties_of_z_add_up(tmp_path: Path) -> None:
    own = {"z_zero_mm": 0.01, "z.scale": 0.002, "process_mm": 0.004, "stock_thickness_mm": 0.03}
    settings = [f"uncertainty.{key}={value}" for key, value in own.items()]
    run = posted(tmp_path, *settings, "axes.z.repeatability_mm=0.006")
    both = Tolerances((dimension("depth", (7, 20)), dimension("thickness", (7, 20))))
    report = inspect(run, both).report
    assert report is not None
    depth, thickness = report.inspection
    standard = math.hypot(0.01, 3.0 * 0.002, 0.004, 0.006)
    assert depth.standard_um == pytest.approx(1e3 * standard, rel=1e-3)
    assert thickness.standard_um == pytest.approx(1e3 * math.hypot(standard, 0.03), rel=1e-3)
    chance = math.erf(0.02 / standard / math.sqrt(2.0))
    assert depth.probability == pytest.approx(chance, abs=0.01)
    assert depth.verdict == "undecided"
    assert depth.measure == "z_zero_mm"


def test_what_nobody_says_of_z_leaves_a_depth_open(tmp_path: Path) -> None:
    drawing, job = tmp_path / "part.svg", tmp_path / "part.toml"
    drawing.write_text(SVG)
    job.write_text(JOB)
    run = camtool.post(drawing, "grbl", camtool.read_job(job))
    report = inspect(run, Tolerances((dimension("depth", (7, 20)),))).report
    assert report is not None
    (each,) = report.inspection
    assert each.verdict == "undecided"
    assert {"z_zero_mm", "z.backlash_mm", "z.scale", "process_mm"} <= set(each.unknown)
    assert not {"x.scale", "x.backlash_mm", "stock_thickness_mm"} & set(each.unknown)


def test_a_through_cut_has_no_depth(tmp_path: Path) -> None:
    run = posted(tmp_path)
    deep = dimension("depth", (28.0, 12.0))
    thin = camtool.post(
        tmp_path / "part.svg", run.target, camtool.read_job(_thinner(tmp_path / "part.toml"))
    )
    found = inspect(thin, Tolerances((deep,)))
    said = [each.message for each in found.findings if "goes through the stock" in each.message]
    assert len(said) == 1
    assert "5 mm deep in 5 mm" in said[0]


def _thinner(job: Path) -> Path:
    text = job.read_text().replace('thickness = "8mm"', 'thickness = "5mm"')
    file = job.with_name("thin.toml")
    file.write_text(text)
    return file


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ('kind = "depth"', "key at: key is missing"),
        ('kind = "depth"\nat = [1, 2]\nnominal = "-3mm"', "nominal '-3mm' is not between"),
        ('kind = "depth"\nat = [1, 2]\nnominal = "3 furlongs"', "furlongs"),
        ('kind = "depth"\nat = [1, 2]\nzone = "1mm"', "a depth has no zone"),
        ('kind = "thickness"\nat = [1, 2]\nfrom = [1, 2]', "a thickness has no from"),
        ('kind = "depth"\nat = [1, 2]\nnominal = "1in"\nlimits = "±0.1mm"', "contradict"),
        ('kind = "depth"\nat = [1, 2]\nnominal = "3mm"\nlimits = "+0.1"', "one number of two"),
    ],
)
def test_wrong_rows_name_their_place(row: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "wrong.toml"
    file.write_text(f"[[dimension]]\n{row}\n")
    with pytest.raises(InputError) as error:
        read_tolerances(file)
    assert message in str(error.value)
    assert "dimension 1" in str(error.value)


def test_meet_judges_a_depth_whose_nominal_size_is_the_jobs(tmp_path: Path) -> None:
    posted(tmp_path)
    file = tmp_path / "limits.toml"
    file.write_text('[[dimension]]\nkind = "depth"\nat = [28, 12]\nlimits = "±0.02"\n')
    target = camtool.load_target("grbl", settings=CERTAIN)
    met = camtool.meet(tmp_path / "part.svg", target, file, job=tmp_path / "part.toml")
    assert not met.certificate
