"""The viewer in a real browser: its layers, deviations, print, names for all, bytes."""

from pathlib import Path
from typing import Any

import pytest

from camtool.geometry.polylines import Polylines, Segments
from camtool.pictures import layers
from camtool.pictures.draw import draw, render
from camtool.pictures.options import PictureOptions
from camtool.pictures.scene import Scene
from camtool.pipeline import verify_program
from camtool.planning.job import Tool
from camtool.records import replace
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles import svg_page
from tests.pictures.conftest import SCENES, circle
from tests.pictures.viewer_browser import NEEDS_BROWSER, browser, find_move, paper, shown
from tests.pictures.viewer_pages import busy, traced
from tests.postprocessors.i8751.machines import SAMPLE

__all__ = ["browser", "shown"]

pytestmark = NEEDS_BROWSER


def _with_table(scene: Scene) -> Scene:
    """The scene with a tool, a table, and a circle that it should have gone round."""
    circles = Polylines.of([circle(2.5, 2.5, 2.0)])
    return replace(scene, tool_mm=0.3, travel_mm=(9.0, 7.0), wanted=Segments.of(circles))


def test_every_layer_is_switched_by_its_key(shown: Any) -> None:
    scene = replace(_with_table(busy(SCENES["toolpath"])), trace_points=None)
    view = shown(scene)
    whole = {name: view.pixels(name) for name in ("ground", "plan", "marks")}
    on = view.page.locator("#layers input:checked").count()
    assert view.page.locator("#layers input").count() == on + 1  # reversals alone are off
    for canvas, keys in (("marks", "boazx"), ("ground", "st"), ("plan", "w")):
        for key in keys:
            view.press(key)
            assert 0 <= view.pixels(canvas) < whole[canvas], key
            view.press(key)
            assert view.pixels(canvas) == whole[canvas], key
    view.press("v")
    assert view.pixels("marks") > whole["marks"]


ROW = layers.Layer(
    "hints",
    lambda content: [
        layers.LineGroup("edges", "edge", content.outlines, layers.RAPID_LINE),
        layers.DotGroup("corners", "corner", [(1.0, 1.0), (3.0, 1.0)], layers.PLUNGE_MARK),
        layers.TextGroup("names", ["A", "B"], [(1.0, 1.0), (3.0, 1.0)], layers.INK),
    ],
    key="h",
)
"""A layer that neither pictures nor the page's script know."""


def test_a_row_of_the_table_is_a_layer_of_pictures_and_of_pages(
    shown: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(layers, "LAYERS", (*layers.LAYERS, ROW))
    scene = busy(SCENES["toolpath"])
    picture = svg_page.parse(draw(scene))
    for name in ("edges", "corners", "names"):
        assert svg_page.group(picture, name) is not None, name
    assert {"edge", "corner"} <= {group.get("aria-label") for group in picture.iter()}
    view = shown(scene)
    label = view.page.locator("#layers label", has_text="hints")
    assert label.inner_text().split() == ["edge", "corner", "A", "hints", "H"]
    assert label.locator("input").is_checked()
    swatches = label.locator(".swatch")
    look = "(all) => all.map((one) => getComputedStyle(one))"
    borders = swatches.evaluate_all(f"{look}.map((style) => style.borderTopColor)")
    assert borders[:2] == ["rgb(139, 150, 163)", "rgb(255, 255, 255)"]
    whole = view.pixels("marks")
    view.press("h")
    assert view.pixels("marks") < whole
    label.locator("input").check()
    assert view.pixels("marks") == whole


def test_beside_a_predicted_path_some_layers_are_off(shown: Any) -> None:
    view = shown(traced(_with_table(busy(SCENES["result"]))))
    names = view.page.locator("#layers label:not(:has(:checked))").all_inner_texts()
    assert [name.split("\n")[0] for name in names] == [
        "starts", "order of contours", "directions", "reversal",
    ]  # fmt: skip


def test_what_the_tool_covers_grows_with_the_time(shown: Any) -> None:
    view = shown(_with_table(busy(SCENES["toolpath"])))
    view.press("t")
    whole = view.pixels("ground")
    view.page.locator("#slider").fill("6000")
    assert 0 < view.pixels("ground") < whole
    view.press("Home")
    assert view.pixels("ground") == 0


def test_deviations_are_drawn_larger_and_the_factor_is_shown(shown: Any) -> None:
    view = shown(traced(_with_table(busy(SCENES["result"]))))
    assert view.page.locator("#factor").is_hidden()
    before = view.pixels("done")
    view.press("m", "m", "m", "m")
    assert view.page.locator("#factor").inner_text().endswith("× 20")
    assert view.pixels("done") != before
    view.press("M", "M", "M", "M", "M")
    assert view.page.locator("#factor").is_hidden()
    assert view.pixels("done") == before


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
    assert paper(view) > 200
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
    program = target.target.write(_square(), target.machine).data
    run = verify_program(program, target, source="a.bin")
    listing, scene = run.listing, run.scene("a")
    view = shown(scene)
    tip = find_move(view, view.place_of(0.5, 0.92))
    made = listing()
    assert made is not None
    block = int(tip.split("block\n")[1].split()[0]) - 1
    assert f"bytes\n{made.blocks[block]}" in tip
    said = float(view.text("#scale-high").removesuffix(" µm"))
    assert said == pytest.approx(run.report.error_um.total.max, rel=1e-3)


def _square() -> Toolpath:
    path = ToolpathBuilder((0.0, 0.0, 0.0)).rapid(z=1.0).line(z=-0.1, feed=8.0)
    for x, y in ((4.0, 0.0), (4.0, 3.0), (0.0, 3.0), (0.0, 0.0)):
        path.line(x, y, feed=8.0)
    return path.rapid(z=1.0).event(Kind.END).finish()


def test_a_tool_that_is_as_wide_as_it_is_deep_fills_what_it_cuts(shown: Any) -> None:
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 1.0)
    builder.line(0.0, 0.0, 0.0, feed=100.0)
    builder.line(10.0, 0.0, -2.0, feed=100.0)
    builder.line(10.0, 10.0, -2.0, feed=100.0)
    builder.rapid(z=1.0)
    bit = Tool(8.0, "v", tip_angle_rad=1.5707963267948966)
    scene = Scene(title="slope", toolpath=builder.finish())
    plain, wide = shown(scene), shown(replace(scene, nose=bit))
    assert "as it is deep" in wide.text("#layers")
    assert wide.pixels("ground") > plain.pixels("ground")
    wide.press("s")
    assert wide.pixels("ground") == plain.pixels("ground")


def test_the_page_of_a_job_with_stock_opens(shown: Any) -> None:
    stock = (-1.0, -1.0, 6.0, 4.0)
    view = shown(replace(busy(SCENES["toolpath"]), stock_mm=stock))
    assert "stock 7 × 5 mm" in view.text("#layers")
    assert b"stock" in render(
        replace(SCENES["toolpath"], stock_mm=stock), "a.svg", PictureOptions(dark=True)
    )
