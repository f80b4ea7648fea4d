"""Tool tables of LinuxCNC, read strictly."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import OptionError
from camtool.jobs.tool_table import WORDS, TableTool, read_tool_table

TABLE = """\
; tools of the mill
T1 P1 Z0.511 D0.125 ;1/8 end mill

t2 p17 d3.175
  P3   T30  X-.5 Q2 ;words in any order
"""


def test_words_remarks_and_lines_without_any() -> None:
    tools = read_tool_table(TABLE, "tool.tbl")
    assert tools == {
        1: TableTool(1, 0.125, "1/8 end mill", 2),
        2: TableTool(2, 3.175, "", 4),
        30: TableTool(30, None, "words in any order", 5),
    }
    assert read_tool_table("", "empty.tbl") == {}


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("T1P1", "'T1P1'"),
        ("T1 P1 E5", "'E5'"),
        ("T1 P1 Dthin", "'Dthin'"),
        ("T1 P1 D1e3", "'D1e3'"),
        ("T1 P1 Dnan", "'Dnan'"),
        ("T1 D1", "word P is missing"),
        ("P1 D1", "word T is missing"),
        ("T1.5 P1", "T1.5 is no whole number"),
        ("T-1 P1", "T-1 is no whole number"),
        ("T1 P1 D" + "9" * 400, "is no diameter"),
        ("T1 P1 D-2", "D-2 is no diameter"),
        ("T1 P1 D1 d2", "D comes twice"),
        ("T7 P1", "stands in line 1 already"),
        ("1 1 0.5 0.25", "'1'"),
    ],
)
def test_what_is_no_tool_is_named_by_line(line: str, words: str) -> None:
    with pytest.raises(OptionError) as caught:
        read_tool_table(f"T7 P7 D1\n{line} ;remark\n", "tool.tbl")
    assert words in str(caught.value)
    assert (caught.value.file, caught.value.where) == ("tool.tbl", "line 2")
    assert caught.value.mend


def _written(tool: TableTool, offsets: dict[str, float]) -> str:
    words = [f"T{tool.number}", f"P{tool.number}"]
    words += [f"{letter}{value:.6f}" for letter, value in offsets.items()]
    words += [] if tool.diameter is None else [f"D{tool.diameter:.6f}"]
    return " ".join(words[::-1]) + f" ;{tool.remark}"


values = st.integers(-(10**9), 10**9).map(lambda millionths: millionths / 1e6)
tools = st.builds(
    TableTool,
    number=st.integers(0, 99999),
    diameter=st.none() | values.map(abs),
    remark=st.text(st.characters(exclude_categories=["C", "Z"]), max_size=20),
    line=st.just(0),
)
offsets = st.dictionaries(st.sampled_from(sorted(set(WORDS) - set("TPD"))), values)


@given(st.lists(tools, unique_by=lambda tool: tool.number, max_size=5), offsets)
def test_what_is_written_is_read(written: list[TableTool], offsets: dict[str, float]) -> None:
    lines = (_written(tool, offsets) for tool in written)
    read = read_tool_table("\n\n".join(lines), "tool.tbl")
    assert list(read) == [tool.number for tool in written]
    for tool, line in zip(written, range(1, 99, 2), strict=False):
        found = read[tool.number]
        assert (found.remark, found.line) == (tool.remark, line)
        assert found.diameter == pytest.approx(tool.diameter)


@given(st.text(alphabet="TPZDtpzdxq0123456789.+- ;\n\té\x00", max_size=60))
def test_any_text_is_tools_or_an_error_with_its_line(text: str) -> None:
    try:
        read = read_tool_table(text, "tool.tbl")
    except OptionError as error:
        read, place = {}, f"{error.file}: {error.where}"
    else:
        place = "tool.tbl: line 1"
    assert place.startswith("tool.tbl: line ")
    for number, tool in read.items():
        assert tool.number == number
        assert tool.diameter is None or (math.isfinite(tool.diameter) and tool.diameter >= 0.0)
