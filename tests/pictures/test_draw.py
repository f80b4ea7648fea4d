"""Whole pictures: well-formed, complete, the same every time, and nothing over anything else."""

import math
import os
import re
import subprocess
import sys
from itertools import combinations
from xml.etree.ElementTree import Element

import numpy as np
import pytest

from camtool.errors import OptionError
from camtool.geometry.drawing import Branch, Gap, Healing, Mark, SelfCrossing
from camtool.pictures.colours import FEED, PAPER, PLUNGE, RAPID, bin_colours, on_dark
from camtool.pictures.content import content_of
from camtool.pictures.draw import draw, png
from camtool.pictures.layers import ALONE_PEN, TRACE_PEN
from camtool.pictures.options import PictureOptions
from camtool.pictures.page import TICK_CAP, page_of
from camtool.pictures.scene import Scene
from camtool.pictures.svg import clean
from camtool.records import replace
from tests.oracles import svg_page
from tests.oracles.png import decode
from tests.pictures.conftest import NASTY, SCENES, circle, drawing_of

Box = tuple[float, float, float, float]


def rgb(colour: str) -> list[int]:
    return [int(colour[k : k + 2], 16) for k in (1, 3, 5)]


def ids(root: Element) -> set[str]:
    return {g.attrib["id"] for g in root.iter() if "id" in g.attrib}


def plot_box(root: Element) -> Box:
    ground = named(root, "grid")[0]
    x, y, width, height = (float(ground.attrib[key]) for key in ("x", "y", "width", "height"))
    return x, y, x + width, y + height


def named(root: Element, name: str) -> Element:
    found = svg_page.group(root, name)
    assert found is not None
    return found


def test_pictures_are_well_formed_and_finite(scene: Scene) -> None:
    svg = draw(scene)
    root = svg_page.parse(svg)
    assert root.tag == f"{svg_page.SVG}svg"
    for word in ("nan", "inf", "None", "e-0", "e+0"):
        assert not any(word in value for value in numbers(root)), word
    for element in root.iter(f"{svg_page.SVG}path"):
        svg_page.pieces(element.attrib["d"])


def numbers(root: Element) -> list[str]:
    """All attributes that hold numbers."""
    texts = {"aria-label", "role", "id"}
    return [v for e in root.iter() for k, v in e.attrib.items() if k not in texts]


def test_the_same_scene_gives_the_same_bytes(scene: Scene) -> None:
    svg = draw(scene)
    assert draw(scene) == svg
    assert png(svg, 120) == png(svg, 120)


def test_no_hash_seed_and_no_fresh_process_changes_a_byte() -> None:
    code = (
        "import hashlib; from tests.pictures.conftest import SCENES;"
        "from camtool.pictures.draw import draw;"
        "print(hashlib.sha256(''.join(map(draw, SCENES.values())).encode()).hexdigest())"
    )
    found = {
        subprocess.run(
            [sys.executable, "-c", code],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("1", "2")
    }
    assert len(found) == 1


def test_no_two_labels_touch_and_all_are_on_the_page(scene: Scene) -> None:
    root = svg_page.parse(draw(scene))
    page = [float(part) for part in root.attrib["viewBox"].split()]
    legend = svg_page.group(root, "legend")
    swatches = [] if legend is None else swatch_boxes(legend)
    boxes = list(svg_page.label_boxes(root).items())
    for (name, box), (other, other_box) in combinations(boxes, 2):
        assert have_a_gap(box, other_box), (name, other)
    for name, box in boxes:
        assert 0.0 < box[0] < box[2] < page[2], name
        assert 0.0 < box[1] < box[3] < page[3], name
        assert all(have_a_gap(box, swatch) for swatch in swatches), name


def test_labels_stay_out_of_the_plot(scene: Scene) -> None:
    root = svg_page.parse(draw(scene))
    plot = plot_box(root)
    inside = [svg_page.group(root, name) for name in ("order", "worst")]
    numbers = {g.get("aria-label") for layer in inside if layer is not None for g in layer.iter()}
    for name, box in svg_page.label_boxes(root).items():
        if name[0] != "nothing to draw" and name[0] not in numbers:
            assert have_a_gap(box, plot), name


def test_the_scale_bar_has_room(scene: Scene) -> None:
    root = svg_page.parse(draw(scene))
    bar = named(root, "scale-bar")
    (line,) = (p for p in bar if p.tag == f"{svg_page.SVG}path")
    points = [q for piece in svg_page.pieces(line.attrib["d"]) for q in (piece.begin, piece.end)]
    bar_box = svg_page.box(points)
    legend = svg_page.group(root, "legend")
    assert all(have_a_gap(bar_box, box) for box in svg_page.label_boxes(root).values())
    assert legend is None or all(have_a_gap(bar_box, box) for box in swatch_boxes(legend))


def swatch_boxes(legend: Element) -> list[Box]:
    found = []
    for g in legend:
        move = g.get("transform", "")
        if move.startswith("translate(") and len(g):
            x, y = (float(part) for part in move[10:-1].split())
            found.append((x, y - 10.0, x + 34.0, y + 10.0))
    return found


def have_a_gap(a: Box, b: Box) -> bool:
    return a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]


@pytest.mark.parametrize(
    ("name", "present", "absent"),
    [
        (
            "drawing",
            {"body", "drawing", "axes", "grid", "scale-bar", "legend", "part-zero", "mm"},
            {"feeds", "rapids", "plunges", "slide-path", "error-scale", "travel", "gaps"},
        ),
        (
            "toolpath",
            {"drawing", "feeds", "rapids", "plunges", "arrows", "part-zero"},
            {"slide-path", "error-scale", "starts", "ramps"},
        ),
        (
            "result",
            {"drawing", "feeds", "slide-path", "error-scale", "travel"},
            {"rapids", "plunges", "arrows", "gaps"},
        ),
        ("ramp", {"ramps", "feeds", "starts"}, {"drawing", "plunges", "rapids"}),
        ("line", {"gaps", "drawing"}, {"body"}),
        ("far", {"drawing"}, {"part-zero"}),
        ("empty", {"axes", "scale-bar"}, {"legend", "part-zero", "mm"}),
    ],
)
def test_each_layer_is_a_group_and_only_what_is_there_is_drawn(
    name: str, present: set[str], absent: set[str]
) -> None:
    found = ids(svg_page.parse(draw(SCENES[name])))
    assert present <= found
    assert not absent & found


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("drawing", {"outline", "holes", "part zero"}),
        ("toolpath", {"drawing", "feed", "rapid", "plunge", "part zero"}),
        (
            "result",
            {
                "drawing",
                "predicted path, by error",
                "programmed path",
                "part zero",
                "travel 22 × 22 mm",
            },
        ),
        ("line", {"drawing", "open end", "part zero"}),
        ("ramp", {"feed", "slope", "start", "part zero"}),
        ("far", {"drawing, layer far"}),
    ],
)
def test_the_legend_names_what_is_there(name: str, words: set[str]) -> None:
    legend = named(svg_page.parse(draw(SCENES[name])), "legend")
    assert {g.attrib["aria-label"] for g in legend if "aria-label" in g.attrib} == words


def test_names_that_hold_anything_stay_text() -> None:
    svg = draw(SCENES["wide"])
    root = svg_page.parse(svg)
    labels = [g.attrib["aria-label"] for g in root.iter() if "aria-label" in g.attrib]
    assert clean(NASTY) in labels
    titles = [t.text for t in root.iter(f"{svg_page.SVG}title")]
    assert clean(NASTY) in titles
    assert not list(root.iter(f"{svg_page.SVG}b"))


def test_there_are_no_fonts_no_scripts_and_no_links(scene: Scene) -> None:
    tags = {
        element.tag.removeprefix(svg_page.SVG) for element in svg_page.parse(draw(scene)).iter()
    }
    assert tags <= {"svg", "title", "g", "rect", "path", "circle"}


def test_coordinates_in_the_picture_are_those_of_the_part_in_mm() -> None:
    drawing = drawing_of([circle(2.5, 1.5, 0.5)], ["0"])
    shifted = Scene("", drawing_of([circle(3.5, 0.5, 0.5)], ["0"]))
    for scene, centre in ((Scene("", drawing), (2.5, 1.5)), (shifted, (3.5, 0.5))):
        layer = named(svg_page.parse(draw(scene)), "drawing")
        arcs = svg_page.paths(layer)[0]
        turned = 0.0
        for arc in arcs:
            assert isinstance(arc, svg_page.Arc)
            assert arc.centre == pytest.approx(centre)
            assert arc.radius == 0.5
            turned += arc.sweep
        assert turned == pytest.approx(2.0 * math.pi)


def test_lines_keep_their_width_on_the_page_whatever_the_part_measures() -> None:
    widths = []
    for scale in (0.1, 1.0, 100.0):
        drawing = drawing_of([circle(scale, scale, scale)], ["0"])
        root = svg_page.parse(draw(Scene("", drawing)))
        factor = float(named(root, "mm").attrib["transform"][7:].split()[0])
        widths.append(factor * float(named(root, "drawing").attrib["stroke-width"]))
    assert widths == pytest.approx([widths[0]] * 3, rel=1e-3)


def test_crowded_lines_are_thinner() -> None:
    def width(count: int) -> float:
        circles = [circle(0.0, 0.0, 1.0 + k / count) for k in range(count)]
        root = svg_page.parse(draw(Scene("", drawing_of(circles, ["0"] * count))))
        return float(named(root, "drawing").attrib["stroke-width"])

    assert width(200) < 0.5 * width(2)


def test_every_plunge_is_marked() -> None:
    root = svg_page.parse(draw(SCENES["many paths"]))
    assert len(named(root, "plunges")) == 100


@pytest.mark.parametrize("width", [40, 250])
def test_png_has_the_size_asked_for_and_shows_something(width: int) -> None:
    svg = draw(SCENES["toolpath"])
    root = svg_page.parse(svg)
    ratio = float(root.attrib["height"]) / float(root.attrib["width"])
    image = decode(png(svg, width))
    assert image.shape[1] == width
    assert image.shape[0] == pytest.approx(width * ratio, abs=1.0)
    assert len(np.unique(image.reshape(-1, image.shape[2]), axis=0)) > 10


@pytest.mark.parametrize(
    ("name", "colour"),
    [
        ("toolpath", FEED),
        ("toolpath", PLUNGE),
        ("many paths", RAPID),
        ("result", bin_colours()[0]),
        ("result", bin_colours()[-1]),
    ],
)
def test_png_shows_the_colours_of_its_layers(name: str, colour: str) -> None:
    image = decode(png(draw(SCENES[name]), 320))[..., :3].astype(int)
    distance = np.abs(image - rgb(colour)).max(axis=2)
    assert (distance <= 24).sum() >= 5


def test_the_picture_is_the_right_way_up() -> None:
    # One small circle in the lower left corner of a large open frame.
    frame = [circle(9.0, 9.0, 0.5), circle(1.0, 1.0, 0.1)]
    scene = Scene("", drawing_of(frame, ["large", "small"]))
    root = svg_page.parse(draw(scene))
    left, top, right, bottom = (round(0.3 * side) for side in plot_box(root))
    image = decode(png(draw(scene), 300))[..., :3].astype(int)
    small = image[..., 0] - image[..., 2] > 60  # the second layer is red on blue-grey
    rows, columns = np.nonzero(small[top:bottom, left:right])
    assert rows.mean() > 0.7 * (bottom - top)
    assert columns.mean() < 0.3 * (right - left)


def test_pictures_of_ordinary_size_are_alike() -> None:
    small, large = (draw(SCENES["drawing"], PictureOptions(size_px=px)) for px in (1000, 1200))
    assert small.split("viewBox")[1] == large.split("viewBox")[1]
    assert 'width="1200"' in large


@pytest.mark.parametrize("size", [400, 4000])
def test_letters_and_lines_suit_the_size(size: int) -> None:
    """Pixels of a capital and of a line: neither too small to read nor as coarse as a poster."""
    root = svg_page.parse(draw(SCENES["result"], PictureOptions(size_px=size)))
    pixels = size / float(root.attrib["viewBox"].split()[2])
    assert 9.0 < pixels * TICK_CAP < 36.0
    assert 1.5 < pixels * TRACE_PEN < 8.0


@pytest.mark.parametrize("size", [400, 4000])
@pytest.mark.parametrize("name", list(SCENES))
def test_no_two_labels_touch_at_any_size(name: str, size: int) -> None:
    root = svg_page.parse(draw(SCENES[name], PictureOptions(size_px=size)))
    page = [float(part) for part in root.attrib["viewBox"].split()]
    boxes = list(svg_page.label_boxes(root).items())
    for (one, box), (other, other_box) in combinations(boxes, 2):
        assert have_a_gap(box, other_box), (one, other)
    assert all(0.0 < box[0] < box[2] < page[2] and box[1] > 0.0 for _, box in boxes)


def test_a_part_is_shown_as_it_was_asked_for() -> None:
    crop = PictureOptions(crop_mm=(1.0, 2.0, 2.0, 1.5))
    view = page_of(content_of(SCENES["result"], crop)).view
    assert view.x_range == pytest.approx((1.0, 3.0), abs=0.005)
    assert view.y_range == pytest.approx((2.0, 3.5), abs=0.005)
    svg = draw(SCENES["result"], crop)
    assert "part-zero" not in ids(svg_page.parse(svg))
    whole = draw(SCENES["result"])
    assert bar_numbers(svg)[-1] == bar_numbers(whole)[-1]


def bar_numbers(svg: str) -> list[str]:
    bar = named(svg_page.parse(svg), "error-scale")
    numbers = [g.attrib["aria-label"] for g in bar.iter() if "aria-label" in g.attrib]
    return [number for number in numbers if number[0].isdigit()]


def test_lines_of_a_part_are_not_thinned_by_what_lies_outside() -> None:
    far = [circle(50.0, 50.0, 1.0 + k / 200) for k in range(200)]
    scene = Scene("", drawing_of([circle(0.0, 0.0, 1.0), *far], ["0"] * 201))
    options = PictureOptions(crop_mm=(-2.0, -2.0, 4.0, 4.0))
    root = svg_page.parse(draw(scene, options))
    factor = float(named(root, "mm").attrib["transform"][7:].split()[0])
    width = float(named(root, "drawing").attrib["stroke-width"])
    assert factor * width == pytest.approx(ALONE_PEN, rel=1e-3)


@pytest.mark.parametrize("crop", [(0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, -1.0), (0, 0, 1, np.inf)])
def test_senseless_parts_are_refused(crop: tuple[float, float, float, float]) -> None:
    with pytest.raises(OptionError, match="cannot be shown"):
        PictureOptions(crop_mm=crop)


def test_the_dark_palette_changes_colours_only(scene: Scene) -> None:
    light, dark = draw(scene), draw(scene, PictureOptions(dark=True))
    paint = re.compile('"#[0-9a-f]{6}"')
    assert paint.sub("", dark) == paint.sub("", light)
    assert f'fill="{PAPER}"' not in dark


def test_png_of_a_dark_picture_is_dark() -> None:
    svg = draw(SCENES["result"], PictureOptions(dark=True))
    image = decode(png(svg, 320))[..., :3].astype(int)
    assert np.median(image.max(axis=2)) < 48
    top = rgb(bin_colours(dark=True)[-1])
    assert (np.abs(image - top).max(axis=2) <= 24).sum() >= 5


@pytest.mark.parametrize("width", [251, 400])
def test_the_paper_covers_the_last_row_of_pixels(width: int) -> None:
    svg = draw(SCENES["wide"], PictureOptions(size_px=width))
    assert (decode(png(svg, width))[..., 3] == 255).all()


@pytest.mark.parametrize("dark", [False, True])
def test_what_leaves_the_plot_is_not_seen(dark: bool) -> None:
    part = PictureOptions(crop_mm=(1.0, 1.0, 1.0, 1.0), dark=dark, size_px=400)
    svg = draw(replace(SCENES["toolpath"], tool_mm=2.0), options=part)
    root = svg_page.parse(svg)
    pixels = 400 / float(root.attrib["viewBox"].split()[2])
    _, top, right, bottom = (pixels * side for side in plot_box(root))
    image = decode(png(svg, 400)).astype(int)
    beside = image[int(top) : int(bottom), int(right) + 3 :]
    paper = rgb(on_dark(PAPER) if dark else PAPER)
    assert (np.abs(beside[..., :3] - paper).max(axis=2) <= 2).all()
    assert (np.abs(image[int(top) + 9, int(right) - 9, :3] - paper) > 2).any()


@pytest.mark.parametrize("width", [0, -5, 15, 20_001])
def test_senseless_widths_are_refused(width: int) -> None:
    with pytest.raises(OptionError, match="pixels wide"):
        draw(SCENES["empty"], PictureOptions(size_px=width))
    with pytest.raises(OptionError, match="pixels wide"):
        png("<svg/>", width)


def test_points_open_ends_and_doubts_of_a_drawing_are_marked() -> None:
    drawing = replace(
        drawing_of([circle(5.0, 5.0, 3.0)], ["0"]),
        marks=(Mark((1.0, 2.0), "0", "", "POINT 1"), Mark((2.0, 2.0), "0", "", "POINT 2")),
        gaps=(Gap((3.0, 3.0), 0.1, "0"),),
        healing=Healing(
            crossings=(SelfCrossing((4.0, 4.0), 0, "0"),), branches=(Branch((5.0, 5.0), 3, "0"),)
        ),
    )
    root = svg_page.parse(draw(Scene(drawing=drawing)))
    assert [len(named(root, name)) for name in ("points", "gaps", "doubts")] == [2, 1, 2]


def test_points_alone_are_a_picture() -> None:
    alone = replace(drawing_of([], []), marks=(Mark((1.0, 2.0), "0", "", "POINT 1"),))
    root = svg_page.parse(draw(Scene(drawing=alone)))
    assert len(named(root, "points")) == 1


@pytest.mark.parametrize("size", [400, 1000])
def test_the_scale_bar_has_a_row_to_itself_only_when_it_must(size: int) -> None:
    root = svg_page.parse(draw(SCENES["no error"], PictureOptions(size_px=size)))
    bar, legend = named(root, "scale-bar"), named(root, "legend")
    rows = {
        float(g.attrib["transform"].split()[1][:-1]) for g in legend if "transform" in g.attrib
    }
    ends = svg_page.pieces(bar[1].attrib["d"])
    middle = next(piece.begin[1] for piece in ends if piece.begin[1] == piece.end[1])
    assert middle in rows
    boxes = svg_page.label_boxes(legend).values()
    left = min(piece.begin[0] for piece in ends)
    assert all(box[2] < left for box in boxes if abs(box[1] + box[3] - 2.0 * middle) < 30.0)
