"""The virtual PIC18F4550 of ValCNC, fed by hand: what it draws, drops, loses and answers."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import OptionError
from camtool.target.twin import Twin
from tests.feeding import at_rest, at_rest_quickly, logo, made, motion, same_motion

ARCS = (
    b"G00X0Y0Z0.625\nG03X1.25Y1.25Z0.625I0J1.25\nG02X-1.25Y1.25Z0.625I-1.25J0\n"
    b"G02X0.3Y0.9Z0.625I1.25J0.00001\nG01X-0.0333Y0.0777Z0.625\nG01X-0.0333Y0.0777Z-0.1\n"
)


def feed(twin: Twin, program: bytes) -> tuple[bytes, float]:
    """A program, block by block, each when the one before is done."""
    now, sent = 0.0, b""
    for block in program.splitlines():
        sent += twin.receive(block + b"\n", now)
        more, now = at_rest_quickly(twin, now)
        sent += more
    return sent, now


def test_the_logo_runs_as_verify_says() -> None:
    program = logo("valcnc")
    twin, loaded = made("valcnc")
    sent, now = feed(twin, program)
    assert sent == b""
    assert b"".join(twin.decoded) == program.replace(b" ", b"")
    same_motion(twin, program, loaded)
    assert now == pytest.approx(motion(program, loaded).time_s[-1], rel=1e-9)


@pytest.mark.parametrize("rounding", ["nearest", "truncated"])
@pytest.mark.parametrize("counting", ["coordinates", "differences"])
@pytest.mark.parametrize("end", ["computed", "programmed"])
def test_what_an_arc_or_a_rounding_leaves_goes_on_as_in_the_simulation(
    rounding: str, counting: str, end: str
) -> None:
    settings = [
        f'controller.rounding="{rounding}"',
        f'controller.counting="{counting}"',
        f'controller.arc_end="{end}"',
        "dialect.arc_spread_mm=30",
        "axes.x.compensation_mm=0.2",
    ]
    twin, loaded = made("valcnc", settings=settings)
    feed(twin, ARCS)
    assert len(twin.decoded) == 6
    same_motion(twin, ARCS, loaded)


def test_words_that_are_missing_stay_as_the_last_block_left_them() -> None:
    program = b"G00X0.1Y0.2Z0.3\nG01X0.5\nG01Y0.25\n"
    twin, loaded = made("valcnc", settings=["dialect.missing_words=keep", "dialect.z_order=after"])
    feed(twin, program)
    same_motion(twin, program, loaded)
    np.testing.assert_allclose(twin.slides.commanded_mm, [4.0, 2.0, 2.4])


@pytest.mark.parametrize(
    "line", [b"", b"G05X1Y1Z0", b"X1", b"HELLO", b"G01X1Y1Z0" + b"0" * 127, b"G02X1Y1Z0"]
)
def test_what_it_cannot_decode_is_passed_over_in_silence(line: bytes) -> None:
    twin, _ = made("valcnc")
    assert twin.receive(line + b"\n", 0.0) == b""
    assert (twin.decoded, twin.commands, twin.is_moving) == ([], [], False)


def test_what_the_thesis_gives_no_meaning_is_done_all_the_same() -> None:
    twin, _ = made("valcnc")
    feed(twin, b"G01X1\nG01X1Y1Z1\nG02X1Y1Z1I1J0\n")
    assert len(twin.decoded) == 3
    np.testing.assert_allclose(twin.slides.commanded_mm, 8.0)
    assert twin.slides.trace.commanded[:, 0].max() == pytest.approx(24.0)


def test_the_pc_says_c_when_it_has_opened_the_line() -> None:
    twin, _ = made("valcnc")
    assert twin.receive(b"C\n", 0.0) == b""
    assert twin.commands == [b"C\n"]


def test_what_comes_while_it_draws_is_a_choice() -> None:
    lines = b"G01X1Y0Z0\nG01X1Y1Z0\n"
    for choice, decoded in (("lost", 1), ("kept", 2)):
        twin, _ = made("valcnc", [f"busy={choice}"])
        twin.receive(lines, 0.0)
        at_rest(twin, 0.0)
        assert b"".join(twin.decoded) == b"".join(lines.splitlines(keepends=True)[:decoded])


def test_wrong_characters_are_a_choice() -> None:
    for choice, x in (("dropped", 104.0), ("block", 0.0)):
        twin, _ = made("valcnc", [f"wrong={choice}"])
        twin.receive(b"G01X1&3Y 0Z0\n", 0.0)
        at_rest(twin, 0.0)
        assert twin.slides.commanded_mm[0] == pytest.approx(x)


def test_the_answer_comes_when_the_block_is_done() -> None:
    twin, _ = made("valcnc", ["answer=ok"])
    assert twin.receive(b"G01X1Y0Z0\n", 0.0) == b""
    sent, now = at_rest(twin, 0.0)
    assert (sent, now) == (b"ok\n", pytest.approx(200 / 6000.0))
    assert twin.receive(b"G01X1Y0Z0\n", 1.0) == b"ok\n"  # nothing is left to do


@given(st.lists(st.binary(max_size=12) | st.sampled_from([b"G01X1Y0Z0\n", b"\n", b"C\n"])))
def test_no_bytes_make_it_fall(pieces: list[bytes]) -> None:
    twin, _ = made("valcnc", ["busy=kept", "answer=ok"])
    now, sent = 0.0, b""
    for piece in pieces:
        sent += twin.receive(piece, now)
        now += 0.1
    sent += at_rest(twin, now)[0]
    assert sent == b"ok\n" * len(twin.decoded)


def test_choices_that_are_none() -> None:
    with pytest.raises(OptionError, match="busy=lost"):
        made("valcnc", ["busy=loud"])
