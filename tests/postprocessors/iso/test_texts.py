"""Text of drawings never becomes a word or ends a comment, in any dialect."""

import re
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.records import replace
from camtool.target.registry import load_target, shipped_files
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from tests.postprocessors.iso.tables import machine_with, tables
from tests.strategies import examples

SIGNS = "();%$!?~#[]{}\\\"'MGXYZNO0123 .-\n\r"
TEXTS = st.text(max_size=90) | st.text(alphabet=SIGNS, max_size=90)


def square(label: str, message: str) -> Toolpath:
    """A square whose contour and message have these texts."""
    path = ToolpathBuilder().event(Kind.SPINDLE_CW, 1200.0).rapid(z=5.0).rapid(1.0, 1.0)
    path.source = label
    path.line(z=-1.0, feed=50.0).line(2.0, 1.0, feed=50.0).message(message)
    path.line(2.0, 2.0, feed=50.0).rapid(z=5.0)
    return path.event(Kind.SPINDLE_OFF).event(Kind.END).finish()


@examples(150, 10_000)
@given(dialect=tables(), label=TEXTS, message=TEXTS)
def test_texts_move_nothing(dialect: dict[str, Any], label: str, message: str) -> None:
    loaded = machine_with(dialect)

    def rows(path: Toolpath) -> tuple[list[Any], int]:
        data = loaded.target.write(path, loaded.machine).data
        assert data.isascii()
        ends = {"lf": b"\n", "crlf": b"\r\n", "cr": b"\r"}[dialect["lines"]["end"]]
        decoded = loaded.target.read(data, loaded.machine)
        moves = [(move.kind, move.end, move.feed) for move in decoded if move.kind != Kind.MESSAGE]
        return moves, data.count(ends)

    plain, lines = rows(square("a", "b"))
    moves, more = rows(square(label, message))
    assert moves == plain
    assert more <= lines + (label != "") + 1


NASTY = (
    "a) G0 Z-9 (",
    "a ; G0 Z-9",
    "a\nG0 Z-9",
    "a\r\nM30\r\n",
    "%",
    "(((",
    ")))",
    "M30",
    "M117 x",
    "\u2028G0 Z-9",
    "Ⓜ３０ é ß ﬁ",
    "!~?\x18\x85",
    "{rpm} {text} %s",
    "MSG,a) M3",
    "'; DROP\\",
)


def code_of(data: bytes) -> list[str]:
    """The lines of a program without comments and lines for the operator, taken off literally."""
    lines = data.decode("ascii").replace("\r", "\n").split("\n")
    bare = [re.sub(r"\([^()]*\)|;.*", "", line).strip() for line in lines]
    return [line for line in bare if line and not re.match(r"(N\d+ )?M117\b", line)]


def check_texts(name: str, label: str, message: str, drawing: str) -> None:
    target = load_target(name)
    plain = target.target.write(square("a", "b"), target.machine)
    path = replace(square(label, message), made_from=drawing)
    program = target.target.write(path, target.machine)
    assert code_of(program.data) == code_of(plain.data)
    decoded = target.target.read(program.data, target.machine)
    cuts = [(move.kind, move.end, move.feed) for move in decoded if move.kind != Kind.MESSAGE]
    wanted = target.target.read(plain.data, target.machine)
    assert cuts == [(m.kind, m.end, m.feed) for m in wanted if m.kind != Kind.MESSAGE]


@pytest.mark.parametrize("name", sorted(shipped_files()))
def test_shipped_machines_take_no_word_from_a_text(name: str) -> None:
    for text in NASTY:
        check_texts(name, text, text, text)


@examples(60, 5000)
@given(name=st.sampled_from(sorted(shipped_files())), label=TEXTS, message=TEXTS, drawing=TEXTS)
def test_no_text_is_a_word_on_a_shipped_machine(
    name: str, label: str, message: str, drawing: str
) -> None:
    check_texts(name, label, message, drawing)
