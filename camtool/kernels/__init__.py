"""Compiled inner loops: arrays in, arrays out.

numba keeps what it compiled beside the sources, and notices a change of a kernel's own file only:
one that calls a kernel of another file would go on running that file's old code after an update.
So whatever was compiled is thrown away here when any source of this folder has changed.
"""

from __future__ import annotations

import contextlib
import hashlib
from pathlib import Path

_STAMP = "camtool-kernels.digest"


def _discard_stale(folder: Path) -> bool:
    """Whether compiled kernels of other sources than those in `folder` were thrown away.

    Where the folder cannot be written numba keeps its files elsewhere, and nothing is done.
    """
    digest = hashlib.sha256()
    for source in sorted(folder.glob("*.py")):
        digest.update(source.name.encode() + b"\0" + source.read_bytes())
    cache = folder / "__pycache__"
    stamp, wanted = cache / _STAMP, digest.hexdigest()
    try:
        if stamp.read_text() == wanted:
            return False
    except OSError:
        pass
    with contextlib.suppress(OSError):
        for compiled in (*cache.glob("*.nbi"), *cache.glob("*.nbc")):
            compiled.unlink(missing_ok=True)
        cache.mkdir(exist_ok=True)
        stamp.write_text(wanted)
        return True
    return False


_discard_stale(Path(__file__).parent)
