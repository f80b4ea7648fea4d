"""Protocol of the Matlab router: the numbers of a job, then a wait for its simulated time.

Each number goes out in digits and a carriage return, with a pause behind it (L4294-4360). Nothing
is acknowledged: homing begins on the last number (L4668-4929), and nothing tells when a job is
done, nor stops it. The master takes one job and must be reset for the next. Where it sends back
what it takes, as the library of its compiler does, each number is compared before the next one
goes out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from camtool.arrays import Ints
from camtool.errors import MachineError, PostError
from camtool.target.terminal import Terminal
from camtool.target.wire import LATE_S, Forecast, Manner, Packet, PacketByPacket, Reopen, Wire

from .dialect import (
    FIXED_Y_UNITS,
    MatlabRouterController,
    MatlabRouterLink,
    MatlabRouterMachine,
    dialect_of,
)
from .jobs import HEADER, NUMBERS_PER_LINE, ReadJob
from .read import execute, read_jobs
from .write import JobNumbers, program_of, stream_of

END: Final = b"\r"
"""Behind each number."""

TIME_FACTOR: Final = 1.05

ECHO_FACTOR: Final = 10.0
"""Longest wait for an echo, in multiples of the lateness of the line (0.5 s)."""

HOMES: Final = (
    "the machine goes home on the last number of each job: Z rises first, then X and Y move"
)


class MatlabRouterWire(Wire):
    """The master over USB; the rate of the port means nothing."""

    baud = 9600
    place = "homed"
    ready = (
        "the master has just been reset, and the stock lies as controller.machine_zero_mm says",
        "nothing is acknowledged: camtool waits for the simulated times, and keep a hand at the "
        "switch",
    )
    stopping = (
        "only its switch stops the machine: a job runs to its end; one whose numbers are not "
        "complete yet is never begun, and the master must then be reset"
    )

    def packets(
        self, data: bytes, machine: MatlabRouterMachine, forecast: Forecast
    ) -> Sequence[Packet]:
        """Return one packet for each job."""
        assert isinstance(machine.link, MatlabRouterLink)
        jobs = list(read_jobs(data, machine))
        packets, low = list[Packet](), 0
        streams = _streams(jobs, data, machine)
        for number, (job, stream) in enumerate(zip(jobs, streams, strict=True)):
            count = job.length.shape[1]
            seconds = float(forecast.seconds[low : low + count + 1].sum())
            low += count + 1
            ask = HOMES if not number else ""
            if number and machine.link.reset == "hand":
                ask = f"reset the master for job {number + 1} of {len(jobs)}, which then begins"
            packets.append(Packet(stream, low - 1, seconds, ask=ask))
        return packets

    def conversation(
        self, packets: Sequence[Packet], machine: MatlabRouterMachine, manner: Manner
    ) -> MatlabRouterConversation:
        """Return the conversation that sends these jobs."""
        if manner.home:
            raise MachineError("each job goes home by itself", where="--home", mend="leave it out")
        return MatlabRouterConversation(packets, machine, manner)

    def terminal(self, machine: MatlabRouterMachine) -> Terminal:
        """Return the terminal, to which numbers are typed."""
        return MatlabRouterTerminal()


class MatlabRouterTerminal(Terminal):
    """Typed numbers; nothing but an echo comes back."""

    end = END
    about = (
        "a number a line: lines n, first x and y, all lx, ly, velx, vely; the machine goes home "
        "on the last of 3 + 4n, and nothing stops it but its switch"
    )


def _streams(jobs: Sequence[ReadJob], data: bytes, machine: MatlabRouterMachine) -> list[bytes]:
    """Return the bytes of each job on the line."""
    dialect = dialect_of(machine)
    if dialect.format != "stream":
        return [stream_of([_numbers(job, job.first, 0)], dialect) for job in jobs]
    words, streams = data.split(END), []
    for job in jobs:
        count = len(HEADER) + NUMBERS_PER_LINE * job.length.shape[1]
        streams.append(b"".join(word + END for word in words[:count]))
        words = words[count:]
    return streams


def _numbers(job: ReadJob, first: Ints, line: int) -> JobNumbers:
    """Return the numbers that are sent for the rest of a job: its lines from `line` (counted from
    0) on, beginning at the point `first` (2,) in units."""
    points = np.column_stack([first, first[:, None] + job.steps[:, line:].cumsum(axis=1)])
    x, y = first.tolist()
    lengths, speeds = job.length[:, line:].tolist(), job.speed[:, line:].tolist()
    return JobNumbers(
        job.length.shape[1] - line, (x, y), tuple(points.tolist()), tuple(lengths), tuple(speeds)
    )


def rest_of(data: bytes, machine: MatlabRouterMachine, first: int) -> tuple[bytes, int]:
    """Return the program from block `first` (from 0) on, and how many of its blocks bring the
    machine there: a job has one block for going home, to its first point and down, then one for
    each line."""
    dialect, jobs = dialect_of(machine), list(read_jobs(data, machine))
    begins = np.cumsum([0, *(job.length.shape[1] + 1 for job in jobs)])
    job_index = int(np.searchsorted(begins, first, side="right")) - 1
    line = max(first - int(begins[job_index]) - 1, 0)
    place = execute(jobs[job_index], dialect).points[line]
    if dialect.master_y == "fixed" and line and int(place[1]) != FIXED_Y_UNITS:
        raise PostError(
            "the master begins each job at one Y, so that no job can begin at a line of another",
            mend=f"begin with block {int(begins[job_index]) + 1}, which is the job's first",
        )
    start = place if line else jobs[job_index].first
    numbers = [
        _numbers(jobs[job_index], start, line),
        *(_numbers(job, job.first, 0) for job in jobs[job_index + 1 :]),
    ]
    return program_of(numbers, len(numbers), dialect), 1 if first > begins[job_index] else 0


class MatlabRouterConversation(PacketByPacket):
    """A conversation that sends a job number by number, and then waits for its simulated time."""

    stands = "nothing more was sent; by the simulated time it stands, and says nothing"
    goes_on = "it runs the job to its end; its switch stops it"

    def __init__(
        self, packets: Sequence[Packet], machine: MatlabRouterMachine, manner: Manner
    ) -> None:
        super().__init__(packets, manner)
        assert isinstance(machine.link, MatlabRouterLink)
        self._link = machine.link
        router = machine.controller
        router = router if isinstance(router, MatlabRouterController) else MatlabRouterController()
        self._pauses = router.header_pause_s, router.number_pause_s
        self._margin_s = self._link.margin_s * manner.late_s / LATE_S
        self._left: list[bytes] = []
        self._count = 0  # numbers of the job sent so far
        self._echo = b""
        """Rest of the expected echo of the last number."""
        self._echoes = False
        """True if the master sends back what it takes."""
        self._moving = False

    def _send(self, packet: Packet, now: float) -> None:
        self._left = packet.data.split(END)[:-1]
        self._count, self._moving, self._echo = 0, False, b""
        self._echoes = self._link.echo == "echo"
        if self.sent > 1 and self._link.reset != "none":
            self._out.append(Reopen())  # a reset takes the port away
        self.next_s = now

    def _next_number(self, now: float) -> None:
        """Send the digits of the next number. Its carriage return follows at once, or, where the
        master echoes, when the echo has been compared."""
        word = self._left.pop(0)
        self._count += 1
        if self._echoes:
            self._echo, self.next_s = word, now + self.manner.patience_s
        elif self._link.echo == "detected" and self._count == 1:
            self._echo, self.next_s = word, now + ECHO_FACTOR * self.manner.late_s
        self._write(word)
        if not self._echo:
            self._end_number(now)

    def _end_number(self, now: float) -> None:
        """Send the carriage return of a number. Behind the last number of a job the machine begins
        to move: schedule the end of its simulated time."""
        self._write(END)
        self._echo = b""
        header, number = self._pauses
        if self._left:
            self.next_s = now + (header if self._count <= len(HEADER) else number)
            return
        self._moving = True
        packet, lines = self.packets[self.sent - 1], self._count - len(HEADER)
        seconds = packet.seconds - len(HEADER) * header - lines * number
        self.next_s = now + TIME_FACTOR * max(seconds, 0.0) + self._margin_s

    def receive(self, data: bytes, now: float) -> None:
        """Compare received bytes with the expected echo; nothing else may come."""
        text = b"".join(data.split())
        if self.is_over or not text:
            return
        if not self._echo.startswith(text):
            surplus = f", where {self._echo_text} was to come back" if self._echo else " unasked"
            self._fail(f"it says {text[:20]!r}{surplus}; {self._remedy}", now)
            return
        self._echoes, self._echo = True, self._echo[len(text) :]
        if not self._echo:
            self._end_number(now)

    @property
    def _echo_text(self) -> str:
        return self._echo.decode("ascii", "replace")

    @property
    def _remedy(self) -> str:
        if self._moving:
            return "the job has begun: its switch stops the machine"
        return "the job has not begun, and the master must be reset"

    def tick(self, now: float) -> None:
        """Send the next number when it is due, or end a job whose time is over."""
        if self.is_over or not self._busy or now < self.next_s:
            return
        if self._moving:
            self._packet_done(now)
        elif self._echo and self._echoes:
            self._fail(f"{self._echo_text} does not come back; {self._remedy}", now)
        elif self._echo:
            self._end_number(now)
        else:
            self._next_number(now)

    def _halt(self, now: float, *, unsent: bool) -> bool:
        """Return True if the machine stands: a job whose numbers are not complete never begins.
        False while it moves."""
        if self._moving and not unsent:
            return False
        self._moving = False
        self._stopped(f"stopped: {self._remedy}")
        return True

    @property
    def _unattended(self) -> str:
        return super()._unattended if self._moving else ""
