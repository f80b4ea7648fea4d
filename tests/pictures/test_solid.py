"""Pictures of the stock after a program."""

from __future__ import annotations

import base64
import math
import re
from pathlib import Path

import click
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.cli.main import cli
from camtool.errors import OptionError
from camtool.geometry.polylines import Polyline
from camtool.kernels.heightmap import project
from camtool.pictures import relief, solid
from camtool.pictures.colours import PAPER, channels, on_dark
from camtool.pictures.draw import draw, render
from camtool.pictures.options import VIEWS, PictureOptions
from camtool.pictures.picture import Picture
from camtool.pictures.relief import CAMERAS, Camera, png_of, stage_of
from camtool.pictures.scene import Scene, scene_of
from camtool.planning.job import Job, Operation, Stock, Tool
from camtool.planning.plan import plan
from camtool.records import replace
from camtool.stock.cutters import CutterProfile
from camtool.stock.heightmap import height_map
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Toolpath
from tests.drawings import drawing_of
from tests.oracles.png import decode
from tests.stock.cuts import moves_of
from tests.strategies import examples

OUTSIDE = ("iso", "front", "side")
Pixels = npt.NDArray[np.uint8]


def square(low: float, high: float, z: float, builder: ToolpathBuilder) -> ToolpathBuilder:
    builder.rapid(low, low, 2.0).line(low, low, z, feed=100.0)
    for x, y in ((high, low), (high, high), (low, high), (low, low)):
        builder.line(x, y, feed=100.0)
    return builder.rapid(z=2.0)


def plate(deep: float = -2.0) -> Toolpath:
    """A pocket from (9, 9) to (21, 21), open ring and island, and a slot through the stock from
    (4, 33) to (36, 37)."""
    builder = square(11.0, 19.0, deep, ToolpathBuilder())
    builder.rapid(6.0, 35.0).line(6.0, 35.0, -5.5, feed=100.0).line(34.0, 35.0, feed=100.0)
    return builder.rapid(z=2.0).finish()


JOB = Job((Operation(tool=Tool(4.0)),), stock=Stock(5.0, (0.0, 0.0), (40.0, 40.0)))


def scene(deep: float = -2.0, job: Job | None = JOB) -> Scene:
    return scene_of(title="plate", job=job, toolpath=plate(deep), wanted_path=plate())


def raster(svg: str) -> Pixels:
    """The picture of the stock in an SVG."""
    data = re.search(r'id="stock"[^>]*base64,([^"]+)"', svg)
    assert data is not None
    return decode(base64.b64decode(data[1]))


def from_above(view: str = "top", deep: float = -2.0, *, dark: bool = False) -> Pixels:
    """A raster whose pixels are squares of 0.1 mm, that of (0, 0) mm lowest and leftmost."""
    options = PictureOptions(size_px=500, crop_mm=(0.0, 0.0, 40.0, 40.0), view=view, dark=dark)
    pixels = raster(draw(scene(deep), options))[::-1]
    high, wide, _ = pixels.shape
    assert abs(high - wide) <= 2
    rows = (np.arange(400) * high / 400).astype(int)
    return pixels[rows][:, (np.arange(400) * wide / 400).astype(int)]


def patch(pixels: Pixels, x: float, y: float) -> list[float]:
    """Mean colour about a place, mm."""
    column, row = round(x * 10), round(y * 10)
    return pixels[row - 3 : row + 4, column - 3 : column + 4].mean(axis=(0, 1)).tolist()


def spoken(svg: str) -> list[str]:
    """The labels of a picture, and all of them as one text, without the breaks of lines."""
    labels = re.findall(r'aria-label="([^"]*)"', svg)
    return [*labels, " ".join(labels)]


def brightness(pixels: Pixels, x: float, y: float) -> float:
    return sum(patch(pixels, x, y))


@pytest.mark.parametrize("dark", [False, True])
def test_floors_are_darker_than_the_top_and_cuts_through_are_holes(dark: bool) -> None:
    pixels = from_above(dark=dark)
    top, floor, tab = (brightness(pixels, x, 20.0) for x in (30.0, 19.0, 5.0))
    assert floor < 0.93 * top
    assert tab == pytest.approx(top, rel=0.02)
    island = brightness(pixels, 15.0, 15.0)
    assert island == pytest.approx(top, rel=0.02)
    # A hole shows the board, in the colour of the paper, in the shade.
    red, _, blue = patch(pixels, 20.0, 35.0)
    paper = channels(on_dark(PAPER) if dark else PAPER)
    assert max(red, blue) <= max(paper)
    assert blue / max(red, 1.0) > 0.9
    red, _, blue = patch(pixels, 30.0, 20.0)
    assert blue / red < 0.85  # the material is not grey


def test_a_wall_throws_its_shadow_away_from_the_lamp() -> None:
    pixels = from_above()
    # The lamp stands at the upper left: the shadow of the island lies at its lower right.
    lit, shaded = brightness(pixels, 9.9, 18.0), brightness(pixels, 17.4, 12.6)
    beside_left, beside_right = brightness(pixels, 9.5, 15.0), brightness(pixels, 20.5, 15.0)
    assert beside_left < beside_right
    assert shaded < lit * 1.2


def test_a_cut_that_is_too_deep_is_coloured_where_it_is() -> None:
    good, deep, shallow = (
        from_above("gouge"),
        from_above("gouge", -2.5),
        from_above("leftover", -1.7),
    )

    def colour(pixels: Pixels, x: float, y: float) -> float:
        """Return the distance of a colour from grey."""
        return max(patch(pixels, x, y)) - min(patch(pixels, x, y))

    ring = [(9.6, 15.0), (20.4, 15.0), (15.0, 9.6), (15.0, 20.4), (12.0, 12.0)]
    beside = [(8.4, 15.0), (21.6, 15.0), (15.0, 8.4), (15.0, 21.6), (15.0, 15.0), (20.0, 35.0)]
    assert max(colour(good, *place) for place in (*ring, *beside)) < 15.0
    for pixels in (deep, shallow):
        assert min(colour(pixels, *place) for place in ring) > 40.0
        assert max(colour(pixels, *place) for place in beside) < 15.0
    text = spoken(draw(scene(-2.5), PictureOptions(size_px=300, view="gouge")))
    assert any("0.5 mm lower than wanted" in line for line in text)
    text = spoken(draw(scene(-1.7), PictureOptions(size_px=300, view="leftover")))
    assert any("0.3 mm higher than wanted" in line for line in text)


def test_a_fault_of_the_plan_is_seen_too() -> None:
    corners = np.array([[5, 5, 0], [25, 5, 0], [25, 20, 0], [5, 20, 0.0]])
    drawing = drawing_of([Polyline(corners, closed=True)])
    pocket = Operation("pocket", tool=Tool(4.0), depth_mm=2.0)
    job = Job((pocket,), stock=Stock(5.0, (0.0, 0.0), (30.0, 25.0)))
    machine = load_target("linuxcnc").machine
    good = plan(drawing, job, machine)
    off = {"gouge": -0.3, "leftover": 0.2}
    for view, by in off.items():
        end = good.end.copy()
        end[end[:, 2] < 0.0, 2] += by
        faulty = replace(good, end=end)
        for moves, said in ((good, "nowhere more than"), (faulty, f"up to {abs(by)} mm")):
            seen = scene_of(
                title="",
                drawing=drawing,
                job=job,
                toolpath=moves,
                machine=machine,
                wanted_path=moves,
            )
            text = spoken(draw(seen, PictureOptions(size_px=200, view=view)))
            assert said in text[-1]


@pytest.mark.parametrize("view", VIEWS[1:])
def test_equal_scenes_give_equal_bytes(view: str) -> None:
    options = PictureOptions(size_px=200, view=view)
    one, other = (Picture(scene(), options) for _ in range(2))
    assert one.svg == other.svg
    assert one.render("a.png") == other.render("a.png")


LIFTED = ToolpathBuilder().rapid(5.0, 5.0, 5.0).finish()
LONG = ToolpathBuilder().rapid(z=5.0).line(z=-1.0, feed=9.0).line(2e3, feed=9.0).finish()
FAR = ToolpathBuilder().rapid(1e6, 1e6, 5.0).line(z=-1.0, feed=9.0).line(1e6 + 20.0, feed=9.0)
TINY = ToolpathBuilder().rapid(z=1.0).line(z=-1e-4, feed=9.0).line(1e-3, feed=9.0).finish()


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("view", ["iso", "side", "top"])
@pytest.mark.parametrize(
    ("moves", "wide", "stock"),
    [
        (LIFTED, 4.0, None),
        (ToolpathBuilder().finish(), 4.0, None),
        (LONG, 4.0, None),
        (FAR.finish(), 4.0, None),
        (TINY, 1e-3, None),
        (plate(), 4.0, Stock(900.0, (0.0, 0.0), (40.0, 40.0))),
        (plate(), 4.0, Stock(1e-3, (0.0, 0.0), (40.0, 40.0))),
    ],
)
def test_odd_stocks_have_pictures(
    moves: Toolpath, wide: float, stock: Stock | None, view: str
) -> None:
    job = Job((Operation(tool=Tool(wide)),), stock=stock)
    odd = scene_of(title="odd", job=job, toolpath=moves)
    for size_px in (16, 100):
        svg = draw(odd, PictureOptions(size_px=size_px, view=view))
        # From the side a block may be thinner than a pixel: its outline is drawn over the raster.
        face = re.search(r'<rect id="face"[^>]* width="([\d.]+)"', svg)
        assert (face is not None) == (view == "side")
        if face is None:
            assert len(np.unique(raster(svg).reshape(-1, 3), axis=0)) > 1
        else:
            assert float(face[1]) > 0.1 * size_px


def test_very_wide_pictures_have_larger_pixels(monkeypatch: pytest.MonkeyPatch) -> None:
    small = raster(draw(scene(), PictureOptions(size_px=150, view="iso")))
    monkeypatch.setattr(solid, "MAX_RASTER_PX", 150)
    svg = draw(scene(), PictureOptions(size_px=300, view="iso"))
    assert 'width="300"' in svg
    assert raster(svg).shape == small.shape


def test_strips_of_a_picture_join(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = draw(scene(), PictureOptions(size_px=150, view="iso"))
    for rows in (1, 7, 10_000):
        monkeypatch.setattr(relief, "ROWS_AT_ONCE", rows)
        assert draw(scene(), PictureOptions(size_px=150, view="iso")) == whole


@pytest.mark.parametrize("view", OUTSIDE)
def test_the_sizes_of_the_block_stand_beside_it(view: str) -> None:
    text = spoken(draw(scene(), PictureOptions(size_px=200, view=view)))
    assert text.count("40 mm") == (2 if view == "iso" else 1)
    assert "5 mm" in text
    assert "stock 40 × 40 × 5 mm; cut 5.5 mm deep, through it" in text[-1]


@pytest.mark.parametrize("view", ["front", "side"])
def test_a_level_view_shows_the_face_and_how_deep_it_is_cut_behind(view: str) -> None:
    svg = draw(scene(), PictureOptions(size_px=800, view=view))
    pixels = raster(svg).astype(int)
    face = np.abs(pixels - pixels[0, 0]).max(axis=2) > 30
    rows, columns = np.flatnonzero(face.any(axis=1)), np.flatnonzero(face.any(axis=0))
    wide, high = np.ptp(columns) + 1, np.ptp(rows) + 1
    assert wide / high == pytest.approx(40.0 / 5.0, rel=0.03)
    assert face[rows[0] : rows[-1], columns[0] : columns[-1]].all()
    found = re.search(r'<path id="deepest" d="([^"]*)"', svg)
    assert found is not None
    steps = re.findall(r"([ML])(-?[\d.]+) (-?[\d.]+)", found[1])
    places = np.array([[float(x), float(y)] for _, x, y in steps])
    # From X the slot hides the pocket, which is cut beside it along Y.
    ends = (4.0, 36.0) if view == "front" else (9.0, 21.0, 33.0, 37.0)
    mm = (places[:, 0] - places[0, 0]) / np.ptp(places[:, 0]) * (ends[-1] - ends[0]) + ends[0]
    upright = np.abs(np.diff(places[:, 1])) > 5.0
    assert sorted({*np.round(mm[1:][upright]).astype(int).tolist()}) == [*map(int, ends)]
    depth = np.ptp(places[:, 1]) / np.ptp(places[:, 0]) * (ends[-1] - ends[0])
    assert depth == pytest.approx(5.0, rel=0.02)


def test_a_stock_that_is_not_known_is_as_large_as_the_cuts() -> None:
    bare = Job((Operation(tool=Tool(4.0)),))
    svg = draw(scene(job=bare), PictureOptions(size_px=200, view="top"))
    assert any("as large as the cuts need" in line for line in spoken(svg))


def test_a_part_of_the_block_can_be_shown() -> None:
    options = PictureOptions(size_px=200, view="iso", crop_mm=(10.0, 10.0, 10.0, 8.0))
    text = spoken(draw(scene(), options))
    assert "10 mm" in text
    assert "8 mm" in text
    with pytest.raises(OptionError, match=r"between \(0, 0\) and \(40, 40\)"):
        draw(scene(), replace(options, crop_mm=(50.0, 10.0, 10.0, 8.0)))


def test_what_no_view_can_show_is_said() -> None:
    options = PictureOptions(view="iso")
    with pytest.raises(OptionError, match="--target"):
        draw(Scene(title="nothing"), options)
    with pytest.raises(OptionError, match="--tool-diameter"):
        draw(scene(job=None), options)
    alone = scene_of(title="plate", job=JOB, toolpath=plate())
    with pytest.raises(OptionError, match="--against"):
        draw(alone, PictureOptions(view="gouge"))
    with pytest.raises(OptionError, match="shows one stock, not 2"):
        Picture((scene(), scene()), options).render("a.png")
    with pytest.raises(OptionError, match="shows the stock alone"):
        PictureOptions(view="iso", exaggerate=3.0)
    with pytest.raises(OptionError, match="unknown view"):
        PictureOptions(view="aslant")


def test_a_png_holds_its_pixels() -> None:
    pixels = np.random.default_rng(1).integers(0, 256, (7, 5, 3)).astype(np.uint8)
    assert (decode(png_of(pixels)) == pixels).all()


def test_the_raster_lies_on_whole_pixels_of_the_picture() -> None:
    made = render(scene(), "a.png", PictureOptions(size_px=300, view="top"))
    inside = raster(draw(scene(), PictureOptions(size_px=300, view="top")))
    outer = decode(made)[..., :3].astype(int)
    row, column = inside.shape[0] // 2, inside.shape[1] // 2
    found = inside[row - 10 : row + 10, column - 10 : column + 10].astype(int)
    places = [
        (y, x)
        for y in range(outer.shape[0] - 20)
        for x in range(outer.shape[1] - 20)
        if np.abs(outer[y, x] - found[0, 0]).max() <= 1
        and np.abs(outer[y : y + 20, x : x + 20] - found).max() <= 1
    ]
    assert len(places) >= 1


# The compiled walk of each column of pixels.


def literal(heights: Pixels, cell: float, camera: Camera, u: float, v: float) -> float:
    """Height of the point that is seen at (u, v), by a walk in tiny steps; NaN beside the map, and
    for its outermost sides."""
    fx, fy = camera.direction
    rows, columns = heights.shape
    for t in np.arange(-20.0, 25.0, 0.002):
        x, y = u * fy + t * fx, t * fy - u * fx
        column, row = math.floor(x / cell), math.floor(y / cell)
        if 0 <= row < rows and 0 <= column < columns:
            z = (v - t * camera.sine) / camera.cosine
            if z <= heights[row, column]:
                return z if z > heights.min() - 0.01 else math.nan
    return math.nan


@examples(6)
@given(seed=st.integers(0, 1000), view=st.sampled_from(OUTSIDE))
def test_each_pixel_shows_what_a_ray_meets_first(seed: int, view: str) -> None:
    rng, cell, camera = np.random.default_rng(seed), 1.0, CAMERAS[view]
    heights = -rng.integers(0, 4, (8, 9)).astype(np.float32)
    heights[0], heights[-1], heights[:, 0], heights[:, -1] = -4.0, -4.0, -4.0, -4.0
    number = np.empty((12, 14), dtype=np.int32)
    level = np.empty((12, 14), dtype=np.float32)
    u0, v0, pixel = rng.uniform(-9.0, -4.0), rng.uniform(-4.0, 0.0), 0.9
    at = (*camera.direction, camera.sine, camera.cosine, u0, v0, pixel)
    project(heights, (0.5, 0.5, cell), at, 0.1, number, level)
    agree = []
    for row, column in rng.integers(0, (12, 14), (25, 2)).tolist():
        seen = literal(heights, cell, camera, u0 + column * pixel, v0 + row * pixel)  # type: ignore[arg-type]
        if math.isnan(seen):
            agree.append(number[row, column] == -1)
        else:
            agree.append(abs(float(level[row, column]) - seen) < 0.01)
    assert np.mean(agree) >= 0.95  # a pixel on an edge may show either side of it


def test_the_lamp_and_the_view_have_directions_of_length_one() -> None:
    for camera in CAMERAS.values():
        assert math.hypot(*camera.direction) == pytest.approx(1.0)
        assert math.hypot(*camera.light) == pytest.approx(1.0)
        assert camera.light[2] > 0.0
    iso = CAMERAS["iso"]
    axes = [iso.place(1.0, 0.0, 0.0), iso.place(0.0, 1.0, 0.0), iso.place(0.0, 0.0, 1.0)]
    assert [math.hypot(*axis) for axis in axes] == pytest.approx([math.sqrt(2.0 / 3.0)] * 3)


def test_a_map_stands_on_its_board() -> None:
    moves = moves_of([(1.0, 2.0, -1.0)], [(9.0, 2.0, -1.0)], 0, CutterProfile(1.0, 1.0))
    found = height_map(moves, (0.0, 0.0, 10.0, 4.0), 0.1, owners=True)
    stage = stage_of(found, 1.0, moves, 0.2)
    assert stage.heights.shape == (40 + 2 * stage.margin, 100 + 2 * stage.margin)
    assert stage.margin == 20
    assert stage.heights[0, 0] == stage.heights[40, 60] == -1.0
    assert stage.heights[25, 60] == 0.0


# Flags.


def run(*arguments: str) -> int:
    return int(cli.main([*arguments, "-q"], standalone_mode=False))


def test_views_of_commands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.csv").write_text("0,0\n14,0\n14,13\n0,0\n", encoding="utf-8")
    cut = ("--tool-diameter", "2mm", "--depth", "1mm", "--size", "200")
    with pytest.raises(click.UsageError, match="--target"):
        run("preview", "a.csv", "-o", "a.png", "--view", "iso")
    assert run("preview", "a.csv", "-t", "linuxcnc", "-o", "a.png", "--view", "iso", *cut) == 0
    posted = ("post", "a.csv", "-t", "linuxcnc", "-o", "a.ngc", "--preview", "b.svg")
    assert run(*posted, "--view", "top", *cut) == 0
    assert 'id="stock"' in Path("b.svg").read_text()
    with pytest.raises(OptionError, match="--tool-diameter"):
        run("preview", "a.ngc", "-t", "linuxcnc", "-o", "c.png", "--view", "iso")
    assert not Path("c.png").exists()
    named = ("-t", "linuxcnc", "-o", "c.svg", "--view", "top", "--tool-diameter", "2mm")
    assert run("preview", "a.ngc", *named) == 0
    judged = ("verify", "a.ngc", "-t", "linuxcnc", "--against", "a.csv", "--preview", "d.svg")
    assert run(*judged, "--view", "leftover", *cut) == 0
    assert "than wanted" in spoken(Path("d.svg").read_text())[-1]


def test_findings_lie_on_the_stock_in_the_view_aslant() -> None:
    places = ((15.0, 9.5), (20.0, 35.0), (2.0, 2.0), (60.0, 2.0))
    svg = draw(replace(scene(), faults=places), PictureOptions(view="iso"))
    group = re.search(r'<g id="faults"[^>]*>(.*?)</g>', svg, re.DOTALL)
    assert group is not None
    rings = [(float(x), float(y)) for x, y in re.findall(r'cx="([\d.]+)" cy="([\d.]+)"', group[1])]
    assert len(rings) == 3  # one lies beside the stock
    # The uncut corner is at a known depth; the first ring's distance to the right gives the scale.
    corner = rings[2]
    unit = (rings[0][0] - corner[0]) / ((15.0 - 2.0 - (9.5 - 2.0)) * math.sqrt(0.5))
    for (x, y), depth, ring in zip(places, (2.0, 5.0, 0.0), rings, strict=False):
        across = unit * (x - 2.0 - (y - 2.0)) * math.sqrt(0.5)
        up = unit * ((x - 2.0 + y - 2.0) / math.sqrt(6.0) - depth * math.sqrt(2.0 / 3.0))
        assert ring == pytest.approx((corner[0] + across, corner[1] - up), abs=0.05)
