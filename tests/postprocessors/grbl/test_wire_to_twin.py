"""grbl's wire and its virtual controller, which share no code: they meet over bytes."""

from __future__ import annotations

from functools import cache

import pytest

from camtool.sending.faults import Faults, Wired
from camtool.sending.prepare import forecast_of
from camtool.target.wire import Conversation, Manner, Packet, State
from tests.feeding import logo, made, same_motion
from tests.sending.talking import talked


@cache
def packets(program: bytes) -> tuple[Packet, ...]:
    _, loaded = made("grbl")
    wire = loaded.target.wire()
    decoded = loaded.target.read(program, loaded.machine)
    return tuple(wire.packets(program, loaded.machine, forecast_of(decoded, loaded)))


def conversation(program: bytes) -> Conversation:
    _, loaded = made("grbl")
    talk = loaded.target.wire().conversation(packets(program), loaded.machine, Manner())
    assert isinstance(talk, Conversation)
    return talk


@cache
def sent_without_faults() -> tuple[bytes, ...]:
    twin, _ = made("grbl")
    talked(conversation(logo("grbl")), Wired(twin), latest_s=1000.0)
    return tuple(twin.decoded)


def test_the_logo_arrives_and_moves_as_verify_says() -> None:
    twin, loaded = made("grbl")
    program = logo("grbl")
    talk = conversation(program)
    talked(talk, Wired(twin), latest_s=1000.0)
    assert talk.state is State.FINISHED, talk.why
    same_motion(twin, program, loaded)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("fault", ["drop=0.0005", "double=0.0005", "garble=0.0005", "unplug=20s"])
def test_faults_never_skip_or_double_a_block(fault: str, seed: int) -> None:
    twin, _ = made("grbl")
    program = logo("grbl")
    talk = conversation(program)
    talked(talk, Wired(twin, back=Faults.of(fault), seed=seed), latest_s=1000.0)
    wanted = sent_without_faults()
    assert twin.decoded == list(wanted[: len(twin.decoded)])
    assert talk.state in (State.FINISHED, State.FAILED)
    if talk.state is State.FAILED and "unplug" not in fault:
        assert not twin.moves


def test_a_stop_leaves_nothing_that_moves() -> None:
    twin, _ = made("grbl")
    talk = conversation(logo("grbl"))

    def wish(talk: Conversation, now: float) -> None:
        if now > 30.0:
            talk.stop(now)

    talked(talk, Wired(twin), wish, latest_s=100.0)
    assert talk.state is State.STOPPED, talk.why
    assert not twin.moves


def test_dwells_are_no_missing_answers_and_missing_ones_are_noticed() -> None:
    program = b"G21 G90\nG1 X1 F500\nG4 P5\nG1 X2\nG4 P3\n"
    twin, _ = made("grbl")
    talk = conversation(program)
    talked(talk, Wired(twin), latest_s=100.0)
    assert talk.state is State.FINISHED, talk.why
    twin, _ = made("grbl")
    line, talk = Wired(twin), conversation(program)

    def wish(talk: Conversation, now: float) -> None:
        line.back.faults = Faults(drop=1.0 if talk.acknowledged == 2 and now < 6.5 else 0.0)

    talked(talk, line, wish, latest_s=100.0)
    assert talk.state is State.FAILED


def test_short_lines_are_sent_as_fast_as_the_machine_takes_them() -> None:
    """A raster of a laser, 0.1 mm a line at 4000 mm/min, over a line of 115200 baud: its answers
    come back over the same line, so what is asked in between costs time."""
    rates = [f"axes.{axis}.max_rate_mm_min=10000" for axis in "xyz"]
    accelerations = [f"axes.{axis}.acceleration_mm_s2=1000" for axis in "xyz"]
    settings = ["controller.laser_mode=true", *rates, *accelerations]
    program = b"G21G90\nM4S0\nF4000\n" + b"".join(
        b"G1X%d.%dS%d\n" % (*divmod(k, 10), 100 + 37 * k % 900) for k in range(1, 300)
    )
    twin, loaded = made("grbl", (), settings)
    decoded = loaded.target.read(program, loaded.machine)
    forecast, wire = forecast_of(decoded, loaded), loaded.target.wire()
    talk = wire.conversation(
        tuple(wire.packets(program, loaded.machine, forecast)), loaded.machine, Manner()
    )
    talked(talk, Wired(twin, paced=True), latest_s=100.0)
    assert talk.state is State.FINISHED, talk.why
    times = twin.slides.trace.time_s
    assert times[-1] - times[0] < 1.02 * forecast.seconds.sum()
