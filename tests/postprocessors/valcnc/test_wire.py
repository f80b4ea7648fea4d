"""valcnc's wire: nothing answers, so that each block has its simulated time to itself."""

from __future__ import annotations

import pytest
from camtool_postprocessors.valcnc.wire import ValcncWire

from camtool.errors import MachineError
from camtool.sending.prepare import consignment
from camtool.target.registry import load_target
from camtool.target.wire import Conversation, Manner, State, Write
from tests.feeding import logo

LOADED = load_target("valcnc")


def talked(stop_behind: int = 10**9) -> tuple[Conversation, list[tuple[float, bytes]]]:
    """What went out, and when."""
    one = consignment(logo("valcnc"), LOADED, source="logo.ngc")
    talk = one.wire.conversation(one.packets, LOADED.machine, Manner())
    out, now = list[tuple[float, bytes]](), 0.0
    talk.begin(now)
    while not talk.ended or talk.has_actions:
        out += [(now, action.data) for action in talk.actions() if isinstance(action, Write)]
        if len(out) > stop_behind:
            talk.stop(now)
        if not talk.ended:
            now = talk.next_s
            talk.elapsed(now)
    return talk, out


def test_each_block_goes_out_once_when_the_one_before_is_over() -> None:
    talk, out = talked()
    one = consignment(logo("valcnc"), LOADED, source="logo.ngc")
    assert talk.state is State.FINISHED
    assert out[0] == (0.0, b"C\n")
    decoded = LOADED.target.read(b"".join(data for _, data in out[1:]), LOADED.machine)
    whole = LOADED.target.read(logo("valcnc"), LOADED.machine)
    assert (decoded.end == whole.end).all()
    for (at, data), (later, _), packet in zip(out, out[1:], one.packets, strict=False):
        assert later - at > packet.seconds + len(data) / 960.0


def test_a_stop_waits_for_the_block_that_is_cut() -> None:
    talk, out = talked(stop_behind=20)
    assert talk.state is State.STOPPED
    assert talk.done == talk.sent == len(out) == 21


def test_a_block_that_is_too_long_is_refused() -> None:
    long = b"G01 X1.0" + b"0" * 128 + b"\n"
    with pytest.raises(MachineError, match="takes 127"):
        ValcncWire().packets(long, LOADED.machine, None)  # type: ignore[arg-type]
