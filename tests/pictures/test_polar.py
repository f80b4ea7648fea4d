"""The polar plot of a circle."""

import numpy as np
import pytest

from camtool.errors import OptionError
from camtool.kernels.judging import bin_directions, empty_bins
from camtool.pictures.draw import draw, png
from camtool.pictures.options import PictureOptions
from camtool.pictures.scene import Round, Scene, rounds_of
from camtool.records import replace
from camtool.toolpath.builder import ToolpathBuilder
from tests.oracles import svg_page
from tests.oracles.dense_moves import pic_mmh
from tests.oracles.kernel_doors import fill_bins_
from tests.oracles.png import decode
from tests.targets import verify

CENTRE = np.array([10.0, -4.0])
RADIUS = 2.0


def seen(error_mm, turns: float = 1.0) -> Round:
    """A circle whose radius is off by error_mm(angle), over a share of the turn."""
    angle = np.linspace(0.0, 2.0 * np.pi * turns, 40_000, endpoint=False)
    radius = RADIUS + error_mm(angle)
    bins = empty_bins(1)[0]
    x, y = CENTRE[0] + radius * np.cos(angle), CENTRE[1] + radius * np.sin(angle)
    fill_bins_(x, y, CENTRE, bin_directions(), bins)
    return Round((10.0, -4.0), RADIUS, True, bins, 0.02, (0.01, -0.01, 0.0), (0.004, np.nan))


WAVY = seen(lambda angle: 0.01 * np.sin(2.0 * angle))


def plot(one: Round, **how: object) -> str:
    return draw(Scene("circle", rounds=(one,)), options=PictureOptions(polar=1, **how))


def line_of(svg: str) -> np.ndarray:
    group = svg_page.group(svg_page.parse(svg), "radial-error")
    assert group is not None
    pieces = svg_page.paths(group)[-1]
    return np.array([pieces[0].begin, *(piece.end for piece in pieces)])


def rings(svg: str) -> np.ndarray:
    group = svg_page.group(svg_page.parse(svg), "rings")
    assert group is not None
    return np.array([[float(ring.attrib[key]) for key in ("cx", "cy", "r")] for ring in group])


def test_the_errors_of_the_bins_are_those_of_the_circle() -> None:
    angle = (np.arange(720) + 0.5) * np.pi / 360.0
    errors = WAVY.errors()
    assert errors[:, 1] == pytest.approx(0.01 * np.sin(2.0 * angle), abs=2e-6)
    assert (errors[:, 0] <= errors[:, 1]).all()
    assert (errors[:, 1] <= errors[:, 2]).all()


def test_the_line_is_magnified_about_the_programmed_circle() -> None:
    svg = plot(WAVY)
    group = svg_page.group(svg_page.parse(svg), "rings")
    assert group is not None
    (base,) = (float(ring.attrib["r"]) for ring in group if ring.get("stroke-width") == "2")
    table = rings(svg)
    middle, points = table[0, :2], line_of(svg)
    away = np.hypot(*(points - middle).T) - base
    angle = np.arctan2(middle[1] - points[:, 1], points[:, 0] - middle[0])
    per_mm = away.max() / 0.01
    assert away == pytest.approx(per_mm * 0.01 * np.sin(2.0 * angle), abs=0.2)
    # 5 µm from ring to ring, as it says.
    assert np.diff(np.sort(table[1:, 2])) == pytest.approx(per_mm * 0.002, abs=0.2)
    labels = {g.get("aria-label", "") for g in svg_page.parse(svg).iter()}
    assert any(label.endswith("from ring to ring 2 µm") for label in labels)


def test_all_lies_on_the_page_and_no_two_labels_touch() -> None:
    for one in (
        WAVY,
        seen(lambda a: 0 * a),
        seen(lambda a: 0 * a - 1.9),
        seen(lambda a: 0 * a + 9),
    ):
        for size in (400, 1000, 4000):
            svg = plot(one, size_px=size)
            page = float(svg_page.parse(svg).attrib["viewBox"].split()[2])
            points = line_of(svg)
            assert points.min() > 0.0
            assert points[:, 0].max() < page
            boxes = [*svg_page.label_boxes(svg_page.parse(svg)).values()]
            assert all(0.0 < box[0] < box[2] < page for box in boxes)


def test_what_was_not_gone_round_stays_open() -> None:
    half = line_of(plot(seen(lambda angle: 0.001 + 0 * angle, turns=0.5)))
    middle = rings(plot(WAVY))[0, :2]
    assert (half[:, 1] <= middle[1] + 1.0).all()
    assert 350 <= len(half) <= 361


def test_the_figures_are_told() -> None:
    labels = {g.get("aria-label") for g in svg_page.parse(plot(WAVY)).iter()}
    assert "G 20.00, F max +10.00, F min -10.00, mean +0.00 (µm)" in labels
    assert "reversal values B: X +4.00, Y unknown (µm)" in labels
    assert {"X+", "Y+", "X−", "Y−"} <= labels


def test_equal_circles_give_equal_bytes_and_a_dark_one_is_dark() -> None:
    assert plot(WAVY) == plot(replace(WAVY))
    dark = decode(png(plot(WAVY, dark=True), 200))
    assert np.median(dark[..., :3].max(axis=2)) < 48


@pytest.mark.parametrize("which", [0, 2])
def test_there_must_be_such_a_circle(which: int) -> None:
    with pytest.raises(OptionError, match="there is no circle"):
        draw(Scene("", rounds=(WAVY,)), options=PictureOptions(polar=which))
    with pytest.raises(OptionError, match="no full circle"):
        draw(Scene(""), options=PictureOptions(polar=1))


def both_ways(ccw: Round, cw: Round) -> Scene:
    """A small circle of another place, and one circle both ways round."""
    pair = (replace(ccw, partner=3), replace(cw, ccw=False, partner=2))
    return Scene("both", rounds=(WAVY, *(replace(one, both_circular_mm=0.03) for one in pair)))


def strokes_of(svg: str) -> list[str]:
    group = svg_page.group(svg_page.parse(svg), "radial-error")
    assert group is not None
    return [path.attrib["stroke"] for path in group]


def test_both_ways_round_are_in_one_plot() -> None:
    scene = both_ways(seen(lambda a: 0.002 + 0 * a), seen(lambda a: -0.004 + 0 * a))
    svg = draw(scene, PictureOptions(polar=2))
    strokes = strokes_of(svg)
    assert len(strokes) == len(set(strokes)) == 4
    assert len(strokes_of(draw(scene, PictureOptions(polar=1)))) == 2
    labels = [g.get("aria-label") or "" for g in svg_page.parse(svg).iter()]
    assert "counterclockwise (circle 2)" in labels
    assert "clockwise (circle 3)" in labels
    assert any("both ways together: G(b) 30.00" in label for label in labels)
    assert sum(label.startswith("clockwise: G 20.00") for label in labels) == 1
    assert svg == draw(scene, PictureOptions(polar=3))


@pytest.mark.parametrize("size_px", [300, 1000])
def test_the_legend_of_both_ways_lies_on_the_page(size_px: int) -> None:
    scene = both_ways(seen(lambda a: 0.002 + 0 * a), seen(lambda a: -0.004 + 0 * a))
    root = svg_page.parse(draw(scene, PictureOptions(polar=2, size_px=size_px)))
    _, _, width, height = map(float, root.attrib["viewBox"].split())
    for _, top, right, bottom in svg_page.label_boxes(root).values():
        assert right < width
        assert top <= bottom < height


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.2, 2.0, 3.5, 5.9])
def test_numbers_of_rings_hide_nothing(angle: float) -> None:
    one = seen(lambda a: 0.008 * np.cos(a - angle) ** 3)
    svg = plot(one)
    group = svg_page.group(svg_page.parse(svg), "ring-labels")
    assert group is not None
    for left, top, right, bottom in svg_page.label_boxes(group).values():
        x, y = line_of(svg).T
        assert not ((x > left) & (x < right) & (y > top) & (y < bottom)).any()


def test_a_program_both_ways_round_knows_its_pairs() -> None:
    b = ToolpathBuilder().rapid(z=1.0).rapid(6.0, 4.0).line(z=-0.1, feed=5.0)
    for ccw in (True, False):
        b.arc(2.0, 4.0, centre=(4.0, 4.0), ccw=ccw, feed=5.0)
        b.arc(6.0, 4.0, centre=(4.0, 4.0), ccw=ccw, feed=5.0)
    verified = verify(b.rapid(z=1.0).finish(), pic_mmh())
    first, second = rounds_of(verified)
    assert (first.partner, second.partner) == (2, 1)
    both = verified.report.bidirectional[0].Gb_um
    assert both is not None
    assert first.both_circular_mm == second.both_circular_mm == pytest.approx(both / 1000.0)
