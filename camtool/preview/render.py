"""A scene as the bytes of a picture file, by the file's extension."""

from __future__ import annotations

from pathlib import PurePath

from camtool.errors import OutputError
from camtool.preview.draw import Scene, draw, png

PNG_WIDTH_PX = 1200


def render(scene: Scene, name: str) -> bytes:
    """SVG or PNG bytes of the scene for a file of this name; OutputError for other extensions."""
    suffix = PurePath(name).suffix.lower()
    svg = draw(scene)
    if suffix == ".svg":
        return svg.encode()
    if suffix == ".png":
        return png(svg, PNG_WIDTH_PX)
    raise OutputError("is no kind of picture that we make", file=name, mend="use .svg or .png")
