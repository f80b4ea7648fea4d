"""A fault in a line of a program, raised where its place is not known yet."""

from __future__ import annotations


class LineFault(Exception):
    """Fault at which a controller stops in a line. `at`: the offset in its text without blanks, or
    the letter of the word; None for the whole line. The reader turns it into a ProgramError with
    the place."""

    def __init__(self, message: str, column: int | str | None = None, mend: str = "") -> None:
        super().__init__(message)
        self.message, self.at, self.mend = message, column, mend
