"""A page on which a figure is drawn by mouse, pen or keys, and saved as a list of points.

One file without a server: it saves its figure as a download, in the form that
`camtool.importers.points` reads."""

from __future__ import annotations

import base64
import hashlib
import json
from importlib.resources import files


def drawing_page(width_mm: float, height_mm: float, grid_mm: float) -> bytes:
    """Return the HTML page for drawing on a sheet of this size, mm, whose lower left corner is
    part zero."""
    folder = files(__package__)
    page, style, script = (
        (folder / f"drawing.{suffix}").read_text(encoding="utf-8")
        for suffix in ("html", "css", "js")
    )
    sheet = json.dumps({"width": width_mm, "height": height_mm, "grid": grid_mm})
    script = script.replace("SHEET_OF_PAGE", sheet)
    values = {
        "STYLE": style,
        "SCRIPT": script,
        "STYLE_DIGEST": _digest(style),
        "SCRIPT_DIGEST": _digest(script),
    }
    for name, text in values.items():
        page = page.replace(f"{{{{{name}}}}}", text)
    return page.encode("utf-8")


def _digest(text: str) -> str:
    """Return the digest by which a browser knows that a script or style is the page's own."""
    digest = hashlib.sha256(text.encode("utf-8")).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"
