"""The exceptions of camtool.

    CamtoolError                 exit code 2: wrong use or bad input
    ├── InputError               a file cannot be used (also ValueError)
    │   ├── DrawingError         a drawing; `where` names layer, entity or line
    │   └── ProgramError         a machine program; `where` names block and column
    ├── GeometryError            numbers that form no polyline (also ValueError)
    ├── OptionError              a flag or a job setting out of its range (also ValueError)
    ├── MachineError             a machine file: file, table, key (also ValueError)
    │   └── UnknownTargetError   no such target
    ├── PostError                what this machine cannot do (also ValueError)
    └── OutputError              a file that cannot be written (also OSError)

Every message is one line: what is wrong, where, and how to fix it. Findings of severity
error are not exceptions: they are collected (see `camtool.findings`) and give exit code 1.
Any other exception is a fault of camtool itself: exit code 3."""

from __future__ import annotations

from camtool.plain import one_line


class CamtoolError(Exception):
    """One line for the user: `[file: ][where: ]message[; mend]`."""

    exit_code = 2

    def __init__(
        self, message: str, *, file: str | None = None, where: str | None = None, mend: str = ""
    ) -> None:
        self.message = message
        self.file = file
        self.where = where
        self.mend = mend
        super().__init__(message)

    def __str__(self) -> str:
        head = "".join(f"{part}: " for part in (self.file, self.where) if part)
        message, mend = (" ".join(words.split()) for words in (self.message, self.mend))
        # One line, whatever characters the name of a file or a layer has.
        return one_line(f"{head}{message}{f'; {mend}' if mend else ''}")


class InputError(CamtoolError, ValueError):
    """A file cannot be used for what it was given."""


class DrawingError(InputError):
    """A drawing that cannot be read; `where` names layer, entity or line."""


class ProgramError(InputError):
    """A machine program that its controller could not decode; `where` names block and column."""


class GeometryError(CamtoolError, ValueError):
    """Numbers that do not form a polyline."""


class OptionError(CamtoolError, ValueError):
    """A flag or a job setting that is out of its range."""


class MachineError(CamtoolError, ValueError):
    """A machine file with an unknown key, a wrong type or a value out of range."""


class UnknownTargetError(MachineError):
    """No target of that name."""


class PostError(CamtoolError, ValueError):
    """Something in the toolpath that this machine or its dialect cannot do."""


class OutputError(CamtoolError, OSError):
    """A file that cannot be written."""

    def __str__(self) -> str:  # OSError has a __str__ of its own
        return CamtoolError.__str__(self)
