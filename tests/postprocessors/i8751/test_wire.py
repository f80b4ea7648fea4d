"""i8751's wire: programs sent to the virtual controller byte by byte, with and without faults."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from camtool.errors import MachineError
from camtool.sending.faults import Faults, WiredTwin
from camtool.sending.prepare import Consignment, consignment
from camtool.target.wire import Conversation, Manner, WireState
from tests.feeding import same_motion
from tests.postprocessors.i8751.machines import loaded
from tests.sending.talking import Talking, talked

RECORDS = bytes.fromhex(
    "01 03 00 64 02 04 00 05 00 01 03 04 00 2C 00 01 01 05 02 03 00 07 00 00 03 05 00 00"
)
SHORT = b"\x13" + (2 * RECORDS + RECORDS[:16] + b"\x45") * 4 + RECORDS + b"\x45\x54"


@cache
def consigned(data: bytes, *settings: str) -> Consignment:
    return consignment(data, loaded(*settings), source="logo.bin")


def conversation(data: bytes, *settings: str, manner: Manner | None = None) -> Conversation:
    one = consigned(data, *settings)
    return one.wire.conversation(one.packets, loaded(*settings).machine, manner or Manner())


@pytest.mark.parametrize(
    ("settings", "choices"),
    [
        ([], ["line_end=none"]),
        (["key=each-packet"], ["key=each-packet", "line_end=cr"]),
        (["motor_reply='8'"], ["motor_reply=8", "line_end=lf"]),
        (["dwell_reply=M"], ["dwell_reply=M"]),
        (["dwell_reply=none"], ["dwell_reply=none"]),
        (["dwell_reply=unstated"], ["dwell_reply=none"]),
        (["dwell_reply=unstated"], ["dwell_reply=B M"]),
        (["dwell_mark=30H"], []),
        (["high_byte='255'", "first_pulse=repeats"], []),
        (["format=listing"], []),
        (["format=hex"], []),
    ],
)
def test_each_reading_of_what_is_open(settings: list[str], choices: list[str]) -> None:
    target = loaded(*settings)
    decoded = loaded().target.read(SHORT, loaded().machine)
    data = target.target.write(decoded, target.machine).data
    twin, talk = target.twin(choices), conversation(data, *settings)
    talked(talk, WiredTwin(twin, paced=True), latest_s=3000.0)
    assert talk.state is WireState.FINISHED, talk.why
    same_motion(twin, data, target)


def test_an_end_of_a_packet_that_is_stored_too() -> None:
    target = loaded().with_settings(["link.packet_end=M F"])
    for choice, state in (("M F", WireState.FINISHED), ("F", WireState.FAILED)):
        one = consignment(SHORT, target, source="a.bin")
        talk = one.wire.conversation(one.packets, target.machine, Manner())
        talked(talk, WiredTwin(target.twin([f"packet_end={choice}"])), latest_s=3000.0)
        assert talk.state is state, talk.why


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("fault", ["drop=0.003", "double=0.003", "garble=0.003", "unplug=60s"])
@pytest.mark.parametrize("way", ["faults_there", "faults_back"])
def test_faults_never_skip_or_double_a_record(fault: str, seed: int, way: str) -> None:
    twin, faults = loaded().twin(), Faults.of(fault)
    talk = conversation(SHORT, manner=Manner(paced=True))
    line = WiredTwin(twin, **{way: faults}, seed=seed, paced=True)  # type: ignore[arg-type]
    now = talked(talk, line, latest_s=1000.0)
    wanted = consigned(SHORT).packets
    assert talk.state in (WireState.FINISHED, WireState.FAILED)
    assert now < 1000.0
    if fault.startswith("garble") and way == "faults_there":
        return  # replies do not repeat what came: nobody sees a wrong number of steps
    taken = b"".join(twin.decoded)
    whole = b"".join(packet.data for packet in wanted)[1:]
    assert whole.startswith(taken)
    assert talk.block < len(twin.decoded) + 1
    assert len(twin.decoded) <= talk.block + 1 + 5
    assert (talk.state is WireState.FINISHED) == (taken + b"\x54" == whole and talk.block == 22)
    if talk.state is WireState.FAILED and "reset" in talk.why:
        assert not twin.is_moving


def test_an_access_that_is_denied_is_asked_for_again() -> None:
    talk = conversation(SHORT)
    talk.begin(0.0)
    assert len(talk.actions()) == 1
    for _ in range(4):
        talk.receive(b"OT", 1.0)
        talk.receive(b"RO\r\n", 1.0)
        assert [action.data for action in talk.actions()] == [b"\x13"]  # type: ignore[union-attr]
    talk.receive(b"OTRO", 1.0)
    assert talk.state is WireState.FAILED


@pytest.mark.parametrize("at_s", [0.01, 0.2, 1.0, 20.0, 35.0])
def test_a_stop_never_begins_what_is_not_complete(at_s: float) -> None:
    twin, talk = loaded().twin(), conversation(SHORT, manner=Manner(paced=True))

    def wish(talk: Conversation, now: float) -> None:
        if now >= at_s:
            talk.stop(now)

    talked(talk, WiredTwin(twin, paced=True), wish, latest_s=200.0)
    assert talk.state is WireState.STOPPED, talk.why
    assert not twin.is_moving
    assert len(twin.decoded) == talk.block + 1


@pytest.mark.parametrize("single", [False, True])
def test_pauses_are_between_packets(single: bool) -> None:
    target = loaded()
    twin, talk = target.twin(), conversation(SHORT, manner=Manner(single=single))
    rests = list[int]()

    def wish(talk: Conversation, now: float) -> None:
        if talk.state is WireState.SENDING and not single:
            talk.pause(now)
        elif talk.state is WireState.PAUSED:
            assert not twin.is_moving
            rests.append(talk.done)
            talk.resume(now)

    talked(talk, WiredTwin(twin), wish, latest_s=2000.0)
    assert talk.state is WireState.FINISHED, talk.why
    assert rests[-5:] == [1, 2, 3, 4, 5]
    same_motion(twin, SHORT, target)


def test_a_jog_is_a_program_of_its_steps() -> None:
    target = loaded()
    wire, twin = target.target.wire(), target.twin()
    values = {"x": 10.0, "z": -1.0, "feed": 60.0}
    talk = wire.command("jog", target.machine, values, Manner())  # type: ignore[union-attr]
    talked(talk, WiredTwin(twin, paced=True), latest_s=1000.0)
    assert talk.state is WireState.FINISHED, talk.why
    assert twin.slides.commanded_mm == pytest.approx([10.0, 0.0, -1.0])
    with pytest.raises(MachineError, match="no command to zero"):
        wire.command("zero", target.machine, {}, Manner())  # type: ignore[union-attr]
    with pytest.raises(MachineError, match="search of its origin"):
        wire.command("home", target.machine, {}, Manner())  # type: ignore[union-attr]
    with pytest.raises(MachineError, match="homes at a reset alone"):
        conversation(SHORT, manner=Manner(home=True))


HOMES = loaded().with_settings(["link.homing=start"])


def homing() -> Conversation:
    wire: Any = HOMES.target.wire()
    talk = wire.command("home", HOMES.machine, {}, Manner(paced=True))
    assert isinstance(talk, Conversation)
    return talk


def agreed(talk: Conversation, now: float) -> None:
    if talk.state is WireState.WAITING:
        assert "has it just been reset" in talk.why
        talk.resume(now)


def test_homing_ends_at_the_optos_one_motor_after_the_other() -> None:
    twin: Any = HOMES.twin(["homing=start", "origin_mm=-1.5"])
    talk = homing()
    talked(talk, WiredTwin(twin, paced=True), agreed, latest_s=1000.0)
    assert talk.state is WireState.FINISHED, talk.why
    assert twin.slides.commanded_mm == pytest.approx([-1.5] * 3, abs=0.0125)
    assert twin.now > 3 * 1.5 / 0.0125 / 8.0
    steps = np.diff(twin.slides.trace.commanded, axis=0, prepend=0.0)
    assert ((steps != 0.0).sum(axis=1) == 1).all()
    assert (np.diff(np.abs(steps).argmax(axis=1)) >= 0).all()
    # A program that follows begins there, and finds the controller waiting for its key.
    one = consigned(SHORT)
    rest = one.wire.conversation(one.packets, HOMES.machine, Manner())
    talked_on = Talking(rest, WiredTwin(twin), now=twin.now)
    talked_on.until(twin.now + 3000.0)
    assert rest.state is WireState.FINISHED, rest.why


def test_homing_that_is_stopped_says_that_nothing_stops_it() -> None:
    twin: Any = HOMES.twin(["homing=start"])
    both = Talking(homing(), WiredTwin(twin, paced=True))
    both.until(5.0, agreed)
    both.talk.stop(both.now)
    both.until(1000.0)
    assert both.talk.state is WireState.STOPPED
    assert "goes on until it has found it: its switch stops it" in both.talk.why
    assert not both.talk.is_still
    assert twin.is_moving


def test_a_controller_that_never_answers_is_not_asked_for_ever() -> None:
    talk = homing()
    line = WiredTwin(HOMES.twin([]), Faults(drop=1.0), Faults(drop=1.0))
    now = talked(talk, line, agreed, latest_s=5000.0)
    assert talk.state is WireState.FAILED
    assert "no reply" in talk.why
    assert now > 1000.0


def test_what_a_person_types_and_reads() -> None:
    terminal = loaded().target.wire().terminal(loaded().machine)  # type: ignore[union-attr]
    assert terminal.encode("13") == b"\x13"
    assert terminal.encode("01 03 00 64") == b"\x01\x03\x00\x64"
    assert terminal.encode("\\x13x") == b"\x13x"
    assert terminal.decode(b"LIS") == []
    assert terminal.decode(b"TO\r\n") == ["LISTO    the key was right: records may come"]
    assert terminal.decode(b"BMMM") == ["B M M M    a datum was stored"]
    assert terminal.decode(b"\r\n") == []
    assert terminal.decode(b"OTRO") == ["OTRO    this is not the key"]


def test_one_that_says_nothing_at_first_may_have_another_rate() -> None:
    talk = conversation(SHORT)
    talk.begin(0.0)
    talk.tick(talk.next_s)
    assert talk.state is WireState.FAILED
    assert "is --baud its rate?" in talk.why
