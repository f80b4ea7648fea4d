"""Plain blocks read by columns, against the same program read block by block."""

import numpy as np
import pytest
from camtool_postprocessors.gcode import blocks
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import ProgramError
from camtool.target.registry import load_target
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import COLUMNS, Toolpath

TARGETS = ["grbl", "linuxcnc", "flashcut", "valcnc"]

NUMBERS = st.one_of(
    st.integers(-9, 9).map(str),
    st.floats(-50.0, 50.0).map(lambda number: f"{number:.3f}"),
    st.sampled_from(["-0.0", "+1.", ".5", "007", "1.2345678901234567890", "1e3", "", "-", "1 2"]),
)
WORDS = st.one_of(
    st.tuples(st.sampled_from("XXYYZIJ"), NUMBERS).map("".join),
    st.sampled_from(["G0", "G1", "G01", "G1", "G2", "G03", "G00", "F100", "F0", "F7", "F20000"]),
)
RARE = st.sampled_from(
    [
        *(
            "",
            " ",
            "\t",
            "(contour 3)",
            "; aside",
            "(MSG, wait)",
            "N10",
            "(open",
            "x1 y2",
            "N5 G1 X1",
        ),
        *("G20", "G21", "G90", "G91", "G90.1", "G91.1", "M3 S1000", "M5", "G4 P1", "T1 M6", "G54"),
        *("G64 P0.1", "G61", "G53 G0 Z0", "G2 X1 Y1 R5", "G80", "M2", "M30", "%", "G0 X1 (c)"),
        *("G2 I1", "G1", "G3 X0 Y0 I1 J0", "G01 X1.0 Y1.0 F3.0", "G00 X1 Y1 Z0", "X9" * 70),
    ]
)
LINES = st.one_of(
    st.lists(WORDS, min_size=1, max_size=4).map(" ".join),
    st.lists(WORDS, min_size=1, max_size=4).map("".join),
    RARE,
)


def outcome(name: str, data: bytes) -> object:
    """All that a reader says of a program."""
    target = load_target(name)
    try:
        path = target.target.read(data, target.machine)
    except ProgramError as error:
        return str(error), error.where, error.mend
    return table(path)


def table(path: Toolpath) -> object:
    """All that a toolpath has, to be compared."""
    columns = [getattr(path, name).tobytes() for name in COLUMNS]
    found = [(each.code, each.where, each.message, each.measured) for each in path.findings]
    return columns, path.modes, path.texts, found


def alone(name: str, data: bytes) -> object:
    """The same, with no block taken by columns."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(blocks, "MIN_RUN", 1 << 60)
        return outcome(name, data)


def by_columns(name: str, data: bytes, rows: int = 3) -> object:
    """The same, with every block offered by columns, few at a time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(blocks, "MIN_RUN", 1)
        patch.setattr(blocks, "ROWS_AT_ONCE", rows)
        return outcome(name, data)


@given(
    st.sampled_from(TARGETS),
    st.lists(LINES, max_size=12),
    st.sampled_from(["\n", "\r\n", "\r"]),
    st.integers(1, 20),
)
def test_whatever_is_read_by_columns_is_read_as_by_blocks(
    name: str, lines: list[str], end: str, rows: int
) -> None:
    data = end.join(lines).encode()
    assert by_columns(name, data, rows) == alone(name, data)


@pytest.mark.parametrize("frame", ["", "%\n"])
@pytest.mark.parametrize("name", TARGETS)
def test_programs_of_moves_are_read_by_columns_as_by_blocks(name: str, frame: str) -> None:
    """Lines, arcs and full circles of a plausible program, in mm and in inches, with comments."""
    rng = np.random.default_rng(8)
    lines = ["G00 X1.000 Y0.500 Z0.000"] if name == "valcnc" else ["G00 X1.0 Y0.5"]
    x, y = 1.0, 0.5
    for k in range(400):
        i, j = np.round(rng.uniform(-5, 5, 2), 1)
        full = name in ("grbl", "linuxcnc") and k % 5 == 0
        to = (x, y) if full else (x + 2 * i, y + 2 * j)
        z = " Z0.000" if name == "valcnc" else ""
        feed = f" F{3 + k % 4}.0" if name != "valcnc" and k % 7 == 0 else ""
        if k == 0 and name != "valcnc":
            lines.append(f"G01 X{x + 1:.1f} Y{y:.1f} F3.0")
            x += 1
            to = (to[0] + 1, to[1])
        if k % 3:
            lines.append(f"G01 X{to[0]:.1f} Y{to[1]:.1f}{z}{feed}")
        else:
            lines.append(f"G0{2 + k % 2} X{to[0]:.1f} Y{to[1]:.1f}{z} I{i:.1f} J{j:.1f}")
        x, y = (round(float(number), 1) for number in to)
        if name in ("grbl", "linuxcnc") and k % 50 == 0:
            lines += [f"(contour {k})", "G20" if k % 100 else "G21", "G00 Z0.1", "S100 M3"]
    if name != "valcnc":
        lines.append("M30")
    data = (frame + "\n".join(lines) + "\n" + frame).encode()
    found = alone(name, data)
    assert by_columns(name, data, 1 << 10) == found
    assert outcome(name, data) == found


def test_small_letters_and_block_numbers_are_read_by_columns() -> None:
    lines = [f"n{k} g1 x{k}.5 y{-k}" for k in range(1, 60)]
    data = "\n".join(["F100", *lines, "m2"]).encode()
    assert outcome("grbl", data) == alone("grbl", data)
    assert outcome("linuxcnc", data) == alone("linuxcnc", data)


def test_numbers_are_the_nearest_floats() -> None:
    rng = np.random.default_rng(9)
    texts = [f"{number:.{k % 12}f}" for k, number in enumerate(rng.uniform(-999, 999, 3000))]
    data = "\n".join(["G0 X0", *(f"X{text}" for text in texts), "M2"]).encode()
    target = load_target("linuxcnc")
    path = target.target.read(data, target.machine)
    assert path.end[1:-1, 0].tolist() == [float(text) for text in texts]


@pytest.mark.parametrize("name", ["grbl", "linuxcnc"])
def test_feeds_above_the_limit_are_counted_in_rows_of_moves_and_alone(name: str) -> None:
    target = load_target(name)
    most = target.machine.max_feed_mm_min
    feeds = [most, *(most + 1.0 + (7 * k) % 50 for k in range(60)), 1.0, 2.0 * most]
    rows = [f"G1 X{k} Y1 F{feed:g}" for k, feed in enumerate(feeds)]
    end = ["M2", ""]
    plain = target.target.read("\n".join([*rows, *end]).encode(), target.machine)
    alone = target.target.read(
        "\n".join([row + " (a)" for row in rows] + end).encode(), target.machine
    )
    assert plain.findings == alone.findings
    (found,) = (one for one in plain.findings if one.code == ProgramCode.FEED_ABOVE_LIMIT)
    assert (found.where, found.measured) == ("block 2", 2.0 * most)
    assert "61" in found.message
