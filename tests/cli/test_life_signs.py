"""Signs of life: on terminals, for commands that take long, and gone when they end."""

import io
import threading

import pytest

from camtool.cli import messages
from camtool.cli.messages import life_signs


class Terminal(io.StringIO):
    """A stream that says it is one, and tells when something was written."""

    def __init__(self, *, is_one: bool = True) -> None:
        super().__init__()
        self.is_one, self.seen = is_one, threading.Event()

    def isatty(self) -> bool:
        return self.is_one

    def write(self, text: str) -> int:
        written = super().write(text)
        self.seen.set()
        return written


@pytest.fixture(autouse=True)
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(messages, "AFTER_S", 0.0)
    monkeypatch.setattr(messages, "EVERY_S", 0.0)


def test_seconds_are_told_and_wiped_out_at_the_end() -> None:
    stream = Terminal()
    with life_signs(stream, ["post", "a.dxf"]):
        assert stream.seen.wait(60.0)
    signs = stream.getvalue().split("\r")
    assert signs[0] == "camtool: 0 s"
    assert signs[-1] == ""
    assert set(signs[-2]) == {" "}
    assert len(signs[-2]) >= len(signs[0])


def test_a_short_run_says_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(messages, "AFTER_S", 1e6)
    stream = Terminal()
    with life_signs(stream, ["post"]):
        pass
    assert stream.getvalue() == ""


@pytest.mark.parametrize(
    ("stream", "words"),
    [
        (Terminal(is_one=False), ["post"]),
        (Terminal(), ["post", "-q"]),
        (Terminal(), ["post", "--quiet"]),
        (Terminal(), ["batch", "x"]),
        (Terminal(), ["post", "--watch"]),
    ],
)
def test_who_wants_no_signs_gets_none(stream: Terminal, words: list[str]) -> None:
    threads = threading.active_count()
    with life_signs(stream, words):
        assert threading.active_count() == threads
    assert stream.getvalue() == ""


def test_no_stream_and_a_terminal_that_goes_away_are_no_fault() -> None:
    with life_signs(None, []):
        pass
    stream = Terminal()
    with life_signs(stream, []):
        stream.close()
