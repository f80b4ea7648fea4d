"""A virtual controller: a machine at the other end of a wire, without input and output of its own.

A `Twin` is a value with a clock that its caller moves. Bytes come in and go out with the time at
which they do; nothing waits, opens ports or reads a clock, so that thousands of runs can be tested
in memory and `camtool twin` is a thin host around it.

    out = twin.connect(0.0)
    out += twin.receive(b"G0X1\\n", 0.1)
    while (at := twin.next_s()) is not None:
        out += twin.advance(at)

Time is in seconds of the machine and never goes back. What the machine executed stands in
`decoded`, what its slides did in `slides.trace`, both comparable with what its target reads and
simulates; `is_moving` says whether anything moves now."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from typing import Any, ClassVar, Final

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints
from camtool.machine.model import Machine
from camtool.records import replace
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import ALL, Chunk, Effects, Options

COMMANDED: Final = Options(effects=Effects(False, False, False, False, False))
"""Options with which a model returns what the controller commands; the mechanics are those of
`Slides`, which outlive a block."""


class TwinTrace(Struct, frozen=True, eq=False):
    """Movements of the slides, K outputs in order: `time_s` (K,), the index (K,) in `Twin.decoded`
    of the block that asked for it (−1: a command), the position (K, 3) mm that the controller
    commanded and that of the slides (K, 3) mm, both in the work frame of when the power came
    on."""

    time_s: Floats
    block: Ints
    commanded: Floats
    slide: Floats

    def __len__(self) -> int:
        return len(self.time_s)


class Travel(Struct, frozen=True, eq=False):
    """Outputs to come, K positions (K, 3), mm, in order: `seconds` (K,), ascending, the time from
    the begin of the travel to each; `added_s` (K,), the time that one step of compensation before
    it would take; `total_s`, the time with the wait after the last; `left_at` (3,): the position
    that the controller then believes in, if that is not the last one."""

    commanded: Floats
    seconds: Floats
    added_s: Floats
    total_s: float
    left_at: Floats | None = None

    def __len__(self) -> int:
        return len(self.seconds)

    def shifted(self, by_mm: Floats) -> Travel:
        """Return the travel shifted by `by_mm` (3,)."""
        left_at = None if self.left_at is None else self.left_at + by_mm
        return replace(self, commanded=self.commanded + by_mm, left_at=left_at)


def travel_of(chunks: Iterable[Chunk], *, by_passes: bool = False) -> Travel:
    """Return the travel of a motion that a model made with `COMMANDED`. The outputs of a row are
    spread evenly over its time. A compensation step takes as long as an output, or (`by_passes`)
    as a pass of the interpolator."""
    commanded, seconds, added, begin = [np.empty((0, 3))], [np.empty(0)], [np.empty(0)], 0.0
    for chunk in chunks:
        ledger = chunk.ledger
        ends = begin + np.cumsum(ledger.duration_s)
        rows = np.searchsorted(ledger.row, chunk.row)
        first = np.searchsorted(chunk.row, ledger.row)
        count = np.bincount(rows, minlength=len(ledger.row))
        share = (np.arange(len(chunk.row)) - first[rows] + 1) / count[rows]
        passes = np.maximum(ledger.iterations if by_passes else count, 1)
        commanded.append(chunk.commanded)
        seconds.append(ends[rows] - ledger.duration_s[rows] * (1.0 - share))
        added.append((ledger.duration_s / passes)[rows])
        begin = float(ends[-1]) if len(ends) else begin
    return Travel(np.concatenate(commanded), np.concatenate(seconds), np.concatenate(added), begin)


class Slides:
    """The slides of a machine: the travel they are to make, and the movements they have made."""

    def __init__(self, machine: Machine[Any, Any]) -> None:
        self.commanded_mm: Floats = np.zeros(3)
        """(3,) the position that the controller believes in."""
        self.ends_s: float | None = None
        """Time at which the travel under way ends; None if nothing is under way."""
        self._mechanics = Mechanics(machine, self.commanded_mm, ALL)
        self._step_mm = np.array([axis.coded_step_mm for axis in machine.axes])
        self._travel = Travel(np.empty((0, 3)), np.empty(0), np.empty(0), 0.0)
        self._times: Floats = np.empty(0)
        self._slide: Floats = np.empty((0, 3))
        self._before = self._mechanics.states.copy()
        self._added: Ints = np.empty((0, 3), dtype=np.int64)
        self.done = 0
        """Count of outputs of the last travel that were made."""
        self._block = -1
        self._pieces: list[TwinTrace] = []

    def begin(self, travel: Travel, now: float, block: int) -> None:
        """Begin a travel that the block with this index asked for; a travel under way is
        abandoned. Compensation steps at reversals delay the outputs after them."""
        self.stop(now)
        self._before = self._mechanics.states.copy()
        count = len(travel)
        slide, reversals = self._mechanics.follow(travel.commanded, np.arange(count + 1))
        steps = reversals @ self._mechanics.compensation_steps
        delays = np.cumsum(steps * travel.added_s)
        self._travel, self._slide = travel, slide
        self._times = now + travel.seconds + delays
        self._block, self.done = block, 0
        self._added = reversals * self._mechanics.compensation_steps
        self.ends_s = now + travel.total_s + (float(delays[-1]) if count else 0.0)

    def next_s(self) -> float | None:
        """Return the time of the next output, or of the end; None if nothing is under way."""
        if self.ends_s is None:
            return None
        due = self._times[self.done : self.done + 1]
        return float(due[0]) if len(due) else self.ends_s

    def advance(self, now: float) -> tuple[Ints, Ints]:
        """Make the outputs that are due by `now`. Return the steps (K, 3) of the axes in these
        outputs, and the compensation steps (K, 3) before each."""
        low = self.done
        high = int(np.searchsorted(self._times, now, side="right"))
        high = max(high, low) if self.ends_s is not None else low
        before = self.commanded_mm
        outputs = self._travel.commanded[low:high]
        if high > low:
            self.done, self.commanded_mm = high, outputs[-1]
            owner = np.full(high - low, self._block, dtype=np.int64)
            self._pieces.append(
                TwinTrace(self._times[low:high], owner, outputs, self._slide[low:high])
            )
        if self.ends_s is not None and now >= self.ends_s:
            self.ends_s = None
            if self._travel.left_at is not None:
                self.set_position(self._travel.left_at)
        travel = np.diff(outputs, axis=0, prepend=before[None, :]) / self._step_mm
        return np.rint(travel).astype(np.int64), self._added[low:high]

    def stop(self, now: float) -> None:
        """Stop where the slides are now; the rest of the travel is dropped."""
        self.advance(now)
        if self.ends_s is not None:
            self._mechanics.states[:] = self._before
            outputs = self._travel.commanded[: self.done]
            self._mechanics.follow(outputs, np.array([0, len(outputs)]))
        self.ends_s = None

    def set_position(self, position_mm: Floats) -> None:
        """Set the position (3,) mm that the controller believes in; nothing moves."""
        self.commanded_mm = np.array(position_mm, dtype=np.float64)
        self._mechanics.place(self.commanded_mm)

    def compensate(self, axis: int, added_mm: float) -> None:
        """Set the length that the controller adds at each reversal of an axis from now on, in
        whole steps."""
        self._mechanics.compensate(axis, round(added_mm / self._step_mm[axis]))

    @property
    def trace(self) -> TwinTrace:
        """All movements, or those since `drain`."""
        if len(self._pieces) != 1:
            self._pieces = [_join_traces(self._pieces)]
        return self._pieces[0]

    def drain(self) -> TwinTrace:
        """Return the movements since the last call, and drop them."""
        trace, self._pieces = self.trace, []
        return trace


def _join_traces(pieces: Sequence[TwinTrace]) -> TwinTrace:
    empty = TwinTrace(np.empty(0), np.empty(0, dtype=np.int64), np.empty((0, 3)), np.empty((0, 3)))
    pieces = [empty, *pieces]
    return TwinTrace(
        np.concatenate([piece.time_s for piece in pieces]),
        np.concatenate([piece.block for piece in pieces]),
        np.concatenate([piece.commanded for piece in pieces]),
        np.concatenate([piece.slide for piece in pieces]),
    )


class Twin(ABC):
    """A virtual controller. A target overrides `_receive_byte`, which handles a byte, and, if the
    controller does more by itself than move, `wake_s` (when) and `_wake` (what)."""

    settings: ClassVar[type[Struct]]
    """The record of the choices that the sources of its wire leave open, with our defaults."""
    wire: ClassVar[str]
    """The settings of the line as terminal programs need them, such as "115200 8N1"."""
    byte_s: ClassVar[float] = 0.0

    def __init__(self, slides: Slides) -> None:
        self.slides = slides
        self.decoded: list[bytes] = []
        """The blocks of programs that the controller has accepted, in order, as it has them."""
        self.commands: list[bytes] = []
        """Other commands that it has accepted: jogging, settings."""
        self.now = 0.0
        """The time up to which it has run, s."""
        self._out = bytearray()

    def connect(self, now: float) -> bytes:
        """Open the line; return what the controller sends then."""
        return self.advance(now)

    def receive(self, data: bytes, now: float) -> bytes:
        """Receive bytes at the time `now`; return what the controller has sent up to then, its
        immediate answer included."""
        self._run(now)
        for octet in data:
            self._receive_byte(octet)
            self._run(now)
        return self._take_output()

    def advance(self, now: float) -> bytes:
        """Advance the clock to `now`; return what the controller sends meanwhile."""
        self._run(now)
        return self._take_output()

    def next_s(self) -> float | None:
        """Return the time at which it may send something if nothing is received; None: never. A
        controller that reports its outputs sends something at each; for others `wake_s` is
        enough."""
        times = [time_s for time_s in (self.wake_s(), self.slides.next_s()) if time_s is not None]
        return min(times, default=None)

    @property
    def is_moving(self) -> bool:
        """True while slides move or a dwell runs."""
        return self.slides.ends_s is not None

    @abstractmethod
    def _receive_byte(self, octet: int) -> None:
        """Handle a byte that comes in at `self.now`."""

    def wake_s(self) -> float | None:
        """Return the time of its next own action, besides the outputs of a travel; None: never."""
        return self.slides.ends_s

    def _wake(self) -> None:  # noqa: B027 - not all do more than move
        """Carry out the action that is due at `self.now`, by `wake_s`."""

    def _make_outputs(self) -> None:
        """Make the outputs that are due; a twin that reports its outputs sends them here."""
        self.slides.advance(self.now)

    def _run(self, now: float) -> None:
        while (time_s := self.wake_s()) is not None and time_s <= now:
            self.now = max(time_s, self.now)
            self._make_outputs()
            self._wake()
        self.now = max(now, self.now)
        self._make_outputs()

    def _take_output(self) -> bytes:
        output = bytes(self._out)
        self._out.clear()
        return output
