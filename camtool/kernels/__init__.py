"""Compiled inner loops: arrays in, arrays out.

numba keeps what it compiled beside the sources, and notices a change of a kernel's own file only:
one that calls a kernel of another file would go on running that file's old code after an update.
So what was compiled of a file is thrown away here when it, or any file of this folder that it
imports from, however far, has changed.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import re
from pathlib import Path

_STAMP = "camtool-kernels.digest"
_IMPORT = re.compile(r"^\s*from camtool\.kernels\.(\w+) import", re.MULTILINE)


def _digests(folder: Path) -> dict[str, str]:
    """Of each source in `folder` the digest of it and of all that it imports from there."""
    texts = {source.stem: source.read_bytes() for source in sorted(folder.glob("*.py"))}
    uses = {name: set(_IMPORT.findall(text.decode())) & set(texts) for name, text in texts.items()}
    digests = {}
    for name in texts:
        known, waiting = {name}, [name]
        while waiting:
            new = uses[waiting.pop()] - known
            known |= new
            waiting += new
        whole = hashlib.sha256()
        for part in sorted(known):
            whole.update(part.encode() + b"\0" + texts[part])
        digests[name] = whole.hexdigest()
    return digests


def _discard_stale(folder: Path) -> set[str]:
    """The sources in `folder` whose compiled kernels were thrown away, since they had changed.

    Where the folder cannot be written numba keeps its files elsewhere, and nothing is done.
    """
    cache = folder / "__pycache__"
    stamp, wanted = cache / _STAMP, _digests(folder)
    known: dict[str, str] = {}
    with contextlib.suppress(OSError, ValueError):
        known = dict(json.loads(stamp.read_text()))
    stale = {name for name in {*known, *wanted} if known.get(name) != wanted.get(name)}
    if not stale:
        return set()
    with contextlib.suppress(OSError):
        cache.mkdir(exist_ok=True)
        for compiled in (*cache.glob("*.nbi"), *cache.glob("*.nbc")):
            if compiled.name.partition(".")[0] in stale or not known:
                compiled.unlink(missing_ok=True)
        stamp.write_text(json.dumps(wanted))
        return stale
    return set()


_discard_stale(Path(__file__).parent)
