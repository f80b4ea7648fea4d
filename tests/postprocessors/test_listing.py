"""The listing of a program: its blocks, numbered as the reader numbers them."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from camtool_postprocessors.gcode.blocks import listing as lines_of

from camtool.target.registry import LoadedTarget, load_target, own_names
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.program import Listing
from tests.postprocessors.i8751.machines import STEP_MM, loaded
from tests.postprocessors.matlab_router.parts import router, strokes

FORWARD, STANDS = 3, 5
"""Bytes of a motor's sense on the i8751."""

Place = Callable[[str, np.ndarray], np.ndarray]
"""Where a block leads to from a place, by its text."""

GOLDEN = Path(__file__).parents[1] / "golden"

TEXTS = {
    "grbl.nc": ("grbl", ()),
    "grbl-options.nc": ("grbl", ()),
    "linuxcnc.ngc": ("linuxcnc", ()),
    "linuxcnc-options.ngc": ("linuxcnc", ("dialect.percent=true",)),
    "flashcut-part.nc": ("flashcut", ()),
    "valcnc-part.ngc": ("valcnc", ()),
    "pic-mmh-example.pic": ("pic-mmh", ()),
    "pic-mmh-annex.pic": ("pic-mmh", ("dialect.form=annex",)),
}


def listed(data: bytes, target: LoadedTarget) -> tuple[Toolpath, Listing]:
    return target.target.read(data, target.machine), target.target.listing(data, target.machine)


@pytest.mark.parametrize("name", list(TEXTS))
def test_each_move_stands_in_its_own_block(name: str) -> None:
    target, settings = TEXTS[name]
    data = (GOLDEN / name).read_bytes()
    toolpath, listing = listed(data, load_target(target, settings=settings))
    assert len(listing.blocks) == int(toolpath.block.max()) + 1
    assert not listing.binary
    words = ("X", "Y", "Z", "G0", "G1", "G2", "G3", "I", "J")
    for row in np.flatnonzero(toolpath.is_motion):
        assert any(word in listing.blocks[toolpath.block[row]].upper() for word in words)
    # Nothing but comments, blank lines and signs of ending lies between the blocks.
    text = data.decode("latin-1")
    at = 0
    for block in listing.blocks:
        at = text.index(block, at) + len(block)


def small(top_mm: float, bottom_mm: float, feed: float) -> Toolpath:
    """Two contours of lines, with a plunge and a retract each."""
    path = ToolpathBuilder((0.0, 0.0, 0.0)).rapid(z=top_mm)
    for x, y in ((1.0, 1.0), (3.0, 2.0)):
        path.rapid(x, y).line(z=bottom_mm, feed=feed)
        for dx, dy in ((2.0, 0.0), (2.0, 1.0), (0.0, 2.0), (0.0, 0.0)):
            path.line(x + dx, y + dy, feed=feed)
        path.rapid(z=top_mm)
    return path.rapid(0.0, 0.0).event(Kind.END).finish()


def said_words(unit_mm: float) -> Place:
    """The place that X, Y and Z words of this unit say."""

    def place(block: str, at: np.ndarray) -> np.ndarray:
        said = {axis: float(number) for axis, number in re.findall(r"([XYZ])(-?[\d.]+)", block)}
        was = dict(zip("XYZ", at / unit_mm, strict=True))
        return np.array([said.get(axis, was[axis]) for axis in "XYZ"]) * unit_mm

    return place


def said_columns(block: str, at: np.ndarray) -> np.ndarray:
    """The place that a column of xy says, 0.1 mm from home; the tool goes down at the first."""
    found = re.search(r"xy\(:,(\d+)\) = \[(\d+); (\d+)\]", block)
    assert found is not None
    return np.array([int(found[2]) / 10.0, int(found[3]) / 10.0, -1.0])


def said_records(block: str, at: np.ndarray) -> np.ndarray:
    """The place that the bytes of a record lead to: each motor with its sense, and steps in two
    bytes where it does not stand; a dwell behind Y and behind Z."""
    data, place = bytes.fromhex(block.removeprefix("13")), at.copy()
    for motor in (1, 2, 3):
        assert data[0] == motor
        if data[1] == STANDS:
            data = data[2:]
        else:
            steps = 256 * data[2] + data[3]
            place[motor - 1] += (steps if data[1] == FORWARD else -steps) * STEP_MM
            data = data[4:]
        data = data[2:] if motor > 1 else data
    assert data in (b"", b"\x45")
    return place


ALL: dict[str, tuple[Place, tuple[float, float, float]]] = {
    "grbl": (said_words(1.0), (5.0, -0.1, 8.0)),
    "linuxcnc": (said_words(1.0), (5.0, -0.1, 8.0)),
    "iso": (said_words(1.0), (5.0, -0.1, 8.0)),
    "flashcut": (said_words(1.0), (0.2, -0.1, 8.0)),
    "pic-mmh": (said_words(0.001), (0.2, -0.1, 1.0)),
    # Its controller counts an eighth of what it is told.
    "valcnc": (said_words(8.0), (5.0, -0.1, 8.0)),
    "matlab-router": (said_columns, (9.0, -1.0, 225.0)),
    "i8751": (said_records, (1.0, -0.1, 8.0)),
}
"""How each target says a place, and heights above and in the stock with a feed that it can do."""


def test_all_targets_are_here() -> None:
    assert set(ALL) == set(own_names())


@pytest.mark.parametrize("name", list(ALL))
def test_the_text_of_each_block_says_where_its_moves_end(name: str) -> None:
    place, heights = ALL[name]
    target = loaded() if name == "i8751" else load_target(name)
    data = target.target.write(small(*heights), target.machine).data
    toolpath, listing = listed(data, target)
    at, seen = np.zeros(3), 0
    for block, text in enumerate(listing.blocks):
        rows = np.flatnonzero((toolpath.block == block) & toolpath.is_motion)
        if not len(rows):
            continue
        at = place(text, at)
        assert toolpath.end[rows[-1]] == pytest.approx(at, abs=1e-6), text
        seen += 1
    assert seen >= 9


def test_a_column_is_what_stands_in_the_arrays() -> None:
    target = load_target("matlab-router")
    data = (GOLDEN / "matlab-router-part.m").read_bytes()
    columns = {
        name: np.array([row.split() for row in rows.strip().split("\n")], dtype=int)
        for name, rows in re.findall(r"(\w+) = \[([^\]]*)\]", data.decode().split("%% job 2")[0])
    }
    _, listing = listed(data, target)
    blocks = [block.removeprefix("job 1: ") for block in listing.blocks]
    for number, block in enumerate(blocks[1 : columns["lxy"].shape[1] + 1], 1):
        for name, column, x, y in re.findall(r"(\w+)\(:,(\d+)\) = \[(-?\d+); (-?\d+)\]", block):
            assert [int(x), int(y)] == columns[name][:, int(column) - 1].tolist()
            assert int(column) == number + (name == "xy")


@pytest.mark.parametrize("settings", [("format=stream",), ("format=stream", "profile=listing")])
def test_a_stream_is_listed_as_it_is_sent(settings: tuple[str, ...]) -> None:
    target = router(*settings)
    data = target.target.write(
        strokes([(5.0, 20.0), (9.0, 20.0), (9.0, 24.0)]), target.machine
    ).data
    toolpath, listing = listed(data, target)
    assert len(listing.blocks) == int(toolpath.block.max()) + 1 == 3
    words = [word.decode("latin-1") for word in data.split(b"\r")[:-1]]
    assert listing.blocks[0].split()[1::2] == [
        w.encode("unicode_escape").decode() for w in words[:3]
    ]
    lx, ly, vx, vy = np.array(words[3:]).reshape(4, 2).tolist()
    for index in range(2):
        numbers = listing.blocks[index + 1].split()
        assert [*numbers[2:4], *numbers[6:8]] == [lx[index], ly[index], vx[index], vy[index]]


FREE_TEXT = b"\n\n(a G1 X1)\r\nG1 X1 F9 ; Y2\r N10\nN1.5\nn20 g0Z3\n ;X\n(x)(y) M30\n"
FREE_BLOCKS = ("G1 X1 F9 ; Y2", "n20 g0Z3", "(x)(y) M30")


def test_lines_without_a_word_are_no_blocks() -> None:
    assert lines_of(FREE_TEXT, None).blocks == FREE_BLOCKS
    assert lines_of(b"%\n" + FREE_TEXT + b"%\n", None).blocks == FREE_BLOCKS


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("grbl", FREE_TEXT),
        ("linuxcnc", FREE_TEXT),
        ("linuxcnc", b"%\n" + FREE_TEXT + b"%\n"),
        ("flashcut", b"\n \t\nG01 X1.0 Y0.0 F3.0\r\rG00 Z3.0\r\n  \nM30\n\n"),
        ("valcnc", b"\n \nG01 X.125Y0Z0\r\r G00 X . 125 Y0 Z.375\r\n  \nG01 X1 Y0 Z.375\n\n"),
    ],
)
def test_readers_count_the_blocks_that_are_listed(name: str, text: bytes) -> None:
    toolpath, listing = listed(text, load_target(name))
    assert len(listing.blocks) == 3
    assert toolpath.block.tolist() == [0, 1, 2]
    assert toolpath.end[:2].ravel() == pytest.approx([1.0, 0.0, 0.0, 1.0, 0.0, 3.0])


def test_packets_are_listed_in_hex_by_record() -> None:
    target = loaded()
    data = (GOLDEN / "i8751-part.bin").read_bytes()
    toolpath, listing = listed(data, target)
    assert listing.binary
    assert bytes.fromhex(" ".join(listing.blocks)) == data
    assert len(listing.blocks) == int(toolpath.block.max()) + 1
