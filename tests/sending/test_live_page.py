"""The page of `send --live`: what it draws, and that nothing depends on it."""

from __future__ import annotations

import re
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from camtool.sending.live import MOST_POINTS, LivePage
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Toolpath
from tests.sending.test_any_order import PROGRAMS
from tests.sending.test_ends import command, hosted


def read() -> Toolpath:
    target = load_target("grbl")
    decoded: Toolpath = target.target.read(PROGRAMS["grbl"], target.machine)
    return decoded


def path_of(page: str, name: str) -> str:
    found = re.search(rf'<path class="{name}" d="([^"]*)"', page)
    assert found is not None
    return found[1]


def test_what_is_acknowledged_is_the_beginning_of_what_is_predicted(tmp_path: Path) -> None:
    page = LivePage(tmp_path / "live.html", "part", read())
    before = ""
    for block in range(-1, 49):
        text = page.html("sending", {"block": str(block)}, block, (1.0, 2.0, 3.0))
        done, whole = path_of(text, "done"), path_of(text, "way")
        assert whole.startswith(done)
        assert done.startswith(before)
        before = done
    assert done == whole != ""
    assert 'cx="1.0000" cy="-2.0000"' in text


def test_it_is_a_page_by_itself_and_names_are_text(tmp_path: Path) -> None:
    page = LivePage(tmp_path / "live.html", "<script>alert(1)</script>", read())
    text = page.html("failed", {"": "<b>&"}, 3)
    assert "<script" not in text
    assert "&lt;b&gt;&amp;" in text
    assert "http-equiv" not in text  # nothing comes any more
    assert "http-equiv" in page.html("sending", {}, 3)
    assert not re.search(r"(src|href)=", text)
    svg = text[text.index("<svg") : text.index("</svg>") + 6]
    assert len(ET.fromstring(svg)) == 3
    page.write(text)
    assert [each.name for each in tmp_path.iterdir()] == ["live.html"]


def test_long_paths_are_thinned_and_keep_their_ends(tmp_path: Path) -> None:
    path = ToolpathBuilder()
    for k in range(40_000):
        path.line(np.cos(0.001 * k) * k, np.sin(0.001 * k) * k, feed=100.0)
    made = path.finish()
    text = LivePage(tmp_path / "live.html", "part", made).html("sending", {}, 40_000)
    assert path_of(text, "way").count("L") <= MOST_POINTS + 1
    x, y, _ = made.end[-1]
    assert path_of(text, "way").endswith(f"L{x:.4f} {-y:.4f}")


def test_an_empty_program_has_a_page(tmp_path: Path) -> None:
    page = LivePage(tmp_path / "live.html", "part", ToolpathBuilder().finish())
    assert path_of(page.html("sending", {}, 0), "way") == ""


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
    assert path_of(text, "done") == path_of(text, "way")


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
