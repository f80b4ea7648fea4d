"""A line between two ends with simulated faults: bytes that are lost, doubled, garbled or late,
and a plug that is pulled.

Faults belong to the line, not to the machine. They are drawn byte by byte from a seed, so that a
run with faults can be repeated exactly, however its bytes are divided into pieces."""

from __future__ import annotations

from dataclasses import dataclass, fields
from random import Random
from typing import TYPE_CHECKING, Final

from camtool.errors import OptionError
from camtool.units import parse_time

if TYPE_CHECKING:
    from camtool.target.twin import Twin

DEFAULT_PROBABILITY: Final = 0.01


@dataclass(frozen=True)
class Faults:
    """Faults of one direction of a line. Each byte is lost, doubled, or has one bit inverted, with
    the probabilities `drop`, `double` and `garble`; bytes sent together arrive `late_s` late with
    the probability `late`; after `unplug_s` nothing passes."""

    drop: float = 0.0
    double: float = 0.0
    garble: float = 0.0
    late: float = 0.0
    late_s: float = 0.0
    unplug_s: float | None = None

    @classmethod
    def of(cls, text: str) -> Faults:
        """Parse `drop=0.01,double,garble,late=2s,unplug=30s`; OptionError for other text.

        >>> Faults.of("drop=0.2,late=2s,unplug=1min")
        Faults(drop=0.2, double=0.0, garble=0.0, late=0.01, late_s=2.0, unplug_s=60.0)
        """
        values: dict[str, float] = {}
        for part in filter(None, (part.strip() for part in text.split(","))):
            name, has_value, value = part.partition("=")
            if name in ("drop", "double", "garble"):
                values[name] = _probability(part, value) if has_value else DEFAULT_PROBABILITY
            elif name == "late" and has_value:
                time, _, probability = value.partition(":")
                values["late_s"] = parse_time(time)
                values["late"] = (
                    _probability(part, probability) if probability else DEFAULT_PROBABILITY
                )
            elif name == "unplug" and has_value:
                values["unplug_s"] = parse_time(value)
            else:
                examples = "drop, double, garble, late=TIME, unplug=TIME"
                raise OptionError(f"{part!r} is no fault", mend=f"faults are {examples}")
        if min(values.get("late_s", 0.0), values.get("unplug_s", 0.0)) < 0.0:
            raise OptionError(f"{text!r} has a time below 0")
        return cls(**values)

    def __str__(self) -> str:
        return ", ".join(
            f"{each.name}={value:g}"
            for each in fields(self)
            if (value := getattr(self, each.name)) not in (0.0, None)
        )


def _probability(part: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0.0 <= value <= 1.0:
        raise OptionError(f"{part!r} is no probability", mend="give a number from 0 to 1")
    return value


class FaultyLine:
    """One direction of a line. A byte takes `byte_s` seconds, and none overtakes another. `faults`
    apply to bytes sent from now on."""

    def __init__(self, faults: Faults, random: Random, byte_s: float = 0.0) -> None:
        self.faults, self._random, self._byte_s = faults, random, byte_s
        self._under_way: list[tuple[float, int]] = []
        self._free_s = 0.0  # when the last byte will have come

    def put(self, data: bytes, now: float) -> None:
        """Send bytes; after the plug was pulled they are lost."""
        faults, random = self.faults, self._random
        if not data:
            return
        delay_s = faults.late_s if faults.late and random.random() < faults.late else 0.0
        for octet in data:
            drop, double, garble = random.random(), random.random(), random.random()
            bit_number = random.randrange(8)
            self._free_s = max(self._free_s, now + delay_s) + self._byte_s
            if self._unplugged(self._free_s) or drop < faults.drop:
                continue
            come = octet ^ (1 << bit_number) if garble < faults.garble else octet
            copies = 2 if double < faults.double else 1
            self._under_way += [(self._free_s, come)] * copies

    def take(self, now: float) -> bytes:
        """Return the bytes that have arrived by now."""
        count = 0
        while count < len(self._under_way) and self._under_way[count][0] <= now:
            count += 1
        come, self._under_way = self._under_way[:count], self._under_way[count:]
        return bytes(octet for _, octet in come)

    def next_s(self) -> float | None:
        """Return the time at which the next byte arrives; None if none is on its way."""
        return self._under_way[0][0] if self._under_way else None

    def _unplugged(self, now: float) -> bool:
        return self.faults.unplug_s is not None and now >= self.faults.unplug_s


class WiredTwin:
    """A twin at the end of a line with faults: `write` to it and `read` its answers, at given
    times.

    `there` are the faults towards the machine, `back` those from it; `paced`: bytes take the
    time that follows from the baud rate."""

    def __init__(
        self,
        twin: Twin,
        faults_there: Faults = Faults(),
        faults_back: Faults = Faults(),
        *,
        seed: int = 0,
        paced: bool = False,
    ) -> None:
        byte_s = twin.byte_s if paced else 0.0
        self.twin = twin
        self.there = FaultyLine(faults_there, Random(f"{seed} there"), byte_s)
        self.back = FaultyLine(faults_back, Random(f"{seed} back"), byte_s)

    def connect(self, now: float) -> None:
        """Open the line, which resets some controllers."""
        self._run(now)
        self.back.put(self.twin.connect(now), now)

    def write(self, data: bytes, now: float) -> None:
        """Send bytes to the machine."""
        self._run(now)
        self.there.put(data, now)
        self._run(now)

    def read(self, now: float) -> bytes:
        """Return the bytes that have arrived from the machine since the last call."""
        self._run(now)
        return self.back.take(now)

    def next_s(self) -> float | None:
        """Return the time of the next event (bytes that arrive, an answer of the twin); None if
        there is none."""
        times = self.there.next_s(), self.back.next_s(), self.twin.next_s()
        return min((time_s for time_s in times if time_s is not None), default=None)

    def wake_s(self) -> float | None:
        """Return the time of the next event, not counting outputs during a move; a clock without
        real time jumps to it. None if there is none."""
        times = self.there.next_s(), self.back.next_s(), self.twin.wake_s()
        return min((time_s for time_s in times if time_s is not None), default=None)

    def unplugged(self, now: float) -> bool:
        """Return True if the plug has been pulled."""
        times = self.there.faults.unplug_s, self.back.faults.unplug_s
        return any(time_s is not None and now >= time_s for time_s in times)

    def _run(self, now: float) -> None:
        while (time_s := self.there.next_s()) is not None and time_s <= now:
            self.back.put(self.twin.advance(time_s), time_s)
            self.back.put(self.twin.receive(self.there.take(time_s), time_s), time_s)
        self.back.put(self.twin.advance(now), now)
