"""The viewer in a real browser: the picture, its time, the mouse and the keys."""

from typing import Any

import pytest

from camtool.records import replace
from tests.pictures.conftest import SCENES, cut_by, followed, plate
from tests.pictures.viewer_browser import NEEDS_BROWSER, browser, find_move, paper, shown
from tests.pictures.viewer_pages import HOSTILE, MANY, busy, large_text

__all__ = ["browser", "shown"]

pytestmark = NEEDS_BROWSER


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
    assert view.text("#play") == "Pause"
    past = "(before) => Number(document.getElementById('slider').value) > before"
    view.page.wait_for_function(past, arg=0)
    first = int(view.page.locator("#slider").input_value())
    view.page.wait_for_function(past, arg=first)
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
    tip = find_move(view, view.place_of(0.42, 0.85))
    assert "N3 G01 X3" in tip
    assert "block\n4" in tip
    assert "outline" in tip
    assert view.text("#listing .current").split() == ["4", "N3", "G01", "X3"]
    view.page.mouse.down()
    view.page.mouse.up()
    assert "move\n4," in view.text("#now")
    view.page.mouse.move(*view.place_of(0.99, 0.01))
    assert view.page.locator("#tip").is_hidden()


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
    find_move(view, view.place_of(0.42, 0.85))
    before = view.text("#tip")
    view.page.mouse.wheel(0, -400)
    view.settled()
    box = view.page.locator("#stage").bounding_box()
    assert box is not None
    view.page.mouse.move(0, 0)
    find_move(view, view.place_of(0.42, 0.85))
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
    assert paper(light) > 200 > 60 > paper(dark)
    dark.page.evaluate("() => dispatchEvent(new Event('beforeprint'))")
    assert paper(dark) > 200
    dark.page.evaluate("() => dispatchEvent(new Event('afterprint'))")
    assert paper(dark) < 60
    dark.page.emulate_media(media="print", color_scheme="dark")
    assert paper(dark) > 200
    assert dark.page.locator("#controls").is_hidden()
    assert dark.page.locator("#tables").is_visible()


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
def test_many_moves_are_painted_after_each_deed(shown: Any, count: int) -> None:
    page = large_text(count)
    view = shown(page)
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
        deed()
        view.page.wait_for_function(
            "(before) => Number(document.body.dataset.painted) > before", arg=painted
        )
    assert "G01X" in view.text("#now")


def test_moves_are_coloured_by_engagement(shown: Any) -> None:
    """A page whose tool is known offers it; the cursor reads it."""
    path = followed(plate())
    view = shown(replace(busy(SCENES["toolpath"]), cut=cut_by(path, 0.5)))
    before = view.page.screenshot()
    view.page.select_option("#colour-by", "engagement")
    view.settled()
    assert view.page.screenshot() != before
    assert (view.text("#scale-low"), view.text("#scale-high")) == ("0°", "180°")
    assert "entries" in view.text("#engagement")
    view.press("Home", *["ArrowRight"] * 4)
    assert "engaged\n" in view.text("#now")
    assert view.complaints == []
    plain = shown(busy(SCENES["toolpath"]))
    assert plain.page.locator("#colour-by option[value=engagement]").count() == 0
