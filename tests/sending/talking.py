"""A conversation with a twin in memory, on one virtual clock, over a line that may have faults."""

from __future__ import annotations

from collections.abc import Callable

from camtool.sending.faults import Wired
from camtool.target.wire import Conversation, Reopen, Write


def talked(
    talk: Conversation,
    line: Wired,
    wish: Callable[[Conversation, float], None] = lambda talk, now: None,
    *,
    latest_s: float,
) -> float:
    """Hold it to its end; when that was. AssertionError when it has none by `latest_s`."""
    now = 0.0
    line.connect(now)
    talk.begin(now)
    while not talk.ended or talk.has_actions:
        for action in talk.actions():
            if isinstance(action, Write):
                line.write(action.data, now)
            elif isinstance(action, Reopen):
                line.connect(now)
        if line.unplugged(now):
            talk.lost("the plug was pulled", now)
            continue
        data = line.read(now)
        if data:
            talk.received(data, now)
        wish(talk, now)
        if talk.ended or talk.has_actions:
            continue
        other = line.next_s()
        at = talk.next_s if other is None else min(talk.next_s, other)
        if at == float("inf"):
            wish(talk, now)
            assert talk.ended or talk.has_actions, (talk.state, talk.why)
            continue
        now = max(now, at)
        assert now < latest_s, (talk.state, talk.why, talk.sent, now)
        if now >= talk.next_s:
            talk.elapsed(now)
    return now
