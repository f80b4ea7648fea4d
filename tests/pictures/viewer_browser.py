"""A real browser for the viewer's pages: Debian's Chromium, headless, led by Playwright."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from camtool.pictures.scene import Scene
from tests.pictures.viewer_pages import text_of
from tests.waiting import HANG_S

CHROMIUM = "/usr/bin/chromium"
# Without the last ones it keeps looking for its maker's hosts.
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
NEEDS_BROWSER = [
    pytest.mark.referee,
    pytest.mark.xdist_group("chromium"),
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
        self.page.on("console", self._said)
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", self._asked)
        self.page.set_default_timeout(HANG_S * 1000)
        self.page.goto(file.as_uri())
        self.page.wait_for_selector("body[data-painted]")

    def _said(self, message: Any) -> None:
        # A browser without a graphics card reads each frame back, and says so.
        if "GPU stall due to ReadPixels" not in message.text:
            self.complaints.append(message.text)

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
        """Count the pixels of a canvas that are not empty."""
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
        """Return the page position of a point of the frame, 0 … 1 of the stage."""
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


def find_move(view: Any, at: tuple[float, float]) -> str:
    """Put the mouse on the move below a place; its words."""
    for down in range(-40, 41, 2):
        view.page.mouse.move(at[0], at[1] + down)
        if view.page.locator("#tip").is_visible():
            return str(view.text("#tip"))
    raise AssertionError("there is no move")


def paper(view: Any) -> int:
    """The red of the page's ground."""
    words = view.page.evaluate("() => getComputedStyle(document.body).backgroundColor")
    return int(words.split("(")[1].split(",")[0])
