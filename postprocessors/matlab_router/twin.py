"""The master and the slaves of the Matlab router at the other end of a USB cable, as
docs/wires/matlab-router.md has it.

Numbers come as characters and a carriage return, until a job is complete (L4668-4708). With its
last number the machine goes home, to the first point and down, and runs the lines (L4718-4929).
Then the master does nothing more until it is reset. It says nothing, but perhaps an echo."""

from __future__ import annotations

import re
from typing import Final, Literal

import msgspec
import numpy as np

from camtool.arrays import Ints
from camtool.errors import ProgramError
from camtool.machine.model import Machine
from camtool.records import replace
from camtool.target.twin import COMMANDED, Slides, Twin, travel_of

from .controller import MatlabRouterModel
from .dialect import MatlabRouterController, MatlabRouterDialect, dialect_of
from .jobs import ReadJob, check_count, check_job
from .read import path_of

END: Final = 13
"""The character that ends a number."""

CHARACTERS: Final = 6
"""Most characters of a number: further ones are dropped (a buffer of 7, L4668-4708)."""

PRINTABLE: Final = range(ord(" "), ord("~") + 1)
"""Characters that the library's get_string_usb takes and sends back; it drops the others."""

HEADER: Final = 3
"""Numbers of a job before those of its lines (L4294-4360)."""

INT16: Final = 1 << 16
"""Numbers of the master repeat themselves behind so many (L4668-4708)."""

NUMBER: Final = re.compile(rb"[+-]?\d+")


class MatlabRouterTwinSettings(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True
):
    """Options for what the thesis leaves open.

    `echo`: the master sends back the characters that it takes, or "none". `reset`: it is reset
    when somebody opens the port and nothing moves (as a user's hand would), or, as a mended master
    might be, by "itself" when a job is done; what has come meanwhile then waits in the cable."""

    echo: Literal["none", "characters"] = "none"
    reset: Literal["opening", "itself"] = "opening"


class MatlabRouterTwin(Twin):
    """The master after a reset, its slides at part zero."""

    settings = MatlabRouterTwinSettings
    wire = "USB (CDC), whose rate means nothing"

    def __init__(
        self,
        machine: Machine[MatlabRouterController, MatlabRouterDialect],
        choices: MatlabRouterTwinSettings,
    ) -> None:
        super().__init__(Slides(machine))
        # When a job begins here, the time of transmitting its numbers has passed already.
        at_once = replace(machine.controller, header_pause_s=0.0, number_pause_s=0.0)
        self._machine = replace(machine, controller=at_once)
        self._choices, self._dialect = choices, dialect_of(machine)
        self._model = MatlabRouterModel()
        self._jobs: list[ReadJob] = []
        self._outputs, self._seconds = 0, 0.0  # of all jobs so far
        self._reset()

    def connect(self, now: float) -> bytes:
        """Open the port."""
        output = super().connect(now)
        if self._choices.reset == "opening" and not self.is_moving:
            self._reset()
        return output

    def _reset(self) -> None:
        self._numbers: list[int] = []
        self._word, self._raw, self._waiting = bytearray(), bytearray(), bytearray()
        self._listens = True

    def _wake(self) -> None:
        if self._choices.reset == "opening" or self.is_moving:
            return
        waiting = self._waiting
        self._reset()
        for octet in waiting:
            self._receive_byte(octet)

    def _receive_byte(self, octet: int) -> None:
        if not self._listens:
            self._waiting.append(octet)
            return
        self._raw.append(octet)
        if octet == END:
            self._numbers.append(_number(bytes(self._word)))
            self._word.clear()
            self._begin_if_complete()
        elif octet in PRINTABLE and len(self._word) < CHARACTERS:
            self._word.append(octet)
            if self._choices.echo == "characters":
                self._out.append(octet)

    def _begin_if_complete(self) -> None:
        """Begin the job when all its numbers have come. A job of more lines than the arrays hold
        overwrites what lies behind them (L4625-4635), and a slave may run away: in both cases this
        controller hangs until it is reset."""
        count = self._numbers[0]
        if not 1 <= count <= self._dialect.max_lines:
            self._listens = False
        elif len(self._numbers) == HEADER + 4 * count:
            self._listens = False
            table = np.array(self._numbers[HEADER:], dtype=np.int64).reshape(4, count)
            first: Ints = np.array(self._numbers[1:HEADER], dtype=np.int64)
            number = len(self._jobs) + 1
            self._begin(ReadJob(number, first, table[:2], table[2:], lambda *_: f"job {number}"))

    def _begin(self, job: ReadJob) -> None:
        """Start the slaves on a job; their counters continue from the jobs before, since only the
        master was reset."""
        try:
            check_count(job.length.shape[1], job.where, self._dialect)
            check_job(job, self._dialect)
            path = path_of([*self._jobs, job], self._machine)
            job_travel = travel_of(self._model.run(path, self._machine, COMMANDED))
        except ProgramError:
            return
        self._jobs.append(job)
        self.decoded.append(bytes(self._raw))
        travel = replace(
            job_travel,
            commanded=job_travel.commanded[self._outputs :],
            seconds=job_travel.seconds[self._outputs :] - self._seconds,
            added_s=job_travel.added_s[self._outputs :],
            total_s=job_travel.total_s - self._seconds,
        )
        self._outputs, self._seconds = len(job_travel), job_travel.total_s
        self.slides.begin(travel, self.now, len(self.decoded) - 1)


def _number(word: bytes) -> int:
    """Parse a word as the firmware's atol does, into a signed int16; 0 if it does not begin with a
    number."""
    match = NUMBER.match(word)
    value = int(match[0]) if match else 0
    return (value + INT16 // 2) % INT16 - INT16 // 2
