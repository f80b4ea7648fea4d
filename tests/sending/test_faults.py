"""The line: its faults come as often as asked for, from a seed, however its bytes are divided."""

from __future__ import annotations

from itertools import pairwise
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import OptionError
from camtool.sending.faults import Faults, FaultyLine, WiredTwin
from tests.feeding import made

DATA = bytes(range(256)) * 8


def passed(faults: Faults, seed: int, pieces: list[bytes]) -> bytes:
    line = FaultyLine(faults, Random(seed))
    come = b""
    for now, piece in enumerate(pieces):
        line.put(piece, float(now))
        come += line.take(float(now))
    return come + line.take(1e9)


def cut(data: bytes, at: list[int]) -> list[bytes]:
    bounds = [0, *sorted(min(each, len(data)) for each in at), len(data)]
    return [data[low:high] for low, high in pairwise(bounds)]


@given(st.integers(0, 99), st.lists(st.integers(0, len(DATA)), max_size=5))
def test_faults_depend_on_the_seed_and_not_on_the_pieces(seed: int, at: list[int]) -> None:
    faults = Faults(drop=0.1, double=0.1, garble=0.1)
    whole = passed(faults, seed, [DATA])
    assert passed(faults, seed, cut(DATA, at)) == whole != DATA
    assert passed(faults, seed + 1, [DATA]) != whole


@given(st.integers(0, 99), st.lists(st.integers(0, len(DATA)), max_size=5))
def test_a_line_without_faults_changes_nothing(seed: int, at: list[int]) -> None:
    assert passed(Faults(), seed, cut(DATA, at)) == DATA
    assert passed(Faults(late=0.5, late_s=3.0), seed, cut(DATA, at)) == DATA


def test_each_fault_comes_as_often_as_asked_for() -> None:
    assert len(passed(Faults(drop=0.25), 1, [DATA])) == pytest.approx(0.75 * len(DATA), rel=0.1)
    assert len(passed(Faults(double=0.25), 1, [DATA])) == pytest.approx(1.25 * len(DATA), rel=0.1)
    garbled = passed(Faults(garble=0.25), 1, [DATA])
    wrong = [a ^ b for a, b in zip(DATA, garbled, strict=True) if a != b]
    assert len(wrong) == pytest.approx(0.25 * len(DATA), rel=0.1)
    assert {each.bit_count() for each in wrong} == {1}


def test_bytes_take_their_time_and_none_overtakes_another() -> None:
    line = FaultyLine(Faults(late=1.0, late_s=2.0), Random(0), byte_s=0.5)
    line.put(b"ab", 0.0)
    assert [line.take(2.4), line.take(2.5), line.next_s(), line.take(3.0)] == [
        b"",
        b"a",
        3.0,
        b"b",
    ]


def test_behind_the_pulling_of_the_plug_nothing_passes() -> None:
    twin, _ = made("pic-mmh")
    wired = WiredTwin(twin, Faults(unplug_s=10.0), Faults(unplug_s=10.0))
    wired.write(b"G54;", 9.0)
    assert wired.read(9.0) == b"G54;"
    wired.write(b"M30;", 10.0)
    assert wired.read(99.0) == b""
    assert twin.decoded == [b"G54;"]
    assert (wired.unplugged(9.9), wired.unplugged(10.0)) == (False, True)


def test_a_paced_line_is_as_fast_as_its_machine() -> None:
    twin, _ = made("pic-mmh")
    type(twin).byte_s, before = 0.25, type(twin).byte_s
    try:
        wired = WiredTwin(twin, paced=True)
    finally:
        type(twin).byte_s = before
    wired.write(b"A;", 0.0)
    assert wired.next_s() == 0.25
    assert (wired.read(0.5), wired.read(0.75), wired.read(1.0)) == (b"", b"A", b";")


def test_what_is_written_on_the_command_line() -> None:
    assert Faults.of("") == Faults()
    assert Faults.of("drop") == Faults(drop=0.01)
    both = Faults.of("drop=0.5, late=200ms:0.1,unplug=1min,double,garble")
    assert both == Faults(0.5, 0.01, 0.01, 0.1, 0.2, 60.0)
    assert str(both).startswith("drop=0.5, double=0.01")
    for wrong in ("drop=2", "drop=x", "late", "loud", "late=1s:7", "unplug=-1s", "late=2kg"):
        with pytest.raises(OptionError):
            Faults.of(wrong)
