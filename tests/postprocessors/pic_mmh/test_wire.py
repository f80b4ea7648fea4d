"""pic-mmh's wire: programs sent to the virtual controller, with and without faults."""

from __future__ import annotations

from functools import cache

import pytest
from camtool_postprocessors.pic_mmh.wire import PicMmhWire

from camtool.errors import MachineError
from camtool.sending.faults import Faults, WiredTwin
from camtool.sending.prepare import forecast_of
from camtool.target.registry import LoadedTarget, load_target
from camtool.target.wire import Conversation, Manner, Packet, WireState
from tests.feeding import logo, made, same_motion
from tests.sending.talking import talked

SHORT = (
    b"G54;G90;G00Z00010.00;G00X00003.00Y00002.00;G01Z-00002.00F08;"
    b"G01X00006.00Y00002.00F08;G02X00009.00Y00005.00I00006.00J00005.00F08;G01X00003.00Y00002.00F08;"
)


@cache
def packets(program: bytes, *settings: str) -> tuple[Packet, ...]:
    _, loaded = made("pic-mmh", settings=settings)
    decoded = loaded.target.read(program, loaded.machine)
    return tuple(PicMmhWire().packets(program, loaded.machine, forecast_of(decoded, loaded)))


def conversation(program: bytes, loaded: LoadedTarget, *settings: str) -> Conversation:
    return PicMmhWire().conversation(packets(program, *settings), loaded.machine, Manner())


def executed(program: bytes) -> list[bytes]:
    return [block + b";" for block in program.replace(b"\n", b"").split(b";")[:-1]]


def test_the_logo_arrives_block_by_block_and_moves_as_verify_says() -> None:
    twin, loaded = made("pic-mmh")
    program = logo("pic-mmh")
    talk = conversation(program, loaded)
    talked(talk, WiredTwin(twin), latest_s=30_000.0, coarse=True)
    assert talk.state is WireState.FINISHED, talk.why
    assert twin.decoded == executed(program)
    assert twin.commands == [b"BX204;", b"BY178;"]
    same_motion(twin, program, loaded)


@pytest.mark.parametrize(
    ("choices", "settings"),
    [
        (["echo=character"], []),
        (["echo=none", "step_byte=none"], ["link.echo=none", "link.step_byte=none"]),
        (["step_byte=letters"], ["link.step_byte=letters"]),
        (["step_byte=none"], ["link.step_byte=none"]),
        (["compensation=reported"], ["link.compensation=reported"]),
    ],
)
def test_each_reading_of_what_is_open(choices: list[str], settings: list[str]) -> None:
    twin, loaded = made("pic-mmh", choices, settings)
    talk = conversation(SHORT, loaded, *settings)
    talked(talk, WiredTwin(twin), latest_s=2000.0)
    assert talk.state is WireState.FINISHED, talk.why
    same_motion(twin, SHORT, loaded)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("fault", ["drop=0.005", "double=0.005", "garble=0.005", "unplug=20s"])
def test_faults_never_skip_or_double_a_block(fault: str, seed: int) -> None:
    twin, loaded = made("pic-mmh")
    talk = conversation(SHORT, loaded)
    line = WiredTwin(twin, faults_back=Faults.of(fault), seed=seed)
    now = talked(talk, line, latest_s=2000.0)
    assert twin.decoded == executed(SHORT)[: len(twin.decoded)]
    assert max(talk.block, -1) < len(twin.decoded)
    assert talk.state in (WireState.FINISHED, WireState.FAILED)
    if talk.state is WireState.FAILED and "unplug" not in fault:
        assert not twin.is_moving
    assert now < 2000.0


@pytest.mark.parametrize("at_s", [0.5, 3.0, 10.0, 25.0])
def test_a_stop_is_at_once_and_nothing_moves_behind_it(at_s: float) -> None:
    twin, loaded = made("pic-mmh")
    talk = conversation(SHORT, loaded)
    stopped = list[float]()

    def wish(talk: Conversation, now: float) -> None:
        if now >= at_s and not stopped:
            stopped.append(now)
            talk.stop(now)

    talked(talk, WiredTwin(twin), wish, latest_s=100.0)
    assert talk.state is WireState.STOPPED, talk.why
    assert not twin.is_moving
    times = twin.slides.trace.time_s
    assert not len(times) or times[-1] <= stopped[0]


def test_pauses_are_between_blocks() -> None:
    twin, loaded = made("pic-mmh")
    talk = conversation(SHORT, loaded)

    def wish(talk: Conversation, now: float) -> None:
        if talk.state is WireState.SENDING and talk.sent % 3 == 0:
            talk.pause(now)
        elif talk.state is WireState.PAUSED:
            assert not twin.is_moving
            talk.resume(now)

    talked(talk, WiredTwin(twin), wish, latest_s=2000.0)
    assert talk.state is WireState.FINISHED, talk.why
    same_motion(twin, SHORT, loaded)


def test_what_the_controller_cannot_take_is_refused() -> None:
    with pytest.raises(MachineError, match="buffer 35"):
        packets(SHORT, "dialect.buffer_chars=35")
    with pytest.raises(MachineError, match="whole µm"):
        packets(SHORT, "axes.x.compensation_mm=0.20004")


@pytest.mark.parametrize("heard", [b"", b"\xff\x80\x00"])
def test_one_that_is_not_understood_at_first_may_have_another_rate(heard: bytes) -> None:
    loaded = load_target("pic-mmh")
    packets = [Packet(b"BX204;"), Packet(b"BY178;")]
    talk = PicMmhWire().conversation(packets, loaded.machine, Manner())
    talk.begin(0.0)
    talk.receive(heard, 0.1)
    while not talk.is_over:
        talk.tick(talk.next_s)
    assert talk.state is WireState.FAILED
    assert "is --baud its rate?" in talk.why


@pytest.mark.parametrize(
    "values", [{"z": 0.0}, {"x": 0.0, "y": 0.0}, {"x": 1.0, "y": 0.0, "z": 0.0}]
)
def test_part_zero_is_that_of_all_axes(values: dict[str, float]) -> None:
    """Q; has no axes (L3504): for one of them alone there is no string."""
    target = load_target("pic-mmh")
    wire = PicMmhWire()
    with pytest.raises(MachineError, match="part zero of all axes"):
        wire.command("zero", target.machine, values, Manner())
    wire.command("zero", target.machine, dict.fromkeys("xyz", 0.0), Manner())
