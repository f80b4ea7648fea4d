"""Text of drawings never becomes a word or ends a comment, in any dialect."""

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

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
