"""What must hold when any bytes are read as a drawing."""

from __future__ import annotations

import numpy as np

from camtool.errors import CamtoolError
from camtool.geometry.drawing import Drawing
from camtool.importers.options import ReadOptions
from camtool.importers.read import read_bytes


def read_or_refuse(data: bytes, file: str, options: ReadOptions) -> Drawing | CamtoolError:
    """The drawing, sound, or the error, clear; anything else escapes and fails the test."""
    result = _outcome(data, file, options)
    if isinstance(result, CamtoolError):
        assert result.exit_code == 2
        assert result.message
        assert "\n" not in str(result)
        assert result.file == file, f"no file named: {result}"
    else:
        assert np.isfinite(result.paths.vertices).all()
        assert result.units.mm_per_unit > 0.0
        assert len(result.paths) or result.marks
    return result


def _outcome(data: bytes, file: str, options: ReadOptions) -> Drawing | CamtoolError:
    try:
        return read_bytes(data, file, options)
    except CamtoolError as error:
        return error
