"""A conversation with a twin in memory, on one virtual clock, over a line that may have faults."""

from __future__ import annotations

from collections.abc import Callable

from camtool.sending.faults import WiredTwin
from camtool.target.wire import Conversation, Reopen, Write

MOST_TURNS = 10_000
"""So much is said in one instant at most."""

Wish = Callable[[Conversation, float], None]


class Talking:
    """A conversation, its line, and the time, s. `coarse`: reports of steps come all at once, when
    a travel is over, which is faster and on a line without faults the same."""

    def __init__(
        self, talk: Conversation, line: WiredTwin, *, coarse: bool = False, now: float = 0.0
    ) -> None:
        self.talk, self.line, self.now = talk, line, now
        self.coarse = coarse
        line.connect(self.now)
        talk.begin(self.now)

    def until(self, end_s: float, wish: Wish = lambda talk, now: None) -> None:
        """Let time pass until then, or to the end of the conversation. `wish`: what the user does,
        asked again and again."""
        talk, line = self.talk, self.line
        turns, before = 0, self.now
        while not talk.is_over or talk.has_actions:
            turns, before = (turns + 1 if self.now == before else 0), self.now
            assert turns < MOST_TURNS, ("time stands still", self.now, talk.state, talk.why)
            self.act()
            if line.unplugged(self.now):
                talk.lose_port("the plug was pulled", self.now)
                continue
            data = line.read(self.now)
            if data:
                talk.receive(data, self.now)
            wish(talk, self.now)
            if talk.is_over or talk.has_actions:
                continue
            other = line.wake_s() if self.coarse else line.next_s()
            at = talk.next_s if other is None else min(talk.next_s, other)
            if at > end_s:
                self.now = max(self.now, min(end_s, at))
                return
            self.now = max(self.now, at)
            if self.now >= talk.next_s:
                talk.tick(self.now)

    def act(self) -> None:
        """Do what the conversation wants now."""
        for action in self.talk.actions():
            if isinstance(action, Write):
                self.line.write(action.data, self.now)
            elif isinstance(action, Reopen):
                self.line.connect(self.now)


def talked(
    talk: Conversation,
    line: WiredTwin,
    wish: Wish = lambda talk, now: None,
    *,
    latest_s: float,
    coarse: bool = False,
) -> float:
    """Hold it to its end; when that was. AssertionError when it has none by `latest_s`."""
    both = Talking(talk, line, coarse=coarse)
    both.until(latest_s, wish)
    assert talk.is_over, (talk.state, talk.why, talk.sent, both.now)
    return both.now
