"""A fault in a line of a program, raised where its place is not known yet."""

from __future__ import annotations


class LineFault(Exception):
    """Why a controller stops at a line; `at`: where in its text without blanks, or the letter of
    the word, None for the line as a whole. The reader makes a ProgramError of it, which has the
    place."""

    def __init__(self, message: str, column: int | str | None = None, mend: str = "") -> None:
        super().__init__(message)
        self.message, self.at, self.mend = message, column, mend
