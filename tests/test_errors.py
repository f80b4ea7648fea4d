"""Every error is one line that names file, place and mend, and has its exit code."""

import inspect

import pytest

from camtool import errors
from camtool.errors import CamtoolError, DrawingError, OutputError


def tree() -> list[type[CamtoolError]]:
    return [
        item
        for _, item in inspect.getmembers(errors, inspect.isclass)
        if issubclass(item, CamtoolError)
    ]


@pytest.mark.parametrize("kind", tree())
def test_every_error_prints_file_place_message_and_mend(kind: type[CamtoolError]) -> None:
    error = kind("is broken", file="a.dxf", where="layer CUT", mend="mend it")
    assert str(error) == "a.dxf: layer CUT: is broken; mend it"
    assert error.exit_code == 2


def test_a_message_stays_one_line_whatever_the_names_hold() -> None:
    error = DrawingError("is broken", file="a\nG00X0.dxf", where="layer\r\n;M30;")
    assert "\n" not in str(error)
    assert "\r" not in str(error)


def test_the_tree_in_the_docstring_names_every_class() -> None:
    assert errors.__doc__ is not None
    for kind in tree():
        assert kind.__name__ in errors.__doc__


def test_builtins_are_bases_too() -> None:
    assert issubclass(DrawingError, ValueError)
    assert issubclass(OutputError, OSError)
