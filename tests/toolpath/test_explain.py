"""Programs in words: each kind of move, each mode, and every block of every machine."""

import math
import time
from pathlib import Path

import numpy as np
import pytest

from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.explain import MAX_MOVES, ExplainedBlock, explain
from camtool.toolpath.moves import Kind
from camtool.toolpath.program import Listing

SAMPLES = Path(__file__).parents[2] / "samples"


def told(target: str, text: str) -> list[tuple[int | None, str]]:
    """Return the line and the words of each block of a program."""
    loaded = load_target(target)
    data = text.encode()
    path = loaded.target.read(data, loaded.machine)
    listing = loaded.target.listing(data, loaded.machine)
    blocks = explain(path, listing, loaded.target.meanings)
    return [(each.line, "; ".join(each.words)) for each in blocks]


def test_moves_and_modes_of_grbl() -> None:
    text = """(G20 in a comment)
G21 G90
G0 X1 Y2

g20 g91 (an inch to the right)
X1
G1 Z-0.1 F2
G3 X0.1 Y0.1 I0 J0.1
G2 X0 I1
G2 X0.1 Y0.1 Z-0.1 I0.1 F4
F4 G1 X1
G4 P1.5
M3 S1000
M5
M8
M9
G80
M2
"""
    assert told("grbl", text) == [
        (2, "numbers are millimetres; positions are absolute"),
        (3, "rapid to X 1 Y 2 mm"),
        (5, "numbers are inches; positions are distances from the last one"),
        (6, "rapid to X 26.4 mm"),
        (7, "line down to Z -2.54 mm, feed 50.8 mm/min (0.847 mm/s)"),
        (
            8,
            "arc counter-clockwise to X 28.94 Y 4.54 mm around X 26.4 Y 4.54 mm, radius 2.54 mm, "
            "90°",
        ),
        (9, "full circle clockwise around X 54.34 Y 4.54 mm, radius 25.4 mm"),
        (
            10,
            "arc clockwise to X 31.48 Y 7.08 Z -5.08 mm around X 31.48 Y 4.54 mm, "
            "radius 2.54 mm, 90°, feed 101.6 mm/min (1.69 mm/s)",
        ),
        (11, "line to X 56.88 mm"),
        (12, "wait 1.5 s"),
        (13, "spindle clockwise at 1000 rev/min"),
        (14, "spindle off"),
        (15, "flood on; come to rest"),
        (16, "coolant off; come to rest"),
        (17, "no cycle"),
        (18, "end of the program"),
    ]


def test_modes_of_linuxcnc_and_what_runs_often() -> None:
    text = """O<g20sub> sub
G1 X[#<_x> + 1] F600
G1 Y[#<_y> + 1]
O<g20sub> endsub
G21 G64 P0.05
O100 repeat [3]
O<g20sub> call
O100 endrepeat
G61
G1 X9
G61.1 Y1
G64
G1 X0
G81 Z-1 R2 X5
T2 M6
M2
"""
    words = [each for _, each in told("linuxcnc", text)]
    assert words[0] == "nothing moves", "g20 is a part of a name"
    assert words[1].startswith("line to X 1 mm, feed 600 mm/min (10 mm/s)")
    assert words[1].endswith("the program comes here 3 times; this is the first")
    assert "corners rounded within 0.05 mm" in words[1]
    assert words[8].startswith("corners met exactly")
    assert words[9] == "line to X 9 mm, corners met exactly"
    assert words[10] == "a stop at each corner; line to Y 1 mm, with a stop at each corner"
    assert words[12] == "line to X 0 mm, corners rounded as far as the moves allow"
    assert words[13].startswith("rapid up to Z 2 mm; rapid to X 5 mm, corners met exactly;")
    assert words[14] == "change to tool 2"


def test_a_block_of_the_brief() -> None:
    """As a reader of a pull request sees it: what the words of the dialect stand for."""
    assert told("pic-mmh", "G54;\nG90;\nG00Z00200.00;G00X02969.00Y02000.00;\n") == [
        (1, "this place becomes part zero"),
        (2, "positions are absolute"),
        (3, "rapid up to Z 0.2 mm"),
        (3, "rapid to X 2.969 Y 2 mm"),
    ]


def test_events_without_a_program() -> None:
    builder = ToolpathBuilder()
    builder.block = 0
    builder.event(Kind.HOME_XY)
    builder.event(Kind.SPINDLE_CCW, 500.0)
    path = builder.finish()
    (block,) = explain(path, None, {})
    assert block.words == (
        "return to machine zero in X and Y",
        "spindle counter-clockwise at 500 rev/min",
    )
    assert (block.line, block.text, block.visits) == (None, "", 1)
    assert list(explain(ToolpathBuilder().finish(), None, {})) == []


def test_many_moves_of_one_block_are_counted() -> None:
    builder = ToolpathBuilder()
    builder.block = 0
    for k in range(10):
        builder.line(float(k + 1), 0.0, feed=60.0)
    (block,) = explain(builder.finish(), Listing(("SPLINE",)), {})
    assert len(block.words) == MAX_MOVES + 1
    assert block.words[0] == "line to X 1 mm, feed 60 mm/min (1 mm/s)"
    assert block.words[-1] == f"and {10 - MAX_MOVES} more moves, the last to X 10 Y 0 Z 0 mm"
    assert [move.to_mm[0] for move in block.moves] == [float(k + 1) for k in range(10)]


def explained(target: str, file: Path) -> tuple[list[ExplainedBlock], int]:
    """Return the blocks of a program, and the number of its rows."""
    loaded = load_target(target)
    data = file.read_bytes()
    path = loaded.target.read(data, loaded.machine)
    listing = loaded.target.listing(data, loaded.machine)
    blocks = list(explain(path, listing, loaded.target.meanings))
    moves = [move for block in blocks for move in block.moves]
    assert [move.to_mm for move in moves] == [tuple(end) for end in path.end.tolist()]
    sweeps = [math.radians(move.sweep_deg or 0.0) for move in moves]
    assert np.allclose(sweeps, path.sweeps())
    assert all(each.words and all(each.words) for each in blocks)
    return blocks, len(path)


@pytest.mark.parametrize(
    ("name", "target"),
    [
        ("circle-30-steps.pic", "pic-mmh"),
        ("ball-bar.nc", "linuxcnc"),
        ("mount-elsewhere.nc", "grbl"),
    ],
)
def test_the_moves_are_those_of_the_reader(name: str, target: str) -> None:
    blocks, _ = explained(target, SAMPLES / name)
    text = (SAMPLES / name).read_text().splitlines()
    for each in blocks:
        assert each.line is not None
        assert each.text in text[each.line - 1]


def test_a_long_program_takes_seconds(tmp_path: Path) -> None:
    lines = [f"G1 X{k % 97} Y{k % 89} F{100 + k % 3}" for k in range(100_000)]
    (tmp_path / "long.nc").write_text("G21 G90\n" + "\n".join(lines) + "\nM2\n")
    begin = time.process_time()
    blocks, _ = explained("grbl", tmp_path / "long.nc")
    assert len(blocks) == 100_002
    assert time.process_time() - begin < 30.0
