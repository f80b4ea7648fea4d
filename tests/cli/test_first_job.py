"""The first job of somebody with a small router: from an empty folder to a program in four
commands, at the first attempt, without editing a file. The program is read block by block as a
machinist reads it, cut in the oracle's stock, and taken by the controllers' own interpreters.

The drawing is made here, once as CAD draws it (DXF) and once as Inkscape does (SVG, with text that
is still text): a plate of 90 by 60 mm with round corners, a window, a pocket 2 mm deep, four holes
of 3 mm, a hole of 4.5 mm for a countersunk screw M4, and a label.
"""

from __future__ import annotations

import math
import re
from itertools import pairwise
from pathlib import Path

import ezdxf
import numpy as np
import pytest
import shapely

from camtool.arrays import Floats
from tests.cli.conftest import ROOT, Done, Run
from tests.feeding import made
from tests.oracles.grbl_firmware import built, run, source
from tests.oracles.rs274 import RS274, run_rs274
from tests.oracles.stock import Cutter, Stock, moves_of
from tests.postprocessors.golden import GOLDEN, compare_golden

WIDE, HIGH, THICK = 90.0, 60.0, 6.0
CORNER = 5.0
WINDOW = (12.0, 32.0, 40.0, 52.0)
POCKET = (50.0, 34.0, 78.0, 50.0)
HOLES = ((8.0, 8.0), (82.0, 8.0), (82.0, 52.0), (30.0, 20.0))
SUNK = (70.0, 18.0)
LABEL = (8.0, 20.0, 24.0, 30.0)
"""Left, lower, right and upper end of where the label may be."""

LISTING = (ROOT / "samples" / "grbl-3018.txt").read_text().replace("$30=10000", "$30=1000")
"""What a router of this kind says of itself; grbl's default says no speed of a spindle."""

CELL_MM = 0.25


@pytest.fixture(autouse=True)
def _settings(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """The user's configuration folder, empty."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path_factory.mktemp("config")))


def as_dxf(file: Path) -> None:
    """The plate as CAD draws it, away from zero."""
    doc = ezdxf.new("R2010", units=4)
    space = doc.modelspace()
    for layer in ("CUT", "POCKET 2mm", "ENGRAVE"):
        doc.layers.add(layer)
    x, y = 100.0, 40.0
    b, r = math.tan(math.pi / 8.0), CORNER
    ring = [
        (r, 0, 0), (WIDE - r, 0, b), (WIDE, r, 0), (WIDE, HIGH - r, b),
        (WIDE - r, HIGH, 0), (r, HIGH, b), (0, HIGH - r, 0), (0, r, b),
    ]  # fmt: skip
    outline = [(x + u, y + v, bulge) for u, v, bulge in ring]
    space.add_lwpolyline(outline, "xyb", close=True, dxfattribs={"layer": "CUT"})
    for (left, low, right, top), layer in ((WINDOW, "CUT"), (POCKET, "POCKET 2mm")):
        corners = [(left, low), (right, low), (right, top), (left, top)]
        for (u, v), (p, q) in zip(corners, corners[1:] + corners[:1], strict=True):
            ends = (x + u, y + v), (x + p, y + q)
            space.add_line(*ends, dxfattribs={"layer": layer})
    for (u, v), diameter in (*((hole, 3.0) for hole in HOLES), (SUNK, 4.5), (SUNK, 8.6)):
        space.add_circle((x + u, y + v), 0.5 * diameter, dxfattribs={"layer": "CUT"})
    text = space.add_text("A1", height=6.0, dxfattribs={"layer": "ENGRAVE"})
    text.set_placement((x + LABEL[0] + 1.0, y + LABEL[1] + 1.0))
    doc.saveas(file)


def as_svg(file: Path) -> None:
    """The plate as Inkscape draws it: Y down, layers that are groups, live text."""

    def layer(name: str, *shapes: str) -> str:
        return (
            f'<g inkscape:groupmode="layer" id="{name.split()[0]}" inkscape:label="{name}"'
            f' style="fill:none;stroke:#000000;stroke-width:0.1">{"".join(shapes)}</g>'
        )

    def rect(box: tuple[float, float, float, float], radius: float = 0.0) -> str:
        left, low, right, top = box
        return (
            f'<rect x="{10 + left}" y="{10 + HIGH - top}" width="{right - left}"'
            f' height="{top - low}" ry="{radius}"/>'
        )

    def circle(at: tuple[float, float], diameter: float) -> str:
        return f'<circle cx="{10 + at[0]}" cy="{10 + HIGH - at[1]}" r="{0.5 * diameter}"/>'

    holes = [circle(hole, 3.0) for hole in HOLES] + [circle(SUNK, 4.5), circle(SUNK, 8.6)]
    cut = layer("Cut", rect((0.0, 0.0, WIDE, HIGH), CORNER), rect(WINDOW), *holes)
    text = (
        f'<text x="{10 + LABEL[0] + 1}" y="{10 + HIGH - LABEL[1] - 1}"'
        ' style="font-size:6px;font-family:sans-serif;fill:#000000;stroke:none">'
        '<tspan sodipodi:role="line">A1</tspan></text>'
    )
    file.write_text(
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<svg xmlns="http://www.w3.org/2000/svg"'
        ' xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"'
        ' xmlns:sodipodi="http://sodipodi.sourceforge.net/DTD/sodipodi-0.dtd"'
        f' width="110mm" height="80mm" viewBox="0 0 110 80">{cut}'
        f"{layer('Pocket 2mm', rect(POCKET))}{layer('Engrave', text)}</svg>\n"
    )


def first_program(camtool: Run, folder: Path, name: str, *more: str) -> tuple[str, list[Done]]:
    """The commands, and the program that they leave."""
    (as_dxf if name.endswith(".dxf") else as_svg)(folder / name)
    (folder / "grbl.txt").write_text(LISTING, encoding="ascii")
    stock = ("--material", "plywood", "--thickness", f"{THICK:g}mm")
    done = [
        camtool("init", "my-3018", "--settings", "grbl.txt"),
        camtool("tools", "new"),
        camtool("job", "new", name, "--tool", "mill", *stock),
        camtool(
            "post", name, "--job", "job.toml", "-o", "plate.nc", "--report", "plate.html", *more
        ),
    ]
    for each in done:
        assert each.returncode == 0, each.stderr.decode()
    return (folder / "plate.nc").read_text(encoding="ascii"), done


def tool_of(program: str, line: int) -> str:
    """Return the text of the comments before a line about the tool."""
    told = re.findall(
        r"^\(tool \d+ ([\w-]+):? .*\)$", "\n".join(program.splitlines()[:line]), re.M
    )
    return str(told[-1])


CUTTERS = {
    "end": Cutter(0.5 * 3.175),
    "drill-3": Cutter(1.5, math.tan(math.radians(59.0))),
    "bit-60": Cutter(3.0, math.tan(math.radians(30.0))),
    "bit-90": Cutter(3.0, math.tan(math.radians(45.0))),
}


def cut_stock(program: str) -> Stock:
    stock = Stock((-8.0, -8.0), (WIDE + 8.0, HIGH + 8.0), CELL_MM)
    for move in moves_of(program):
        if min(move.a[2], move.b[2]) < 0.0:
            stock.cut(move, CUTTERS[tool_of(program, move.line)])
    return stock


NAMES = ["plate.dxf", "plate.svg"]


@pytest.mark.parametrize("name", NAMES)
def test_the_part_is_what_was_drawn(camtool: Run, tmp_path: Path, name: str) -> None:
    program, done = first_program(camtool, tmp_path, name)
    said = b"\n".join(each.stderr for each in done).decode()
    assert set(re.findall(r"camtool: \w+ ([A-Z_]+)", said)) == {
        "TOOL_BY_HAND",
        "TOOL_CHANGE_NOT_STATED",
    }
    for reason in (
        "circles as wide as the drill drill-3",
        "a countersink of 90° with bit-90",
        "pocket 2mm is called so",
        "text is engraved",
    ):
        assert reason in said.replace("P", "p").replace("OCKET", "ocket")
    stock = cut_stock(program)
    part = shapely.box(CORNER, CORNER, WIDE - CORNER, HIGH - CORNER).buffer(CORNER, quad_segs=256)
    places, height = stock.points, stock.height.ravel()
    points = shapely.points(places)
    window, pocket, label = (shapely.box(*box) for box in (WINDOW, POCKET, LABEL))

    def heights_of(area: shapely.Geometry) -> Floats:
        return np.asarray(height[shapely.contains(area, points)])

    sure = 0.05
    for hole in HOLES:
        drilled = shapely.Point(hole).buffer(1.5 - sure)
        assert heights_of(drilled).max() <= -THICK
    away = np.hypot(*(places - SUNK).T)
    slope = (away > 2.25 + sure) & (away < 4.3 - sure)
    assert height[slope] == pytest.approx(away[slope] - 4.3, abs=0.01)
    assert height[away < 2.25 - sure].max() <= -THICK
    floor = heights_of(pocket.buffer(-1.6).buffer(1.5))  # the corners keep the tool's radius
    assert floor == pytest.approx(np.full(len(floor), -2.0), abs=1e-3)
    lettered = heights_of(label)
    assert -0.21 < lettered.min() < -0.19
    holes = [shapely.Point(hole).buffer(1.5 + sure) for hole in HOLES]
    holes += [shapely.Point(SUNK).buffer(4.3 + sure), pocket.buffer(sure), label]
    kept = part.buffer(-sure) - shapely.union_all([*holes, window.buffer(sure)])
    assert heights_of(kept).min() == 0.0
    # All round, and along the window, the tool goes through, but for four tabs each,
    # 6.35 mm wide where they are narrowest.
    for ring, tabs in (
        (part.buffer(3.0) - part.buffer(sure), 4),
        (window.buffer(-1.6).buffer(1.5) - window.buffer(-3.0), 4),
    ):
        deep = heights_of(ring)
        left = deep > -THICK
        assert deep.max() <= -THICK + 2.0 + 1e-6
        area = float(left.sum()) * CELL_MM**2
        assert 0.95 * tabs * 6.35 * 2.9 < area < 1.6 * tabs * 6.35 * 3.0
    beyond = shapely.box(-7.9, -7.9, WIDE + 7.9, HIGH + 7.9) - part.buffer(3.175 + sure)
    assert heights_of(beyond).min() == 0.0


@pytest.mark.parametrize("name", NAMES)
def test_the_recipe_is_the_golden_one(
    camtool: Run, tmp_path: Path, name: str, bless: bool
) -> None:
    """Return the lines of the job, without its comments."""
    first_program(camtool, tmp_path, name)
    lines = (tmp_path / "job.toml").read_text(encoding="utf-8").splitlines()
    said = [line.split("   #")[0].rstrip() for line in lines if not line.startswith("#")]
    recipe = "\n".join(line for line in said if line) + "\n"
    compare_golden(GOLDEN / f"first-job-{name[-3:]}.toml", recipe.encode(), bless=bless)


def blocks_of(program: str) -> list[tuple[str, dict[str, float], dict[str, float]]]:
    """Each line with its words, and where X, Y, Z and F stand behind it."""
    state, found = {"X": 0.0, "Y": 0.0, "Z": 0.0, "F": 0.0, "G": 0.0}, []
    for text in program.splitlines():
        words = dict(re.findall(r"([A-Z])(-?\d+(?:\.\d+)?)", re.sub(r"\(.*?\)", "", text)))
        numbers = {letter: float(value) for letter, value in words.items()}
        motion = [each for each in re.findall(r"G(\d+)", text) if int(each) in (0, 1, 2, 3)]
        state = {**state, **{k: v for k, v in numbers.items() if k in "XYZF"}}
        if motion and not text.startswith("("):
            state["G"] = float(motion[-1])
        found.append((text, numbers, state))
    return found


@pytest.mark.parametrize("name", NAMES)
def test_a_machinist_reads_the_program(camtool: Run, tmp_path: Path, name: str) -> None:
    """Block by block: units and planes first, the spindle on before anything is cut, and off where
    tools are changed, rapids above the stock, feeds within what the axes can do, nothing deeper
    than the board below allows, and at each stop what to mount and where to touch off."""
    program, _ = first_program(camtool, tmp_path, name)
    blocks = blocks_of(program)
    code = [text for text, _, _ in blocks if not text.startswith("(")]
    assert code[0].split() == ["G17", "G21", "G90", "G94"]
    assert code[-1] == "M2"
    job = (tmp_path / "job.toml").read_text(encoding="utf-8")
    board = float(re.findall(r'^spoilboard = "([\d.]+)mm"', job, re.M)[0])
    spins, before, stops = False, blocks[0][2], 0
    for row, (text, words, state) in enumerate(blocks):
        if text.startswith("("):
            continue
        if re.search(r"\bM3\b", text):
            spins = True
            assert 3000.0 <= words["S"] <= 10000.0
        if re.search(r"\bM5\b", text):
            spins = False
        moves = {axis for axis in "XYZ" if state[axis] != before[axis]}
        if "M0" in text.split():
            stops += 1
            assert not spins
            assert state["Z"] >= 10.0
            told = "\n".join(each[0] for each in blocks[row - 5 : row])
            assert re.search(r"\(stop: mount tool \d+ [\w-]+", told)
            assert re.search(r"\(zero Z on top of the stock at X\S+ Y\S+ - not cut yet\)", told)
        if not moves:
            before = state
            continue
        assert -2.0 <= state["X"] <= WIDE + 2.0
        assert -2.0 <= state["Y"] <= HIGH + 2.0
        assert -THICK - board - 1e-9 <= state["Z"] <= 40.0
        if state["G"] == 0.0:
            assert ("X" not in moves and "Y" not in moves) or min(state["Z"], before["Z"]) >= 0.5
        else:
            assert spins
            assert 0.0 < state["F"] <= 1000.0
            if state["G"] == 1.0 and moves == {"Z"} and state["Z"] < before["Z"]:
                assert state["F"] <= 600.0
        before = state
    tools = re.findall(r"^\(tool (\d+) ", program, re.M)
    assert stops == sum(one != other for one, other in pairwise(tools)) == 2
    assert not spins


@pytest.mark.parametrize("name", NAMES)
def test_grbl_takes_every_block_in_its_check_mode(camtool: Run, tmp_path: Path, name: str) -> None:
    program, _ = first_program(camtool, tmp_path, name)
    twin, _ = made("grbl")
    assert b"Enabled" in twin.receive(b"$C\n", 0.0)
    for line in program.splitlines():
        reply = twin.receive(line.encode() + b"\n", 0.0)
        assert b"error" not in reply, line
    if source() is not None:  # the firmware itself
        data = f"$C\n{program}".encode()
        ran = run(built(tmp_path / "firmware"), data, {"$30": 1000.0}, tmp_path)
        assert not any(ran.errors)


@pytest.mark.skipif(RS274 is None, reason="LinuxCNC's rs274 is not installed")
@pytest.mark.parametrize("name", NAMES)
def test_linuxcnc_takes_the_same_job(camtool: Run, tmp_path: Path, name: str) -> None:
    first_program(camtool, tmp_path, name)
    travel = [f"axes.{axis}.travel_mm=300" for axis in "xyz"]
    flags = [word for each in travel for word in ("--set", each)]
    done = camtool("post", name, "--job", "job.toml", "-t", "linuxcnc", "-o", "a.ngc", *flags)
    assert done.returncode == 0, done.stderr.decode()
    table = "".join(f"T{number} P{number} D1\n" for number in range(1, 20))
    (tmp_path / "tool.tbl").write_text(table, encoding="ascii")
    ran = run_rs274("-t", str(tmp_path / "tool.tbl"), "-g", str(tmp_path / "a.ngc"))
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout.count("STRAIGHT_FEED") + ran.stdout.count("ARC_FEED") > 100
