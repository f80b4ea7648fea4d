"""The virtual PIC18F8720, fed by hand: what it echoes, does, reports, ignores and stops."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import MachineError, OptionError
from camtool.target.registry import load_target
from camtool.target.twin import Twin
from tests.feeding import at_rest, at_rest_quickly, logo, made, motion, same_motion

BLOCK = b"G01X00014.00Y00007.00F08;"
STEP_UM = 0.14


def feed(twin: Twin, program: bytes, *, echo: bool = True) -> tuple[bytes, float]:
    """A program, block by block, each when the one before is done: the bytes of its steps."""
    now, reported = 0.0, b""
    for block in program.translate(None, b"\r\n").split(b";")[:-1]:
        sent = twin.receive(block + b";", now)
        if echo:
            assert sent.startswith(block + b";")
            sent = sent.removeprefix(block + b";")
        more, now = at_rest_quickly(twin, now)
        reported += sent + more
    return reported, now


def test_the_logo_runs_as_verify_says() -> None:
    program = logo("pic-mmh")
    twin, loaded = made("pic-mmh")
    reported, now = feed(twin, program)
    assert b"".join(twin.decoded) == program.translate(None, b"\r\n")
    same_motion(twin, program, loaded)
    wanted = motion(program, loaded)
    assert len(reported) == len(wanted)
    assert now == pytest.approx(wanted.time_s[-1], rel=1e-9)


@pytest.mark.parametrize("reading", ["equal", "nearest", "final-quadrant"])
@pytest.mark.parametrize("base", ["event", "iteration"])
def test_arcs_that_miss_their_ends_go_on_as_in_the_simulation(reading: str, base: str) -> None:
    arcs = (
        b"G54;G02X00100.00Y00100.00I00100.00J00000.00F08;G01Z00002.00F08;"
        b"G03X00031.00Y00055.00I00060.00J00080.00F08;G00X00000.00Y00000.00;G28Z0;G28X0Y0;"
        b"G02X00000.00Y00000.00I00031.33J00017.77F08;G04P02;M30;"
    )
    settings = [f'controller.arc_end="{reading}"', f'controller.time_base="{base}"']
    twin, loaded = made("pic-mmh", settings=settings)
    _, now = feed(twin, arcs)
    same_motion(twin, arcs, loaded)
    assert now == pytest.approx(motion(arcs, loaded).time_s[-1] + 2.0, rel=1e-6)


def test_each_step_is_a_byte_that_tells_axis_and_sense() -> None:
    twin, _ = made("pic-mmh", settings=["axes.x.compensation_mm=0", "axes.y.compensation_mm=0"])
    sent = twin.receive(b"PX+0002;PY-0001;", 0.0)  # the second stops the first before a step
    assert sent == b"PX+0002;PY-0001;"
    assert at_rest(twin, 0.0)[0] == bytes([0x4C])
    assert feed(twin, b"PX+0002;")[0] == bytes([0x41, 0x41])
    twin, _ = made("pic-mmh", ["step_byte=letters", "compensation=reported"])
    steps = round(0.204 / 0.00014)
    assert feed(twin, b"PX+0002;PX-0001;")[0] == b"XX" + b"x" * steps + b"x"


def test_the_echo_is_a_choice() -> None:
    for choice, first in (("string", b""), ("character", b"A"), ("none", b"")):
        twin, _ = made("pic-mmh", [f"echo={choice}"])
        assert twin.receive(b"A", 0.0) == first
        assert twin.receive(b";", 0.0) == {"string": b"A;", "character": b";", "none": b""}[choice]


def test_a_character_stops_what_moves_and_is_received() -> None:
    twin, _ = made("pic-mmh")
    twin.receive(BLOCK, 0.0)
    before = twin.advance(0.2)
    assert twin.is_moving
    assert len(before) == len(twin.slides.trace) > 0
    assert twin.receive(b"A;", 0.2) == b"A;"
    assert not twin.is_moving
    assert twin.next_s() is None
    stood = twin.slides.commanded_mm.copy()
    assert twin.advance(100.0) == b""
    np.testing.assert_array_equal(twin.slides.commanded_mm, stood)
    assert 0.0 < stood[0] < 0.014
    # It knows where it stands: the same block goes on to its end.
    feed(twin, BLOCK)
    np.testing.assert_allclose(twin.slides.commanded_mm, [0.014, 0.007, 0.0])


def test_the_slides_forget_what_was_not_done() -> None:
    """A block that is stopped at a step and done again is as if it had never been stopped."""
    whole, _ = made("pic-mmh")
    feed(whole, BLOCK + b"G00X00000.00Y00000.00;")
    halved, _ = made("pic-mmh")
    halved.receive(BLOCK, 0.0)
    halved.advance(0.3)
    halved.receive(b"A;", 0.3)
    feed(halved, BLOCK + b"G00X00000.00Y00000.00;")
    np.testing.assert_allclose(halved.slides.trace.slide[-1], whole.slides.trace.slide[-1])


@pytest.mark.parametrize(
    "string", [b";", b"G05X1;", b"G01X00014.00Y00007.00F00;", b"X;", b"JQ+;", b"PX+10;", b"hello;"]
)
def test_what_it_cannot_decipher_is_ignored_in_silence(string: bytes) -> None:
    twin, _ = made("pic-mmh")
    assert twin.receive(string, 0.0) == string
    assert (twin.decoded, twin.commands, twin.is_moving) == ([], [], False)


def test_a_block_beyond_the_buffer_is_lost() -> None:
    for choice, decoded in (("overflow=lost", []), ("overflow=kept", [BLOCK])):
        twin, _ = made("pic-mmh", [choice], ["dialect.buffer_chars=20"])
        feed(twin, BLOCK)
        assert twin.decoded == decoded


def test_compensation_is_what_the_line_said_last() -> None:
    twin, loaded = made("pic-mmh")
    assert feed(twin, b"BX000;BY000;")[0] == b""
    assert twin.commands == [b"BX000;", b"BY000;"]
    there_and_back = b"G01X00014.00Y00007.00F08;G01X00000.00Y00000.00F08;"
    _, now = feed(twin, there_and_back)
    settings = ["axes.x.compensation_mm=0", "axes.y.compensation_mm=0"]
    same_motion(twin, there_and_back, load_target("pic-mmh", settings=settings))
    assert now < motion(there_and_back, loaded).time_s[-1]


def test_the_joystick_runs_until_a_character_comes() -> None:
    twin, _ = made("pic-mmh", settings=["axes.y.compensation_mm=0"])
    twin.receive(b"&X+Y-;", 0.0)
    twin.advance(100.0)
    assert twin.is_moving
    twin.receive(b"A;", 100.0)
    assert not twin.is_moving
    steps = np.rint(twin.slides.commanded_mm * 1000.0 / STEP_UM)
    assert steps.tolist() == [16600, -16600, 0]  # 166 a second: the link


def test_home_goes_beyond_and_back_in_the_order_z_x_y() -> None:
    twin, _ = made("pic-mmh")
    feed(twin, BLOCK + b"G01Z00003.00F08;")
    twin.slides.drain()
    feed(twin, b"H;")
    trace = twin.slides.trace
    np.testing.assert_allclose(trace.commanded[-1], 0.0, atol=1e-12)
    np.testing.assert_allclose(trace.commanded.min(axis=0), -400 * STEP_UM / 1000.0)
    first = [int((np.diff(trace.commanded[:, axis]) != 0).argmax()) for axis in range(3)]
    assert first[2] < first[0] < first[1]


def test_part_zero_is_where_it_was_stored() -> None:
    twin, _ = made("pic-mmh")
    feed(twin, b"PX+1000;Q;G01X00014.00Y00000.00F08;G28X0Y0;")
    x = twin.slides.trace.commanded[:, 0]
    assert x.max() == pytest.approx(1.1 * 0.14)
    assert x[-1] == pytest.approx(0.0, abs=1e-12)


@given(st.lists(st.binary(max_size=12) | st.sampled_from([BLOCK, b"PX+0100;", b"A;", b"H;"])))
def test_no_bytes_make_it_fall(pieces: list[bytes]) -> None:
    twin, _ = made("pic-mmh")
    now, sent = 0.0, b""
    for piece in pieces:
        sent += twin.receive(piece, now)
        now += 0.3
    assert sent.count(b";") == b"".join(pieces).count(b";")
    assert len(twin.slides.trace) >= 0


def test_choices_that_are_none() -> None:
    with pytest.raises(OptionError, match="echo=string"):
        made("pic-mmh", ["echo=loud"])
    with pytest.raises(MachineError, match="model of the real one"):
        made("pic-mmh", settings=['controller.model="path"'])
