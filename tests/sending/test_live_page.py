"""The page of `send --live`: that it draws the program, and that nothing depends on it."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from camtool.records import replace
from camtool.sending.live import BYTES_PER_S, RELOAD_S, LivePage
from camtool.sending.prepare import consignment
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Toolpath
from tests.oracles.page_paths import beside, live_rows, program_paths, viewer_paths
from tests.pictures.viewer_browser import NEEDS_BROWSER, browser
from tests.sending.test_any_order import PROGRAMS
from tests.sending.test_ends import command, hosted

__all__ = ["browser"]


def read(data: bytes = PROGRAMS["grbl"]) -> Toolpath:
    target = load_target("grbl")
    decoded: Toolpath = target.target.read(data, target.machine)
    return decoded


@pytest.mark.parametrize("block", [-1, 3, 7, 20, 44])
def test_what_is_acknowledged_is_what_these_blocks_cut(block: int, tmp_path: Path) -> None:
    text = PROGRAMS["grbl"].decode()
    page = LivePage(tmp_path / "live.html", "part", read()).html("sending", {}, block)
    cuts = program_paths("\n".join(text.splitlines()[: block + 1])).cuts
    done = viewer_paths(page, live_rows(page)).cuts
    assert beside(done, cuts) < 1e-3 if cuts else done == []


def test_blocks_that_run_again_are_acknowledged_with_the_first_that_is_later(
    tmp_path: Path,
) -> None:
    path = ToolpathBuilder()
    for k in range(1, 5):
        path.line(k, k * k, feed=100.0)
    made = path.finish()
    made = replace(made, block=np.array([0, 5, 1, 6], dtype=np.int32))
    page = LivePage(tmp_path / "live.html", "part", made)
    lines = [live_rows(page.html("x", {}, block)) for block in (0, 1, 5, 6)]
    assert lines == [1, 1, 3, 4]


def test_the_rest_of_a_program_counts_the_blocks_of_the_whole() -> None:
    target = load_target("grbl")
    whole = consignment(PROGRAMS["grbl"], target, source="part.nc")
    assert [whole.block_of(k) for k in (-1, 0, 7)] == [-1, 0, 7]
    rest = consignment(PROGRAMS["grbl"], target, source="part.nc", first=20)
    assert rest.rest is not None
    entry = rest.rest.entry
    assert entry > 1
    assert [rest.block_of(k) for k in range(-1, entry)] == [-1] * (entry + 1)
    assert [rest.block_of(entry + k) for k in range(3)] == [20, 21, 22]


def test_what_is_acknowledged_grows_to_the_whole_program(tmp_path: Path) -> None:
    page, before = LivePage(tmp_path / "live.html", "part", read()), 0
    for block in range(-1, 49):
        text = page.html("sending", {"block": str(block)}, block, (1.0, 2.0, 3.0))
        assert live_rows(text) >= before
        before = live_rows(text)
    assert before == read().executed_rows > 0
    assert '"place": [1.0, 2.0, 3.0]' in text
    whole = viewer_paths(text)
    program = program_paths(PROGRAMS["grbl"].decode())
    assert beside(whole.cuts, program.cuts) < 1e-3
    assert beside(whole.rapids, program.rapids) < 1e-3


def test_it_is_a_page_by_itself_and_names_are_text(tmp_path: Path) -> None:
    page = LivePage(tmp_path / "live.html", "<script>alert(1)</script>", read())
    text = page.html("failed", {"": "<b>&"}, 3)
    assert "<script>alert" not in text
    assert "&lt;b&gt;&amp;" in text
    assert '"again_ms": 0' in text  # nothing comes any more
    assert '"again_ms": 1000' in page.html("sending", {}, 3)
    assert not re.search(r"(src|href)=", text)
    told = page.html("sending", {"place": "<b>"}, 9, share=0.4199, reason="a <hold>")
    assert "<b>, 41 %" not in told
    assert "</b>, 41 %" in told
    assert "a &lt;hold&gt;" in told
    assert "<dt>feed</dt><dd>400 mm/min</dd>" in told
    assert "<dd>rapid</dd>" in page.html("sending", {}, 1)
    page.write(text)
    assert [each.name for each in tmp_path.iterdir()] == ["live.html"]


class TestBrowser:
    """The page in a browser, which loads it again."""

    pytestmark = NEEDS_BROWSER

    def test_it_follows_and_keeps_the_view(self, browser: Any, tmp_path: Path) -> None:
        live = LivePage(tmp_path / "live.html", "part.nc", read())
        live.write(live.html("sending", {"block": "2"}, 1, (0.0, 0.0, 5.0), share=0.1))
        page = browser.new_page(viewport={"width": 800, "height": 700})
        page.goto(live.file.as_uri())
        page.wait_for_selector("body[data-painted]")
        assert page.title() == "10 % part.nc: sending"
        assert page.locator("#controls").is_hidden()
        page.keyboard.press("g")
        page.keyboard.press("7")
        page.wait_for_function("() => !document.body.dataset.waiting")
        top = page.locator("#stage").screenshot()
        live.write(live.html("sending", {"block": "9"}, 8, (0.0, 0.0, 5.0), share=0.5))
        page.wait_for_function("() => document.title.startsWith('50 %')")
        page.wait_for_function("() => !document.body.dataset.waiting")
        assert page.locator("#in-depth").get_attribute("aria-pressed") == "true"
        later = page.locator("#stage").screenshot()
        assert later != top
        page.keyboard.press("7")
        page.wait_for_function("() => !document.body.dataset.waiting")
        assert page.locator("#stage").screenshot() == later
        live.write(live.html("finished", {}, 10**6, share=1.0))
        page.wait_for_function("() => document.title.startsWith('100 %')")
        assert page.locator("#controls").is_visible()
        assert "finished, 100 %" in page.inner_text("#live")
        page.close()


def test_a_long_program_is_written_less_often(tmp_path: Path) -> None:
    path = ToolpathBuilder()
    for k in range(130_000):
        path.line(np.cos(0.001 * k) * k, np.sin(0.001 * k) * k, feed=100.0)
    page = LivePage(tmp_path / "live.html", "part", path.finish())
    assert len(page.html("sending", {}, 0)) < 1.01 * BYTES_PER_S * page.every_s
    assert page.every_s > RELOAD_S


def test_an_empty_program_has_a_page(tmp_path: Path) -> None:
    page = LivePage(tmp_path / "live.html", "part", ToolpathBuilder().finish())
    assert viewer_paths(page.html("sending", {}, 0)).cuts == []


def test_send_writes_it_and_says_how_it_ended(tmp_path: Path) -> None:
    program, live = tmp_path / "part.nc", tmp_path / "live.html"
    program.write_bytes(PROGRAMS["grbl"])
    twin: Any = load_target("grbl").twin([])
    with hosted(twin, 12.0) as port:
        line = command("grbl", program, port, "--live", str(live))
        done = subprocess.run(line, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    text = live.read_text()
    assert '<b class="finished">' in text
    assert live_rows(text) == read().executed_rows
    assert '"blocks":"' in text
    assert "part.nc" in text
    assert "</b>, 100 %" in text


@pytest.mark.parametrize("name", ["none/live.html", "."])
def test_a_page_that_cannot_be_written_is_said_before_anything_is_sent(
    name: str, tmp_path: Path
) -> None:
    program = tmp_path / "part.nc"
    program.write_bytes(PROGRAMS["grbl"])
    twin: Any = load_target("grbl").twin([])
    with hosted(twin, 12.0) as port:
        line = command("grbl", program, port, "--live", str(tmp_path / name))
        done = subprocess.run(line, capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    assert "cannot be written" in done.stderr
    assert twin.decoded == []
