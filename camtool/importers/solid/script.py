"""A build123d script is run, and what it leaves is the model.

It may leave `part`, `sketch` or `result`: a shape, a list of shapes, or one of the builders.
`__name__` is not "__main__", so that what a script does only when it is started itself (showing
the part, writing files) is left out. All this happens in a process of its own.
"""

from __future__ import annotations

import sys
import traceback
from pathlib import Path
from typing import Any

from camtool.errors import DrawingError
from camtool.importers.solid.shapes import Body, shape_bodies

RESULTS = ("part", "sketch", "result")
"""Names under which a script may leave its model; the first one that there is counts."""

_MEND = "mend the script"


def run_script(data: bytes, file: str) -> list[Body]:
    """The bodies that a script leaves; DrawingError with its line when it fails."""
    names: dict[str, Any] = {"__name__": "camtool_script", "__file__": file}
    if Path(file).is_file():  # what lies beside a script it finds, as ever
        sys.path.insert(0, str(Path(file).resolve().parent))
    sys.argv[:] = [file]
    try:
        exec(compile(data, file, "exec"), names)
    except SystemExit as error:
        # A script that ends itself without complaint has done its work.
        if error.code not in (None, 0):
            raise _failed(f"ended itself: {error.code}", error, file) from error
    except SyntaxError as error:
        where = f"line {error.lineno}" if error.lineno else None
        raise DrawingError(f"is no Python: {error.msg}", where=where, mend=_MEND) from error
    # Whatever a stranger's program raises is its own fault.
    except Exception as error:
        what = f"{type(error).__name__}: {error}".rstrip(": ")
        raise _failed(f"stopped with {what}", error, file) from error
    return _left(names)


def _failed(message: str, error: BaseException, file: str) -> DrawingError:
    """The error with the last line of the script that was being run."""
    lines = [
        frame.lineno
        for frame in traceback.extract_tb(error.__traceback__)
        if frame.filename == file
    ]
    return DrawingError(message, where=f"line {lines[-1]}" if lines else None, mend=_MEND)


def _left(names: dict[str, Any]) -> list[Body]:
    """The bodies of the first of RESULTS; DrawingError when there is none."""
    name = next((name for name in RESULTS if names.get(name) is not None), None)
    if name is None:
        raise DrawingError(
            "the script leaves no model",
            mend=f"let it assign {', '.join(RESULTS[:-1])} or {RESULTS[-1]} outside of functions "
            "and of `if __name__ == ...`",
        )
    try:
        shapes = _shapes(names[name])
    except TypeError as error:
        raise DrawingError(
            f"{name} is of type {error}, no shape",
            mend="let it be a shape, a list of shapes or a builder of build123d",
        ) from error
    found = [body for shape in shapes for body in shape_bodies(shape)]
    if not found:
        raise DrawingError(f"{name} is empty", mend=_MEND)
    return found


def _shapes(value: Any) -> list[Any]:
    """The shapes in a builder, a shape or a list of them; TypeError naming another type."""
    from build123d import BuildLine, BuildPart, BuildSketch, Shape

    for builder, inside in ((BuildPart, "part"), (BuildSketch, "sketch"), (BuildLine, "line")):
        if isinstance(value, builder):
            made = getattr(value, inside)
            return [] if made is None else _shapes(made)
    if isinstance(value, Shape) and value.wrapped is not None:
        return [value]
    if isinstance(value, list | tuple):
        return [shape for item in value for shape in _shapes(item)]
    raise TypeError(type(value).__name__)
