"""Blocks of words from bytes: what is taken, what is refused, and where the fault is."""

import re

import pytest
from camtool_postprocessors.gcode.blocks import Lexing, blocks_of
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import ProgramError
from tests.waiting import no_chewing

FREE = Lexing(
    letters="GMXYZIJF",
    lower_case=True,
    blanks="anywhere",
    parentheses=True,
    semicolon=True,
    block_numbers=True,
)
STRICT = Lexing(letters="GMXYZIJF", blanks="between")
TIGHT = Lexing(letters="GMXYZIJF", blanks="none")


def words(data: bytes, lexing: Lexing = FREE) -> list[list[tuple[str, str]]]:
    return [block.words for block in blocks_of(data, lexing)]


@pytest.mark.parametrize(
    ("data", "found"),
    [
        (b"G1 X1.5Y-.5", [[("G", "1"), ("X", "1.5"), ("Y", "-.5")]]),
        (b"g1x+2.", [[("G", "1"), ("X", "+2.")]]),
        (b"N10 G0\nn20G1", [[("G", "0")], [("G", "1")]]),
        (b"G 1 X - 1 . 5\t2", [[("G", "1"), ("X", "-1.52")]]),
        (b"(only a comment)\n; another\n\n G1 (in) X2 ; end\n", [[("G", "1"), ("X", "2")]]),
        (b"G0\r\nG1\rG2\n\rG3", [[("G", "0")], [("G", "1")], [("G", "2")], [("G", "3")]]),
        (b"N5\n", []),
        (b"", []),
    ],
)
def test_words(data: bytes, found: list[list[tuple[str, str]]]) -> None:
    assert words(data) == found


def test_blocks_and_lines_are_counted_apart() -> None:
    blocks = list(blocks_of(b"(a)\nG0 X1\n\nG1 (b) Y2 ; c\n", FREE))
    assert [(block.index, block.line) for block in blocks] == [(0, 2), (1, 4)]
    assert blocks[1].comments == ("b", " c")
    assert [blocks[1].column(word) for word in range(2)] == [1, 8]


def test_comment_lines_are_given_when_asked_for() -> None:
    lexing = Lexing(letters="G", parentheses=True, comment_lines=True)
    blocks = list(blocks_of(b"(MSG, hi)\nG0\n", lexing))
    assert [(block.index, block.words, block.comments) for block in blocks] == [
        (-1, [], ("MSG, hi",)),
        (0, [("G", "0")], ()),
    ]


def test_columns_count_the_block_number() -> None:
    (block,) = blocks_of(b"N10 G1 X2", FREE)
    assert block.column(1) == 8
    with pytest.raises(ProgramError, match=r"^block 1, line 1, column 8: no$"):
        block.fail("no", word=1)


@pytest.mark.parametrize(
    ("data", "lexing", "place", "message"),
    [
        (b"G1 X1,5", FREE, "block 1, line 1, column 6", "a decimal comma"),
        (b"G1\nG1 X Y2", FREE, "block 2, line 2, column 6", "no number after X"),
        (b"G1 X-", FREE, "block 1, line 1, column 4", "no number after X"),
        (b"G1 Q3", FREE, "block 1, line 1, column 4", "the letter Q is no word here"),
        (b"G1 X1.5.5", FREE, "block 1, line 1, column 8", "a number without its letter"),
        (b"G1 X1 N5", FREE, "block 1, line 1, column 7", "the letter N"),
        (b"N-5 G1", FREE, "block 1, line 1, column 1", "a block number is digits only"),
        (b"#1=5", FREE, "block 1, line 1, column 1", "a parameter"),
        (b"G1 X[1+2]", FREE, "block 1, line 1, column 5", "no number after X"),
        (b"/G1", FREE, "block 1, line 1, column 1", "a block that a switch may leave out"),
        (b"$H", FREE, "block 1, line 1, column 1", "a command of the controller itself"),
        (b"G1 X1e3", FREE, "block 1, line 1, column 6", "the letter E is no word"),
        (b"G1 (a (b) c)", FREE, "block 1, line 1, column 4", "a comment that is nested"),
        (b"G1 (a", FREE, "block 1, line 1, column 4", "not closed"),
        (b"G1 a)", FREE, "block 1, line 1, column 5", "not closed"),
        (b"G0\r\nG1 \xc3\xa4", FREE, "line 2, column 4", "the byte 0xc3"),
        (b"G0 X1\x00", FREE, "line 1, column 6", "the byte 0x00"),
        (b"g1", STRICT, "block 1, line 1, column 1", "no small letters"),
        (b"G1 X 1", STRICT, "block 1, line 1, column 5", "no number after X"),
        (b"G1 (a)", STRICT, "block 1, line 1, column 4", "this dialect has no comments"),
        (b"G1 ; a", STRICT, "block 1, line 1, column 4", "this dialect has no comments"),
        (b"N1 G1", STRICT, "block 1, line 1, column 1", "the letter N"),
        (b"%", STRICT, "block 1, line 1, column 1", "a %, which is no word"),
        (b"G1%", FREE, "block 1, line 1, column 3", "a %, which is no word"),
        (b"G1 X1", TIGHT, "block 1, line 1, column 3", "a blank within the block"),
        (b"1", TIGHT, "block 1, line 1, column 1", "a number without its letter, '1'"),
    ],
)
def test_faults_name_their_place(data: bytes, lexing: Lexing, place: str, message: str) -> None:
    with pytest.raises(ProgramError, match=message) as caught:
        words(data, lexing)
    assert caught.value.where == place


def test_a_line_may_be_as_long_as_the_limit() -> None:
    limit = Lexing(letters="X", line_chars=6, parentheses=True, blanks="anywhere")
    assert words(b"X12345", limit) == [[("X", "12345")]]
    with pytest.raises(ProgramError, match="more than 6 characters"):
        words(b"X12 345", limit)
    dropping = Lexing(
        letters="X", line_chars=6, parentheses=True, blanks="anywhere", counts_blanks=False
    )
    assert words(b"X12 345 (note)", dropping) == [[("X", "12345")]]
    with pytest.raises(ProgramError, match="more than 6 characters"):
        words(b"X123456", dropping)


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
    for lexing in (FREE, STRICT, TIGHT):
        with no_chewing(), pytest.raises(ProgramError) as caught:
            words(line, lexing)
        assert len(str(caught.value)) < 200


def place_of_fault(data: bytes, lexing: Lexing) -> str | None:
    """Where the first fault is, None when there is none."""
    try:
        words(data, lexing)
    except ProgramError as error:
        return str(error.where)
    return None


@given(st.binary(max_size=200), st.sampled_from([FREE, STRICT, TIGHT]))
def test_noise_is_read_or_refused(data: bytes, lexing: Lexing) -> None:
    place = place_of_fault(data, lexing)
    assert place is None or re.search(r"line \d+, column \d+$", place)


@given(
    st.text("GXYZN(); .-+,0123456789\n\r\t%", max_size=60), st.sampled_from([FREE, STRICT, TIGHT])
)
def test_almost_programs_are_read_or_refused_in_their_line(text: str, lexing: Lexing) -> None:
    place = place_of_fault(text.encode(), lexing)
    if place is not None:
        line, column = map(int, re.findall(r"\d+", place)[-2:])
        assert 1 <= column <= len(text.splitlines()[line - 1]) + 1
