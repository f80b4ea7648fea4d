"""The virtual grbl, fed by hand: replies, the two buffers, holds, resets, alarms, reports."""

from __future__ import annotations

import re

import numpy as np
import pytest
from camtool_postprocessors.grbl.settings import differences
from hypothesis import given
from hypothesis import strategies as st

from camtool.target.twin import Twin
from tests.feeding import at_rest, logo, made, motion, same_motion

BANNER = b"\r\nGrbl 1.1h ['$' for help]\r\n"
M2_ENDS = b"[MSG:Pgm End]\r\nok\r\n"
"""What grbl says of an M2 that waits for the slides, also where a reset ends its waiting."""
SQUARE = b"G21 G90\nG1 X10 F500\nY10\nX0\nY0\nM2\n"


def stream(
    twin: Twin, program: bytes, now: float = 0.0, most: int = 127
) -> tuple[list[str], float]:
    """Send a program by counting characters; the replies to its lines, and when all is done."""
    lines = [line for line in program.splitlines() if line.strip()]
    replies, under_way, come = list[str](), list[int](), b""
    while len(replies) < len(lines):
        sent = len(replies) + len(under_way)
        if sent < len(lines) and sum(under_way) + len(lines[sent]) + 1 <= most:
            under_way.append(len(lines[sent]) + 1)
            come += twin.receive(lines[sent] + b"\n", now)
        else:
            at = twin.next_s()
            assert at is not None
            now = max(now, at)
            come += twin.advance(now)
        *whole, come = come.split(b"\r\n")
        for each in whole:
            if each.startswith((b"ok", b"error")):
                under_way.pop(0)
                replies.append(each.decode())
    return replies, at_rest(twin, now)[1]


def reply(twin: Twin, line: str, now: float = 0.0) -> str:
    return twin.receive(line.encode() + b"\n", now).decode().strip()


def report(twin: Twin, now: float) -> str:
    return twin.receive(b"?", now).decode().strip()


def test_the_logo_runs_as_verify_says_steps_and_seconds() -> None:
    program = logo("grbl")
    twin, loaded = made("grbl")
    replies, now = stream(twin, program)
    assert set(replies) == {"ok"}
    assert twin.decoded == [line for line in program.splitlines() if line.strip()]
    same_motion(twin, program, loaded)
    assert now == pytest.approx(motion(program, loaded).time_s[-1], rel=1e-6)


def test_a_slow_sender_costs_time_and_no_step() -> None:
    program = b"G21 G90\n" + b"".join(b"G1 X%.2f F500\n" % (0.1 * k) for k in range(1, 60))
    twin, loaded = made("grbl")
    now = 0.0
    for line in program.splitlines():
        assert twin.receive(line + b"\n", now) in (b"ok\r\n",)
        now = at_rest(twin, now)[1]
    same_motion(twin, program, loaded)
    quick, _ = made("grbl")
    assert stream(quick, program)[1] < 0.5 * now


def test_a_line_is_answered_when_it_is_planned() -> None:
    twin, _ = made("grbl")
    assert reply(twin, "$10=3") == "ok"
    assert "|Bf:15,128|" in report(twin, 0.0)
    lines = [b"G1X%dF100\n" % k for k in range(1, 25)]
    sent = b"".join(twin.receive(line, 0.0) for line in lines)
    assert sent == b"ok\r\n" * 15  # places in the ring
    assert twin.is_moving
    waiting = sum(map(len, lines[16:]))  # one line is with the parser
    assert f"|Bf:0,{128 - waiting}|" in report(twin, 0.0)
    assert at_rest(twin, 0.0)[0].count(b"ok\r\n") == len(lines) - 15


def test_what_goes_beyond_the_receive_buffer_is_lost() -> None:
    twin, _ = made("grbl")
    data = b"".join(b"G1X%dF100\n" % k for k in range(1, 80))
    sent = twin.receive(data, 0.0) + at_rest(twin, 0.0)[0]
    assert b"".join(line + b"\n" for line in twin.decoded) != data
    assert sent.count(b"\r\n") < 79


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("G1 X1", 22),
        ("X", 2),
        ("*", 1),
        ("G5", 20),
        ("M6", 20),
        ("G17 G18", 21),
        ("G0 G1 X1 F1", 24),
        ("G0 X1 X2", 25),
        ("G2 X1 F100", 35),
        ("G0 X1 P2", 36),
        ("G4", 28),
        ("G1 X1 F-3", 4),
        ("G80 X1", 31),
        ("$10=x", 2),
        ("$99=1", 3),
        ("$H", 5),
        ("$Q", 2),
        ("G0 X" + "1" * 90, 11),
    ],
)
def test_errors_have_grbls_numbers_and_change_nothing(line: str, code: int) -> None:
    twin, _ = made("grbl")
    before = reply(twin, "$G")
    assert reply(twin, line) == f"error:{code}"
    assert reply(twin, "$G") == before
    assert not twin.is_moving


def test_an_empty_line_is_answered_too() -> None:
    twin, _ = made("grbl")
    assert twin.receive(b"\r\n", 0.0) == b"ok\r\n" * 2
    assert twin.receive(b"(only said)\n", 0.0) == b"ok\r\n"


def test_a_hold_slows_down_on_the_path_and_goes_on_to_the_last_step() -> None:
    twin, loaded = made("grbl")
    twin.receive(SQUARE, 0.0)
    twin.advance(0.7)
    twin.receive(b"!", 0.7)
    assert report(twin, 0.7).startswith("<Hold:1|")
    twin.advance(5.0)
    assert report(twin, 5.0).startswith("<Hold:0|MPos:")
    assert not twin.is_moving
    stood = twin.slides.commanded_mm.copy()
    assert 0.0 < stood[0] < 10.0
    twin.advance(60.0)
    np.testing.assert_array_equal(twin.slides.commanded_mm, stood)
    twin.receive(b"~", 60.0)
    assert report(twin, 60.1).startswith("<Run|")
    at_rest(twin, 60.1)
    same_motion(twin, SQUARE, loaded)


def test_a_hold_that_ends_behind_a_corner() -> None:
    fine = b"".join(b"G1 X%.3f F500\n" % (0.05 * k) for k in range(1, 15))
    for at in np.linspace(0.01, 0.6, 23):
        twin, loaded = made("grbl")
        twin.receive(fine, 0.0)
        twin.receive(b"!", float(at))
        at_rest(twin, float(at))
        twin.receive(b"~", 9.0)
        at_rest(twin, 9.0)
        twin.receive(b"~", 99.0)
        at_rest(twin, 99.0)
        same_motion(twin, b"\n".join(twin.decoded), loaded)


def test_a_hold_in_a_dwell_stops_its_clock() -> None:
    twin, _ = made("grbl")
    twin.receive(b"G4P2\nG1X1F500\n", 0.0)
    twin.receive(b"?", 0.49)  # it looks at its flags every 50 ms
    assert twin.advance(0.51).startswith(b"<Idle|")  # as grbl says of a dwell
    twin.receive(b"!", 0.51)
    assert report(twin, 30.0).startswith("<Hold:0|")
    assert len(twin.slides.trace) == 0
    twin.receive(b"~", 30.0)
    twin.advance(31.39)
    assert len(twin.slides.trace) == 0
    at_rest(twin, 31.4)
    assert twin.slides.commanded_mm[0] == pytest.approx(1.0)


def test_a_reset_in_motion_is_an_alarm_until_it_is_unlocked() -> None:
    twin, _ = made("grbl")
    twin.receive(SQUARE, 0.0)
    assert twin.receive(b"\x18", 0.5) == b""
    sent, now = at_rest(twin, 0.5)
    assert sent == b"ALARM:3\r\n" + M2_ENDS + BANNER + b"[MSG:'$H'|'$X' to unlock]\r\n"
    assert now == pytest.approx(0.5 + 0.5 + 2 * 0.025)  # it says an alarm slowly, and $1 twice
    assert report(twin, now).startswith("<Alarm|")
    assert reply(twin, "G0 X1", now) == "error:9"
    assert reply(twin, "$X", now) == "[MSG:Caution: Unlocked]\r\nok"
    assert reply(twin, "G0 X1", now) == "ok"
    at_rest(twin, now)
    assert twin.slides.commanded_mm[0] == pytest.approx(1.0)


def test_a_reset_at_rest_is_none() -> None:
    twin, _ = made("grbl")
    assert twin.receive(b"\x18", 0.0) + at_rest(twin, 0.0)[0] == BANNER
    twin.receive(SQUARE, 0.1)
    twin.receive(b"!", 0.6)
    twin.advance(3.0)
    ended = twin.receive(b"\x18", 3.0) + at_rest(twin, 3.0)[0]
    assert ended == M2_ENDS + BANNER  # held: nothing moves
    assert report(twin, 3.1).startswith("<Idle|")


def test_homing_locks_until_it_is_done() -> None:
    twin, _ = made("grbl", ["homing=on"])
    assert twin.connect(0.0) == BANNER + b"[MSG:'$H'|'$X' to unlock]\r\n"
    assert reply(twin, "G0 X1") == "error:9"
    assert reply(twin, "$H") == ""
    assert at_rest(twin, 0.0)[0] == b"ok\r\n"
    assert report(twin, 99.0).startswith("<Idle|MPos:-1.000,-1.000,-1.000|")


def test_m0_waits_for_the_operator() -> None:
    twin, _ = made("grbl")
    assert twin.receive(b"G1X1F500\nM0\nG1X2\n", 0.0) == b"ok\r\n"
    at_rest(twin, 0.0)
    assert report(twin, 30.0).startswith("<Hold:0|MPos:1.000")
    assert twin.receive(b"~", 30.0) == b"ok\r\nok\r\n"
    at_rest(twin, 30.0)
    assert twin.slides.commanded_mm[0] == pytest.approx(2.0)


def test_the_end_of_a_program_is_not_the_end_of_the_twin() -> None:
    twin, _ = made("grbl")
    stream(twin, SQUARE)
    assert re.search(r"G1 G54 G17 G21 G90 G94 M5 M9", reply(twin, "$G", 99.0))
    replies, _ = stream(twin, SQUARE, 100.0)
    assert set(replies) == {"ok"}


def test_check_mode_moves_nothing_and_its_end_is_a_reset() -> None:
    twin, _ = made("grbl")
    assert reply(twin, "$C") == "[MSG:Enabled]\r\nok"
    assert set(stream(twin, SQUARE)[0]) == {"ok"}
    assert reply(twin, "G1 X1 X2") == "error:25"
    assert report(twin, 0.0).startswith("<Check|MPos:0.000,0.000,0.000")
    assert twin.receive(b"$C\n", 0.0) == b"[MSG:Disabled]\r\nok\r\n"
    assert at_rest(twin, 0.0)[0] == BANNER
    assert len(twin.slides.trace) == 0


def test_jogs_move_and_are_cancelled_and_change_no_mode() -> None:
    twin, _ = made("grbl")
    before = reply(twin, "$G")
    assert reply(twin, "$J=G91 X-5 F500") == "ok"
    assert report(twin, 0.3).startswith("<Jog|")
    assert reply(twin, "G0 X1", 0.3) == "error:9"
    twin.receive(b"\x85", 0.4)
    _, now = at_rest(twin, 0.4)
    assert -5.0 < twin.slides.commanded_mm[0] < 0.0
    assert report(twin, now).startswith("<Idle|")
    assert reply(twin, "$G", now) == before
    assert reply(twin, "$J=X1", now).startswith("error:22")


def test_settings_are_those_of_the_machine_and_can_be_changed() -> None:
    twin, loaded = made("grbl", settings=["axes.x.max_rate_mm_min=1234"])
    listing = reply(twin, "$$")
    assert "$110=1234.000" in listing
    said = {each.key: each.value for each in loaded.target.settings_from(listing)}
    assert said["axes.x.max_rate_mm_min"] == 1234
    assert said["controller.arc_tolerance_mm"] == loaded.machine.controller.arc_tolerance_mm
    slow, _ = made("grbl")
    assert reply(slow, "$110=100") == "ok"
    assert stream(slow, b"G0X10\n")[1] > 1.9 * stream(made("grbl")[0], b"G0X10\n")[1]


def test_laser_mode_is_compared_before_a_program_is_sent() -> None:
    laser, with_laser = made("grbl", settings=["controller.laser_mode=true"])
    spindle, without = made("grbl")
    for twin, loaded in ((laser, with_laser), (spindle, without)):
        listing = reply(twin, "$$")
        said = {each.key: each.value for each in loaded.target.settings_from(listing)}
        assert said["controller.laser_mode"] is loaded.machine.controller.laser_mode
        assert differences(listing, loaded.machine) == ([], [])
    (error,) = differences(reply(laser, "$$"), without.machine)[0]
    assert error.startswith("$32 is laser mode")
    (error,) = differences(reply(spindle, "$$"), with_laser.machine)[0]
    assert error.startswith("$32=0 is no laser mode")


def test_overrides_of_the_feed_act_at_once() -> None:
    plain, fast, slow = made("grbl")[0], made("grbl")[0], made("grbl")[0]
    line = b"G1X20F200\n"
    ends = []
    for twin, bytes_ in ((plain, b""), (fast, b"\x91" * 10), (slow, b"\x92" * 5)):
        twin.receive(line, 0.0)
        twin.receive(bytes_, 1.0)
        ends.append(at_rest(twin, 1.0)[1])
    assert ends[1] < 0.7 * ends[0] < 0.45 * ends[2]
    assert all(twin.slides.commanded_mm[0] == pytest.approx(20.0) for twin in (plain, fast, slow))


@given(
    st.lists(
        st.tuples(
            st.sampled_from([b"G1X3F400\n", b"G2X0Y0I-1.5\n", b"!", b"~", b"?", b"\x18", b"$X\n"])
            | st.binary(max_size=4),
            st.floats(0.0, 0.5),
        ),
        max_size=25,
    )
)
def test_no_bytes_make_it_fall_and_its_slides_never_jump(
    pieces: list[tuple[bytes, float]],
) -> None:
    twin, _ = made("grbl")
    now = 0.0
    for data, pause in pieces:
        twin.receive(data, now)
        now += pause
    twin.receive(b"~", now)
    at_rest(twin, now)
    trace = twin.slides.trace
    steps = np.diff(trace.commanded, axis=0, prepend=np.zeros((1, 3)))
    assert np.abs(steps).max(initial=0.0) <= 0.004 + 1e-9
    assert (np.diff(trace.time_s) >= -1e-9).all()


def test_laser_mode_changes_power_without_a_stop() -> None:
    program = b"G21 G90\nM4 S0\n" + b"".join(
        b"G1 X%.1f S%d F500\n" % (0.2 * k, 7 * k % 90) for k in range(1, 30)
    )
    program += b"S50\nM4\nG1 X0 Y2\nM3\nX0\nX1 S9\nM5\nM2\n"
    twin, loaded = made("grbl", settings=["controller.laser_mode=true"])
    assert "$32=1" in reply(twin, "$$")
    _, now = stream(twin, program)
    same_motion(twin, program, loaded)
    assert now == pytest.approx(motion(program, loaded).time_s[-1], rel=1e-6)
    spindle, _ = made("grbl")
    slow = stream(spindle, program)[1]
    assert slow > 2.0 * now
    assert reply(spindle, "$32=1", slow) == "ok"
    assert stream(spindle, program, slow)[1] - slow < 1.5 * now  # it begins elsewhere
