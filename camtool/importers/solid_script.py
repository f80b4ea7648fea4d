"""A build123d script is run, and what it leaves is the model.

It may leave `part`, `sketch` or `result`: a shape, a list of shapes, or one of the builders.
What it prints goes to standard error. `__name__` is not "__main__", so that what a script does
only when it is started itself (showing the part, writing files) is left out.
"""

from __future__ import annotations

import contextlib
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from camtool.errors import DrawingError
from camtool.importers.solid_shapes import Body, Model, bodies, has_edges, redirected

RESULTS = ("part", "sketch", "result")
"""Names under which a script may leave its model; the first one that there is counts."""


def run_script(data: bytes, file: str) -> Model:
    """The bodies that a script leaves; DrawingError with its line when it fails."""
    names: dict[str, Any] = {"__name__": "camtool_script", "__file__": file}
    with _surroundings(file):
        try:
            exec(compile(data, file, "exec"), names)
        except SystemExit as error:
            # A script that ends itself without complaint has done its work.
            if error.code not in (None, 0):
                raise _failed(f"ended itself: {error.code}", error, file) from error
        except SyntaxError as error:
            where = f"line {error.lineno}" if error.lineno else None
            raise DrawingError(f"is no Python: {error.msg}", file=file, where=where) from error
        # Whatever a stranger's program raises is its own fault.
        except Exception as error:
            what = f"{type(error).__name__}: {error}".rstrip(": ")
            raise _failed(f"stopped with {what}", error, file) from error
    return Model(_left(names, file), "build123d counts in mm")


@contextlib.contextmanager
def _surroundings(file: str) -> Iterator[None]:
    """Where a script finds what lies beside it, and where its words go."""
    path, arguments = list(sys.path), list(sys.argv)
    if Path(file).is_file():
        sys.path.insert(0, str(Path(file).resolve().parent))
    sys.argv[:] = [file]
    try:
        with contextlib.redirect_stdout(sys.stderr), redirected({1: 2}):
            yield
    finally:
        sys.path[:], sys.argv[:] = path, arguments


def _failed(message: str, error: BaseException, file: str) -> DrawingError:
    """The error with the last line of the script that was being run."""
    lines = [
        frame.lineno
        for frame in traceback.extract_tb(error.__traceback__)
        if frame.filename == file
    ]
    where = f"line {lines[-1]}" if lines else None
    return DrawingError(message, file=file, where=where, mend="mend the script")


def _left(names: dict[str, Any], file: str) -> list[Body]:
    """The bodies of the first of RESULTS; DrawingError when there is none."""
    name = next((name for name in RESULTS if names.get(name) is not None), None)
    if name is None:
        raise DrawingError(
            "the script leaves no model",
            file=file,
            mend=f"let it assign {', '.join(RESULTS[:-1])} or {RESULTS[-1]} outside of functions "
            "and of `if __name__ == ...`",
        )
    try:
        shapes = _shapes(names[name])
    except TypeError as error:
        raise DrawingError(
            f"{name} is of type {error}, no shape",
            file=file,
            mend="let it be a shape, a list of shapes or a builder of build123d",
        ) from error
    found = [body for shape in shapes for body in bodies(shape) if has_edges(body.shape)]
    if not found:
        raise DrawingError(f"{name} is empty", file=file, mend="mend the script")
    return found


def _shapes(value: Any) -> list[Any]:
    """The shapes in a builder, a shape or a list of them; TypeError naming another type."""
    from build123d import BuildLine, BuildPart, BuildSketch, Shape

    for builder, inside in ((BuildPart, "part"), (BuildSketch, "sketch"), (BuildLine, "line")):
        if isinstance(value, builder):
            return _shapes(getattr(value, inside))
    if isinstance(value, Shape) and value.wrapped is not None:
        return [value]
    if isinstance(value, list | tuple):
        return [shape for item in value for shape in _shapes(item)]
    raise TypeError(type(value).__name__)
