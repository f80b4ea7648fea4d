"""Progress of a long run: its present stage and the share of the stage that is done."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Progress:
    """The stage of a run, in words that follow "camtool:", and its `done` parts out of `count`
    (0 if unknown). It has one writer and many readers, in other threads."""

    stage: str = ""
    done: int = 0
    count: int = 0

    def begin(self, stage: str, count: int = 0) -> None:
        """Begin the next stage."""
        self.count = 0  # first, since another thread may read it at any time
        self.stage, self.done = stage, 0
        self.count = count

    @property
    def share(self) -> float | None:
        """Share of the stage that is done, 0 to 1; None if unknown."""
        count = self.count
        return min(self.done / count, 1.0) if count else None
