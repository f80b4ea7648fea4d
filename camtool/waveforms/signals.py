"""The signals of a program on its machine: levels of a stretch, dumps, tables and pictures.

Everything is made anew by each call, in chunks: memory does not grow with the program."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints
from camtool.errors import MachineError, OptionError, OutputError
from camtool.machine.model import PathController
from camtool.pictures.draw import rendered
from camtool.pictures.options import AS_USUAL, PictureOptions
from camtool.simulation.pulses import Pulses
from camtool.target.registry import LoadedTarget
from camtool.target.signals import Board, Coils, NoSignals, SignalModel
from camtool.toolpath.moves import Toolpath
from camtool.waveforms.levels import LineLevels, levels
from camtool.waveforms.scope import MAX_MOMENTS, Stretch, scope_svg
from camtool.waveforms.table import table
from camtool.waveforms.vcd import dump

PICTURE_MOMENTS = 120
"""Number of changes that a picture without a span shows."""

MAX_S = 1e9
"""Latest begin and greatest length of a stretch, s: 30 years."""

KINDS = (".vcd", ".csv", ".svg", ".png")


class PulseCounts(Struct, frozen=True, eq=False):
    """Counts of a whole run: `steps` (M,) of the motors, `added` (M,) steps at reversals;
    `shortest_s` (M,), the least time between two pulses, infinite for fewer than two; `seconds`,
    the time of the program."""

    steps: Ints
    added: Ints
    shortest_s: Floats
    seconds: float


@dataclass(frozen=True, eq=False)
class Signals:
    """The signals of `toolpath`, as the target's `read` decodes it; `name` stands in pictures."""

    target: LoadedTarget
    toolpath: Toolpath
    model: SignalModel
    name: str = ""

    @classmethod
    def of(cls, data: bytes, target: LoadedTarget, name: str = "") -> Signals:
        """Return the signals of a program; MachineError for a machine without signals,
        ProgramError as `Target.read`."""
        model = target.target.signals()
        machine = target.machine.target.name
        if isinstance(model, NoSignals):
            raise MachineError(f"{machine} has no signals: {model.why}", mend=model.mend)
        if isinstance(target.machine.controller, PathController):
            raise MachineError(
                "signals need the model of the real controller",
                where="table [controller], key model",
                mend=f'leave model = "path" out: its own is {machine}',
            )
        return cls(target, target.target.read(data, target.machine), model, name)

    @property
    def board(self) -> Board:
        """The lines of the controller."""
        return self.model.board(self.target.machine)

    @property
    def blocks(self) -> Ints:
        """(N,) the block of each row of the toolpath, from 1."""
        return np.asarray(np.append(self.toolpath.block, -1)[: max(len(self.toolpath), 1)] + 1)

    def pulses(self) -> Iterator[Pulses]:
        """Yield the pulses of all motors."""
        return self.model.pulses(self.toolpath, self.target.machine)

    def count(self) -> PulseCounts:
        """Run the whole program and return its counts."""
        count = len(self.board.motors)
        states = np.array(
            [each.states_per_step if isinstance(each, Coils) else 1 for each in self.board.motors]
        )
        steps, added = np.zeros((2, count), dtype=np.int64)
        last_s, shortest_s, seconds = np.full(count, -np.inf), np.full(count, np.inf), 0.0
        for pulses in self.pulses():
            size = np.abs(pulses.moves)
            steps += size[~pulses.is_added].sum(axis=0)
            added += size[pulses.is_added].sum(axis=0)
            seconds = pulses.until_s
            for motor in range(count):
                at_s = pulses.at_s[size[:, motor] > 0]
                if len(at_s):
                    gaps_s = np.diff(at_s, prepend=last_s[motor])
                    shortest_s[motor] = min(shortest_s[motor], gaps_s.min())
                    last_s[motor] = at_s[-1]
        return PulseCounts(steps // states, added // states, shortest_s, seconds)

    def levels(self, from_s: float = 0.0, span_s: float | None = None) -> Iterator[LineLevels]:
        """Yield the levels of all lines from `from_s` on, for `span_s` or up to the end of the
        program; the first moment is the state at `from_s`. OptionError for a stretch outside of
        the program, raised when that is known."""
        first, last = self._ticks(from_s, span_s)
        seconds, state, is_open = 0.0, None, first == 0

        def watched() -> Iterator[Pulses]:
            nonlocal seconds
            for pulses in self.pulses():
                seconds = pulses.until_s
                yield pulses

        for part in levels(self.board, watched()):
            low = int(np.searchsorted(part.tick, first, side="right")) if first else 0
            high = len(part.tick)
            if last is not None:
                high = int(np.searchsorted(part.tick, last, side="right"))
            if not is_open:
                if low:
                    before = part.part(low - 1, low)
                    state = LineLevels(np.array([first]), before.ports, before.places, before.row)
                if low == len(part.tick) or state is None:
                    continue
                yield state
                is_open = True
            if low < high:
                yield part.part(low, high)
            if high < len(part.tick):
                return
        if state is not None and not is_open:
            self._check_end(from_s, seconds)
            yield state

    def content(
        self,
        name: str,
        from_s: float = 0.0,
        span_s: float | None = None,
        motors: Sequence[str] | None = None,
        options: PictureOptions = AS_USUAL,
    ) -> Iterator[bytes]:
        """Yield the bytes of a file with this name: .vcd, .csv, .svg or .png; `motors` and
        `options` apply to pictures. OutputError for another extension; OptionError for a stretch
        outside the program, an unknown motor, and more changes than a table or a picture can have.
        """
        suffix = PurePath(name).suffix.lower()
        if suffix not in KINDS:
            raise OutputError("is no file of signals", file=name, mend=f"use {', '.join(KINDS)}")
        if suffix in (".svg", ".png"):
            stretch = self._stretch(from_s, span_s)
            yield rendered(
                lambda sized: scope_svg(self.name, stretch, motors, sized), name, options
            )
            return
        moments = self.levels(from_s, span_s)
        if suffix == ".csv":
            yield from table(self.board, moments, self.blocks)
        else:
            end = None if span_s is None else self._ticks(from_s, span_s)[1]
            yield from dump(self.board, moments, self.blocks, self.name, end)

    def save(self, file: str | Path, from_s: float = 0.0, span_s: float | None = None) -> None:
        """Write the file, by its extension, whole or not at all; raises as `content` does."""
        place = Path(file)
        part = place.with_name(f"{place.name}.part")
        try:
            with part.open("wb") as stream:
                stream.writelines(self.content(str(file), from_s, span_s))
            part.replace(place)
        finally:
            part.unlink(missing_ok=True)

    def _stretch(self, from_s: float, span_s: float | None) -> Stretch:
        """Return the stretch for a picture; without a span it ends after the first changes."""
        parts, count = [], 0
        for part in self.levels(from_s, span_s):
            parts.append(part)
            count += len(part.tick)
            if count > (MAX_MOMENTS if span_s is not None else PICTURE_MOMENTS):
                break
        moments = LineLevels(
            np.concatenate([part.tick for part in parts]),
            np.concatenate([part.ports for part in parts]),
            np.concatenate([part.places for part in parts]),
            np.concatenate([part.row for part in parts]),
        )
        first, last = self._ticks(from_s, span_s)
        if last is None:
            moments = moments.part(0, PICTURE_MOMENTS)
            last = max(int(moments.tick[-1]), first + 1)
        return Stretch(self.board, moments, first, last)

    def _ticks(self, from_s: float, span_s: float | None) -> tuple[int, int | None]:
        """Return the first and the last tick of a stretch (None: the end of the program);
        OptionError for negative or infinite times."""
        if not 0.0 <= from_s <= MAX_S:
            raise OptionError(
                f"a stretch from {from_s:g} s on is none", mend=f"give 0 to {MAX_S:g}"
            )
        if span_s is not None and not 0.0 < span_s <= MAX_S:
            raise OptionError(
                f"a stretch of {span_s:g} s is none",
                mend=f"give more than 0, and at most {MAX_S:g}",
            )
        tick_s = self.board.tick_s
        first = round(from_s / tick_s)
        return first, None if span_s is None else first + max(round(span_s / tick_s), 1)

    def _check_end(self, from_s: float, seconds: float) -> None:
        if from_s > seconds:
            raise OptionError(
                f"the program ends after {seconds:.6g} s; from {from_s:g} s on there is nothing",
                where="--from",
                mend=f"give less than {seconds:.6g}",
            )
