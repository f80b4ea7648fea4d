"""Pictures that nobody asked for by name carry a seal, by which camtool knows them again.

A page in Markdown brings a picture along, a batch one for each program. They lie beside drawings,
which may be SVG too: only a picture that bears the seal of its maker, and is as it was written, is
replaced. The seal is a comment at the end of the SVG.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path, PurePath

_BEGINS = b"<!-- camtool: sha256 "


def sealed(svg: bytes, maker: str) -> bytes:
    """The picture with the seal of its maker, the name of a page or of a drawing's outputs."""
    name = os.fsencode(PurePath(maker).name)
    digest = hashlib.sha256(name + b"\n" + svg).hexdigest().encode()
    return svg + _BEGINS + digest + b" -->\n"


def is_foreign(place: str | Path, maker: str) -> bool:
    """Whether something lies there that is no picture of this maker as it was written."""
    if not os.path.lexists(place):
        return False
    try:
        data = Path(place).read_bytes()
    except OSError:  # whatever it is, it is none of ours
        return True
    return data != sealed(data[: data.rfind(_BEGINS)], maker)
