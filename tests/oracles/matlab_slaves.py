"""The Matlab router's slaves, literally: an encoder that counts one by one, the interrupt and the
main loop of the listing in its own words, and a motor that is followed from count to count.

Lnnnn are lines of the thesis.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

TURN = 1024


def table(top: int) -> list[int]:
    return [round(top * math.sqrt(q / 1000)) for q in range(1001)]


def int32(value: int) -> int:
    return (value + 2**31) % 2**32 - 2**31


@dataclass
class Motor:
    """τ dω/dt = A (u − friction · sign ω) − ω, in ticks and counts."""

    gain: float
    tau: float
    friction: float = 0.0
    place: float = 0.0
    speed: float = 0.0

    def aim(self, drive: float) -> float | None:
        """The speed that it tends to; None when it stands and stays."""
        sign = math.copysign(1.0, self.speed)
        if self.speed == 0.0:
            if abs(drive) <= self.friction:
                return None
            sign = math.copysign(1.0, drive)
        return self.gain * (drive - sign * self.friction)

    def after(self, aim: float, time: float) -> tuple[float, float]:
        fade = 1.0 - math.exp(-time / self.tau)
        moved = aim * time + (self.speed - aim) * self.tau * fade
        return self.place + moved, self.speed + (aim - self.speed) * fade

    def when_at(self, aim: float, place: float, most: float) -> float:
        """The moment at which it is at `place`, by halving."""
        low, high, forward = 0.0, most, place > self.place
        while high - low > 1e-13:
            middle = 0.5 * (low + high)
            if (self.after(aim, middle)[0] >= place) == forward:
                high = middle
            else:
                low = middle
        return high


@dataclass
class Slave:
    """One axis. `count` is the true one; the program sees it modulo 1024, and interrupts."""

    motor: Motor
    kid: int = 28
    kpd: int = 159
    chunk: int = 5120
    phase: int = 0
    top: int = 480
    count: int = 0
    up: int = 0
    k: int = 0
    u: int = 0
    posAnt: int = 0
    velAc: int = 0
    inte: int = 0
    Ref: int = 0
    done: float | None = 0.0
    task: Iterator[None] | None = None
    tabla: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.tabla = table(self.top)
        self.posAnt = self.conv

    @property
    def conv(self) -> int:
        return (self.count + self.phase) % TURN

    def posi(self) -> int:
        """L5589-5729."""
        return (self.conv if self.up else 1023 - self.conv) + 1023 * self.k

    def interrupt(self) -> None:
        """L5496-5584, every 5 ms."""
        posAc = self.conv
        difference = (posAc - self.posAnt if self.up else self.posAnt - posAc) % 65536
        if difference <= 1023:
            self.velAc = difference
        self.posAnt = posAc
        Ref1 = self.Ref
        if Ref1 <= 0:
            Ref1 = -Ref1
        error_inte = Ref1 - self.velAc
        self.inte = int32(self.inte + error_inte * self.kid)
        PROP = self.velAc * self.kpd
        u = int32(self.u + self.inte - PROP)
        u = int(u / 1000)
        if u >= 100:
            u = 100
        elif u < 0:
            u = 0
        if self.Ref < 0:
            u = -u
        if self.Ref == 0:
            u = 0
        self.u = u

    def movimiento(self, distancia: int, velocidad: int) -> Iterator[None]:
        """MOVIMIENTO_X, L5589-5729: one round of its loops for each time that it is asked."""
        factor = distancia // 2
        sign = 1 if velocidad >= 0 else -1
        for _ in range((factor - 1) % 65536):
            Posi = self.k = 0
            while Posi <= self.chunk:
                Posi = self.posi()
                self.Ref = velocidad
                yield
        Posi = self.k = 0
        while Posi < self.chunk - 1000:
            Posi = self.posi()
            self.Ref = velocidad
            yield
        while 1 < Posi < self.chunk:
            Posi = self.posi()
            self.Ref = sign * self.tabla[min(max(self.chunk - Posi, 0), 1000)]
            yield
        self.k = self.velAc = self.Ref = self.u = 0

    def poll(self, moment: float) -> None:
        """The main loop is quick: it has gone round until it waits for the next count."""
        for _ in range(4):
            if self.task is None:
                return
            if next(self.task, "over") == "over":
                self.task, self.done = None, moment

    def tick(self, number: int, start: float | None, order: tuple[int, int]) -> None:
        """Run a tick of 5 ms from `number` on; the order comes at `start`, if there is one."""
        self.interrupt()
        at = 0.0
        while at < 1.0:
            until = 1.0
            if start is not None:
                until = min(1.0, start - number)
                if until <= at:
                    self.task, start = self.movimiento(*order), None
                    self.poll(number + at)
                    continue
            aim = self.motor.aim(self.u)
            if aim is None:
                at = until
                continue
            at = self.until_next_count(number, at, until, aim)
        if self.u == 0 and abs(self.motor.speed) * self.motor.tau < 1e-6:
            self.motor.speed = 0.0

    def until_next_count(self, number: int, at: float, until: float, aim: float) -> float:
        motor, time, turns = self.motor, until - at, False
        forward = motor.speed > 0.0 or (motor.speed == 0.0 and aim > 0.0)
        if motor.speed * aim < 0.0:
            back = motor.tau * math.log(1.0 - motor.speed / aim)
            if back <= time:
                time, turns = back, True
        edge = self.count + 1 if forward else self.count
        new = self.count + 1 if forward else self.count - 1
        end = motor.after(aim, time)[0]
        crosses = end >= edge if forward else end < edge
        if not crosses:
            motor.place, motor.speed = motor.after(aim, time)
            if turns:
                motor.speed = 0.0
            return at + time if turns else until
        time = motor.when_at(aim, edge, time) if motor.place != edge else 0.0
        motor.place, motor.speed = float(edge), motor.after(aim, time)[1]
        if self.conv == (1023 if forward else 0):
            self.k += 1
        self.count, self.up = new, int(forward)
        self.poll(number + at + time)
        return at + time


@dataclass
class TextSlave(Slave):
    """The chapters' program: equations 4.15-4.18 and 4.27; distances are counts."""

    target: int = 0
    before: int = 0
    last: int = 0
    drive: float = 0.0

    def interrupt(self) -> None:
        omega = self.count - self.before
        self.before = self.count
        if self.task is not None:
            q = self.target - self.count
            if abs(q) >= 1000:
                ref = math.copysign(abs(self.Ref), q)
            else:
                ref = math.copysign(min(abs(self.Ref), self.top * math.sqrt(abs(q) / 1000)), q)
            added = -self.kpd / 1000 * (omega - self.last) + self.kid / 1000 * (ref - omega)
            self.drive = min(max(self.drive + added, -100.0), 100.0)
        self.last = omega
        self.u = self.drive  # type: ignore[assignment]

    def movimiento(self, distancia: int, velocidad: int) -> Iterator[None]:
        self.target += distancia if velocidad >= 0 else -distancia
        self.Ref = velocidad
        below = self.count <= self.target
        while self.count < self.target if below else self.count > self.target:
            yield
        self.Ref, self.drive = 0, 0.0
        self.u = 0


def run(
    slaves: list[Slave],
    orders: list[list[tuple[int, int]]],
    pauses: list[float],
    lag: float,
    most: int = 10_000,
) -> tuple[list[list[int]], list[float]]:
    """Counts at each tick until the last pause is over, and when each line began and the last one
    was over. `orders`: for each line (distance, speed) of each axis; behind a negative pause the
    next line begins on a tick."""
    counts: list[list[int]] = []
    begins = [0.0]
    tick = 0
    for order, pause in zip(orders, pauses, strict=True):
        begin = begins[-1]
        starts: list[float | None] = []
        for index, (slave, (distance, _)) in enumerate(zip(slaves, order, strict=True)):
            slave.done = None if distance else begin
            starts.append(begin + (lag if index == 1 else 0.0) if distance else None)
        while tick < begin or any(slave.done is None for slave in slaves):
            assert tick - begin < most
            for index, slave in enumerate(slaves):
                start = starts[index]
                comes = start is not None and start < tick + 1
                slave.tick(tick, start if comes else None, order[index])
                if comes:
                    starts[index] = None
            tick += 1
            counts.append([slave.count for slave in slaves])
        done = max(slave.done for slave in slaves if slave.done is not None)
        after = max(done + abs(pause), float(tick))
        begins.append(float(math.ceil(after)) if pause < 0.0 else after)
    while tick < begins[-1]:
        for slave in slaves:
            slave.tick(tick, None, (0, 0))
        tick += 1
        counts.append([slave.count for slave in slaves])
    return counts, begins
