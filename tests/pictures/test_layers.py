"""Layers: what each shows, and pictures with some of them only."""

import math
import subprocess
import sys
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from camtool.errors import OptionError
from camtool.geometry.drawing import Gap
from camtool.pictures.chains import reversals_of
from camtool.pictures.colours import VERDICTS
from camtool.pictures.content import content_of
from camtool.pictures.draw import draw
from camtool.pictures.layers import chosen, layer_names, layers_in, usual_layers
from camtool.pictures.options import PictureOptions
from camtool.pictures.page import page_of
from camtool.pictures.plot import CLEAR, labels_beside
from camtool.pictures.scene import Scene
from camtool.records import replace
from camtool.toolpath.builder import ToolpathBuilder
from camtool.verification.report import InspectedReport
from tests.oracles import literal_reversals, svg_page
from tests.pictures.conftest import (
    SCENES,
    circle,
    cut_by,
    drawing_of,
    followed,
    plate,
    scene_of_toolpath,
)

LAYERS = layer_names()
MILLED = replace(
    scene_of_toolpath(followed(plate()), title="", drawing=plate()),
    tool_mm=0.5,
    cut=cut_by(followed(plate()), 0.5),
    stock_mm=(-1.0, -1.0, 6.0, 4.0),
    pins=((2.5, -0.5), (2.5, 3.7)),
    flips=(((2.5, -1.2), (2.5, 4.2)),),
    tabs=((1.0, 0.5),),
    inspected=tuple(
        InspectedReport(
            name="width",
            kind="distance",
            source="test",
            places_mm=((0.5, y), (4.5, y)),
            nominal_mm=4.0,
            limits="±0.01",
            lower_mm=3.99,
            upper_mm=4.01,
            fit_mm=4.002,
            low_mm=4.001,
            high_mm=4.003,
            verdict=verdict,
            standard_um=3.0,
        )
        for y, verdict in enumerate(VERDICTS)
    ),
)
JUDGED = replace(SCENES["result"], worst=((4.5, 2.5), (2.5, 0.5), (4.5, 2.5)))
GROUPS = {
    "drawing": ("drawing",),
    "swept": ("swept",),
    "stock": ("stock", "flips"),
    "pins": ("pins",),
    "rapids": ("rapids",),
    "feeds": ("feeds",),
    "plunges": ("plunges",),
    "order": ("order",),
    "arrows": ("arrows",),
    "reversals": ("reversals",),
    "engagement": ("engagement", "engagement-scale"),
    "tabs": ("tabs",),
    "dimensions": tuple(f"dimensions-{verdict}" for verdict in VERDICTS),
    "sizes": ("sizes", *(f"ends-{verdict}" for verdict in VERDICTS)),
    "zero": ("part-zero",),
}


def ids(scene: Scene, *layers: str) -> set[str]:
    svg = draw(scene, PictureOptions(layers=frozenset(layers)))
    return {g.attrib["id"] for g in svg_page.parse(svg).iter() if "id" in g.attrib}


def present(scene: Scene, *layers: str) -> set[str]:
    """The layers, of these or of all, that have something to show."""
    return set(layers_in(content_of(scene, PictureOptions(layers=frozenset(layers or LAYERS)))))


@pytest.mark.parametrize("layer", list(GROUPS))
def test_a_layer_alone_shows_itself_alone(layer: str) -> None:
    shown = ids(MILLED, layer)
    assert set(GROUPS[layer]) <= shown
    others = {group for name, groups in GROUPS.items() if name != layer for group in groups}
    assert not others & shown


@pytest.mark.parametrize("layer", list(GROUPS))
def test_without_a_layer_the_others_stay(layer: str) -> None:
    shown = ids(MILLED, *(set(LAYERS) - {layer}))
    assert not set(GROUPS[layer]) & shown
    others = {group for name, groups in GROUPS.items() if name != layer for group in groups}
    assert others <= shown


def test_layers_do_not_move_the_picture() -> None:
    usual = content_of(JUDGED).window
    for layer in LAYERS:
        options = PictureOptions(layers=frozenset(LAYERS) - {layer})
        assert content_of(JUDGED, options).window.tolist() == usual.tolist()


def test_names_of_layers_are_checked() -> None:
    assert chosen([], []) == usual_layers() == set(LAYERS) - {"reversals", "engagement"}
    assert chosen(["feeds", "order"], ["order"]) == {"feeds"}
    with pytest.raises(OptionError) as found:
        chosen(["reversal"], [])
    assert "did you mean reversals?" in str(found.value)
    with pytest.raises(OptionError, match="no layer"):
        chosen([], ["x"])
    with pytest.raises(OptionError, match="no layer is left"):
        chosen(["feeds"], ["feeds"])


def test_layers_with_nothing_to_show_are_known() -> None:
    empty = {"travel", "starts", "path", "worst", "doubts"}  # each contour begins with a plunge
    assert present(MILLED) == set(LAYERS) - empty
    assert "swept" not in present(replace(MILLED, tool_mm=None))
    below = present(JUDGED)
    assert not {"rapids", "plunges", "starts", "order", "arrows"} & below
    assert {"path", "worst", "feeds", "zero"} <= below
    assert present(JUDGED, "order", "arrows") == {"order", "arrows"}  # without the path
    groups = {g for name in LAYERS if name not in empty for g in GROUPS.get(name, ())}
    assert groups <= ids(MILLED, *LAYERS)


def test_the_tool_is_drawn_at_its_true_width() -> None:
    root = svg_page.parse(draw(MILLED))
    swept = svg_page.group(root, "swept")
    assert swept is not None
    assert float(swept.attrib["stroke-width"]) == 0.5
    assert "tool 0.5 mm wide" in {g.get("aria-label") for g in root.iter()}
    feeds = svg_page.group(root, "feeds")
    assert feeds is not None
    assert swept[0].attrib["d"] == feeds[0].attrib["d"]


def test_what_a_wide_tool_covers_is_in_the_picture() -> None:
    window = content_of(replace(MILLED, tool_mm=8.0)).window
    assert (window[:, 0] < 0.5 - 4.0).all()
    assert (window[:, 1] > 4.5 + 4.0).all()


def test_contours_are_numbered_in_their_order() -> None:
    root = svg_page.parse(draw(MILLED))
    order = svg_page.group(root, "order")
    assert order is not None
    assert [g.get("aria-label") for g in order if "aria-label" in g.attrib] == ["1", "2"]


def test_no_number_covers_another_and_crowded_ones_are_left_out() -> None:
    view = page_of(content_of(SCENES["many paths"])).view
    rng = np.random.default_rng(7)
    for count in (10, 100, 400):
        numbers = [str(number) for number in range(1, count + 1)]
        found = labels_beside(numbers, rng.uniform(0.0, 500.0, (count, 2)).tolist(), view)
        for one, other in combinations([label.box for label in found], 2):
            apart = one[2] + CLEAR <= other[0] or other[2] + CLEAR <= one[0]
            assert apart or one[3] + CLEAR <= other[1] or other[3] + CLEAR <= one[1]
        names = [int(label.text) for label in found]
        assert names == sorted(names)
        assert len(names) <= count
    assert len(found) < 400  # there is no room for all


def test_the_worst_places_have_rings_and_ranks() -> None:
    layer = svg_page.group(svg_page.parse(draw(JUDGED)), "worst")
    assert layer is not None
    assert [g.get("aria-label") for g in layer if "aria-label" in g.attrib] == ["1", "2", "3"]
    assert len([circle for circle in layer if circle.tag.endswith("circle")]) == 3


def test_an_axis_reverses_at_corners_and_at_quarters_of_circles() -> None:
    full = ToolpathBuilder((2.0, 0.0, 0.0)).arc(2.0, 0.0, centre=(0.0, 0.0), ccw=True, feed=1.0)
    turns = reversals_of(full.finish())
    # At 0° it begins and ends: nothing goes before and nothing comes after.
    assert turns == pytest.approx(np.array([[0.0, 2.0], [-2.0, 0.0], [0.0, -2.0]]), abs=1e-12)
    tour = ToolpathBuilder()
    for x, y in ((1.0, 1.0), (2.0, 0.0), (3.0, 0.0), (2.0, 0.0)):
        tour.line(x, y, feed=1.0)
    assert reversals_of(tour.finish()).tolist() == [[1.0, 1.0], [3.0, 0.0]]


def test_a_reversal_counts_when_the_tool_is_fed_after_it() -> None:
    air = ToolpathBuilder().line(1.0, 0.0, feed=1.0).rapid(0.0, 0.0).line(1.0, 0.0, feed=1.0)
    assert reversals_of(air.finish()).tolist() == [[0.0, 0.0]]


@pytest.mark.parametrize("ccw", [False, True])
def test_reversals_are_those_of_a_finely_sampled_path(ccw: bool) -> None:
    path = ToolpathBuilder((1.0, 0.0, 0.0))
    path.arc(math.cos(2.0), math.sin(2.0), centre=(0.0, 0.0), ccw=ccw, feed=1.0)
    path.line(-2.0, 0.3, feed=1.0).line(-1.0, 2.0, feed=1.0)
    toolpath = path.finish()
    sweep = float(toolpath.sweeps()[0])
    angle = np.linspace(0.0, sweep, 20_001)
    points = np.column_stack([np.cos(angle), np.sin(angle)])
    points = np.concatenate([points, toolpath.end[1:, :2]])
    last, found = np.zeros(2), 0
    for step in np.sign(np.diff(points, axis=0)):
        found += bool((step * last < 0).any())
        last = np.where(step == 0, last, step)
    assert len(reversals_of(toolpath)) == found


@pytest.mark.parametrize("seed", range(30))
def test_reversals_are_those_of_the_literal_loop(seed: int) -> None:
    rng = np.random.default_rng(seed)
    path, (x, y) = ToolpathBuilder(), (0.0, 0.0)
    for kind in rng.integers(0, 5, 40).tolist():
        if kind > 2:
            radius = float(rng.integers(1, 3))
            cx, cy = x + radius * (-1) ** int(rng.integers(2)), y
            turn = float(rng.choice([0.5 * math.pi, math.pi, 2.0 * math.pi, 2.1]))
            cos, sin = math.cos(turn), math.sin(turn)
            x, y = cx + cos * (x - cx) - sin * (y - cy), cy + sin * (x - cx) + cos * (y - cy)
            path.arc(x, y, centre=(cx, cy), ccw=bool(kind == 3), feed=1.0)
        else:
            x, y = rng.integers(-3, 4, 2).astype(float).tolist()
            path.rapid(x, y) if kind == 0 else path.line(x, y, feed=1.0)
    toolpath = path.finish()
    assert reversals_of(toolpath) == pytest.approx(
        literal_reversals.reversals_of(toolpath), abs=1e-12
    )


def test_pictures_of_all_layers_are_drawn() -> None:
    scene = scene_of_toolpath(followed(drawing_of([circle(1.0, 1.0, 1.0)], ["0"])), title="all")
    assert draw(scene, PictureOptions(layers=frozenset(LAYERS)))


def rows_of_marks(count: int) -> Scene:
    b = ToolpathBuilder().rapid(z=1.0)
    for k in range(count):
        b.rapid(float(k % 40), float(k // 40)).line(z=-1.0, feed=5.0)
        b.line(k % 40 + 0.5, feed=5.0).rapid(z=1.0)
    return Scene("marks", toolpath=b.finish())


def test_of_very_many_contours_some_are_numbered() -> None:
    root = svg_page.parse(draw(rows_of_marks(1200), options=PictureOptions(size_px=4000)))
    order = svg_page.group(root, "order")
    assert order is not None
    shown = [int(g.attrib["aria-label"]) for g in order if "aria-label" in g.attrib]
    assert shown[0] == 1
    assert len(shown) > 30
    assert all(number % 20 == 0 for number in shown[1:])
    first = {count: content_of(rows_of_marks(count)).order[0][:3] for count in (100, 101, 7000)}
    assert first == {100: ["1", "2", "3"], 101: ["1", "2", "4"], 7000: ["1", "100", "200"]}


def test_rims_of_marks_shrink_with_them() -> None:
    root = svg_page.parse(draw(rows_of_marks(1200)))
    plunges = svg_page.group(root, "plunges")
    assert plunges is not None
    radius, rim = float(plunges[0].attrib["r"]), float(plunges.attrib["stroke-width"])
    assert radius / rim == pytest.approx(5.0 / 1.6, rel=0.02)


def test_numbers_lie_over_all_other_marks() -> None:
    gapped = drawing_of([circle(2.5, 2.5, 1.0)], ["0"], (Gap((3.5, 2.5), 0.1, ""),))
    svg = draw(
        replace(SCENES["toolpath"], drawing=gapped),
        options=PictureOptions(layers=frozenset(LAYERS)),
    )
    marks = ("plunges", "reversals", "arrows", "part-zero", "gaps")
    assert svg.index('id="order"') > max(svg.index(f'id="{name}"') for name in marks)


def test_arrows_of_passes_over_each_other_are_left_out() -> None:
    b = ToolpathBuilder()
    for depth, (low, high) in enumerate([(0.0, 10.0), (0.1, 9.9), (0.2, 9.8)]):
        b.rapid(z=1.0).rapid(low, 0.0).line(z=-1.0 - depth, feed=5.0).line(high, 0.0, feed=5.0)
    svg = draw(Scene("passes", toolpath=b.rapid(z=1.0).finish()))
    arrows = svg_page.group(svg_page.parse(svg), "arrows")
    assert arrows is not None
    assert arrows[0].attrib["d"].count("M") == 1


ONE_ROW = """
import sys
from camtool.pictures import layers

def corners(content):
    places = [place for chain in content.outlines for place in chain.points.tolist()]
    return [layers.DotGroup("corners", "corner", places, layers.POINT_MARK)]

layers.LAYERS += (layers.Layer("corners", corners, needs="drawing"),)
from camtool.cli.main import main
sys.argv = ["camtool", "preview", *sys.argv[1:]]
main()
"""
"""A program that adds a layer, and runs `camtool preview`."""


def test_a_layer_is_added_by_one_row(tmp_path: Path) -> None:
    """Help, pictures, legends, checks, messages and the viewer's pages know it."""

    def ran(*arguments: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-c", ONE_ROW, *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    (tmp_path / "box.csv").write_text("0,0\n4,0\n4,4\n0,4\n0,0\n")
    (tmp_path / "points.csv").write_text("1,1\n")
    box, picture = str(tmp_path / "box.csv"), tmp_path / "box.svg"
    assert "doubts, corners." in " ".join(ran("--help").stdout.split())
    assert ran(box, "-o", str(picture)).returncode == 0
    root = svg_page.parse(picture.read_text(encoding="utf-8"))
    layer = svg_page.group(root, "corners")
    assert layer is not None
    assert len(layer) == 5
    assert "corner" in {g.get("aria-label") for g in root.iter()}
    assert ran(box, "-o", str(picture), "--no-layer", "corners").returncode == 0
    assert svg_page.group(svg_page.parse(picture.read_text(encoding="utf-8")), "corners") is None
    assert "did you mean corners?" in ran(box, "-o", str(picture), "--layers", "corner").stderr
    program = ["-t", "grbl", "-o", str(picture), "--layers", "corners,rapids"]
    (tmp_path / "a.nc").write_text("G0 X1\nG1 X2 F100\nM2\n")
    said = ran(str(tmp_path / "a.nc"), *program).stderr
    assert "--layers corners: nothing in this picture" in said
    page = tmp_path / "box.html"
    assert ran(box, "-o", str(page)).returncode == 0
    assert '"rows":[{"name":"corners",' in page.read_text()
