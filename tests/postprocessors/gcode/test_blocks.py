"""Blocks of words from bytes: what is taken, what is refused, and where the fault is."""

import re

import numpy as np
import pytest
from camtool_postprocessors.gcode.blocks import ROWS_AT_ONCE, Lexing, PlainBlocks, blocks_of
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import ProgramError
from camtool.kernels.words import X_WORD
from tests.waiting import no_chewing

pytestmark = pytest.mark.checked

PARTED = Lexing(letters="GMXYZIJF")
LOOSE = Lexing(letters="GMXYZIJF", blanks="anywhere")
BOTH = [PARTED, LOOSE]

Words = list[list[tuple[str, str]]]


def words(data: bytes, lexing: Lexing) -> Words:
    return [block.words for block in blocks_of(data, lexing)]


@pytest.mark.parametrize("lexing", BOTH)
@pytest.mark.parametrize(
    ("data", "found"),
    [
        (b"G1 X1.5Y-.5", [[("G", "1"), ("X", "1.5"), ("Y", "-.5")]]),
        (b" G1\tX+2. ", [[("G", "1"), ("X", "+2.")]]),
        (b"G0\r\nG1\rG2\n\rG3", [[("G", "0")], [("G", "1")], [("G", "2")], [("G", "3")]]),
        (b"\n \t\r\n\rG0\n\n", [[("G", "0")]]),
        (b"\n \n", []),
        (b"", []),
    ],
)
def test_words(data: bytes, lexing: Lexing, found: Words) -> None:
    assert words(data, lexing) == found


def test_blanks_may_stand_within_numbers_where_they_may_stand_anywhere() -> None:
    assert words(b"G 1 X - 1 . 5\t2", LOOSE) == [[("G", "1"), ("X", "-1.52")]]


@pytest.mark.parametrize("lexing", BOTH)
def test_blocks_and_lines_are_counted_apart(lexing: Lexing) -> None:
    blocks = list(blocks_of(b"\nG0 X1\r\r\n  G1  Y2\r\n", lexing))
    assert [(block.index, block.line) for block in blocks] == [(0, 2), (1, 4)]
    assert [block.text for block in blocks] == ["G0 X1", "  G1  Y2"]
    assert [blocks[1].column(word) for word in range(2)] == [3, 7]


def test_columns_are_those_of_the_line_with_its_blanks() -> None:
    (block,) = blocks_of(b"G 1 \tX 2 Y3", LOOSE)
    assert [block.column(word) for word in range(3)] == [1, 6, 10]
    with pytest.raises(ProgramError, match=r"^block 1, line 1, column 6: no$"):
        block.fail("no", word=1)
    with pytest.raises(ProgramError, match=r"^block 1, line 1, column 1: no; do$"):
        block.fail("no", mend="do")


@pytest.mark.parametrize(
    ("data", "lexing", "place", "message"),
    [
        (b"G1 X1,5", LOOSE, "block 1, line 1, column 6", "a decimal comma"),
        (b"G1\nG1 X Y2", LOOSE, "block 2, line 2, column 6", "no number after X"),
        (b"G1 X-", LOOSE, "block 1, line 1, column 4", "no number after X"),
        (b"G1 Q3", LOOSE, "block 1, line 1, column 4", "the letter Q is no word here"),
        (b"G1 X1.5.5", LOOSE, "block 1, line 1, column 8", "a number without its letter"),
        (b"#1=5", LOOSE, "block 1, line 1, column 1", "a parameter"),
        (b"G1=5", LOOSE, "block 1, line 1, column 3", "an assignment"),
        (b"G1 X[1+2]", LOOSE, "block 1, line 1, column 5", "no number after X"),
        (b"G1 [1+2]", LOOSE, "block 1, line 1, column 4", "an expression"),
        (b"/G1", LOOSE, "block 1, line 1, column 1", "a block that a switch may leave out"),
        (b"$H", LOOSE, "block 1, line 1, column 1", "a command of the controller itself"),
        (b"G1 X1E3", LOOSE, "block 1, line 1, column 6", "the letter E is no word"),
        (b"G1 X1 (a)", LOOSE, "block 1, line 1, column 7", "this dialect has no comments"),
        (b"G0\r\nG1 \xc3\xa4", LOOSE, "line 2, column 4", "the byte 0xc3"),
        (b"G0 X1\x00", LOOSE, "line 1, column 6", "the byte 0x00"),
        (b"g1", PARTED, "block 1, line 1, column 1", "no small letters"),
        (b"G1 X 1", PARTED, "block 1, line 1, column 5", "no number after X"),
        (b"G1 1", PARTED, "block 1, line 1, column 4", "a number without its letter, '1'"),
        (b"G1 (a)", PARTED, "block 1, line 1, column 4", "this dialect has no comments"),
        (b"G1\n\n;", PARTED, "block 2, line 3, column 1", "this dialect has no comments"),
        (b"G1 )", PARTED, "block 1, line 1, column 4", "this dialect has no comments"),
        (b"N1 G1", PARTED, "block 1, line 1, column 1", "the letter N"),
        (b"%", PARTED, "block 1, line 1, column 1", "a %, which is no word"),
        (b"G1%", PARTED, "block 1, line 1, column 3", "a %, which is no word"),
        (b'G1 "', PARTED, "block 1, line 1, column 4", "begins no word"),
    ],
)
def test_faults_name_their_place(data: bytes, lexing: Lexing, place: str, message: str) -> None:
    with pytest.raises(ProgramError, match=message) as caught:
        words(data, lexing)
    assert caught.value.where == place


@given(st.lists(st.integers(1, 200), min_size=1, max_size=5))
def test_lines_are_taken_or_given_once_and_not_offered_many_times(runs: list[int]) -> None:
    """Of runs of so many blocks, in turn, `take` leaves the first each."""
    firsts = np.cumsum(runs * (3000 // sum(runs) + 1))
    count = int(firsts[-1])
    lines = [f"G1 X{k}" + "\n" * (1 + k % 2) for k in range(count)]
    seen: list[int] = []
    offered: list[int] = []

    def take(plain: PlainBlocks) -> int:
        left = set(firsts.tolist())
        taken = next((k for k in range(len(plain)) if plain.first + k in left), len(plain))
        assert plain.numbers[:taken, X_WORD].tolist() == [
            float(plain.first + k) for k in range(taken)
        ]
        seen.extend(range(plain.first, plain.first + taken))
        offered.append(len(plain))
        return taken

    for block in blocks_of("".join(lines).encode(), PARTED, take):
        assert block.words[1] == ("X", str(block.index))
        seen.append(block.index)
    assert seen == list(range(count))
    assert sum(offered) <= 8 * count + ROWS_AT_ONCE


@pytest.mark.parametrize("lexing", BOTH)
def test_a_line_may_be_as_long_as_the_limit_with_its_blanks(lexing: Lexing) -> None:
    limit = Lexing(lexing.letters, lexing.blanks, line_chars=6)
    assert words(b"X12345\r\nX12 \t ", limit) == [[("X", "12345")], [("X", "12")]]
    with pytest.raises(ProgramError, match="more than 6 characters") as caught:
        words(b"X1\nX12345 ", limit)
    assert caught.value.where == "block 2, line 2, column 7"
    with pytest.raises(ProgramError, match="no comments"):
        words(b"(what is cut)", limit)


@pytest.mark.parametrize(
    "line",
    [
        b"X" + b"1" * 10_000_000,
        b"X1" * 5_000_000 + b",",
        b" " * 10_000_000 + b"X",
        b"(" * 10_000_000,
        b"N" * 10_000_000,
        b"X1.1" * 2_500_000,
        b"G1 (" + b"a" * 10_000_000,
    ],
)
def test_ten_megabytes_on_a_line_are_refused_and_not_chewed(line: bytes) -> None:
    for lexing in BOTH:
        with no_chewing(), pytest.raises(ProgramError) as caught:
            words(line, lexing)
        assert len(str(caught.value)) < 200
        part = line[:1_000_000] + b","
        endless = Lexing(lexing.letters, lexing.blanks, line_chars=len(part))
        with no_chewing(), pytest.raises(ProgramError) as caught:
            words(part, endless)
        assert len(str(caught.value)) < 200


def place_of_fault(data: bytes, lexing: Lexing) -> str | None:
    """Return the place of the first fault, or None."""
    try:
        words(data, lexing)
    except ProgramError as error:
        return str(error.where)
    return None


@given(st.binary(max_size=200), st.sampled_from(BOTH))
def test_noise_is_read_or_refused(data: bytes, lexing: Lexing) -> None:
    place = place_of_fault(data, lexing)
    assert place is None or re.search(r"line \d+, column \d+$", place)


@given(st.text("GXYZN(); .-+,0123456789\n\r\t%", max_size=60), st.sampled_from(BOTH))
def test_almost_programs_are_read_or_refused_in_their_line(text: str, lexing: Lexing) -> None:
    place = place_of_fault(text.encode(), lexing)
    if place is not None:
        line, column = map(int, re.findall(r"\d+", place)[-2:])
        assert 1 <= column <= len(text.splitlines()[line - 1]) + 1
