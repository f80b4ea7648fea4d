"""Pages of the viewer that its tests look at."""

import json
import re
from functools import cache

import numpy as np
import pytest

from camtool.geometry.polylines import Segments
from camtool.pictures.scene import Playback, ReportTable, Scene, TableLine, by_feed
from camtool.pictures.viewer.page import viewer_page
from camtool.records import replace
from camtool.toolpath.moves import Toolpath

MANY = [50_000, pytest.param(200_000, marks=pytest.mark.slow)]
"""Moves of long programs."""

HOSTILE = "</script><script>hack()</script><img src=x onerror=hack()> {script} &amp; \ud800\x00\n"


def run_of(toolpath: Toolpath, **more: object) -> Playback:
    """The run of a toolpath by its feeds, and whatever else is said."""
    return replace(by_feed(toolpath, 60.0), **more)


def with_run(scene: Scene, run: Playback) -> Scene:
    return replace(scene, playback=lambda: run)


def busy(scene: Scene) -> Scene:
    """The scene with blocks, errors and tables."""
    toolpath = scene.toolpath
    assert toolpath is not None
    count = len(toolpath)
    numbered = replace(toolpath, block=np.arange(count))
    run = run_of(
        numbered,
        error_mm=np.linspace(0.0, 0.02, count),
        blocks=tuple(f"N{row} G01 X{row}" for row in range(count)),
        tables=(ReportTable("Worst moves", ("block", "error"), (TableLine(("3", "20"), 2),)),),
    )
    return with_run(replace(scene, toolpath=numbered, tool_mm=0.5, worst=((2.5, 2.5),)), run)


def traced(scene: Scene) -> Scene:
    """The scene with a run that knows the rows of its trace."""
    assert scene.playback is not None
    assert scene.toolpath is not None
    assert scene.trace_points is not None
    rows = np.linspace(0, len(scene.toolpath) - 1, len(scene.trace_points)).astype(np.int64)
    return with_run(scene, replace(scene.playback(), trace_row=rows))


def spiral(count: int) -> Toolpath:
    """A toolpath of many short lines on a spiral that fills 60 × 60 mm."""
    turn = np.linspace(0.0, 400.0, count)
    radius = 30.0 * turn / turn[-1]
    end = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.full(count, -0.1)])
    return Toolpath(
        kind=np.ones(count),
        end=end,
        centre=np.full((count, 2), np.nan),
        feed=np.full(count, 50.0),
        value=np.full(count, np.nan),
        source=np.full(count, -1),
        block=np.arange(count),
        start=np.zeros(3),
    )


def large(count: int) -> Scene:
    """A scene of so many moves, with a program, errors, a tool, and as many points of a predicted
    path, each 10 µm outside of the wanted one."""
    toolpath = spiral(count)
    blocks = tuple(f"G01X{x * 1000:09.2f}Y{y * 1000:09.2f}F050;" for x, y, _ in toolpath.end)
    error = np.abs(np.sin(np.arange(count))) * 0.01
    flat = toolpath.end[:, :2]
    out = flat / np.maximum(np.hypot(flat[:, 0], flat[:, 1]), 0.1)[:, None]
    scene = Scene(
        "many moves",
        toolpath=toolpath,
        trace_points=flat + error[:, None] * out,
        trace_error_mm=error,
        wanted=Segments.between(flat[1:-1], flat[2:], np.zeros(count - 2)),
        tool_mm=0.6,
    )
    rows = np.arange(count)
    return with_run(scene, run_of(toolpath, blocks=blocks, error_mm=error, trace_row=rows))


@cache
def large_text(count: int) -> str:
    """The page of so many moves, made once."""
    return text_of(large(count))


def text_of(scene: Scene) -> str:
    return viewer_page(scene).decode("utf-8")


def head_of(page: str) -> dict[str, object]:
    found = re.search(r'<script type="application/json" id="head">(.*?)</script>', page, re.S)
    assert found is not None
    return dict(json.loads(found[1]))
