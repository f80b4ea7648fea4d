"""How wide pictures draw a tool: as it cuts at the surface."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry.polylines import Polyline
from camtool.pictures.chains import Chain, tapers
from camtool.pictures.content import content_of
from camtool.pictures.draw import draw, render
from camtool.pictures.scene import scene_of
from camtool.pictures.viewer.page import viewer_page
from camtool.pipeline import post_drawing, read_program
from camtool.planning.job import Job, Operation, Tool
from camtool.records import replace
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from tests.drawings import drawing_of
from tests.oracles import svg_page
from tests.oracles.page_paths import program_paths, svg_paths, viewer_column

CORNERS = [[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0.0]]
SQUARE = Polyline(np.array(CORNERS), closed=True)
BIT = Tool(6.0, "v", 1.5707963267948966)


def width(*operations: Operation) -> float | None:
    """The width that the picture of these operations has."""
    job, target = Job(operations), load_target("linuxcnc")
    run = post_drawing(drawing_of([SQUARE]), job, target, check=False)
    return scene_of(title="", drawing=drawing_of([SQUARE]), job=job, toolpath=run.decoded).tool_mm


@pytest.mark.parametrize(
    ("operation", "wide"),
    [
        (Operation("engrave", tool=BIT, depth_mm=0.5), 1.0),
        (Operation("engrave", tool=BIT, depth_mm=1.0, step_down_mm=0.3), 2.0),
        (Operation("engrave", tool=BIT, depth_mm=4.0), 6.0),
        (Operation("engrave", tool=Tool(2.0, "ball"), depth_mm=1.0), 2.0),
        (Operation("engrave", tool=Tool(2.0), depth_mm=0.1), 2.0),
        (Operation("vcarve", tool=BIT, depth_mm=2.0), None),
    ],
)
def test_a_bit_is_as_wide_as_it_cuts_at_its_depth(
    operation: Operation, wide: float | None
) -> None:
    found = width(operation)
    assert found == (None if wide is None else pytest.approx(wide))


def test_several_depths_of_several_operations_have_no_single_width() -> None:
    shallow = Operation("engrave", "one", tool=BIT, depth_mm=0.5)
    deep = Operation("engrave", "two", tool=BIT, depth_mm=1.0)
    assert width(shallow, deep) is None


def outline(chain: Chain) -> shapely.Polygon:
    """Return the area of a closed chain, its arcs in dense chords."""
    places = []
    for k, sweep in enumerate(chain.sweep.tolist()):
        spoke = chain.points[k] - chain.centre[k]
        for turn in np.linspace(0.0, sweep, 200, endpoint=False) if sweep else [0.0]:
            cos, sin = math.cos(turn), math.sin(turn)
            turned = np.array([cos * spoke[0] - sin * spoke[1], sin * spoke[0] + cos * spoke[1]])
            places.append(chain.centre[k] + turned if sweep else chain.points[k])
    return shapely.Polygon(places)


small = st.floats(-3.0, 3.0)


@given(st.lists(st.tuples(small, small, st.floats(-2.0, 0.0)), min_size=2, max_size=6))
def test_a_slope_cuts_what_the_discs_along_it_cover(
    places: list[tuple[float, float, float]],
) -> None:
    builder = ToolpathBuilder()
    builder.rapid(places[0][0], places[0][1], 1.0)
    for x, y, z in places:
        builder.line(x, y, round(z, 3), feed=100.0)
    toolpath = builder.finish()
    found = shapely.union_all([outline(each).buffer(0) for each in tapers(toolpath, lambda d: d)])
    discs = []
    for row in np.flatnonzero(toolpath.is_feed).tolist():
        start, end = toolpath.starts[row], toolpath.end[row]
        for share in np.linspace(0.0, 1.0, 60):
            x, y, z = start + share * (end - start)
            if z < -1e-3:
                discs.append(shapely.Point(x, y).buffer(-z, quad_segs=64))
    swept = shapely.union_all(discs)
    assert swept.difference(found.buffer(2e-3)).is_empty
    # Between the discs of a coarse row their hull covers more.
    assert found.difference(swept.buffer(0.1)).is_empty


def test_a_carving_is_drawn_as_wide_as_it_cuts() -> None:
    job, target = Job((Operation("vcarve", tool=BIT, depth_mm=2.0),)), load_target("linuxcnc")
    run = post_drawing(drawing_of([SQUARE]), job, target, check=False)
    scene = scene_of(title="", drawing=drawing_of([SQUARE]), job=job, toolpath=run.decoded)
    swept = shapely.union_all(
        [outline(each).buffer(0) for each in content_of(scene).swept[0].chains]
    )
    square = shapely.box(0, 0, 10, 10)
    assert swept.difference(square.buffer(0.01)).is_empty
    assert b"as wide as it is deep" in render(scene, "sign.svg")


FINE, WIDE = Tool(1.0, number=1), Tool(3.0, number=2)
SEVERAL = Job(
    (
        Operation("profile", "inner", tool=FINE, depth_mm=1.0, side="inside"),
        Operation("profile", "outer", tool=WIDE, depth_mm=2.0, side="outside"),
        Operation("vcarve", "sign", tool=replace(BIT, number=3), depth_mm=0.5),
    )
)
RADII = {1: lambda depth: 0.5, 2: lambda depth: 1.5, 3: lambda depth: depth}
"""Of the tools, by their numbers, at a depth."""


def cut_by(text: str) -> shapely.Geometry:
    """Return the area that a program cuts at the surface, from its words alone."""
    found, discs = program_paths(text), []
    for path, (first, last), tool in zip(found.cuts, found.z, found.tools, strict=True):
        for (x, y), z in zip(path, np.linspace(first, last, len(path)), strict=True):
            if z < -1e-3:
                discs.append(shapely.Point(x, y).buffer(RADII[tool](-z), quad_segs=32))
    return shapely.union_all(discs)


def test_cuts_of_several_tools_are_as_wide_as_each_cuts() -> None:
    run = post_drawing(drawing_of([SQUARE]), SEVERAL, load_target("linuxcnc"))
    cut, scene = cut_by(run.program.data.decode()), run.scene()
    group = svg_page.parse(draw(scene))
    shown = []
    for each in group.iter(f"{svg_page.SVG}g"):
        if not (each.get("id") or "").startswith("swept"):
            continue
        wide = 0.5 * float(each.get("stroke-width", 0.0))
        for path in each.iter(f"{svg_page.SVG}path"):
            for piece in path.attrib["d"].split("M")[1:]:
                path.attrib["d"] = f"M{piece}"
                line = shapely.LineString(np.concatenate(svg_paths(path)))
                shown.append(line.buffer(wide) if wide else shapely.Polygon(line).buffer(0))
    swept = shapely.union_all(shown)
    assert cut.difference(swept.buffer(0.02)).is_empty
    assert swept.difference(cut.buffer(0.02)).is_empty
    assert "cuts: 1 mm, 3 mm, V bit" in draw(scene)


def test_tools_of_a_program_from_a_file_are_those_of_its_job() -> None:
    target = load_target("linuxcnc")
    run = post_drawing(drawing_of([SQUARE]), SEVERAL, target)
    assert run.program is not None
    read = read_program(run.program.data, target, source="a.ngc")
    assert read.scene().turns == ()
    tools = [tool for _, tool in replace(read, job=SEVERAL).scene().turns]
    mounted = list(dict.fromkeys(tool for _, tool in run.scene().turns))
    assert list(dict.fromkeys(tools)) == mounted
    assert "cuts: 1 mm, 3 mm, V bit" in draw(replace(read, job=SEVERAL).scene())
    other = replace(SEVERAL, operations=SEVERAL.operations[:2])
    assert replace(read, job=other).scene().turns == ()


def test_the_viewer_knows_the_width_of_each_of_several_tools() -> None:
    run = post_drawing(drawing_of([SQUARE]), SEVERAL, load_target("linuxcnc"))
    page = viewer_page(run.scene()).decode()
    found = program_paths(run.program.data.decode())
    wide = viewer_column(page, "move_wide").reshape(-1, 2)
    kinds = viewer_column(page, "move_kind")
    shown = wide[(kinds >= 1) & (kinds <= 3)].tolist()
    expected = [
        [RADII[tool](max(-z, 0.0)) for z in ends] if min(ends) < 0.0 else [0.0, 0.0]
        for ends, tool in zip(found.z, found.tools, strict=True)
    ]
    assert shown == pytest.approx(np.array(expected), abs=1e-4)
    assert '"swept":"cuts: 1 mm, 3 mm, V bit"' in page
