"""Scenes beside each other in one picture."""

import re

import numpy as np
import pytest

from camtool.errors import OptionError, OutputError
from camtool.geometry.polylines import Polylines, Segments
from camtool.pictures.beside import draw_beside, render_beside
from camtool.pictures.draw import png
from camtool.pictures.options import PictureOptions
from camtool.pictures.scene import Scene
from camtool.records import replace
from tests.oracles import svg_page
from tests.oracles.png import decode
from tests.pictures.conftest import SCENES, circle, drawing_of, line
from tests.pictures.test_polar import seen

BEFORE = replace(
    SCENES["result"], wanted=Segments.of(Polylines.of([circle(2.5, 2.5, 2.0)])), title="before"
)
AFTER = replace(BEFORE, trace_error_mm=0.4 * BEFORE.trace_error_mm, title="after")
LOOKS = {
    "usual": PictureOptions(),
    "small and dark": PictureOptions(size_px=400, dark=True),
    "part": PictureOptions(crop_mm=(0.0, 0.0, 3.0, 3.0)),
    "exaggerated": PictureOptions(exaggerate=20.0, layers=frozenset({"path", "feeds"})),
}


def panels(svg: str) -> list[str]:
    """The text of each panel without its name and its place."""
    found = re.split(r'<g id="panel-\d+" transform="translate\([^"]*\)">\n', svg)[1:]
    return [re.sub(r"panel-\d+-", "", text) for text in found]


def corners(svg: str) -> list[tuple[float, float]]:
    found = re.findall(r'<g id="panel-\d+" transform="translate\((\S+) (\S+)\)">', svg)
    return [(float(x), float(y)) for x, y in found]


def scales(svg: str) -> set[str]:
    """The first four numbers of each panel's map from mm to the page."""
    return set(re.findall(r'id="panel-\d+-mm" transform="matrix\((\S+ \S+ \S+ \S+) ', svg))


@pytest.mark.parametrize("look", list(LOOKS))
def test_equal_scenes_make_equal_panels(look: str) -> None:
    svg = draw_beside([BEFORE, BEFORE], LOOKS[look])
    first, second = panels(svg)
    assert second.startswith(first)
    assert svg == draw_beside([replace(BEFORE), replace(BEFORE)], LOOKS[look])


def test_equal_scenes_make_equal_pixels() -> None:
    svg = draw_beside([SCENES["toolpath"]] * 2, PictureOptions(size_px=250))
    page = int(svg_page.parse(svg).attrib["viewBox"].split()[2])
    image = decode(png(svg, page // 2))
    (x0, _), (x1, _) = corners(svg)
    across = int(x1 - x0) // 2
    assert 2 * across == x1 - x0
    # Neighbours share a margin, so the edge of one reaches a pixel into the other's; and single
    # precision shifts an edge by a tenth of a pixel.
    above = image[: int(0.8 * len(image))].astype(int)
    first, second = above[:, 2 : across - 2], above[:, across + 2 : 2 * across - 2]
    assert np.abs(first - second).max() <= 24
    assert (first[..., :3].min(axis=2) < 64).any()


def test_what_is_high_stands_side_by_side_and_what_is_wide_below() -> None:
    side = corners(draw_beside([BEFORE, AFTER]))
    assert side[0][1] == side[1][1]
    assert side[0][0] < side[1][0]
    below = corners(draw_beside([SCENES["wide"], SCENES["wide"]]))
    assert below[0][0] == below[1][0]
    assert below[0][1] < below[1][1]
    assert len({*corners(draw_beside([BEFORE] * 4))}) == 4


def test_all_have_one_window_one_scale_and_one_map_of_errors() -> None:
    far = drawing_of([line((0, 0), (20, 20))], ["0"])
    svg = draw_beside([BEFORE, AFTER, Scene("far", far)])
    root = svg_page.parse(svg)
    assert len(scales(svg)) == 1
    labels = [g.get("aria-label") for g in root.iter()]
    assert labels.count("error (µm)") == 1
    assert labels.count("19") == 1
    assert len([title for title in root.iter() if "scale bar" in (title.text or "")]) == 1
    colours = [set(re.findall(r'stroke="(#\w+)"', slides(part))) for part in panels(svg)[:2]]
    assert not colours[0] >= colours[1]
    # 40 % of the worst error are no brighter than 40 % of the map.
    alone = draw_beside([AFTER])
    assert set(re.findall(r'stroke="(#\w+)"', slides(panels(alone)[0]))) != colours[1]


def slides(panel: str) -> str:
    return panel[panel.index('id="slide-path"') :].split("</g>")[0]


def test_names_of_parts_are_there_once() -> None:
    svg = draw_beside([BEFORE, AFTER, SCENES["toolpath"]])
    names = re.findall(r' id="([^"]+)"', svg)
    assert len(names) == len(set(names))
    assert set(re.findall(r"url\(#([^)]+)\)", svg)) <= set(names)


def test_pictures_of_one_page_do_not_clip_each_other() -> None:
    large = draw_beside([BEFORE, AFTER])
    small = draw_beside([BEFORE, AFTER], PictureOptions(size_px=400))
    clips = [set(re.findall(r'<clipPath id="([^"]+)"', svg)) for svg in (large, small)]
    assert len(clips[0]) == len(clips[1]) == 2
    assert not clips[0] & clips[1]


def test_the_legend_names_each_thing_once_and_layers_keep_their_colour() -> None:
    one = drawing_of([circle(0, 0, 1), circle(3, 0, 1)], ["holes", "outline"])
    other = drawing_of([circle(0, 0, 1)], ["outline"])
    svg = draw_beside([Scene("one", one), Scene("other", other)])
    legend = svg_page.group(svg_page.parse(svg), "legend")
    assert legend is not None
    shown = [g.get("aria-label") for g in legend if g.get("aria-label")]
    assert shown == ["holes", "outline", "part zero"]
    first, second = ({title: colour for colour, title in layers(part)} for part in panels(svg))
    assert first["outline"] == second["outline"] != first["holes"]


def layers(panel: str) -> list[tuple[str, str]]:
    return re.findall(r'<g stroke="(#\w+)">\n<title>(\w+)</title>', panel)


@pytest.mark.parametrize("size_px", [400, 1000, 4000])
def test_all_lies_on_the_page_and_no_two_labels_touch(size_px: int) -> None:
    long = replace(AFTER, title="a title that goes on and on and on, and then once more beyond")
    for scenes in ([BEFORE, long], [SCENES["wide"], SCENES["wide"]], [SCENES["toolpath"], long]):
        svg = draw_beside(scenes, PictureOptions(size_px=size_px))
        root = svg_page.parse(svg)
        assert root.attrib["width"] == str(size_px)
        _, _, width, height = map(float, root.attrib["viewBox"].split())
        moved = corners(svg)
        boxes = []
        for index, (x, y) in enumerate(moved):
            panel = svg_page.group(root, f"panel-{index + 1}")
            assert panel is not None
            for box in svg_page.label_boxes(panel).values():
                boxes.append((box[0] + x, box[1] + y, box[2] + x, box[3] + y))
        for name in ("legend", "error-scale", "scale-bar"):
            below = svg_page.group(root, name)
            boxes += [] if below is None else svg_page.label_boxes(below).values()
        for left, top, right, bottom in boxes:
            assert 0.0 < left < right < width
            assert 0.0 < top <= bottom < height
        for index, a in enumerate(boxes):
            for b in boxes[:index]:
                beside = a[2] <= b[0] or b[2] <= a[0]
                assert beside or a[3] <= b[1] or b[3] <= a[1], (a, b)


def rounded(error_mm: float, title: str) -> Scene:
    return Scene(title, rounds=(seen(lambda angle: error_mm * np.sin(2.0 * angle)),))


def test_polar_plots_are_magnified_alike() -> None:
    svg = draw_beside([rounded(0.01, "a"), rounded(0.002, "b")], PictureOptions(polar=1))
    first, second = panels(svg)
    rings = [re.findall(r'<circle [^>]*r="([\d.]+)"', part.split('"radial-error"')[0])
             for part in (first, second)]  # fmt: skip
    assert rings[0] == rings[1]
    small, large = (
        float(np.ptp([float(y) for y in re.findall(r"[ML]\S+ ([\d.]+)", part.split("</g>")[0])]))
        for part in (second.split('"radial-error"')[1], first.split('"radial-error"')[1])
    )
    assert small < large
    labels = [g.get("aria-label") or "" for g in svg_page.parse(svg).iter()]
    assert len({name for name in labels if "from ring to ring" in name}) == 1


def test_each_must_have_the_circle() -> None:
    with pytest.raises(OptionError, match="no circle 1 in b"):
        draw_beside([rounded(0.01, "a"), Scene("b")], PictureOptions(polar=1))


def test_kinds_of_files() -> None:
    assert render_beside([BEFORE, AFTER], "x.svg").startswith(b"<svg")
    assert decode(render_beside([BEFORE], "x.png", PictureOptions(size_px=300))).shape[1] == 300
    with pytest.raises(OptionError, match=r"x\.html"):
        render_beside([BEFORE, AFTER], "x.html")
    with pytest.raises(OutputError, match="not a picture file"):
        render_beside([BEFORE, AFTER], "x.bmp")
    with pytest.raises(ValueError, match="no scene"):
        draw_beside([])
