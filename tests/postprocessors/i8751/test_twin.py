"""The virtual Intel 8751, fed by hand: what it answers, stores, executes and passes over."""

from __future__ import annotations

import numpy as np
import pytest
from camtool_postprocessors.i8751.twin import I8751Twin, I8751TwinSettings
from hypothesis import given
from hypothesis import strategies as st

from tests.feeding import at_rest, same_motion
from tests.postprocessors.i8751.machines import STEP_MM, loaded

STILL = bytes.fromhex("01 05 02 05 00 00 03 05 00 00")
RECORD = bytes.fromhex("01 03 00 64 02 04 00 05 00 02 03 04 01 2C 00 01")
"""X +100 and Y −5 steps, 2 s, Z −300 steps, 1 s."""
ANSWER = b"BMMMBMMMBMBMMMBM"


def made(*choices: str, settings: tuple[str, ...] = ()) -> I8751Twin:
    twin = loaded(*settings).twin(choices)
    assert isinstance(twin, I8751Twin)
    return twin


def fed(twin: I8751Twin, data: bytes, now: float = 0.0) -> bytes:
    """The bytes, each when the one before has been answered and executed."""
    said = b""
    for octet in data:
        said += twin.receive(bytes([octet]), max(now, twin.now))
        said += at_rest(twin, twin.now)[0]
    return said


def test_a_program_is_answered_byte_by_byte() -> None:
    twin = made("line_end=none")
    assert fed(twin, b"\x13") == b"LISTO"
    assert fed(twin, RECORD) == ANSWER
    assert not twin.is_moving
    assert twin.decoded == []
    assert fed(twin, b"\x45") == b"F"
    assert twin.decoded == [RECORD + b"\x45"]
    assert fed(twin, b"\x54") == b"A"
    np.testing.assert_allclose(twin.slides.commanded_mm, np.array([100, -5, -300]) * STEP_MM)
    same_motion(twin, b"\x13" + RECORD + b"\x45\x54", loaded())


def test_it_says_f_when_all_has_been_executed() -> None:
    twin = made("line_end=none")
    twin.receive(b"\x13" + RECORD + RECORD, 0.0)
    assert twin.receive(b"\x45", 10.0) == b""
    assert twin.is_moving
    said, now = at_rest(twin, 10.0)
    program = b"\x13" + 2 * RECORD + b"\x45\x54"
    whole = loaded().target.read(program, loaded().machine)
    chunks = list(loaded().simulate(whole))
    seconds = sum(float(chunk.ledger.duration_s.sum()) for chunk in chunks)
    assert said == b"F"
    assert now == pytest.approx(10.0 + seconds)


def test_programs_follow_one_another_from_where_it_stands() -> None:
    twin = made("line_end=none")
    for count in (1, 2):
        said = fed(twin, b"\x13" + RECORD + b"\x45\x54")
        assert said == b"LISTO" + ANSWER + b"FA"
        np.testing.assert_allclose(twin.slides.commanded_mm[0], count * 100 * STEP_MM)


def test_nothing_but_the_key_opens_it() -> None:
    twin = made()
    assert fed(twin, b"\x01\x54") == b"OTRO\r\nOTRO\r\n"
    assert fed(twin, b"\x13\x02\x13\x54\x45") == b"LISTO\r\n"  # not a motor number, not stored
    assert fed(twin, b"\x01") == b"B"


def test_a_packet_has_five_records_and_bytes_in_their_places() -> None:
    twin = made()
    fed(twin, b"\x13")
    assert fed(twin, 5 * STILL) == 5 * b"BMBMBMBMBM"
    assert fed(twin, STILL) == b""  # the sixth
    assert fed(twin, b"\x45") == b"F"
    assert fed(twin, b"\x01\x09\x02") == b"B"  # neither a sense
    assert fed(twin, b"\x05\x03\x02") == b"MB"


def test_what_comes_while_it_moves_is_lost() -> None:
    twin = made()
    twin.receive(b"\x13" + RECORD + b"\x45", 0.0)
    assert twin.receive(b"\x54\x01\x13", 1.0) == b""
    said, now = at_rest(twin, 1.0)
    assert said == b"F"
    assert twin.receive(b"\x54", now) == b"A"


@pytest.mark.parametrize(
    ("choice", "said"),
    [
        ("motor_reply=8", b"8M8M8M8M8M"),
        ("dwell_reply=B M", b"BMBMBMBMBM"),
        ("dwell_reply=M", b"BMBMMMBMMM"),
        ("dwell_reply=none", b"BMBMBM"),
    ],
)
def test_replies_are_choices(choice: str, said: bytes) -> None:
    twin = made(choice)
    fed(twin, b"\x13")
    assert fed(twin, STILL) == said


def test_the_key_the_line_ends_and_the_packet_ends_are_choices() -> None:
    twin = made("key=each-packet", "line_end=cr", "packet_end=M F")
    assert fed(twin, b"\x13")[-1:] == b"\r"
    assert fed(twin, STILL + b"\x45")[-2:] == b"MF"
    assert fed(twin, b"\x01") == b"OTRO\r"
    assert fed(twin, b"\x13" + STILL + b"\x45\x54")[-3:] == b"MFA"


def test_a_reset_forgets_a_packet_that_is_not_complete() -> None:
    for choice, said in (("nothing", b""), ("reset", b"LISTO\r\n")):
        twin = made(f"opening={choice}")
        fed(twin, b"\x13\x01")
        twin.connect(1.0)
        assert twin.receive(b"\x13", 1.0) == said


def test_a_motor_that_turns_for_no_steps_hangs_it() -> None:
    twin = made("line_end=none")
    said = fed(twin, bytes.fromhex("13 01 03 00 00 02 05 00 00 03 05 00 00 45"))
    assert b"F" not in said
    assert twin.decoded == []


@given(
    st.lists(st.binary(max_size=12) | st.sampled_from([b"\x13", RECORD, STILL, b"\x45", b"\x54"]))
)
def test_no_bytes_make_it_fall(pieces: list[bytes]) -> None:
    twin = made()
    now, said = 0.0, b""
    for piece in pieces:
        said += twin.receive(piece, now)
        now += 20.0
    said += at_rest(twin, now)[0]
    assert said.count(b"LISTO") == len(twin.commands)


def test_the_choices_are_those_of_the_page() -> None:
    assert I8751TwinSettings().key == "once"
