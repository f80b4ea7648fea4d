"""Works that do what the drawing tells them, and a pool that is no pool."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Generator, Sequence
from dataclasses import dataclass

from camtool.batches.manifest import content_digest
from camtool.batches.pool import made_of
from camtool.batches.run import Made, Task, Work
from camtool.errors import DrawingError


@dataclass(frozen=True)
class Obedient:
    """Makes `.out` of a drawing, or comes to the end that its content names."""

    dies_warm: bool = False

    def warm(self) -> None:
        if self.dies_warm:
            os.kill(os.getpid(), signal.SIGKILL)

    def digest(self) -> str:
        return "of no matter"

    def make(self, task: Task, data: bytes | None) -> Made:
        data = task.path.read_bytes() if data is None else data
        word, _, number = data.decode().partition(" ")
        if word == "die":
            os.kill(os.getpid(), signal.SIGKILL)
        if word == "leave":
            os._exit(7)
        if word == "sleep":
            time.sleep(float(number))
        if word == "broken":
            raise DrawingError("is broken", file=task.source)
        if word == "fault":
            raise ZeroDivisionError("by nought")
        if word == "memory":
            raise MemoryError
        size = int(number) if word == "large" else 0
        made = data + str(os.getpid()).encode() * (word == "pid") + b"x" * size
        return Made(content=content_digest(data), files={".out": made})


class HerePool:
    """Makes one drawing after the other in this process."""

    def __init__(self, work: Work) -> None:
        self.work = work
        self.asked: list[str] = []

    def results(self, tasks: Sequence[Task]) -> Generator[tuple[Task, Made] | None]:
        for task in tasks:
            self.asked.append(task.stem)
            yield task, made_of(self.work, task, None)
