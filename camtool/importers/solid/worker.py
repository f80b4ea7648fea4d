"""The process in which solid models are read: bytes in one file, JSON in another one.

It ends without an answer when OpenCASCADE brings it down."""

from __future__ import annotations

import contextlib
import json
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from camtool.errors import CamtoolError, DrawingError, GeometryError
from camtool.importers.solid.bodies import Body, is_missing, load_brep, load_step, run_script
from camtool.importers.solid.outline import Outlines, outlines

_DAMAGED = "cannot be read: its structure is damaged"
_AGAIN = "export it again as STEP (AP214 or AP242)"

MAX_MEMORY_BYTES = 12 << 30
"""The worker for a STEP or BREP file gets no more address space than this (on POSIX)."""


def main(request: dict[str, Any]) -> None:
    """Read the model that `request` describes and write its outlines, or the error, as JSON to the
    file `request["answer"]`."""
    _limit(None if request["kind"] == "script" else MAX_MEMORY_BYTES)
    try:
        result = find_outlines(request)
    except CamtoolError as error:
        result = {"error": {"message": error.message, "where": error.where, "mend": error.mend}}
    except Exception:
        result = {"fault": traceback.format_exc()}
    Path(request["answer"]).write_text(json.dumps(result), encoding="utf-8")


def find_outlines(request: dict[str, Any]) -> dict[str, Any]:
    """Return the outlines of the model in the file `request["source"]`, as plain lists and
    numbers.

    Other keys: `kind` ("step", "brep", "script"), `height` of a section or None, `tolerance` of
    fitting, both in the model's mm, and `file`, the model's name for messages."""
    script = request["kind"] == "script"
    return outlines_of(
        lambda: _bodies(request), request["height"], request["tolerance"], script=script
    )


def outlines_of(
    bodies_of: Callable[[], list[Body]], height: float | None, tolerance: float, *, script: bool
) -> dict[str, Any]:
    """Return the outlines of the bodies that `bodies_of` makes, as plain lists and numbers.

    DrawingError where OpenCASCADE fails on them: those of a `script`, or else of a file."""
    try:
        bodies = bodies_of()
        result = outlines(bodies, height, tolerance)
        faulty = sum(not _is_valid(body) for body in bodies)
    except GeometryError as error:
        raise DrawingError(
            f"holds a curve that is not valid: {error.message}", mend=_AGAIN
        ) from error
    except Exception as error:
        if is_missing(error):
            raise _missing_error(error) from error
        if not _is_of_kernel(error):
            raise
        message = "OpenCASCADE fails on the model" if script else _DAMAGED
        raise DrawingError(message, mend="correct the script" if script else _AGAIN) from error
    return _as_plain_lists(result) | {"faulty": faulty, "bodies": len(bodies)}


def _missing_error(error: Exception) -> DrawingError:
    """Return the error for a library that is not installed, or cannot be loaded."""
    if isinstance(error, ModuleNotFoundError):
        return DrawingError(
            "is read by build123d, which is not installed here", mend="pip install build123d"
        )
    return DrawingError(
        f"is read by build123d, which cannot be loaded here ({error})",
        mend="install what it names (Debian: apt install libx11-6 libexpat1)",
    )


def _is_of_kernel(error: Exception) -> bool:
    """Return True if OpenCASCADE raised the error (its exceptions have no common class), or ran
    out of memory."""
    return type(error).__module__.startswith("OCP") or isinstance(
        error, RuntimeError | MemoryError
    )


def _bodies(request: dict[str, Any]) -> list[Body]:
    if request["kind"] == "script":
        return run_script(Path(request["source"]).read_bytes(), request["file"])

    load = load_step if request["kind"] == "step" else load_brep
    bodies = load(request["source"])
    if not bodies:
        raise DrawingError("holds no shapes, or is damaged", mend=_AGAIN)
    return bodies


def _is_valid(body: Body) -> bool:
    """Return True if all faces and edges of the body fit together."""
    from OCP.BRepCheck import BRepCheck_Analyzer

    return bool(BRepCheck_Analyzer(body.shape).IsValid())


def _as_plain_lists(result: Outlines) -> dict[str, Any]:
    """Return the outlines as lists and dictionaries, ready for JSON."""
    return {
        "levels": result.levels,
        "span": result.span,
        "missed": result.missed,
        "outlines": [
            {
                "kind": outline.kind,
                "layer": outline.layer,
                "colour": outline.colour,
                "paths": [
                    {
                        "closed": path.closed,
                        "vertices": path.vertices.tolist(),
                        "off": path.off.tolist(),
                    }
                    for path in outline.paths
                ],
            }
            for outline in result.outlines
        ],
    }


def _limit(memory: int | None) -> None:
    """Limit the memory of this process to so many bytes, if any are given, and switch off core
    files."""
    with contextlib.suppress(ImportError, ValueError, OSError):
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        if memory is not None:
            resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
