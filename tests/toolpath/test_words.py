"""Blocks of words written by columns, against one format for each number."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from camtool.toolpath.words import ROWS_AT_ONCE, WordColumn, texts_of

NUMBERS = st.integers(-(10**15), 10**15) | st.integers(-1200, 1200)


def plain_number(word: WordColumn, units: int) -> str:
    """The number of one word, by Python's own formatting."""
    digits = f"{abs(units):0{word.decimals + word.digits}d}"
    whole, part = digits[: len(digits) - word.decimals], digits[len(digits) - word.decimals :]
    kept = word.decimals if word.kept is None else word.kept
    while len(part) > kept and part.endswith("0"):
        part = part[:-1]
    sign = "-" if units < 0 else "+" if word.plus else ""
    return f"{sign}{whole}{'.' if part else ''}{part}"


@st.composite
def columns(draw: st.DrawFn) -> list[WordColumn]:
    count = draw(st.integers(0, 12))
    found = []
    for letter in draw(st.lists(st.sampled_from(["G", "X", "Y", "", "IJ"]), min_size=1)):
        decimals = draw(st.integers(0, 6))
        units = draw(st.lists(NUMBERS, min_size=count, max_size=count))
        written = draw(st.lists(st.booleans(), min_size=count, max_size=count))
        found.append(
            WordColumn(
                letter,
                np.array(units, dtype=np.int64),
                np.array(written, dtype=np.bool_),
                decimals,
                draw(st.none() | st.integers(0, decimals)),
                draw(st.integers(1, 5)),
                draw(st.booleans()),
            )
        )
    return found


@given(columns(), st.booleans(), st.sampled_from(["\n", ";\n"]))
def test_lines_are_their_words(words: list[WordColumn], blanks: bool, end: str) -> None:
    lines = []
    for row in range(len(words[0].units)):
        texts = [
            word.letter + plain_number(word, int(word.units[row]))
            for word in words
            if word.written[row]
        ]
        lines.append((" " if blanks else "").join(texts) + (end if texts else ""))
    texts = texts_of(words, blanks=blanks, end=end)
    assert texts.data.decode() == "".join(lines)
    assert texts.lengths.tolist() == [len(line) for line in lines]


def test_more_lines_than_are_written_at_once() -> None:
    count = 2 * ROWS_AT_ONCE + 5
    units, written = np.arange(count), np.arange(count) % 7 != 0
    texts = texts_of([WordColumn("X", units, written, 2)])
    wanted = "".join(f"X{k / 100:.2f}\n" for k in range(count) if k % 7)
    assert texts.data.decode() == wanted
    assert texts.ends[-1] == len(wanted)
    assert (texts.lengths[::7] == 0).all()


def test_further_lines_stand_before_theirs() -> None:
    texts = texts_of([WordColumn("X", np.arange(3), np.array([True, False, True]))])
    between = [(0, "a"), (0, "b"), (1, "c"), (2, "d"), (3, "e")]
    assert texts.with_lines(between) == b"a\nb\nX0\nc\nd\nX2\ne\n"
    assert texts.with_lines([]) == texts.data
