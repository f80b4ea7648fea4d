"""Tool changes of a toolpath, for machines that have none or only some."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from camtool.toolpath.moves import Kind, Toolpath


def mounted_before(toolpath: Toolpath) -> npt.NDArray[np.bool_]:
    """(N,) true for tool changes before the first move at a feed: where a machine cannot be told
    of tools, the operator mounts this one before the program starts."""
    fed = np.cumsum(toolpath.is_feed) > 0
    return np.asarray((toolpath.kind == Kind.TOOL_CHANGE) & ~fed)
