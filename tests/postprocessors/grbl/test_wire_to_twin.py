"""grbl's wire and its virtual controller, which share no code: they meet over bytes."""

from __future__ import annotations

import shutil
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from camtool.records import replace
from camtool.sending.faults import Faults, WiredTwin
from camtool.sending.prepare import forecast_of
from camtool.target.registry import load_target
from camtool.target.wire import Conversation, Manner, Packet, ResumePoint, WireState
from tests.feeding import logo, made, same_motion
from tests.oracles.grbl_firmware import FirmwareLine, Switch, built, factory, source
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
    talked(conversation(logo("grbl")), WiredTwin(twin), latest_s=1000.0)
    return tuple(twin.decoded)


def test_the_logo_arrives_and_moves_as_verify_says() -> None:
    twin, loaded = made("grbl")
    program = logo("grbl")
    talk = conversation(program)
    talked(talk, WiredTwin(twin), latest_s=1000.0)
    assert talk.state is WireState.FINISHED, talk.why
    same_motion(twin, program, loaded)


@pytest.mark.parametrize("fault", ["drop=0.0005", "double=0.0005", "garble=0.0005", "unplug=20s"])
def test_faults_never_skip_or_double_a_block(fault: str) -> None:
    twin, _ = made("grbl")
    program = logo("grbl")
    talk = conversation(program)
    talked(talk, WiredTwin(twin, faults_back=Faults.of(fault), seed=1), latest_s=1000.0)
    wanted = sent_without_faults()
    assert twin.decoded == list(wanted[: len(twin.decoded)])
    assert talk.state in (WireState.FINISHED, WireState.FAILED)
    if talk.state is WireState.FAILED and "unplug" not in fault:
        assert not twin.is_moving


def test_a_stop_leaves_nothing_that_moves() -> None:
    twin, _ = made("grbl")
    talk = conversation(logo("grbl"))

    def wish(talk: Conversation, now: float) -> None:
        if now > 30.0:
            talk.stop(now)

    talked(talk, WiredTwin(twin), wish, latest_s=100.0)
    assert talk.state is WireState.STOPPED, talk.why
    assert not twin.is_moving


def test_dwells_are_no_missing_answers_and_missing_ones_are_noticed() -> None:
    program = b"G21 G90\nG1 X1 F500\nG4 P5\nG1 X2\nG4 P3\n"
    twin, _ = made("grbl")
    talk = conversation(program)
    talked(talk, WiredTwin(twin), latest_s=100.0)
    assert talk.state is WireState.FINISHED, talk.why
    twin, _ = made("grbl")
    line, talk = WiredTwin(twin), conversation(program)

    def wish(talk: Conversation, now: float) -> None:
        line.back.faults = Faults(drop=1.0 if talk.acknowledged == 2 and now < 6.5 else 0.0)

    talked(talk, line, wish, latest_s=100.0)
    assert talk.state is WireState.FAILED


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
    talked(talk, WiredTwin(twin, paced=True), latest_s=100.0)
    assert talk.state is WireState.FINISHED, talk.why
    times = twin.slides.trace.time_s
    assert times[-1] - times[0] < 1.02 * forecast.seconds.sum()


# The firmware itself instead of the twin (GRBL_SOURCE names its sources).

SQUARE = b"G21G90\nG0Z5\nG1X3F500\nG1Y2\nG0Z6\n"
LEFT = ResumePoint((1.5, -2.0, -1.0), True, np.zeros((0, 3)), "journal")
CLOSED = [Switch("X", 0, 5)]
"""The limit switch of X is closed until it has gone 5 steps."""
BESIDE = Manner(reach_mm=((0.0, 0.0, 0.0), (3.0, 2.0, 6.0)))


@pytest.fixture(scope="module")
def firmware(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if source() is None or shutil.which("gcc") is None:
        pytest.skip("GRBL_SOURCE names no sources of grbl, or there is no gcc")
    return built(tmp_path_factory.mktemp("grbl"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("before", "switches", "manner", "program", "why", "steps"),
    [
        ([], [], Manner(), SQUARE, "", (750, 500, 1500)),
        (["$N0=G54"], [], Manner(), SQUARE, "", (750, 500, 1500)),
        (["$N0=G20"], [], Manner(), SQUARE, "", (750, 500, 1500)),
        (["$N0=G20"], [], Manner(), b"G90\nG0Z5\n", "leaves G20", None),
        (["$22=1", "\x18"], [], Manner(unlock=True), SQUARE, "", (750, 500, 1500)),
        (["$21=1"], CLOSED, Manner(), SQUARE, "'Check Limits'; it reports closed", None),
        # It is told where it stands, and goes from there: 3 − 1.5, 2 + 2 and 6 + 1 mm.
        ([], [], Manner(standing=LEFT), SQUARE, "", (375, 1000, 1750)),
        ([], [], Manner(standing=replace(LEFT, tool_at="")), SQUARE, "but the program was", None),
        (
            ["G10L20P1X1.5Y-2Z-1"],
            [],
            Manner(standing=replace(LEFT, tool_at="")),
            SQUARE,
            "",
            (375, 1000, 1750),
        ),
        (["$22=1", "$20=1", "$X"], [], BESIDE, SQUARE, "X would go to 3.000", None),
        (["$22=1", "$20=1", "$X", "G10L20P1X3Y5Z9"], [], BESIDE, SQUARE, "", (0, -750, -750)),
    ],
)
def test_conversations_with_the_firmware(
    firmware: Path,
    tmp_path: Path,
    before: list[str],
    switches: list[Switch],
    manner: Manner,
    program: bytes,
    why: str,
    steps: tuple[int, int, int] | None,
) -> None:
    loaded = load_target("grbl", settings=["spindle.max_rpm=1000"])
    wire: Any = loaded.target.wire()
    decoded = loaded.target.read(program, loaded.machine)
    made = tuple(wire.packets(program, loaded.machine, forecast_of(decoded, loaded)))
    talk = wire.conversation(made, loaded.machine, manner)
    line: Any = FirmwareLine(firmware, factory(firmware, tmp_path), tmp_path, switches, before)
    talked(talk, line, latest_s=100.0)
    assert talk.state is (WireState.FAILED if why else WireState.FINISHED), talk.why
    assert why in talk.why
    went = line.played.steps[-1].tolist() if len(line.played.steps) else None
    assert went == (None if steps is None else list(steps))
