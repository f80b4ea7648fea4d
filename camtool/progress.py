"""What a long run is doing, for whoever shows it: its stage, and the share of it that is done."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Progress:
    """The stage of a run, in words that follow "camtool:"; of `count` parts of it `done` are done
    (a count of 0: nobody knows how many there are). Whoever works writes, others only read."""

    stage: str = ""
    done: int = 0
    count: int = 0

    def begin(self, stage: str, count: int = 0) -> None:
        """The next stage."""
        self.count = 0  # first, since it may be read at any time
        self.stage, self.done = stage, 0
        self.count = count

    @property
    def share(self) -> float | None:
        """How much of the stage is done, 0 to 1; None where nobody knows."""
        count = self.count
        return min(self.done / count, 1.0) if count else None
