"""Readers of flashcut and valcnc on damaged programs: a toolpath or a ProgramError, at once."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import ProgramError
from camtool.target.registry import load_target
from camtool.toolpath.moves import Toolpath
from tests.postprocessors.gcode.plain_parts import KINDS, part
from tests.strategies import examples
from tests.waiting import no_chewing

LOADED = {name: load_target(name) for name in sorted(KINDS)}
PROGRAMS = {
    name: target.target.write(part(3.0, 8.0), target.machine).data
    for name, target in LOADED.items()
}
"""Far more than any of these takes, and far less than a reader that hangs."""


def tried(name: str, data: bytes) -> Toolpath | None:
    """The toolpath, or None after a clean error with a place."""
    target = LOADED[name]
    try:
        path: Toolpath = target.target.read(data, target.machine)
    except ProgramError as error:
        text = str(error)
        assert "\n" not in text
        assert len(text) < 500
        assert re.search(r"line \d+, column \d+", text) or "empty" in text
        return None
    return path


@pytest.mark.parametrize("name", LOADED)
def test_cut_anywhere(name: str) -> None:
    data = PROGRAMS[name]
    whole = tried(name, data)
    assert whole is not None
    for length in range(len(data)):
        path = tried(name, data[:length])
        assert path is None or len(path) <= len(whole)


@pytest.mark.parametrize("name", LOADED)
@examples(200)
@given(data=st.binary(max_size=200))
def test_noise(name: str, data: bytes) -> None:
    tried(name, data)


@pytest.mark.parametrize("name", LOADED)
@examples(200)
@given(text=st.text(alphabet="GMXYZIJF0123456789.-+,(); %\t\r\n", max_size=80))
def test_likely_noise(name: str, text: str) -> None:
    tried(name, text.encode())


@pytest.mark.parametrize("name", LOADED)
@examples(200)
@given(data=st.data())
def test_damaged_programs(name: str, data: st.DataObject) -> None:
    program = bytearray(PROGRAMS[name])
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(program) - 1))
        what = data.draw(st.sampled_from([b"", b"\n", b"-", b".", b"G02", b"X", b"9", b"\xb5"]))
        program[at : at + data.draw(st.integers(0, 3))] = what
    tried(name, bytes(program))


@pytest.mark.parametrize("name", LOADED)
@pytest.mark.parametrize("piece", [b"9", b" ", b"X1.0 ", b"(", b"G00", b"-"])
def test_ten_megabytes_on_one_line(name: str, piece: bytes) -> None:
    with no_chewing():
        assert tried(name, b"G00 X" + piece * (10_000_000 // len(piece))) is None


@pytest.mark.parametrize("name", LOADED)
def test_decimal_commas(name: str) -> None:
    with pytest.raises(ProgramError, match="decimal comma"):
        LOADED[name].target.read(PROGRAMS[name].replace(b".", b","), LOADED[name].machine)


@pytest.mark.parametrize("name", LOADED)
@pytest.mark.parametrize("end", [b"\r\n", b"\r", b"\n\n"])
def test_line_ends(name: str, end: bytes) -> None:
    whole, other = tried(name, PROGRAMS[name]), tried(name, PROGRAMS[name].replace(b"\n", end))
    assert whole is not None
    assert other is not None
    assert whole.end.tolist() == other.end.tolist()
    assert whole.block.tolist() == other.block.tolist()
