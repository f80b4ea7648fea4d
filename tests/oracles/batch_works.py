"""Works that do what the drawing tells them, and a pool that is no pool."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from pathlib import Path

from camtool.batches.manifest import content_digest
from camtool.batches.pool import make_outputs
from camtool.batches.run import BatchWork, DrawingTask, Outputs
from camtool.errors import DrawingError

WARM_S = 0.3
"""How long a worker takes to be warm when it notes when it begins and when it ends."""


@dataclass(frozen=True)
class Obedient:
    """Makes `.out` of a drawing, or comes to the end that its content names; writes to `notes`
    when it begins and ends to be warm."""

    dies_warm: bool = False
    notes: Path | None = None

    def warm(self) -> None:
        if self.notes is not None:
            for word in ("begin", "end"):
                with self.notes.open("a") as stream:
                    stream.write(f"{word}\n")
                time.sleep(WARM_S)
        if self.dies_warm:
            os.kill(os.getpid(), signal.SIGKILL)

    def digest(self) -> str:
        return "of no matter"

    def make(self, task: DrawingTask, data: bytes | None) -> Outputs:
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
        return Outputs(content=content_digest(data), files={".out": made})


class HerePool:
    """Makes one drawing after the other in this process."""

    def __init__(self, work: BatchWork) -> None:
        self.work = work
        self.asked: list[str] = []

    def results(
        self, tasks: Sequence[DrawingTask]
    ) -> Generator[tuple[DrawingTask, Outputs] | None]:
        for task in tasks:
            self.asked.append(task.stem)
            yield task, make_outputs(self.work, task, None)
