"""Pictures of what the other calls give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypedDict, Unpack

from camtool.geometry.drawing import Drawing as DrawingRecord
from camtool.pipeline.judge import Posted as PostedRecord
from camtool.preview.scene import Scene
from camtool.results import Drawing, Picture, Shown, Toolpath, extended
from camtool.toolpath.moves import Toolpath as ToolpathRecord


class Looks(TypedDict, total=False):
    """How a picture looks: the fields of `camtool.preview.options.Options`. `size_px` is its
    width, `crop_mm` the part (x, y, width, height) that it shows, `exaggerate` how many times as
    far from the wanted path the predicted one is drawn, `layers` the names of those to show,
    `polar` the circle, from 1, of which the radial errors are plotted instead."""

    size_px: int | None
    crop_mm: tuple[float, float, float, float] | None
    dark: bool
    exaggerate: float
    layers: frozenset[str]
    polar: int | None


def preview(
    what: DrawingRecord | ToolpathRecord | PostedRecord | Shown,
    *beside: DrawingRecord | ToolpathRecord | PostedRecord | Shown,
    titles: Sequence[str] = (),
    **looks: Unpack[Looks],
) -> Picture:
    """The picture of what any of these calls gave: the drawing, its toolpath, the path that the
    slides are predicted to take, coloured by its error (µm, with scale), or several such paths.

    Of several values: `beside` each other, at one scale, by one map of errors. `titles` take the
    place of their own, in order. Raises OptionError for looks that make no picture. Source:
    docs/pictures.md, docs/viewer.md.
    """
    from camtool.preview.options import Options

    scenes = [_shown(each)._scene() for each in (what, *beside)]
    if len(titles) > len(scenes):
        raise TypeError(f"{len(titles)} titles for {len(scenes)} values")
    for row, title in enumerate(titles):
        scenes[row] = replace(scenes[row], title=title)
    options = Options(**looks)
    if not beside:
        return Picture(scenes[0], options)
    for value, scene in zip((what, *beside), scenes, strict=True):
        if not isinstance(scene, Scene):
            raise TypeError(f"a {type(value).__name__} stands beside no other picture")
    return Picture(tuple(scene for scene in scenes if isinstance(scene, Scene)), options)


def _shown(what: Any) -> Shown:
    """The value, as one that has a picture."""
    if isinstance(what, Shown):
        return what
    if isinstance(what, DrawingRecord):
        return extended(Drawing, what)
    if isinstance(what, ToolpathRecord):
        return extended(Toolpath, what)
    if isinstance(what, PostedRecord):
        return extended(Toolpath, what.decoded or what.wanted)
    raise TypeError(f"{type(what).__name__} has no picture")
