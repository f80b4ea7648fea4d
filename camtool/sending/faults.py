"""A line between two ends, with faults on demand: bytes that are lost, doubled, garbled or late,
and a plug that is pulled.

Faults belong to the line and not to the machine. They are drawn byte by byte from a seed, so that
a run with faults can be repeated, however its bytes were divided into pieces.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from random import Random
from typing import Final

from camtool.errors import OptionError
from camtool.target.twin import Twin
from camtool.units import parse_time

OFTEN: Final = 0.01
"""How probable a fault is that is asked for without a number."""


@dataclass(frozen=True)
class Faults:
    """What may happen on one direction of a line: each byte is lost, comes twice, or has one of
    its bits inverted, with these probabilities; what is sent at once comes `late_s` late with the
    probability `late`; behind `unplug_s` nothing passes."""

    drop: float = 0.0
    double: float = 0.0
    garble: float = 0.0
    late: float = 0.0
    late_s: float = 0.0
    unplug_s: float | None = None

    @classmethod
    def of(cls, text: str) -> Faults:
        """`drop=0.01,double,garble,late=2s,unplug=30s`; OptionError for other text.

        >>> Faults.of("drop=0.2,late=2s,unplug=1min")
        Faults(drop=0.2, double=0.0, garble=0.0, late=0.01, late_s=2.0, unplug_s=60.0)
        """
        found: dict[str, float] = {}
        for part in filter(None, (part.strip() for part in text.split(","))):
            name, has_value, value = part.partition("=")
            if name in ("drop", "double", "garble"):
                found[name] = _probability(part, value) if has_value else OFTEN
            elif name == "late" and has_value:
                time, _, often = value.partition(":")
                found["late_s"] = parse_time(time)
                found["late"] = _probability(part, often) if often else OFTEN
            elif name == "unplug" and has_value:
                found["unplug_s"] = parse_time(value)
            else:
                known = "drop, double, garble, late=TIME, unplug=TIME"
                raise OptionError(f"{part!r} is no fault", mend=f"faults are {known}")
        if min(found.get("late_s", 0.0), found.get("unplug_s", 0.0)) < 0.0:
            raise OptionError(f"{text!r} has a time below 0")
        return cls(**found)

    @property
    def none(self) -> bool:
        """Whether the line is without faults."""
        return self == Faults()

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


class Line:
    """One direction of a line. A byte takes `byte_s` seconds; none overtakes another. `faults` are
    those of what is sent from now on."""

    def __init__(self, faults: Faults, random: Random, byte_s: float = 0.0) -> None:
        self.faults, self._random, self._byte_s = faults, random, byte_s
        self._under_way: list[tuple[float, int]] = []
        self._free_s = 0.0  # when the last byte will have come

    def put(self, data: bytes, now: float) -> None:
        """Send bytes; those behind the pulling of the plug are lost."""
        faults, random = self.faults, self._random
        if not data:
            return
        late = faults.late_s if faults.late and random.random() < faults.late else 0.0
        for octet in data:
            drop, double, garble = random.random(), random.random(), random.random()
            bit = random.randrange(8)
            self._free_s = max(self._free_s, now + late) + self._byte_s
            if self._unplugged(self._free_s) or drop < faults.drop:
                continue
            come = octet ^ (1 << bit) if garble < faults.garble else octet
            copies = 2 if double < faults.double else 1
            self._under_way += [(self._free_s, come)] * copies

    def take(self, now: float) -> bytes:
        """What has come by now."""
        count = 0
        while count < len(self._under_way) and self._under_way[count][0] <= now:
            count += 1
        come, self._under_way = self._under_way[:count], self._under_way[count:]
        return bytes(octet for _, octet in come)

    def next_s(self) -> float | None:
        """When the next byte comes; None: none is under way."""
        return self._under_way[0][0] if self._under_way else None

    def _unplugged(self, now: float) -> bool:
        return self.faults.unplug_s is not None and now >= self.faults.unplug_s


class Wired:
    """A twin at the end of a line: `write` to it and `read` what it says, at given times.

    `there` are the faults of what goes to the machine, `back` of what comes from it; `paced`:
    bytes take the time that the machine's rate gives them.
    """

    def __init__(
        self,
        twin: Twin,
        there: Faults = Faults(),
        back: Faults = Faults(),
        *,
        seed: int = 0,
        paced: bool = False,
    ) -> None:
        byte_s = twin.byte_s if paced else 0.0
        self.twin = twin
        self.there = Line(there, Random(f"{seed} there"), byte_s)
        self.back = Line(back, Random(f"{seed} back"), byte_s)

    def connect(self, now: float) -> None:
        """Open the line."""
        self._run(now)
        self.back.put(self.twin.connected(now), now)

    def write(self, data: bytes, now: float) -> None:
        """Send bytes to the machine."""
        self._run(now)
        self.there.put(data, now)
        self._run(now)

    def read(self, now: float) -> bytes:
        """What has come from the machine by now, since the last call."""
        self._run(now)
        return self.back.take(now)

    def next_s(self) -> float | None:
        """When something happens next by itself; None: never."""
        times = self.there.next_s(), self.back.next_s(), self.twin.next_s()
        return min((at for at in times if at is not None), default=None)

    def turn_s(self) -> float | None:
        """The same, outputs of a travel left aside: so far a clock that keeps to nothing jumps."""
        times = self.there.next_s(), self.back.next_s(), self.twin.turn_s()
        return min((at for at in times if at is not None), default=None)

    def unplugged(self, now: float) -> bool:
        """Whether the plug has been pulled."""
        times = self.there.faults.unplug_s, self.back.faults.unplug_s
        return any(at is not None and now >= at for at in times)

    def _run(self, now: float) -> None:
        while (at := self.there.next_s()) is not None and at <= now:
            self.back.put(self.twin.advance(at), at)
            self.back.put(self.twin.receive(self.there.take(at), at), at)
        self.back.put(self.twin.advance(now), now)
