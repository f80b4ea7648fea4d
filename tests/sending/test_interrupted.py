"""Programs that are interrupted by whatever may happen, and gone on with: nothing stays uncut and
nothing is cut elsewhere, measured on the slides of the virtual machines.

The line loses, doubles, garbles or delays bytes; the plug is pulled; the controller begins anew in
the run; the computer sleeps, with a clock that stands still meanwhile (CLOCK_MONOTONIC of Linux)
or that jumps (others); the sender is killed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from camtool.arrays import Floats, Ints
from camtool.errors import OptionError
from camtool.records import replace
from camtool.sending.drive import counts_of
from camtool.sending.faults import Faults, WiredTwin
from camtool.sending.journal import JournalState
from camtool.sending.prepare import Consignment, consignment, tool_at_of
from camtool.target.registry import LoadedTarget
from camtool.target.twin import Twin
from camtool.target.wire import Conversation, Manner, ToolAt, WireState
from tests.feeding import motion
from tests.sending.talking import Talking
from tests.sending.test_any_order import ARC, CHOICES, PROGRAMS, STAYS, loaded

FILE = "/programs/part.ngc"

LINUXCNC = b"G21 G90 G61\nF400\nG0 Z5\nG0 X2 Y1\nG1 Z-1\n" + b"".join(
    b"G1 X%d Y%d\n" % (3 + k % 7, 1 + k % 5) for k in range(20)
)
PARTS = {
    **{name: data.replace(ARC, b"G01X00009.00Y00005.00F08;") for name, data in PROGRAMS.items()},
    "linuxcnc": LINUXCNC + b"G2 X12 Y9 I1 J3\nG0 Z5\nM2\n",
}
SAYS: dict[str, ToolAt] = {**STAYS, "linuxcnc": ""}

POWER = {"linuxcnc": ("power=on",)}
"""How a controller comes back."""

KINDS = (
    *(f"{kind} on the way back" for kind in ("drop", "double", "garble", "late")),
    "late on the way there",
    "unplugged",
    "begins anew",
    "sleeps, and the clock stands",
    "sleeps, and the clock jumps",
    "killed",
)


class Sleeping(WiredTwin):
    """A line whose machine lives `ahead_s` later than the sender's clock."""

    ahead_s = 0.0

    def write(self, data: bytes, now: float) -> None:
        super().write(data, now + self.ahead_s)

    def read(self, now: float) -> bytes:
        return super().read(now + self.ahead_s)

    def connect(self, now: float) -> None:
        super().connect(now + self.ahead_s)

    def next_s(self) -> float | None:
        time_s = super().next_s()
        return None if time_s is None else time_s - self.ahead_s

    def wake_s(self) -> float | None:
        time_s = super().wake_s()
        return None if time_s is None else time_s - self.ahead_s


class Interrupted:
    """A program on its way to a machine, until it ends or is interrupted."""

    def __init__(self, name: str, kind: str, seed: int) -> None:
        self.name, self.kind = name, kind
        self.chance = np.random.default_rng([seed, len(name), KINDS.index(kind)])
        self.target: LoadedTarget = loaded(name)
        self.one = consignment(PARTS[name], self.target, source=name)
        self.twins: list[tuple[Any, Floats]] = []
        self.line = self.new_machine(np.zeros(3))
        self.begins_anew = False

    def new_machine(self, at: Floats, *choices: str) -> Sleeping:
        """A controller whose power comes on at a place, seen from the first part zero."""
        opening = {"i8751": ["opening=reset"], "grbl": ["opening=nothing"]}.get(self.name, [])
        twin: Any = self.target.twin([*CHOICES.get(self.name, []), *opening, *choices])
        twin.read_file = lambda name: self.data
        self.twins.append((twin, at))
        return Sleeping(twin)

    @property
    def is_unseen(self) -> bool:
        """True if nobody can notice what has happened: valcnc says nothing when it begins anew,
        and takes the next block from where it stands."""
        return self.begins_anew and self.name == "valcnc"

    @property
    def twin(self) -> Twin:
        twin = self.twins[-1][0]
        assert isinstance(twin, Twin)
        return twin

    def conversation(self, one: Consignment, **manner: Any) -> Conversation:
        self.data = one.data
        file = FILE if one.wire.opens_file else ""
        packets = [replace(one.packets[0], ask=""), *one.packets[1:]]
        return one.wire.conversation(packets, self.target.machine, Manner(file=file, **manner))

    def places(self, first: int = 0) -> Floats:
        """(K, 3) mm: the places of the slides, on one machine after the other."""
        traces = [twin.slides.trace.commanded + at for twin, at in self.twins[first:]]
        return np.concatenate(traces)

    def sent(self) -> Conversation:
        """Send the program, with what happens to it at some time."""
        talk = self.conversation(self.one)
        both = Talking(talk, self.line, coarse=self.name != "pic-mmh")
        both.until(float(self.chance.uniform(0.02, 0.95)) * self.one.seconds)
        if not talk.is_over:
            self.happen(both)
        going_on = 5.0 * self.one.seconds + 10.0 * talk.manner.patience_s
        if self.kind != "killed":
            both.until(both.now + going_on)
            assert talk.is_over, (talk.state, talk.why)
        self.line.read(both.now + going_on)  # what it has been told, it does
        assert not self.twin.is_moving
        return talk

    def happen(self, both: Talking) -> None:
        line, kind, chance = self.line, self.kind, self.chance
        word = kind.split()[0]
        if word in ("drop", "double", "garble", "late"):
            often = float(chance.choice([0.01, 0.1, 1.0]))
            faults = Faults(**{word: often}, late_s=float(chance.choice([0.3, 2.0, 9.0])))
            way = line.there if kind.endswith("there") else line.back
            way.faults = faults
            both.until(both.now + float(chance.choice([0.2, 3.0, 100.0])))
            way.faults = Faults()
        elif word == "unplugged":
            line.there.faults = line.back.faults = Faults(unplug_s=both.now)
        elif word == "begins":
            self.begins_anew = True
            twin, at = self.twins[-1]
            twin.slides.stop(both.now)
            stood = at + twin.slides.commanded_mm
            self.line = both.line = self.new_machine(stood, *POWER.get(self.name, ()))
            self.line.connect(both.now)
        elif word == "sleeps,":
            seconds = float(chance.choice([0.5, 5.0, 3600.0]))
            if kind.endswith("jumps"):
                both.now += seconds
            else:
                line.ahead_s += seconds

    def left(self, talk: Conversation) -> JournalState:
        """What the journal says of it."""
        counts, tool = counts_of(talk, self.one.block_of), self.one.place_of(talk)
        return JournalState(
            self.one.sha256,
            "",
            self.name,
            counts["block"] + 1,
            talk.state is WireState.FINISHED,
            counts["last"],
            tool,
            talk.is_still,
        )

    def gone_on(self, left: JournalState) -> Floats | None:
        """Go on with it as `--resume` does; the places of the slides in that, None where nothing
        moves any more. The tool is brought to part zero where the machine's place is not sure."""
        is_known = left.is_still and not self.begins_anew
        answer = SAYS[self.name] if is_known else "zero"
        if answer == "zero" or self.begins_anew:
            self.line = self.new_machine(np.zeros(3))
        if answer == "zero" and self.name == "linuxcnc":
            answer = "known"
        tool_at, asked = tool_at_of(self.one.wire, left, answer, self.name)
        assert not asked
        try:
            second = consignment(
                PARTS[self.name],
                self.target,
                source=self.name,
                first=left.block,
                state=left,
                tool_at=tool_at,
            )
        except OptionError as refused:
            if "nothing moves" not in str(refused):
                raise
            return None
        twin, at = self.twins[-1]
        before = len(twin.slides.trace)
        standing = second.standing if second.wire.place == "told" else None
        again = self.conversation(second, standing=standing)
        Talking(again, WiredTwin(twin), coarse=True, now=twin.now).until(2e5 + twin.now)
        assert again.state is WireState.FINISHED, (again.why, left, answer)
        return np.asarray(twin.slides.trace.commanded[before:] + at)


class Places:
    """Places (K, 3) mm and all within about a step of the lines between them, for look-ups."""

    def __init__(self, path: Floats, step: float) -> None:
        self._step = step
        lengths = np.abs(np.diff(path, axis=0)).max(axis=1, initial=0.0)
        counts = np.maximum(np.ceil(lengths / step), 1).astype(np.int64)
        index = np.repeat(np.arange(len(counts)), counts)
        first = np.cumsum(counts) - counts
        share = (np.arange(len(index)) - first[index]) / counts[index]
        between = path[index] + share[:, None] * (path[index + 1] - path[index])
        cells = np.unique(self._cells(np.concatenate([between, path[-1:]])), axis=0)
        offsets = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3), axis=-1).reshape(-1, 3)
        self._known = np.unique((cells[:, None] + offsets).reshape(-1, 3) @ CELL_KEYS)

    def _cells(self, places: Floats) -> Ints:
        return np.rint(places / self._step).astype(np.int64)

    def has(self, places: Floats) -> bool:
        """True if all of these are among them, or next to one."""
        return bool(np.isin(self._cells(places) @ CELL_KEYS, self._known).all())


CELL_KEYS = np.array([1, 1 << 20, 1 << 40])


def interrupted_and_gone_on(name: str, kind: str, seed: int) -> str:
    """Run one case, check what must hold, and return its outcome."""
    it = Interrupted(name, kind, seed)
    talk = it.sent()
    left = it.left(talk)
    step = max(axis.coded_step_mm for axis in it.target.machine.axes)
    step = max(step, 0.02 if name == "linuxcnc" else 0.0)  # its rest is written with G64 P0.01
    near = 1.01 * step + 1e-6
    trace = motion(PARTS[name], it.target)
    of = it.target.target.read(PARTS[name], it.target.machine).block[trace.block]
    whole = trace.commanded
    path = Places(np.concatenate([np.zeros((1, 3)), whole]), step)
    begin = int(np.searchsorted(of, left.block))
    first = it.places()
    if it.is_unseen:
        return "unseen"
    assert path.has(first), "it has moved elsewhere"
    done = Places(np.concatenate([np.zeros((1, 3)), first]), step)
    assert done.has(whole[:begin]), "what counts as done is not"
    if talk.state is WireState.FINISHED:
        assert left.finished
        assert done.has(whole)
        return "finished"
    if talk.is_over:
        assert talk.state is WireState.FAILED
        assert talk.why
    if left.is_still and left.tool_mm is not None and not it.begins_anew:
        np.testing.assert_allclose(first[-1] if len(first) else 0.0, left.tool_mm, atol=near)
    second = it.gone_on(left)
    if second is None:
        assert begin == len(whole)
        return "done"
    rest = whole[begin:]
    assert len(second) >= len(rest)
    entry, rest_made = second[: len(second) - len(rest)], second[len(second) - len(rest) :]
    np.testing.assert_allclose(rest_made, rest, atol=near)
    # The way there: it crosses above everything, and goes down where the path is.
    top = 0.0 if whole[:, 2].min() < 0.0 else whole[:, 2].max() - near
    crosses = (np.diff(entry[:, :2], axis=0) != 0.0).any(axis=1)
    assert path.has(entry[1:][crosses & (entry[1:, 2] < top)]), "it has cut on its way"
    return "went on"


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", sorted(PARTS))
def test_nothing_stays_uncut_and_nothing_is_cut_elsewhere(name: str, kind: str) -> None:
    interrupted_and_gone_on(name, kind, 0)


def test_the_cases_do_interrupt() -> None:
    """Otherwise the tests above would show nothing."""
    outcomes = [interrupted_and_gone_on(name, "unplugged", 1) for name in PARTS]
    assert outcomes == ["went on"] * len(PARTS)


@pytest.mark.parametrize(
    ("name", "kind", "seed"),
    [
        # The report in which it stood had lost its place, so that the one before counted.
        ("grbl", "drop on the way back", 0),
        # A digit of the place had come twice.
        ("grbl", "double on the way back", 2),
        # The stop was not confirmed, and yet its place counted as sure.
        ("grbl", "garble on the way back", 4),
    ],
)
def test_a_place_that_came_damaged_is_not_taken_for_sure(name: str, kind: str, seed: int) -> None:
    interrupted_and_gone_on(name, kind, seed)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", sorted(PARTS))
def test_hundreds_of_interruptions(name: str, kind: str) -> None:
    for seed in range(100, 300):
        interrupted_and_gone_on(name, kind, seed)
