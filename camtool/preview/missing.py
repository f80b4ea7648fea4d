"""Layers that hold nothing in a picture: who names one of them wants to hear of it."""

from __future__ import annotations

from collections.abc import Iterable

from camtool.preview.content import Content, content_of
from camtool.preview.layers import NOT_UNDER_PATH
from camtool.preview.options import Options
from camtool.preview.scene import Scene


def missing_layers(scene: Scene, options: Options, names: Iterable[str]) -> list[str]:
    """Those of the `names` of layers that hold nothing in the picture of the scene, wherever its
    window lies."""
    content = content_of(scene, options)
    return [name for name in names if not _holds(name, content)]


def _holds(name: str, content: Content) -> bool:
    if name in NOT_UNDER_PATH and content.trace is not None:
        return False
    return {
        "drawing": bool(content.outlines),
        "swept": bool(content.swept),
        "travel": content.scene.travel_mm is not None,
        "reversals": len(content.reversals) > 0,
        "path": content.trace is not None,
        "worst": len(content.worst) > 0,
        "zero": not content.is_empty,
        "doubts": any(len(places) for _, _, places, _ in content.places.looks()),
        **_moves(content),
    }[name]


def _moves(content: Content) -> dict[str, bool]:
    strokes = content.strokes
    return {
        "rapids": strokes is not None and bool(strokes.rapids),
        "feeds": strokes is not None and bool(strokes.feeds or strokes.ramps),
        "plunges": strokes is not None and len(strokes.plunges) > 0,
        "starts": len(content.starts) > 0,
        "order": strokes is not None and len(strokes.starts) > 0,
        "arrows": bool(content.arrows),
    }
