"""The viewer in depth: the stock that its script cuts, beside one that shares nothing with it, and
what a browser shows of it."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Callable, Iterator
from importlib import resources
from typing import Any

import numpy as np
import pytest
from PIL import Image

import camtool
from camtool.arrays import Floats
from camtool.geometry.turn import Turn
from camtool.kernels.stock import StockTree
from camtool.pictures.scene import ReportTable, Scene, StockPair, TableLine, stock_pair
from camtool.pictures.viewer.page import viewer_page
from camtool.planning.job import Job, Tool
from camtool.records import replace
from camtool.stock.before import SetupCut, StockBefore
from camtool.stock.cutters import cutter_profile
from camtool.stock.heights import stock_tree
from camtool.stock.moves import StockMoves, stock_moves_of_toolpath
from camtool.stock.slides import tools_of_rows
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Toolpath
from tests.oracles.page_paths import viewer_column
from tests.oracles.stock import Cutter, Move, Stock
from tests.pictures.viewer_browser import NEEDS_BROWSER, browser, shown
from tests.pictures.viewer_pages import busy, head_of, with_run

__all__ = ["browser", "shown"]

BOX = (-2.0, -3.0, 18.0, 12.0)
GRID = (161, 121)
MILL, BIT, BALL = Tool(3.0), Tool(6.0, "v", math.radians(60.0), 0.4), Tool(4.0, "ball")
BULL = Tool(4.0, "bull", corner_radius_mm=1.0)


def random_path(seed: int, count: int = 30) -> Toolpath:
    """Lines, level arcs, ramps, plunges and rapids in a box of 16 × 9 mm."""
    draws = np.random.default_rng(seed)
    path = ToolpathBuilder().rapid(0.0, 0.0, 2.0)
    for _ in range(count):
        x, y = draws.uniform([0.0, 0.0], [16.0, 9.0]).tolist()
        z = float(draws.uniform(-2.0, 0.5))
        kind = int(draws.integers(5))
        if kind == 0:
            path.rapid(z=2.0).rapid(x, y).line(z=z, feed=100.0)
        elif kind == 1:
            path.line(x, y, z, feed=100.0)
        elif kind == 2:
            start = path.finish().end[-1]
            middle = 0.5 * (start[:2] + np.array([x, y]))
            path.arc(x, y, centre=(*middle.tolist(),), ccw=bool(draws.integers(2)), feed=100.0)
        else:
            path.line(x, y, feed=100.0)
    return path.finish()


def slot(depth: float) -> Toolpath:
    """A slot through the middle of the stock."""
    path = ToolpathBuilder().rapid(2.0, 4.5, 2.0).line(z=depth, feed=50.0)
    return path.line(14.0, 4.5, feed=50.0).rapid(z=2.0).rapid(0.0, 0.0).finish()


def cuts_of(path: Toolpath, *turns: tuple[int, Tool]) -> StockMoves:
    """The moves of a path with tools that begin at rows."""
    begins = [row for row, _ in turns]
    which = np.searchsorted(begins, np.arange(len(path)), side="right") - 1
    return stock_moves_of_toolpath(path, which, tuple(cutter_profile(tool) for _, tool in turns))


def cuts_of_job(path: Toolpath, job: Job) -> StockTree:
    """The stock that a toolpath would leave on a machine without any error."""
    tools = tools_of_rows(path, job)
    return stock_tree(stock_moves_of_toolpath(path, tools.index, tools.cutters))


def scene_of_cuts(
    path: Toolpath, *turns: tuple[int, Tool], wanted: StockMoves | None = None
) -> Scene:
    cut = StockPair(cuts_of(path, *turns), wanted, BOX, 3.0, known=True)
    return busy(Scene("cuts", toolpath=path, tools=turns, cut=lambda: cut))


def cut_by(script: Callable[[str], Any], path: Toolpath, tool: Tool, *rows: int) -> list[Floats]:
    """Cut up to the ends of the rows in turn with the page's script: heights (ny, nx) each."""
    names = ("data.js", "solid.js")
    folder = resources.files("camtool.pictures.viewer")
    text = "\n".join(folder.joinpath(name).read_text() for name in names)
    moves = cuts_of(path, (0, tool))
    given = {
        "at": np.vstack([moves.start[:1], moves.end]).ravel().tolist(),
        "counts": np.bincount(moves.row, minlength=len(path)).tolist(),
        "cutter": cutter_profile(tool).columns,
        "stock": {"box": BOX, "grid": GRID},
        "rows": rows,
    }
    made = script(
        f"""() => {{
          {text}
          const given = {json.dumps(given)};
          const slides = new Slides(Float64Array.from(given.at), given.counts);
          const turns = [[0, new Cutter(given.cutter)]];
          const solid = new Solid(given.stock, turns, slides);
          const all = given.rows.map((row) => {{
            solid.toward(row, 1);
            return Array.from(solid.heights);
          }});
          return {{ nx: solid.nx, ny: solid.ny, all }};
        }}"""
    )
    return [np.array(each).reshape(made["ny"], made["nx"]) for each in made["all"]]


def cut_slowly(path: Toolpath, tool: Tool, shape: tuple[int, ...]) -> Iterator[Floats]:
    """Yield, after each row, the same stock of needles at the same places, by the oracle; a tool
    with a round corner by the dense points of its path."""
    stock = Stock((0.0, 0.0), (1.0, 1.0))
    stock.x = np.linspace(BOX[0], BOX[2], shape[1])
    stock.y = np.linspace(BOX[1], BOX[3], shape[0])
    stock.height = np.zeros(shape)
    angle = tool.tip_angle_rad
    slope = 0.0 if angle is None else math.tan(0.5 * angle)
    cutter = Cutter(tool.radius_mm, slope, 0.5 * tool.tip_diameter_mm)
    for k in range(len(path)):
        centre = (*path.centre[k].tolist(),) if path.is_arc[k] else None
        sweep = float(path.sweeps()[k]) if path.is_arc[k] else 0.0
        start, end = path.starts[k].tolist(), path.end[k].tolist()
        move = Move(False, (*start,), (*end,), k, centre, sweep)
        if tool.kind not in ("ball", "bull"):
            stock.cut(move, cutter)
            yield stock.height.copy()
            continue
        length = math.dist(start, end) if centre is None else abs(sweep) * 10.0
        for x, y, z in move.at(np.linspace(0.0, 1.0, 2 + int(length / 0.05))).tolist():
            d = np.hypot(stock.x[None, :] - x, stock.y[:, None] - y)
            nose = tool.nose_mm
            out = np.clip(d - (tool.radius_mm - nose), 0.0, nose)
            high = z + nose - np.sqrt(nose**2 - out**2)
            stock.height = np.where(
                d <= tool.radius_mm, np.minimum(stock.height, high), stock.height
            )
        yield stock.height


@pytest.mark.parametrize("tool", [MILL, BIT, BALL, BULL], ids=lambda tool: str(tool.kind))
@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
class TestCutting:
    """Heights of the page's script beside those of the oracle."""

    pytestmark = NEEDS_BROWSER

    def test_the_script_cuts_as_the_oracle(self, browser: Any, tool: Tool, seed: int) -> None:
        path, page = random_path(seed), browser.new_page()
        last = len(path) - 1
        ends = [last // 3, last, last // 2, 3, last]
        found = cut_by(page.evaluate, path, tool, *ends)
        page.close()
        assert found[1].min() < -1.0
        slowly = list(cut_slowly(path, tool, found[0].shape))
        for row, heights in zip(ends, found, strict=True):
            slow = slowly[row]
            apart = np.abs(heights - slow)
            # A needle at the very edge of a tool is cut or not by rounding, or by the chord of an
            # arc: beside it another one is as high.
            assert np.quantile(apart, 0.995) < 0.01, row
            assert (apart > 0.02).mean() < 0.004, row
        np.testing.assert_array_equal(found[1], found[4])


def picture(view: Any) -> bytes:
    view.settled()
    return bytes(view.page.locator("#stage").screenshot())


class TestShown:
    """The page in a browser, with a coarse grid: without a graphics card this is slow."""

    pytestmark = NEEDS_BROWSER

    @pytest.fixture(autouse=True)
    def _coarse(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr("camtool.pictures.viewer.page.MAX_HEIGHTS", 30_000)

    @pytest.fixture
    def view(self, shown: Any) -> Any:
        view = shown(scene_of_cuts(random_path(3), (0, MILL), (12, BIT)))
        view.press("g")
        view.settled()
        return view

    def test_it_turns_zooms_and_returns(self, view: Any) -> None:
        before = picture(view)
        seen = {before}
        for keys in (("ArrowLeft",), ("ArrowUp",), ("+",), ("Shift+ArrowLeft",), ("s",), ("7",)):
            view.press(*keys)
            seen.add(picture(view))
        assert len(seen) == 7
        view.press("i")
        assert picture(view) == before
        view.page.mouse.move(*view.place_of(0.5, 0.5))
        view.page.mouse.down()
        view.page.mouse.move(*view.place_of(0.7, 0.6))
        view.page.mouse.up()
        view.page.mouse.move(0, 0)
        assert picture(view) not in seen
        view.press("g")
        assert view.pixels("plan") > 0
        assert picture(view) not in seen

    def test_fingers_turn_move_and_zoom(self, view: Any) -> None:
        box = view.page.locator("#stage").bounding_box()
        x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
        session = view.page.context.new_cdp_session(view.page)

        def touch(kind: str, *places: tuple[float, float]) -> None:
            points = [{"x": x + a, "y": y + b, "id": k} for k, (a, b) in enumerate(places)]
            session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

        def drag(*ways: tuple[tuple[float, float], tuple[float, float]]) -> bytes:
            touch("touchStart", *(begin for begin, _ in ways))
            touch("touchMove", *(end for _, end in ways))
            touch("touchEnd")
            return picture(view)

        seen = [picture(view)]
        seen.append(drag(((0, 0), (60, 20))))
        seen.append(drag(((-50, 0), (-100, 0)), ((50, 0), (100, 0))))
        seen.append(drag(((-50, 0), (-50, 40)), ((50, 0), (50, 40))))
        assert len(set(seen)) == 4
        # Two fingers that move together do not zoom: the opposite way leads back.
        assert drag(((-50, 40), (-50, 0)), ((50, 40), (50, 0))) == seen[2]

    def test_it_is_drawn_again_after_the_picture_is_lost(self, view: Any) -> None:
        before = picture(view)
        view.page.evaluate(
            """() => new Promise((done) => {
              const canvas = document.getElementById("solid"), gl = canvas.getContext("webgl2");
              const lost = gl.getExtension("WEBGL_lose_context");
              const restore = () => setTimeout(() => lost.restoreContext(), 50);
              canvas.addEventListener("webglcontextrestored", () => setTimeout(done, 50));
              canvas.addEventListener("webglcontextlost", restore);
              lost.loseContext();
            })"""
        )
        assert picture(view) == before

    def test_the_slider_cuts_and_fills_again(self, view: Any) -> None:
        whole = picture(view)
        view.page.locator("#slider").fill("3000")
        assert picture(view) != whole
        view.press("End")
        assert picture(view) == whole

    def test_it_begins_with_what_the_setups_before_have_left(self, shown: Any) -> None:
        """A slot of another set-up stands at the start; a cut less deep along it adds nothing."""
        path = slot(-1.0)
        left = SetupCut.of("first", cuts_of(slot(-1.5), (0, MILL)), Turn())
        before = StockBefore(above=(left,))
        moves = cuts_of(path, (0, MILL))
        pair = StockPair(moves, moves, BOX, 3.0, known=True, before=before)
        view = shown(replace(scene_of_cuts(path, (0, MILL)), cut=lambda: pair))
        view.press("g")
        for key in ("Home", "End"):
            view.press(key)
            view.press("t")
            view.settled()
            view.page.mouse.move(*view.place_of(0.5, 0.5))
            assert "Z -1.500" in view.text("#tip")

    def test_section_path_and_colours_change_it(self, view: Any) -> None:
        seen = {picture(view)}
        view.page.select_option("#section-axis", "y")
        seen.add(picture(view))
        view.page.locator("#section-at").fill("300")
        seen.add(picture(view))
        view.press("l")
        seen.add(picture(view))
        view.press("e")
        seen.add(picture(view))
        assert len(seen) == 5

    def test_the_place_under_the_mouse_and_its_move(self, view: Any) -> None:
        view.press("t")
        view.settled()
        view.page.mouse.move(*view.place_of(0.5, 0.5))
        tip = view.text("#tip")
        assert "place\nX 8." in tip
        assert "block" in tip

    def test_its_heights_are_those_of_the_simulated_slides(
        self, shown: Any, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr("camtool.pictures.viewer.page.MAX_HEIGHTS", 500_000)
        worn = {"axes.x.backlash_mm": 1.0, "axes.y.backlash_mm": 1.0}
        job = camtool.read_job("samples/mount.toml")
        machine = camtool.load_target("grbl", settings=worn)
        run = camtool.post("samples/mount.dxf", machine, job)
        page = viewer_page(run.scene()).decode("utf-8")
        stock = head_of(page)["stock"]
        assert isinstance(stock, dict)
        cell = (stock["box"][2] - stock["box"][0]) / (stock["grid"][0] - 1)
        exact = camtool.cut_stock(run)
        assert run.decoded is not None
        planned = cuts_of_job(run.decoded, job)
        view = shown(page)
        view.press("g", "t")
        view.settled()
        seen, besides = 0, 0
        for across in np.linspace(0.1, 0.9, 120):
            view.page.mouse.move(*view.place_of(across, 0.5 + 0.5 * (across - 0.5)))
            words = view.text("#tip").split()
            if "place" not in words:
                continue
            x, y, z = (float(words[words.index(axis) + 1]) for axis in "XYZ")
            near = np.linspace(-1.0, 1.0, 9) * (cell + 0.005)
            places = np.stack(np.meshgrid(x + near, y + near), axis=-1).reshape(-1, 2)
            heights = exact.heights(places).clip(stock["bottom"])
            assert heights.min() - 0.002 <= z <= heights.max() + 0.002, (x, y)
            seen += 1
            low, high = np.sort(planned.heights(places)[0])[[0, -1]]
            besides += bool(z < low - 0.01 or z > high + 0.01)
        assert seen > 15
        assert besides  # the decoded moves cut elsewhere

    def test_a_table_shows_a_place(self, shown: Any) -> None:
        scene = scene_of_cuts(random_path(3), (0, MILL))
        assert scene.playback is not None
        line = TableLine(("here",), at_mm=(4.0, 6.0))
        run = replace(scene.playback(), tables=(ReportTable("Findings", ("what",), (line,)),))
        view = shown(with_run(scene, run))
        view.press("g", "t")
        before = picture(view)
        view.page.get_by_role("button", name="show X 4 Y 6").click()
        assert picture(view) != before
        view.page.mouse.move(*view.place_of(0.5, 0.5))
        tip = view.text("#tip").split()
        x, y = float(tip[tip.index("X") + 1]), float(tip[tip.index("Y") + 1])
        assert (x, y) == pytest.approx((4.0, 6.0), abs=0.1)
        view.press("g")
        view.page.get_by_role("button", name="show X 4 Y 6").click()
        assert view.pixels("over") > 0

    def test_gouges_and_leftovers_have_their_colours(self, shown: Any) -> None:
        wanted = cuts_of(slot(-1.0), (0, MILL))
        for depth, red, blue in ((-1.0, False, False), (-1.2, True, False), (-0.8, False, True)):
            view = shown(scene_of_cuts(slot(depth), (0, MILL), wanted=wanted))
            view.press("g", "t")
            view.page.select_option("#colour-by", "beside")
            data = np.array(Image.open(io.BytesIO(picture(view))).convert("RGB")).astype(int)
            floor = data[data.shape[0] // 2, data.shape[1] // 2]
            assert bool(floor[0] - floor[2] > 100) == red
            assert bool(floor[2] - floor[0] > 100) == blue

    def test_the_tip_and_the_axes_of_part_zero_are_shown(self, shown: Any) -> None:
        view = shown(scene_of_cuts(slot(-1.0), (0, MILL)))
        view.page.locator("#play").focus()
        for key, tip in (("Home", "X 0.000"), ("ArrowRight", "X 2.000"), ("End", "X 0.000")):
            view.press(key)
            assert view.text("#now").startswith(f"tool at\n{tip}"), key
        view.press("g")
        before = picture(view)
        view.press("z")
        assert picture(view) != before

    def test_without_a_tool_the_path_is_shown_and_it_says_so(self, shown: Any) -> None:
        view = shown(busy(Scene("no tool", toolpath=random_path(3))))
        assert not view.page.locator("#no-tool").is_visible()
        view.press("g")
        assert "No tool is known" in view.text("#tools")
        assert view.page.locator("#path-shown").is_checked()
        before = picture(view)
        view.press("l")
        assert picture(view) != before
        known = shown(scene_of_cuts(random_path(3), (0, MILL)))
        known.press("g")
        assert not known.page.locator("#no-tool").is_visible()

    def test_shank_and_holder_are_drawn_where_they_are_known(self, shown: Any) -> None:
        seen = []
        bare = replace(MILL, cutting_length_mm=5.0)
        shank = replace(bare, shank_diameter_mm=4.0, stickout_mm=8.0)
        holder = replace(shank, holder_diameter_mm=10.0, holder_length_mm=6.0)
        for tool in (bare, shank, holder):
            view = shown(scene_of_cuts(slot(-1.0), (0, tool)))
            view.press("g", "f", "-", "-")
            view.page.locator("#slider").fill("5000")
            view.page.mouse.move(0, 0)
            data = np.array(Image.open(io.BytesIO(picture(view))).convert("RGB")).astype(int)
            seen.append((np.abs(data - data[5, 5]).max(axis=2) > 20).sum())
        assert seen[0] < seen[1] < seen[2]

    def test_without_webgl_the_plan_stays_and_says_so(self, shown: Any) -> None:
        view = shown(scene_of_cuts(random_path(3), (0, MILL)))
        view.page.evaluate("() => { HTMLCanvasElement.prototype.getContext = () => null; }")
        view.press("g")
        assert "WebGL 2" in view.text("#tools")
        assert view.page.locator("#plan").is_visible()


def test_the_head_has_the_stock_and_each_tool() -> None:
    head = head_of(
        viewer_page(scene_of_cuts(random_path(3), (0, MILL), (12, BIT))).decode("utf-8")
    )
    stock = head["stock"]
    assert isinstance(stock, dict)
    across, upwards = stock.pop("grid")
    assert stock == {"box": [*BOX], "bottom": -3.0}
    assert 400_000 < across * upwards < 530_000
    assert (across - 1) / (upwards - 1) == pytest.approx(20.0 / 15.0, rel=1e-4)
    cutters = head["cutters"]
    assert isinstance(cutters, list)
    assert [row for row, *_ in cutters] == [0, 12]
    assert cutters[0][1:] == [1.5, 1.5, 0.0, 0.0]
    assert cutters[1][1:] == pytest.approx([3.0, 0.2, 0.0, math.sqrt(3.0)])


def test_the_page_holds_the_wanted_heights() -> None:
    path = random_path(4, 8)
    scene = scene_of_cuts(path, (0, BIT), wanted=cuts_of(path, (0, BIT)))
    page = viewer_page(scene).decode("utf-8")
    stock = head_of(page)["stock"]
    assert isinstance(stock, dict)
    across, upwards = stock["grid"]
    counts = viewer_column(page, "goal_count").astype(int)
    heights = np.repeat(viewer_column(page, "goal_height"), counts) * 3.0 / 32_000
    *_, slow = cut_slowly(path, BIT, (upwards, across))
    apart = np.abs(heights.reshape(upwards, across) - slow)
    assert np.quantile(apart, 0.995) < 0.005
    without = head_of(viewer_page(scene_of_cuts(path, (0, BIT))).decode("utf-8"))["columns"]
    assert isinstance(without, dict)
    assert without["goal_height"][2] == 0


def test_without_a_stock_it_is_as_large_as_the_cuts() -> None:
    path = ToolpathBuilder().rapid(0.0, 0.0, 2.0).line(10.0, 4.0, -1.5, feed=50.0).finish()
    pair = stock_pair(cuts_of(path, (0, MILL)), None, None)
    page = viewer_page(replace(scene_of_cuts(path, (0, MILL)), cut=lambda: pair)).decode("utf-8")
    stock = head_of(page)["stock"]
    assert isinstance(stock, dict)
    beside = 1.5 + 0.06 * 13.0
    box = (-beside, -beside, 10.0 + beside, 4.0 + beside)
    assert stock["box"] == pytest.approx(box)
    assert stock["bottom"] == pytest.approx(-1.25 * 1.5)
