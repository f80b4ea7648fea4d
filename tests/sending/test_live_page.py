"""The page of `send --live`: that it draws the program, and that nothing depends on it."""

from __future__ import annotations

import random
import re
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from camtool.records import replace
from camtool.sending.live import MAX_LINES, STEPS_PX, WIDTH_PX, LivePage
from camtool.sending.prepare import consignment
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Toolpath
from tests.oracles.page_paths import beside, live_paths, program_paths
from tests.sending.test_any_order import PROGRAMS
from tests.sending.test_ends import command, hosted

HEAD = "G21 G90\nM3 S1000\nG0 Z5\n"
SHAPES = {
    "rectangle": [(0, 0), (20, 0), (20, 10), (0, 10), (0, 0)],
    "M": [(0, 0), (0, 30), (9, 12), (18, 30), (18, 0)],
    "A": [(0, 0), (8, 25), (16, 0), (13, 9), (3, 9)],
}


def read(data: bytes = PROGRAMS["grbl"]) -> Toolpath:
    target = load_target("grbl")
    decoded: Toolpath = target.target.read(data, target.machine)
    return decoded


def passes(shape: list[tuple[int, int]], count: int) -> str:
    """The shape at so many depths, each a little deeper."""
    x, y = shape[0]
    lines = [f"{HEAD}G0 X{x} Y{y}"]
    for k in range(count):
        lines.append(f"G1 Z{-0.001 * (k + 1):.3f} F100")
        lines += [f"G1 X{x} Y{y} F600" for x, y in shape]
    return "\n".join([*lines, "G0 Z5", "M5", "M2"])


def drawn_beside(text: str, tmp_path: Path) -> float:
    """Largest distance between the page's cuts and those of the program, in px of the picture."""
    program = program_paths(text)
    page = LivePage(tmp_path / "live.html", "part", read(text.encode())).html("x", {}, 0)
    left, low, right, top = program.box()
    px_mm = 1.08 * max(right - left, top - low) / WIDTH_PX
    rapids = [path for path in program.rapids if len(path) > 1]
    if rapids:
        assert beside(live_paths(page, "rapid"), rapids) < 0.5 * px_mm
    return beside(live_paths(page, "way"), program.cuts) / px_mm


@pytest.mark.parametrize("count", [1, 13, 4_000])
@pytest.mark.parametrize("name", SHAPES)
def test_every_corner_is_drawn(name: str, count: int, tmp_path: Path) -> None:
    assert drawn_beside(passes(SHAPES[name], count), tmp_path) < 0.01


def random_program(seed: int) -> str:
    """Lines, arcs, circles and rapids over a table of some random size."""
    draws = random.Random(seed)
    size, lines, x, y = 10.0 ** draws.uniform(-0.5, 2.0), [HEAD, "G1 F500"], 0.0, 0.0
    for _ in range(draws.choice([5, 60, 300])):
        kind = draws.randrange(5)
        to = [round(draws.uniform(-size, size), 3) for _ in range(2)]
        if kind >= 3:
            i, j = (round(draws.uniform(-0.5, 0.5) * size, 3) for _ in range(2))
            if abs(i) + abs(j) < 0.1 * size:
                continue
            to = [x, y] if kind == 4 else [round(x + 2 * i, 3), round(y + 2 * j, 3)]
            lines.append(f"G{draws.choice('23')} X{to[0]} Y{to[1]} I{i} J{j}")
        else:
            lines.append(f"G{min(kind, 1)} X{to[0]} Y{to[1]} Z{draws.choice([1, -1, -2])}")
        x, y = to
    return "\n".join([*lines, "M2"])


@pytest.mark.parametrize(
    "seed", [*range(6), *(pytest.param(k, marks=pytest.mark.slow) for k in range(6, 200))]
)
def test_what_is_drawn_is_the_program(seed: int, tmp_path: Path) -> None:
    assert drawn_beside(random_program(seed), tmp_path) < 2.0 * STEPS_PX[0] + 0.1


@pytest.mark.parametrize("block", [-1, 3, 7, 20, 44])
def test_what_is_acknowledged_is_what_these_blocks_cut(block: int, tmp_path: Path) -> None:
    text = PROGRAMS["grbl"].decode()
    page = LivePage(tmp_path / "live.html", "part", read()).html("sending", {}, block)
    cuts = program_paths("\n".join(text.splitlines()[: block + 1])).cuts
    done = live_paths(page, "done")
    assert beside(done, cuts) < 0.02 if cuts else done == []


def test_blocks_that_run_again_are_acknowledged_with_the_first_that_is_later(
    tmp_path: Path,
) -> None:
    path = ToolpathBuilder()
    for k in range(1, 5):
        path.line(k, k * k, feed=100.0)
    made = path.finish()
    made = replace(made, block=np.array([0, 5, 1, 6], dtype=np.int32))
    page = LivePage(tmp_path / "live.html", "part", made)
    lines = [len(live_paths(page.html("x", {}, block), "done")) for block in (0, 1, 5, 6)]
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
    told = page.html("sending", {"place": "<b>"}, 9, share=0.4199, why="a <hold>")
    assert "<b>, 41 %" not in told
    assert "</b>, 41 %" in told
    assert "a &lt;hold&gt;" in told
    assert "<dt>feed</dt><dd>400 mm/min</dd>" in told
    assert "<dd>rapid</dd>" in page.html("sending", {}, 1)
    page.write(text)
    assert [each.name for each in tmp_path.iterdir()] == ["live.html"]


def test_long_paths_are_thinned_and_keep_their_ends(tmp_path: Path) -> None:
    path = ToolpathBuilder()
    for k in range(MAX_LINES + 20_000):
        path.line(np.cos(0.001 * k) * k, np.sin(0.001 * k) * k, feed=100.0)
    made = path.finish()
    text = LivePage(tmp_path / "live.html", "part", made).html("sending", {}, 0)
    assert 1_000 < path_of(text, "way").count("L") <= MAX_LINES
    x, y, _ = made.end[-1]
    ends = [float(each) for each in path_of(text, "way").rsplit("L", 1)[1].split()]
    assert ends == pytest.approx([x, -y], abs=0.1 * STEPS_PX[0] * MAX_LINES / WIDTH_PX)


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
