"""Progress of a long run: its present stage and the share of the stage that is done."""

from __future__ import annotations

from contextvars import ContextVar

STEPS = 100
"""Steps in which the share of a long part of a stage is reported, rounded down, so that 100 %
means complete."""


class Progress:
    """The stage of a run, in words that follow "camtool:", and its `done` parts out of `count`
    (0 if unknown). It has one writer and many readers, in other threads. Work deep inside a stage
    tells of it by `tell_share`."""

    def __init__(self) -> None:
        self.stage = ""
        self.done = self.count = 0

    def begin(self, stage: str, count: int = 0) -> None:
        """Begin the next stage."""
        _CURRENT.set(self)
        self.count = 0  # first, since another thread may read it at any time
        self.stage, self.done = stage, 0
        self.count = count

    @property
    def share(self) -> float | None:
        """Share of the stage that is done, 0 to 1; None if unknown."""
        count = self.count
        return min(self.done / count, 1.0) if count else None

    @property
    def outer_stage(self) -> str:
        """The stage without the part of it that is told."""
        return self.stage.split(" – ", 1)[0]


_CURRENT: ContextVar[Progress | None] = ContextVar("progress", default=None)
"""The progress on which a stage was begun last in this thread."""


def tell_share(part: str, share: float | None) -> None:
    """Report the progress of a part of the present stage: its name and the share that is done, 0
    to 1; None when it has ended. Without a listener nothing happens."""
    progress = _CURRENT.get()
    if progress is None:
        return
    stage = progress.outer_stage
    if share is None:
        progress.begin(stage)
        return
    words = f"{stage} – {part}" if stage else part
    if progress.stage != words:
        progress.begin(words, STEPS)
    progress.done = int(share * STEPS)
