"""The contract of a terminal: what a person types to a controller, and what its answers mean.

A `Terminal` is a value like a conversation: typed lines go in and bytes come out, bytes that were
heard go in and sentences come out. It opens nothing; `camtool console` joins it to a port. What it
says of an answer stands behind the answer itself, never in its place."""

from __future__ import annotations

import re
from typing import ClassVar

_ESCAPE = re.compile(r"\\x([0-9A-Fa-f]{2})")
_ENDS = re.compile(rb"[\r\n]+")

MAX_LINE_BYTES = 1000
"""Longest answer that waits for its line end; longer ones are shown without it."""


class Terminal:
    """A controller that takes and answers lines; a target overrides what it knows better about its
    own."""

    end: ClassVar[bytes] = b"\n"
    """End of a typed line."""
    stop: bytes = b""
    """Bytes that stop the machine at once, for Ctrl-C; b"" if none do."""
    asks: ClassVar[bytes] = b""
    """Query that is repeated behind `stop` until the machine `stands`."""
    leaves: ClassVar[bytes] = b""
    """Bytes sent to a standing machine when the terminal is closed."""
    knock: ClassVar[bytes] = b""
    """Query that is repeated until the controller is `ready`."""
    about: ClassVar[str] = "each line goes out with a line feed; \\x13 is the byte of that number"
    """Help for the user: how to type lines to it."""

    def __init__(self) -> None:
        self.due = 0
        """Count of answers that are due, for a controller that answers each line; piped input
        waits for them."""
        self.answers = False
        """True if it answers every line, for a controller whose answers `due` does not count."""
        self.ready = True
        """False while it may not take lines yet, since the opening of the port has reset it."""
        self.failed = ""
        """Reason why a due answer will never come, "" if it may."""
        self.stands = False
        """True if it has reported, since it was told to stop, that it stands."""
        self.runs_on = False
        """True if what was typed last goes on until the next thing is typed."""
        self.rests_s = 0.0
        """Longest silence while it executes what was typed last, s."""
        self.hello = b""
        """Bytes sent when the port has been opened."""
        self._rest = b""

    def encode(self, line: str) -> bytes:
        r"""Return the bytes of a typed line; the escape `\x13` in it stands for the byte 0x13."""
        return self.unescape(line) + self.end

    def halt(self) -> bytes:
        """Return the bytes that stop the machine, and remember that it was told to stop."""
        self.stands = self.runs_on = False
        return self.stop

    def is_urgent(self, line: str) -> bool:
        """Return True if a line stops or resumes the machine, and so must not wait for the answers
        due before it."""
        return False

    def decode(self, data: bytes) -> list[str]:
        """Return the complete lines to show for these received bytes; an unfinished line is kept
        for the next call."""
        *lines, self._rest = _ENDS.split(self._rest + data)
        if len(self._rest) > MAX_LINE_BYTES:
            lines, self._rest = [*lines, self._rest], b""
        return [self._with_meaning(line) for line in lines if line]

    def flush(self) -> list[str]:
        """Return the unfinished line in a list, [] if there is none, and drop it."""
        partial, self._rest = self._rest, b""
        return [self._with_meaning(partial)] if partial else []

    def meaning(self, line: str) -> str:
        """Return the explanation of an answer; "" for one that needs none."""
        return ""

    def _with_meaning(self, line: bytes) -> str:
        text = "".join(chr(octet) if 0x20 <= octet < 0x7F else f"\\x{octet:02X}" for octet in line)
        meaning = self.meaning(text)
        return f"{text}    {meaning}" if meaning else text

    @staticmethod
    def unescape(line: str) -> bytes:
        r"""Return the bytes of a text in which escapes such as `\x13` stand for bytes."""
        parts = _ESCAPE.split(line)
        return b"".join(
            bytes([int(part, 16)]) if k % 2 else part.encode("utf-8")
            for k, part in enumerate(parts)
        )
