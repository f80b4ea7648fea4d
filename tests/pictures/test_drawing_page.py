"""The drawing page in a browser: `camtool post` reads what is drawn by mouse, pen and keys."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from camtool.pictures.drawing import drawing_page
from camtool.target.registry import load_target
from tests.commands import run_camtool
from tests.pictures.viewer_browser import NEEDS_BROWSER, browser
from tests.waiting import HANG_S

__all__ = ["browser"]

pytestmark = NEEDS_BROWSER


class Sheet:
    """The page, by the places of its sheet."""

    def __init__(self, browser: Any, folder: Path) -> None:
        self.folder = folder
        self.page = browser.new_page(viewport={"width": 1200, "height": 800})
        self.complaints: list[str] = []
        self.page.on("console", lambda message: self.complaints.append(message.text))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.set_default_timeout(HANG_S * 1000)
        file = folder / "draw.html"
        file.write_bytes(drawing_page(100.0, 80.0, 5.0))
        self.page.goto(file.as_uri())

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Where a place of the sheet is on the screen."""
        found = self.page.evaluate(
            "([x, y]) => { const at = new DOMPoint(x, y).matrixTransform("
            "document.getElementById('flip').getScreenCTM()); return [at.x, at.y]; }",
            [x, y],
        )
        return found[0], found[1]

    def click(self, x: float, y: float, button: str = "left") -> None:
        self.page.mouse.click(*self.at(x, y), button=button)

    def press(self, *keys: str) -> None:
        for key in keys:
            self.page.keyboard.press(key)

    def saved(self) -> Any:
        with self.page.expect_download() as download:
            self.page.locator("#save").click()
        file = self.folder / download.value.suggested_filename
        download.value.save_as(file)
        return json.loads(file.read_text())


@pytest.fixture
def sheet(browser: Any, tmp_path: Path) -> Iterator[Sheet]:
    sheet = Sheet(browser, tmp_path)
    yield sheet
    assert sheet.complaints == []
    sheet.page.close()


def points_of(figure: Any) -> list[Any]:
    assert figure["units"] == "mm"
    return [[tuple(point) for point in stroke["points"]] for stroke in figure["strokes"]]


def test_clicks_set_points_on_the_grid_and_the_right_one_ends(sheet: Sheet) -> None:
    for x, y in ((10.9, 9.4), (41.0, 11.0), (40.0, 29.0)):
        sheet.click(x, y)
    sheet.click(60.0, 60.0, "right")
    for x, y in ((60.0, 20.0), (80.0, 20.0), (80.0, 40.0), (60.4, 20.3)):  # back to the first
        sheet.click(x, y)
    figure = sheet.saved()
    assert points_of(figure) == [
        [(10.0, 10.0), (40.0, 10.0), (40.0, 30.0)],
        [(60.0, 20.0), (80.0, 20.0), (80.0, 40.0)],
    ]
    assert [stroke["closed"] for stroke in figure["strokes"]] == [False, True]


def test_angles_and_points_are_snapped_to_without_a_grid(sheet: Sheet) -> None:
    sheet.page.locator("#to-grid").uncheck()
    sheet.click(10.0, 10.0)
    start = [sheet.page.evaluate("state.current[0]")]
    sheet.click(30.0, 10.4)  # within three degrees of the level
    sheet.click(45.0, 25.2)  # and of 45°
    points = sheet.page.evaluate("state.current")
    assert points[1][1] == points[0][1]
    across, up = points[2][0] - points[1][0], points[2][1] - points[1][1]
    assert across == pytest.approx(up, abs=2e-4)
    sheet.press("e")
    sheet.click(start[0][0] + 0.4, start[0][1] - 0.4)  # near a point of the first line
    assert sheet.page.evaluate("state.current[0]") == start[0]


def test_keys_alone_draw_undo_and_save(sheet: Sheet) -> None:
    sheet.page.locator("#sheet").focus()
    sheet.press("ArrowRight", "ArrowUp", "Enter")
    sheet.press("ArrowRight", "ArrowRight", "Enter", "ArrowUp", "Shift+ArrowUp", "Enter")
    sheet.press("ArrowLeft", "Enter", "Control+z", "c")
    told = sheet.page.locator("#told").text_content()
    assert re.search(r"1 line", told), told
    sheet.press("Control+z", "Control+z", "Control+y", "Control+y")
    with sheet.page.expect_download():
        sheet.press("Control+s")
    figure = sheet.saved()
    assert points_of(figure) == [[(5.0, 5.0), (15.0, 5.0), (15.0, 10.5)]]
    assert figure["strokes"][0]["closed"]


def test_typed_places_are_points_too_and_every_control_has_a_name(sheet: Sheet) -> None:
    for x, y in (("1.25", "2"), ("7", "-3.5")):
        sheet.page.locator("#x").fill(x)
        sheet.page.locator("#y").fill(y)
        sheet.page.locator("#typed button").click()
    assert points_of(sheet.saved()) == [[(1.25, 2.0), (7.0, -3.5)]]
    nameless = sheet.page.evaluate(
        "[...document.querySelectorAll('button, input')].filter((each) =>"
        " !(each.textContent.trim() || each.ariaLabel || (each.labels && each.labels.length)))"
        ".map((each) => each.outerHTML)"
    )
    assert nameless == []


def test_a_pen_draws_freely(sheet: Sheet) -> None:
    places = [(10.0 + k, 10.0 + 0.3 * k) for k in range(30)]
    for kind, (x, y) in [
        ("pointerdown", places[0]),
        *(("pointermove", each) for each in places),
        ("pointerup", places[-1]),
    ]:
        px, py = sheet.at(x, y)
        sheet.page.evaluate(
            "([kind, x, y]) => { const sheet = document.getElementById('sheet');"
            "sheet.setPointerCapture = () => {}; sheet.dispatchEvent(new PointerEvent(kind,"
            "{ clientX: x, clientY: y, button: 0, pointerType: 'pen', bubbles: true })); }",
            [kind, px, py],
        )
    [stroke] = points_of(sheet.saved())
    assert len(stroke) > 20
    assert stroke[0] == pytest.approx(places[0], abs=0.05)
    assert stroke[-1][0] > 38.0


def test_what_is_saved_is_posted_and_cuts_what_was_drawn(sheet: Sheet) -> None:
    for x, y in ((10.0, 10.0), (50.0, 10.0), (50.0, 40.0), (10.0, 40.0), (10.0, 10.0)):
        sheet.click(x, y)
    sheet.page.locator("#name").fill("plate.json")
    sheet.saved()
    words = ["post", "plate.json", "-t", "grbl", "--kind", "engrave", "-o", "plate.nc"]
    done = run_camtool(*words, cwd=sheet.folder)
    assert done.returncode == 0, done.stderr
    target = load_target("grbl")
    path = target.target.read((sheet.folder / "plate.nc").read_bytes(), target.machine)
    cut = path.end[path.is_feed & (path.end[:, 2] < 0.0)]
    assert cut[:, :2].min(axis=0) == pytest.approx([10.0, 10.0])
    assert cut[:, :2].max(axis=0) == pytest.approx([50.0, 40.0])
