"""The plainest streamer of grbl there is: lines go out while all that is unanswered fits into the
buffer of 127 characters, and each answer frees those of the oldest line. It asks nothing else."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

from camtool.target.wire import NEVER, Action, Write

ROOM = 127


class CharacterCounter:
    """As much of a conversation as `tests.sending.talking.Talking` needs."""

    state = why = ""

    def __init__(self, lines: Iterable[bytes]) -> None:
        self._lines = deque(line + b"\n" for line in lines if line.strip())
        self._sizes: deque[int] = deque()
        self._out: list[Action] = []
        self._rest = b""
        self.next_s = NEVER
        self.refusals: list[bytes] = []

    @property
    def is_over(self) -> bool:
        return not self._lines and not self._sizes

    @property
    def has_actions(self) -> bool:
        return bool(self._out)

    def begin(self, now: float) -> None:
        self._fill()

    def actions(self) -> list[Action]:
        actions, self._out = self._out, []
        return actions

    def tick(self, now: float) -> None:
        """Nothing happens by the clock."""

    def receive(self, data: bytes, now: float) -> None:
        *lines, self._rest = (self._rest + data).split(b"\n")
        for line in lines:
            if line.startswith((b"ok", b"error")):
                self._sizes.popleft()
                self.refusals += [line] if line.startswith(b"error") else []
        self._fill()

    def _fill(self) -> None:
        while self._lines and sum(self._sizes) + len(self._lines[0]) <= ROOM:
            line = self._lines.popleft()
            self._sizes.append(len(line))
            self._out.append(Write(line))
