"""Which pieces are read: patterns of layers and line types, and colours."""

import numpy as np
import pytest

from camtool.errors import DrawingError, OptionError
from camtool.geometry.drawing import Skipped
from camtool.importers.options import Selection, colour_named
from camtool.importers.pieces import Piece, select_pieces

LINE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
PIECES = [
    Piece(LINE, False, "CUT", "#ff0000", "LINE 1"),
    Piece(LINE, False, "Cut inner", "#000000", "LINE 2", "DASHED"),
    Piece(LINE, False, "ENG [1]", "#ff0000", "ARC 3", "CENTER2"),
]


def chosen(**wanted: tuple[str, ...]) -> list[str]:
    kept, _ = select_pieces(PIECES, Selection(**wanted), "t.dxf")
    return [piece.source for piece in kept]


@pytest.mark.parametrize(
    ("wanted", "sources"),
    [
        ({}, ["LINE 1", "LINE 2", "ARC 3"]),
        ({"layers": ("cut*",)}, ["LINE 1", "LINE 2"]),
        ({"layers": ("cut",)}, ["LINE 1"]),
        ({"layers": ("CUT", "eng*")}, ["LINE 1", "ARC 3"]),
        ({"exclude_layers": ("cut?inner", "none such")}, ["LINE 1", "ARC 3"]),
        ({"layers": ("cut*",), "exclude_layers": ("CUT",)}, ["LINE 2"]),
        ({"colours": ("#ff0000",)}, ["LINE 1", "ARC 3"]),
        ({"colours": ("#ff0000",), "line_types": ("continuous",)}, ["LINE 1"]),
        ({"line_types": ("dash*", "center?")}, ["LINE 2", "ARC 3"]),
    ],
)
def test_patterns_choose(wanted: dict[str, tuple[str, ...]], sources: list[str]) -> None:
    assert chosen(**wanted) == sources


def test_what_is_left_out_is_counted_with_the_first_reason() -> None:
    wanted = Selection(layers=("cut*",), colours=("#ff0000",))
    _, gone = select_pieces(PIECES, wanted, "t.dxf")
    assert gone == [
        Skipped("LINE", 1, "has a colour that was not asked for"),
        Skipped("ARC", 1, "is on a layer that was not asked for"),
    ]


@pytest.mark.parametrize("field", ["layers", "colours", "line_types"])
def test_a_pattern_that_chooses_nothing_names_what_there_is(field: str) -> None:
    with pytest.raises(DrawingError) as caught:
        select_pieces(
            PIECES, Selection(**{field: ("cut", "#ff0000", "DASHED", "misspelt")}), "t.dxf"
        )
    assert caught.value.file == "t.dxf"
    assert any(name in caught.value.mend for name in ("Cut inner", "#000000", "CENTER2"))


@pytest.mark.parametrize(
    ("text", "colour"),
    [("#F00", "#ff0000"), ("#12aBcd", "#12abcd"), ("Red", "#ff0000"), ("7", "#000000")],
)
def test_colours_have_names_and_numbers(text: str, colour: str) -> None:
    assert colour_named(text) == colour


@pytest.mark.parametrize("text", ["", "0", "256", "#12", "#gggggg", "no colour", "-1", "1.0"])
def test_what_is_no_colour_is_refused(text: str) -> None:
    with pytest.raises(OptionError, match="unknown colour"):
        colour_named(text)
