"""A scene as the bytes of a picture file, by the file's extension."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import PurePath

from camtool.errors import OutputError
from camtool.preview.draw import draw, png
from camtool.preview.options import AS_USUAL, PNG_WIDTH_PX, SVG_WIDTH_PX, Options
from camtool.preview.scene import Scene


def render(scene: Scene, name: str, options: Options = AS_USUAL) -> bytes:
    """SVG, PNG or HTML bytes of the scene for a file of this name; OutputError for other
    extensions. HTML is the viewer, which has no options."""
    if PurePath(name).suffix.lower() == ".html":
        from camtool.preview.viewer.page import viewer_page

        return viewer_page(scene)
    return rendered(lambda sized: draw(scene, options=sized), name, options)


def rendered(drawn: Callable[[Options], str], name: str, options: Options) -> bytes:
    """The same of whatever makes SVG text with options that say how wide."""
    suffix = PurePath(name).suffix.lower()
    if suffix not in (".svg", ".png"):
        raise OutputError("is no kind of picture that we make", file=name, mend="use .svg or .png")
    usual = SVG_WIDTH_PX if suffix == ".svg" else PNG_WIDTH_PX
    width = options.size_px or usual
    svg = drawn(replace(options, size_px=width))
    return svg.encode() if suffix == ".svg" else png(svg, width)
