"""Senders and virtual machines under whatever may happen, in any order, on a virtual clock: faults
of the line, pauses, stops, a pulled plug."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar

import numpy as np
import pytest
from hypothesis import Phase
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)

from camtool.arrays import Floats
from camtool.errors import MachineError, OptionError
from camtool.sending.drive import counts_of
from camtool.sending.faults import Faults, WiredTwin
from camtool.sending.journal import JournalState
from camtool.sending.prepare import consignment, forecast_of, rest_of, tool_at_of
from camtool.target.registry import LoadedTarget, load_target
from camtool.target.twin import Twin
from camtool.target.wire import Conversation, Forecast, Manner, Packet, ToolAt, WireState
from camtool.toolpath.moves import Toolpath
from tests.feeding import motion
from tests.sending.talking import Talking
from tests.strategies import examples

PROGRAMS = {
    "grbl": b"G21 G90\nG0 Z5\nM3 S1000\nG0 X1 Y1\n"
    + b"".join(b"G1 X%d.125 Y%d.375 F400\n" % (k % 9, k % 7) for k in range(40))
    + b"G4 P0.3\nG2 X4.125 Y5.375 I1 F300\nG0 Z5\nM5\nM30\n",
    "pic-mmh": b"G54;G90;G00Z00010.00;G00X00003.00Y00002.00;G01Z-00002.00F08;"
    b"G01X00006.00Y00002.00F08;G02X00009.00Y00005.00I00006.00J00005.00F08;"
    b"G01X00003.00Y00002.00F08;G04P01;G01X00001.00Y00002.00F08;G00Z00010.00;M30;",
    "i8751": b"\x13"
    + bytes.fromhex("01 05 02 05 00 00 03 03 00 28 00 00")
    + (b"".join(b"\1\3\0%c\2\4\0%c\0\0\3\5\0\1" % (9 * k, 5 + k) for k in (1, 2, 12, 20)) + b"E")
    + 3 * (bytes.fromhex("01 04 00 07 02 05 00 00 03 05 00 00") * 5 + b"E")
    + b"T",
    "valcnc": b"G00X0Y0Z0.625\nG00X0.1Y0.1Z0.625\nG01X0.1Y0.1Z-0.125\n"
    + b"".join(b"G01X%d.5Y0.%dZ-0.125\n" % (k % 5, k % 7) for k in range(12))
    + b"G02X2.5Y1.4Z-0.125I1.0J0.0\nG00X2.5Y1.4Z0.625\n",
}
"""A program of each machine: short, with more blocks than its buffers hold."""

SETTINGS = {
    "i8751": (*(f"axes.{axis}.coded_step_mm=0.0125" for axis in "xyz"), "feed.default_mm_min=78"),
    "valcnc": ("link.answer=ok",),
}
CHOICES = {"valcnc": ["answer=ok"]}
END = {"valcnc": b"\n"}
"""What machine files leave out, what is chosen of what is open, and what ends a block."""


@pytest.mark.parametrize("name", PROGRAMS)
def test_the_forecast_of_the_judged_run_is_that_of_a_simulation(name: str) -> None:
    target = load_target(name, settings=SETTINGS.get(name, ()))
    one = consignment(PROGRAMS[name], target, source=name)
    decoded = one.run.decoded
    assert decoded is not None
    again = forecast_of(decoded, target)
    assert one.forecast.decoded is decoded
    for column in ("seconds", "compensation_s", "outputs", "steps", "reversals", "end_mm"):
        judged, simulated = getattr(one.forecast, column), getattr(again, column)
        np.testing.assert_allclose(judged, simulated, rtol=1e-12, err_msg=column)
    assert one.forecast.seconds.sum() > 0.0


BOUND = 3.0
"""A program ends within so many times its simulated time, and what the machine may be silent."""


@dataclass(frozen=True, eq=False)
class Part:
    """A program, or its rest: what is sent, and what the simulation says of it."""

    packets: tuple[Packet, ...]
    forecast: Forecast
    blocks: list[bytes]
    """As the controller is to have them."""

    @property
    def seconds(self) -> float:
        return sum(packet.seconds for packet in self.packets)


@cache
def loaded(name: str) -> LoadedTarget:
    return load_target(name, settings=SETTINGS.get(name, ()))


@cache
def part(name: str, first: int = 0) -> Part:
    """The program of a machine from a block on."""
    target, data = loaded(name), PROGRAMS[name]
    decoded = target.target.read(data, target.machine)
    if first:
        data = rest_of(decoded, target, first).data
        decoded = target.target.read(data, target.machine)
    forecast = forecast_of(decoded, target)
    wire: Any = target.target.wire()
    packets = tuple(wire.packets(data, target.machine, forecast))
    end = END.get(name, b"")
    blocks = [packet.data.strip() + end for packet in packets if packet.block >= 0]
    listed = target.target.listing(data, target.machine)
    if listed.binary:  # several blocks a packet; the key in front and the end are none
        blocks = [bytes.fromhex(line).lstrip(b"\x13") for line in listed.blocks[:-1]]
    return Part(packets, forecast, blocks)


def outputs_until(twin: Twin, block: int) -> int:
    """Count the outputs that the slides have made for the blocks up to this one."""
    of = twin.slides.trace.block
    return int(np.count_nonzero((of >= 0) & (of <= block)))


def ends_of(decoded: Toolpath, low: int = 0) -> Floats:
    """(K, 3) mm: where the moves from a row on end, if they are longer than nothing."""
    path = decoded.part(low, decoded.executed_rows)
    moved = path.is_motion & ((path.starts != path.end).any(axis=1) | path.is_arc)
    return path.end[moved]


class Sending(RuleBasedStateMachine):
    """One program on its way to one virtual machine."""

    name: ClassVar[str]

    @initialize(seed=st.integers(0, 2**16), single=st.sampled_from([False, False, False, True]))
    def opened(self, seed: int, single: bool) -> None:
        target = loaded(self.name)
        self.part = part(self.name)
        self.twin: Any = target.twin(CHOICES.get(self.name, []))
        self.line = WiredTwin(self.twin, seed=seed)
        wire: Any = target.target.wire()
        talk = wire.conversation(self.part.packets, target.machine, Manner(single=single))
        self.both = Talking(talk, self.line)
        self.talk = talk
        self.true = True  # whether all bytes to the machine have arrived as they were
        self.still: int | None = None  # the outputs when a halt was said
        self.asked_s: float | None = None  # when a stop was asked for

    # What happens.

    @rule(seconds=st.sampled_from([0.01, 0.1, 0.3, 1.0, 4.0, 20.0]))
    def time_passes(self, seconds: float) -> None:
        end = self.both.now + seconds
        self.both.until(end)
        if self.talk.is_over and not self.line.unplugged(end):
            self.line.read(end)  # nobody speaks any more, and the machine goes on as it is
        self.both.now = max(self.both.now, end)

    @rule(
        to_machine=st.sampled_from([False, False, False, True]),
        kind=st.sampled_from(["drop", "double", "garble", "late"]),
        often=st.sampled_from([0.002, 0.02, 0.2, 1.0]),
        late_s=st.sampled_from([0.2, 2.0, 8.0]),
        seconds=st.sampled_from([0.02, 0.2, 2.0]),
    )
    def the_line_is_bad(
        self, to_machine: bool, kind: str, often: float, late_s: float, seconds: float
    ) -> None:
        """For a while."""
        line = self.line.there if to_machine else self.line.back
        before = line.faults
        line.faults = Faults(**{kind: often}, late_s=late_s)
        self.true = self.true and not to_machine
        self.time_passes(seconds)
        if before.unplug_s is None:
            line.faults = before

    @precondition(lambda self: not self.talk.is_over)
    @rule()
    def pause(self) -> None:
        self.talk.pause(self.both.now)
        self.both.act()

    @precondition(lambda self: not self.talk.is_over)
    @rule()
    def resume(self) -> None:
        self.still = None
        self.talk.resume(self.both.now)
        self.both.act()

    @precondition(lambda self: not self.talk.is_over)
    @rule(step=st.booleans())
    def single(self, step: bool) -> None:
        self.talk.single = step

    @precondition(lambda self: not self.talk.is_over)
    @rule()
    def stop(self) -> None:
        self.talk.stop(self.both.now)
        self.both.act()
        if self.asked_s is None:
            self.asked_s = self.both.now

    @precondition(lambda self: not self.talk.is_over and not self.line.unplugged(self.both.now))
    @rule(likely=st.sampled_from([False, False, True]))
    def the_plug_is_pulled(self, likely: bool) -> None:
        if likely:
            gone = Faults(unplug_s=self.both.now)
            self.line.there.faults = self.line.back.faults = gone

    # What must hold, whatever happens.

    @invariant()
    def all_is_well(self) -> None:
        self.no_block_is_skipped_or_doubled()
        self.the_counts_are_in_order()
        self.what_is_done_is_done()
        self.nothing_moves_behind_a_halt()
        self.a_stop_is_quick()

    def no_block_is_skipped_or_doubled(self) -> None:
        if self.true:
            assert self.twin.decoded == self.part.blocks[: len(self.twin.decoded)]

    def the_counts_are_in_order(self) -> None:
        talk = self.talk
        assert 0 <= talk.done <= talk.acknowledged <= talk.sent <= len(self.part.packets)

    def what_is_done_is_done(self) -> None:
        if self.true:
            block = self.talk.block
            wanted = int(self.part.forecast.outputs[: block + 1].sum())
            assert outputs_until(self.twin, block) == wanted

    def nothing_moves_behind_a_halt(self) -> None:
        halted = self.talk.state in (WireState.STOPPED, WireState.PAUSED)
        halted = halted or (
            self.talk.state is WireState.FAILED and not _unknown(self.talk.why) and self.true
        )
        if not halted:
            self.still = None
            return
        assert not self.twin.is_moving, (self.talk.state, self.talk.why)
        count = len(self.twin.slides.trace)
        assert self.still in (None, count)
        self.still = count

    def a_stop_is_quick(self) -> None:
        """As long as a block, and what the machine may be silent."""
        if self.asked_s is not None and not self.talk.is_over:
            longest = max(packet.seconds for packet in self.part.packets)
            assert self.both.now - self.asked_s <= longest + 3.0 * self.talk.manner.patience_s

    def teardown(self) -> None:
        """It comes to an end; whatever is missing is completed by another machine."""
        if not hasattr(self, "both"):
            return
        patience_s = self.talk.manner.patience_s

        def going_on(talk: Any, now: float) -> None:
            if talk.state in (WireState.PAUSED, WireState.WAITING):
                talk.resume(now)

        self.talk.single = False
        self.both.until(self.both.now + BOUND * self.part.seconds + 10.0 * patience_s, going_on)
        assert self.talk.is_over, (self.talk.state, self.talk.why)
        self.all_is_well()
        if self.talk.state is WireState.FINISHED:
            assert self.talk.done == len(self.part.packets)
            assert not self.twin.is_moving
            if self.true:
                assert self.twin.decoded == self.part.blocks
        else:
            self._completed(self.talk.block + 1)

    def _completed(self, first: int) -> None:
        """The rest of the program, on a machine that stands at part zero again."""
        decoded = part(self.name).forecast.decoded
        rows = np.flatnonzero(decoded.block >= first)
        target = loaded(self.name)
        if not len(rows) or not len(ends_of(decoded, int(rows[0]))):
            return  # nothing moves any more
        rest = part(self.name, first)
        twin: Any = target.twin(CHOICES.get(self.name, []))
        wire: Any = target.target.wire()
        talk = wire.conversation(rest.packets, target.machine, Manner())
        both = Talking(talk, WiredTwin(twin), coarse=True)
        both.until(BOUND * rest.seconds + 60.0)
        assert talk.state is WireState.FINISHED, talk.why
        assert twin.decoded == rest.blocks
        again, wanted = ends_of(rest.forecast.decoded), ends_of(decoded, int(rows[0]))
        unit = [target.target.unit_mm(target.machine, axis) for axis in target.machine.axes]
        for end in wanted[::-1]:  # arcs may have become lines
            while (np.abs(again[-1] - end) > unit).any():
                again = again[:-1]


def _unknown(why: str) -> bool:
    """True if a failure states that it is unknown whether the machine stands still."""
    return "switch it off" in why or "plug" in why or "nothing answers" in why


@pytest.mark.parametrize("name", sorted(PROGRAMS))
def test_any_order(name: str) -> None:
    machine = type(f"Sending to {name}", (Sending,), {"name": name})
    run_state_machine_as_test(  # type: ignore[no-untyped-call]
        machine,
        settings=examples(
            20,
            stateful_step_count=20,
            phases=(Phase.explicit, Phase.generate),  # to shrink a failure takes minutes
            report_multiple_bugs=False,
        ),
    )


# Stopped at any time, and gone on with where it stands.

ARC = b"G02X00009.00Y00005.00I00006.00J00005.00F08;"
"""It may end beside its end, where the rest of a program does not begin."""
STAYS: dict[str, ToolAt] = {"grbl": "", "pic-mmh": "zero", "i8751": "journal", "valcnc": "zero"}
"""What the user says of a machine that nobody has touched since, where it can go on; or that the
tool was brought to part zero."""


def stopped_and_gone_on(name: str, seed: int) -> str:
    """Run one case, assert all that must hold, and return its outcome."""
    chance, target = np.random.default_rng(seed), loaded(name)
    program = PROGRAMS[name].replace(ARC, b"G01X00009.00Y00005.00F08;")
    one = consignment(program, target, source=name)
    opening = {"i8751": ["opening=reset"], "grbl": ["opening=nothing"]}.get(name, [])
    choices = [*CHOICES.get(name, []), *opening]
    twin: Any = target.twin(choices)
    stop_s = float(chance.uniform(0.0, one.seconds))

    def stopping(talk: Conversation, now: float) -> None:
        if now > stop_s and (seed % 2 or talk.state is WireState.PAUSED):
            talk.stop(now)
        elif now > stop_s:
            talk.pause(now)

    talk = one.wire.conversation(one.packets, target.machine, Manner())
    Talking(talk, WiredTwin(twin), coarse=name != "pic-mmh").until(1e5, stopping)
    if talk.state is WireState.FINISHED:
        return "finished"
    counts, tool = counts_of(talk, one.block_of), one.place_of(talk)
    left = JournalState(
        one.sha256, "", name, counts["block"] + 1, False, counts["last"], tool, talk.is_still
    )
    step = np.array([axis.coded_step_mm for axis in target.machine.axes])
    if left.is_still and tool is not None:
        assert (np.abs(twin.slides.commanded_mm - tool) <= 0.51 * step + 1e-3).all()
    said = STAYS[name] if left.is_still else "zero"
    if said == "zero":
        twin = target.twin(choices)
    tool_at, asked = tool_at_of(one.wire, left, said, name)
    try:
        second = consignment(
            program, target, source=name, first=left.block, state=left, tool_at=tool_at
        )
    except OptionError as refused:
        if "nothing moves" not in str(refused):
            raise
        return "done"
    assert not asked
    before = len(twin.slides.trace)
    standing = second.standing if one.wire.place == "told" else None
    again = one.wire.conversation(second.packets, target.machine, Manner(standing=standing))
    Talking(again, WiredTwin(twin), coarse=True, now=twin.now).until(2e5)
    assert again.state is WireState.FINISHED, (again.why, left, said)
    trace = motion(program, target)
    of = target.target.read(program, target.machine).block[trace.block]
    whole = trace.commanded[int(np.searchsorted(of, left.block)) :]
    made = twin.slides.trace.commanded[before:]
    assert len(made) >= len(whole)
    np.testing.assert_allclose(made[len(made) - len(whole) :], whole, atol=step.max() * 1.01)
    return "went on"


@pytest.mark.parametrize("name", sorted(STAYS))
def test_a_stopped_program_goes_on_where_it_stands(name: str) -> None:
    happened = {stopped_and_gone_on(name, seed) for seed in range(8)}
    assert "went on" in happened


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(STAYS))
def test_a_thousand_stopped_programs_go_on(name: str) -> None:
    for seed in range(100, 1100):
        stopped_and_gone_on(name, seed)


@pytest.mark.parametrize("name", sorted(STAYS))
def test_where_a_machine_stands_that_does_not_say_is_asked(name: str) -> None:
    """And refused where the answer would mean nothing."""
    wire: Any = loaded(name).target.wire()
    left = JournalState("", "", name, 3, False, 5, (1.0, 2.0, 3.0), True)
    lost = JournalState("", "", name, 3, False, 5, (1.0, 2.0, 3.0), False)
    new = JournalState("", "", name, 0, False, -1, None, True)
    tool_at, asked = tool_at_of(wire, left, "", name)
    assert tool_at == STAYS[name]
    assert tool_at_of(wire, new, "", name)[1] == ""
    if name == "grbl":  # it says where it is, and is compared
        assert asked == ""
        assert tool_at_of(wire, lost, "", name) == ("", "")
        assert tool_at_of(wire, lost, "known", name) == ("known", "")
    else:
        assert "X1.000 Y2.000 Z3.000" in asked
        with pytest.raises(MachineError, match="--tool-at"):
            tool_at_of(wire, left, "known", name)
    with pytest.raises((OptionError, MachineError), match="part zero"):
        tool_at_of(wire, lost, "journal", name)
    assert tool_at_of(wire, lost, "zero", name) == ("zero", "")
    router: Any = loaded("matlab-router").target.wire()
    assert tool_at_of(router, lost, "", "matlab-router") == ("", "")
