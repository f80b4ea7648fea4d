"""The viewer in a real browser: Debian's Chromium, headless, led by Playwright."""

import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from camtool.geometry.polylines import Polylines, Segments
from camtool.machine.registry import load_target
from camtool.pipeline import listing_of, picture, verify_program
from camtool.preview.draw import Scene
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from tests.postprocessors.i8751_machines import SAMPLE
from tests.preview.conftest import SCENES, circle
from tests.preview.viewer_pages import HOSTILE, MANY, busy, large_text, text_of, traced

CHROMIUM = "/usr/bin/chromium"
# Without the last ones it keeps looking for its maker's hosts.
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
MOST_LOAD_S = 20.0
MOST_PAINT_S = 6.0

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.referee,
    pytest.mark.skipif(not Path(CHROMIUM).exists(), reason=f"{CHROMIUM} is not installed"),
]


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with playwright.sync_playwright() as tool:
        running = tool.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield running
        running.close()


class Shown:
    """A page in the browser, and what it complained about."""

    def __init__(self, browser: Any, page: str, folder: Path, **more: Any) -> None:
        file = folder / "page.html"
        file.write_text(page, encoding="utf-8")
        self.page = browser.new_page(viewport={"width": 1200, "height": 800}, **more)
        self.complaints: list[str] = []
        self.page.on("console", lambda message: self.complaints.append(message.text))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", self._asked)
        self.page.goto(file.as_uri())
        self.page.wait_for_selector("body[data-painted]", timeout=10_000)

    def _asked(self, request: Any) -> None:
        if not request.url.startswith("file:"):
            self.complaints.append(f"asks for {request.url}")

    def text(self, place: str) -> str:
        return str(self.page.inner_text(place))

    def press(self, *keys: str) -> None:
        for key in keys:
            self.page.keyboard.press(key)

    def settled(self) -> None:
        """All frames that were asked for are painted."""
        self.page.wait_for_timeout(40)
        self.page.wait_for_function("() => !document.body.dataset.waiting")

    def pixels(self, canvas: str) -> int:
        """How many pixels of a canvas are not empty."""
        self.settled()
        return int(
            self.page.evaluate(
                """(name) => {
                  const canvas = document.getElementById(name), copy = canvas.cloneNode();
                  const ctx = copy.getContext("2d", { willReadFrequently: true });
                  ctx.drawImage(canvas, 0, 0);
                  const data = ctx.getImageData(0, 0, canvas.width, canvas.height).data;
                  let seen = 0;
                  for (let at = 3; at < data.length; at += 4) if (data[at]) seen++;
                  return seen;
                }""",
                canvas,
            )
        )

    def place_of(self, x: float, y: float) -> tuple[float, float]:
        """Where a point of the frame, 0 … 1 of the stage, lies on the page."""
        box = self.page.locator("#stage").bounding_box()
        return box["x"] + x * box["width"], box["y"] + y * box["height"]


@pytest.fixture
def shown(browser: Any, tmp_path: Path) -> Iterator[Any]:
    """Opens scenes; nothing that it opened may have complained."""
    opened: list[Shown] = []

    def show(scene: Scene | str, **more: Any) -> Shown:
        page = scene if isinstance(scene, str) else text_of(scene)
        opened.append(Shown(browser, page, tmp_path, **more))
        return opened[-1]

    yield show
    for each in opened:
        complaints = each.complaints
        each.page.close()
        assert not complaints


@pytest.mark.parametrize("name", ["drawing", "result", "wide", "line", "empty", "empty toolpath"])
def test_every_scene_opens_without_a_complaint(shown: Any, name: str) -> None:
    shown(SCENES[name])


def test_the_slider_moves_the_tool(shown: Any) -> None:
    view = shown(busy(SCENES["toolpath"]))
    assert "move\n14," in view.text("#now")
    end, whole = view.pixels("over"), view.pixels("done")
    view.page.locator("#slider").fill("3000")
    assert "move\n14," not in view.text("#now")
    assert view.pixels("over") != end
    assert 0 < view.pixels("done") < whole
    assert not view.text("#clock").startswith(view.text("#clock").split(" of ")[1])
    view.press("End")
    assert view.pixels("done") == whole


def test_play_goes_on_and_stops(shown: Any) -> None:
    view = shown(busy(SCENES["toolpath"]))
    view.page.locator("#play").click()
    view.page.wait_for_timeout(300)
    assert view.text("#play") == "Pause"
    first = int(view.page.locator("#slider").input_value())
    view.page.wait_for_timeout(300)
    second = int(view.page.locator("#slider").input_value())
    assert 0 < first < second < 10_000
    view.page.locator("h1").click()
    view.press(" ")
    assert view.text("#play") == "Play"
    rests = view.page.locator("#slider").input_value()
    view.page.wait_for_timeout(150)
    assert view.page.locator("#slider").input_value() == rests


def test_hovering_shows_the_block_and_a_click_goes_there(shown: Any) -> None:
    view = shown(busy(SCENES["toolpath"]))
    assert view.page.locator("#tip").is_hidden()
    # The lower edge of the plate: its first cut.
    tip = _find_move(view, view.place_of(0.42, 0.85))
    assert "N3 G01 X3" in tip
    assert "block\n4" in tip
    assert "outline" in tip
    assert view.text("#listing .current").split() == ["4", "N3", "G01", "X3"]
    view.page.mouse.down()
    view.page.mouse.up()
    assert "move\n4," in view.text("#now")
    view.page.mouse.move(*view.place_of(0.99, 0.01))
    assert view.page.locator("#tip").is_hidden()


def _find_move(view: Any, at: tuple[float, float]) -> str:
    """Put the mouse on the move below a place; its words."""
    for down in range(-40, 41, 2):
        view.page.mouse.move(at[0], at[1] + down)
        if view.page.locator("#tip").is_visible():
            return str(view.text("#tip"))
    raise AssertionError("there is no move")


def test_layers_and_colours(shown: Any) -> None:
    view = shown(busy(SCENES["toolpath"]))
    plan, done = view.pixels("plan"), view.pixels("done")
    view.page.locator("#layers input").nth(0).uncheck()
    assert view.pixels("plan") < plan
    view.press("r")
    fewer = view.pixels("done")
    assert 0 < fewer < done
    view.press("r", "1")
    assert view.pixels("done") == done
    assert view.pixels("plan") == plan
    assert view.page.locator("#scale").is_hidden()
    view.press("e")
    assert view.text("#scale-high") == "20 µm"
    assert view.page.locator("#colour-by").input_value() == "error"


def _signs(scene: Scene) -> Scene:
    """The scene with a tool, a table, and a circle that it should have gone round."""
    circles = Polylines.of([circle(2.5, 2.5, 2.0)])
    return replace(scene, tool_mm=0.3, travel_mm=(9.0, 7.0), wanted=Segments.of(circles))


def test_every_layer_is_switched_by_its_key(shown: Any) -> None:
    scene = replace(_signs(busy(SCENES["toolpath"])), trace_points=None)
    view = shown(scene)
    whole = {name: view.pixels(name) for name in ("ground", "plan", "signs")}
    on = view.page.locator("#layers input:checked").count()
    assert view.page.locator("#layers input").count() == on + 1  # reversals alone are off
    for canvas, keys in (("signs", "boazx"), ("ground", "st"), ("plan", "w")):
        for key in keys:
            view.press(key)
            assert 0 <= view.pixels(canvas) < whole[canvas], key
            view.press(key)
            assert view.pixels(canvas) == whole[canvas], key
    view.press("v")
    assert view.pixels("signs") > whole["signs"]


def test_beside_a_predicted_path_signs_are_off(shown: Any) -> None:
    view = shown(traced(_signs(busy(SCENES["result"]))))
    names = view.page.locator("#layers label:not(:has(:checked))").all_inner_texts()
    assert [name.split("\n")[0] for name in names] == [
        "starts", "order of contours", "directions", "reversals of X and Y",
    ]  # fmt: skip


def test_what_the_tool_covers_grows_with_the_time(shown: Any) -> None:
    view = shown(_signs(busy(SCENES["toolpath"])))
    view.press("t")
    whole = view.pixels("ground")
    view.page.locator("#slider").fill("6000")
    assert 0 < view.pixels("ground") < whole
    view.press("Home")
    assert view.pixels("ground") == 0


def test_deviations_are_drawn_larger_and_the_factor_is_shown(shown: Any) -> None:
    view = shown(traced(_signs(busy(SCENES["result"]))))
    assert view.page.locator("#factor").is_hidden()
    before = view.pixels("done")
    view.press("m", "m", "m", "m")
    assert view.page.locator("#factor").inner_text().endswith("× 20")
    assert view.pixels("done") != before
    view.press("M", "M", "M", "M", "M")
    assert view.page.locator("#factor").is_hidden()
    assert view.pixels("done") == before


def test_keys_zoom_pan_fit_and_step(shown: Any) -> None:
    view = shown(busy(SCENES["toolpath"]))
    view.settled()
    fitted = view.page.screenshot()
    view.press("+", "+", "Shift+ArrowLeft")
    view.settled()
    assert view.page.screenshot() != fitted
    view.press("f")
    view.settled()
    assert view.page.screenshot() == fitted
    view.press("Home", "ArrowRight")
    assert "move\n2," in view.text("#now") or "move\n3," in view.text("#now")
    view.press("?")
    assert view.page.locator("#help").is_visible()
    view.press("Escape")
    assert view.page.locator("#help").is_hidden()


def test_the_wheel_zooms_where_the_mouse_is(shown: Any) -> None:
    view = shown(busy(SCENES["toolpath"]))
    _find_move(view, view.place_of(0.42, 0.85))
    before = view.text("#tip")
    view.page.mouse.wheel(0, -400)
    view.settled()
    box = view.page.locator("#stage").bounding_box()
    assert box is not None
    view.page.mouse.move(0, 0)
    _find_move(view, view.place_of(0.42, 0.85))
    assert view.text("#tip") == before


def test_the_table_shows_a_move(shown: Any) -> None:
    view = shown(busy(SCENES["toolpath"]))
    assert "Worst moves" in view.text("#tables")
    view.page.locator("#tables button").click()
    assert "move\n3," in view.text("#now")


def test_dark_and_paper_have_their_own_colours(shown: Any) -> None:
    light, dark = (
        shown(busy(SCENES["toolpath"]), color_scheme=scheme) for scheme in ("light", "dark")
    )
    assert _paper(light) > 200 > 60 > _paper(dark)
    dark.page.evaluate("() => dispatchEvent(new Event('beforeprint'))")
    assert _paper(dark) > 200
    dark.page.evaluate("() => dispatchEvent(new Event('afterprint'))")
    assert _paper(dark) < 60
    dark.page.emulate_media(media="print", color_scheme="dark")
    assert _paper(dark) > 200
    assert dark.page.locator("#controls").is_hidden()
    assert dark.page.locator("#tables").is_visible()


def _paper(view: Any) -> int:
    """The red of the page's ground."""
    words = view.page.evaluate("() => getComputedStyle(document.body).backgroundColor")
    return int(words.split("(")[1].split(",")[0])


def test_it_prints_on_white_with_the_tables_and_without_the_controls(
    shown: Any, tmp_path: Path
) -> None:
    view = shown(busy(SCENES["toolpath"]), color_scheme="dark")
    view.settled()
    file = tmp_path / "page.pdf"
    view.page.pdf(path=str(file))
    view.page.emulate_media(media="print", color_scheme="dark")
    view.page.evaluate("() => dispatchEvent(new Event('beforeprint'))")
    for place in ("#controls", "#listing", "#tools", "#colours", "#now", "#tables button"):
        assert view.page.locator(place).is_hidden(), place
    assert view.page.locator("#tables").is_visible()
    assert _paper(view) > 200
    # The whole picture stands on one canvas, with the blue of feeds as on white ground.
    view.settled()
    blue = view.page.evaluate(
        """() => {
          const copy = document.createElement("canvas");
          const ground = document.getElementById("ground");
          [copy.width, copy.height] = [ground.width, ground.height];
          const ctx = copy.getContext("2d", { willReadFrequently: true });
          ctx.drawImage(ground, 0, 0);
          const data = ctx.getImageData(0, 0, copy.width, copy.height).data;
          let seen = 0;
          for (let at = 0; at < data.length; at += 4) {
            seen += data[at] === 15 && data[at + 1] === 106 && data[at + 2] === 196;
          }
          return seen;
        }"""
    )
    assert blue > 300
    assert file.read_bytes().count(b"/Type /Page\n") + file.read_bytes().count(b"/Type/Page") <= 3


def test_the_keyboard_reaches_everything_and_all_of_it_has_a_name(shown: Any) -> None:
    view = shown(busy(SCENES["toolpath"]))
    view.press("?")
    names = """() => [...document.querySelectorAll(
        "button, input, select, [tabindex]")].filter((each) => each.offsetParent).length"""
    wanted, seen = view.page.evaluate(names), []
    for _ in range(wanted):
        view.press("Tab")
        seen.append(
            view.page.evaluate(
                """() => { const it = document.activeElement, style = getComputedStyle(it);
                const label = it.labels && it.labels.length ? it.labels[0].innerText : "";
                return [it.getAttribute("aria-label") || label || it.innerText,
                        it.outerHTML.slice(0, 60), style.outlineStyle]; }"""
            )
        )
    assert all(name.strip() for name, _, _ in seen), seen
    assert all(outline == "solid" for _, _, outline in seen), seen
    assert len({tag for _, tag, _ in seen}) > 8
    assert view.page.evaluate("() => document.activeElement.textContent") == "show"


def test_the_listing_goes_from_block_to_block(shown: Any) -> None:
    view = shown(busy(SCENES["toolpath"]))
    view.page.locator("#listing").focus()
    view.press("ArrowUp", "ArrowUp", "ArrowDown")
    assert "move\n13," in view.text("#now")
    assert view.text("#listing .current").split()[0] == "13"


def test_at_the_end_stands_the_last_block(shown: Any) -> None:
    view = shown(busy(SCENES["toolpath"]))
    view.press("Home")
    view.page.locator("#slider").fill("10000")
    count = view.page.evaluate("() => JSON.parse(head.textContent).blocks.split('\\n').length")
    assert view.text("#listing .current").split()[0] == str(count)
    assert view.text("#clock").split(" of ")[0] == view.text("#clock").split(" of ")[1]


def test_bytes_under_the_cursor_and_the_largest_error_of_the_report(shown: Any) -> None:
    target = load_target("i8751", machine_file=SAMPLE, settings=["axes.x.backlash_mm=0.05"])
    program = target.post.write(_square(), target.machine).data
    decoded, judged = verify_program(program, target, source="a.bin")
    listing = listing_of(program, target, decoded)
    scene = picture(
        title="a", toolpath=decoded, verification=judged, machine=target.machine, listing=listing
    )
    view = shown(scene)
    tip = _find_move(view, view.place_of(0.5, 0.92))
    made = listing()
    assert made is not None
    block = int(tip.split("block\n")[1].split()[0]) - 1
    assert f"bytes\n{made.blocks[block]}" in tip
    said = float(view.text("#scale-high").removesuffix(" µm"))
    assert said == pytest.approx(judged.report.error_um.total.max, rel=1e-3)


def _square() -> Toolpath:
    path = ToolpathBuilder((0.0, 0.0, 0.0)).rapid(z=1.0).line(z=-0.1, feed=8.0)
    for x, y in ((4.0, 0.0), (4.0, 3.0), (0.0, 3.0), (0.0, 0.0)):
        path.line(x, y, feed=8.0)
    return path.rapid(z=1.0).event(Kind.END).finish()


def test_hostile_names_stay_names(shown: Any) -> None:
    scene = busy(SCENES["toolpath"])
    view = shown(replace(scene, title=HOSTILE, notes=(HOSTILE,)))
    assert "hack()" in view.text("h1")
    assert view.page.evaluate("() => typeof hack") == "undefined"
    assert view.page.locator("img").count() == 0


def test_the_picture_shows_the_errors_in_colours(shown: Any) -> None:
    view = shown(busy(SCENES["result"]))
    view.press("e")
    view.settled()
    colours = view.page.evaluate(
        """() => {
          const copy = document.createElement("canvas"), names = ["plan", "done", "over"];
          const ctx = copy.getContext("2d", { willReadFrequently: true });
          [copy.width, copy.height] = [600, 400];
          for (const name of names) ctx.drawImage(document.getElementById(name), 0, 0, 600, 400);
          const data = new Uint32Array(ctx.getImageData(0, 0, 600, 400).data.buffer);
          return new Set(data).size;
        }"""
    )
    assert colours > 50


@pytest.mark.parametrize("count", MANY)
def test_many_moves_stay_quick(shown: Any, count: int) -> None:
    page = large_text(count)
    begin = time.perf_counter()
    view = shown(page)
    assert time.perf_counter() - begin < MOST_LOAD_S
    assert view.pixels("done") > 10_000
    for deed in (
        lambda: view.page.locator("#slider").fill("5000"),
        lambda: view.press("+"),
        lambda: view.page.mouse.move(*view.place_of(0.5, 0.5)),
        lambda: view.press("e"),
        lambda: view.press("v"),
        lambda: view.press("m"),
    ):
        painted = int(view.page.evaluate("() => document.body.dataset.painted"))
        begin = time.perf_counter()
        deed()
        view.page.wait_for_function(
            "(before) => Number(document.body.dataset.painted) > before", arg=painted
        )
        assert time.perf_counter() - begin < MOST_PAINT_S
    assert "G01X" in view.text("#now")
