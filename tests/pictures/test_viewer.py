"""The viewer's pages as files: whole, the same every time, and safe whatever names they hold."""

import base64
import hashlib
import json
import re
import tomllib
from html.parser import HTMLParser
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

import camtool
from camtool.geometry.polylines import Polylines, Segments
from camtool.pictures.colours import BINS
from camtool.pictures.content import content_of
from camtool.pictures.draw import render
from camtool.pictures.layers import LAYERS
from camtool.pictures.scene import Playback, ReportTable, Round, Scene, TableLine, by_feed
from camtool.pictures.trace import bins_of, exaggerated, trace_of
from camtool.pictures.viewer.columns import CountColumn, columns_of, packed, traced_of
from camtool.pictures.viewer.page import MAX_PLOTS, SCRIPTED, SCRIPTS, viewer_page
from camtool.records import replace
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind
from tests.oracles.page_paths import viewer_column
from tests.pictures.conftest import NASTY, SCENES, circle, drawing_of, followed, line
from tests.pictures.viewer_pages import (
    HOSTILE,
    MANY,
    busy,
    head_of,
    large_text,
    run_of,
    text_of,
    traced,
    with_run,
)

MOST_BYTES_A_MOVE = 100


class Tags(HTMLParser):
    """All tags with their attributes, and the text of each script."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: list[str] = []
        self.inside = ""
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self.inside = tag
        if tag == "script":
            self.scripts.append("")

    def handle_endtag(self, tag: str) -> None:
        self.inside = ""

    def handle_data(self, data: str) -> None:
        if self.inside == "script":
            self.scripts[-1] += data


def test_every_scene_makes_a_page_of_its_own_the_same_each_time(scene: Scene) -> None:
    page = viewer_page(scene)
    assert page == viewer_page(scene) == render(scene, "a.HTML")
    tags = [name for name, _ in Tags(page.decode()).tags]
    assert tags.count("html") == tags.count("body") == 1
    assert tags.count("script") == 3


def test_nothing_is_loaded_from_anywhere(scenes: dict[str, Scene]) -> None:
    page = text_of(busy(scenes["result"]))
    for _, attributes in Tags(page).tags:
        assert not {"src", "href", "style", "action"} & set(attributes)
        assert not any(name.startswith("on") for name in attributes)
    assert not re.search(r"https?:|@import|url\(|fetch\(|XMLHttp|WebSocket|import\(", page)


def test_the_policy_names_the_script_and_the_styles(scenes: dict[str, Scene]) -> None:
    page = text_of(scenes["toolpath"])
    tags = Tags(page)
    policy = next(a["content"] for n, a in tags.tags if "http-equiv" in a and n == "meta")
    style = re.search(r"<style>(.*?)</style>", page, re.S)
    assert policy is not None
    assert style is not None
    for kind, text in (("script", tags.scripts[-1]), ("style", style[1])):
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        assert f"{kind}-src 'sha256-{digest}'" in policy
    assert policy.startswith("default-src 'none'")


def test_the_script_makes_no_markup_of_text() -> None:
    folder = resources.files("camtool.pictures.viewer")
    for name in SCRIPTS:
        text = folder.joinpath(name).read_text(encoding="utf-8")
        for call in ("innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval("):
            assert call not in text, name
        assert "</" not in text


@pytest.mark.parametrize("words", [HOSTILE, NASTY, "{head}{columns}", "<!--", "]]>"])
def test_names_stay_names(words: str) -> None:
    drawing = drawing_of([circle(1.0, 1.0, 1.0)], [words])
    toolpath = followed(drawing)
    table = ReportTable(words, (words,), (TableLine((words,), 0),))
    run = run_of(toolpath, blocks=(words,) * 3, tables=(table,))
    scene = with_run(Scene(words, drawing, toolpath, notes=(words,)), run)
    page = text_of(scene)
    plain = text_of(with_run(Scene("t", drawing_of([circle(1.0, 1.0, 1.0)], ["l"])), run))
    tags, clean = Tags(page), Tags(plain)
    assert [name for name, _ in tags.tags] == [name for name, _ in clean.tags]
    assert tags.scripts[-1] == clean.scripts[-1]
    head = head_of(page)
    assert head["layers"] == [{"name": words, "light": "#2b4c6f", "dark": "#cfdbe8"}]
    assert head["tables"] == [
        {"title": words, "columns": [words], "rows": [{"cells": [words], "move": 0, "at": None}]}
    ]
    assert str(head["blocks"]).count("\n") == 2


def test_every_layer_is_drawn_by_its_parts_or_by_the_script() -> None:
    for layer in LAYERS:
        assert (layer.name in SCRIPTED) or (layer.parts is not None), layer.name
    assert {layer.name for layer in LAYERS} >= SCRIPTED


def test_columns_come_back_as_they_went_in(scenes: dict[str, Scene]) -> None:
    scene = busy(scenes["result"])
    assert scene.playback is not None
    assert scene.toolpath is not None
    run = Playback(
        scene.playback().seconds,
        scene.playback().error_mm,
        np.arange(len(scene.trace_points if scene.trace_points is not None else ())),
    )
    wide = {"wide": np.array([7, -70_000], dtype="<i4"), "far": np.array([0, 2**40, -(2**40)])}
    wide |= {"none": np.array([], dtype="<i4"), "zero": np.array([0, 0, 0, 0], dtype="<i4")}
    counted = {name: CountColumn(column, 0.5, 2) for name, column in wide.items()}
    columns = {**columns_of(content_of(scene), run), **traced_of(scene, run, 20.0).columns}
    columns |= wide | {f"{name}_counted": column for name, column in counted.items()}
    columns["far"] = CountColumn(wide["far"])
    named, data = packed(columns)
    assert all(offset % 4 == 0 for _, offset, *_ in named.values())
    head, block = json.dumps({"columns": named}), base64.b64encode(data).decode()
    page = (
        f'<script type="a" id="head">{head}</script><script type="a" id="columns">{block}</script>'
    )
    for name, column in columns.items():
        known = column.counts * column.unit if isinstance(column, CountColumn) else column
        np.testing.assert_array_equal(viewer_column(page, name), known.ravel())
    np.testing.assert_allclose(np.asarray(columns["move_end"]), scene.toolpath.end, atol=1e-6)
    assert named["trace_row"][2] == len(columns["trace_bin"]) > 100
    page = text_of(scene)
    block = re.search(r'id="columns">([^<]*)<', page)
    assert block is not None
    assert base64.b64decode(block[1])


def test_the_page_draws_deviations_as_pictures_do() -> None:
    ring = Segments.of(Polylines.of([circle(2.5, 2.5, 2.0)]))
    scene = traced(busy(replace(SCENES["result"], wanted=ring)))
    assert scene.playback is not None
    assert scene.trace_points is not None
    assert scene.trace_cutting is not None
    found = traced_of(scene, scene.playback(), 20.0)
    column = found.columns["trace_off"]
    assert isinstance(column, CountColumn)
    counts = column.counts.astype(float)
    off = counts * found.count_mm
    assert np.abs(counts).max() == 4_000
    cut = scene.trace_cutting
    drawn = scene.trace_points + 49.0 * off
    wanted = exaggerated(scene.trace_points, ring, 50.0)
    np.testing.assert_allclose(drawn[cut], wanted[cut], atol=50.0 * found.count_mm)
    worst = np.array(scene.worst)
    moved = exaggerated(worst, ring, 50.0)
    np.testing.assert_allclose(worst + 49.0 * found.worst_off, moved, atol=1e-9)
    picture = trace_of(scene)
    assert picture is not None
    bins = found.columns["trace_bin"]
    assert isinstance(bins, np.ndarray)
    shown = bins[1:].astype(int)
    np.testing.assert_array_equal(
        np.where(shown == BINS, -1, shown), bins_of(replace(picture, top_um=20.0))
    )


def test_the_wanted_path_breaks_where_it_does() -> None:
    paths = [line((0.0, 0.0), (1.0, 0.0, 1.0), (1.0, 2.0)), line((5.0, 5.0), (6.0, 5.0))]
    wanted = Segments.of(Polylines.of(paths))
    toolpath = followed(drawing_of(paths, ["a", "b"]))
    scene = Scene("t", toolpath=toolpath, wanted=wanted)
    columns = columns_of(content_of(scene), run_of(toolpath))
    found = {
        name: np.asarray(columns[f"wanted_{name}"]).tolist() for name in ("break", "begin", "arc")
    }
    assert found == {"break": [0, 2], "begin": [[0.0, 0.0], [5.0, 5.0]], "arc": [1]}


def test_full_circles_are_plotted_in_the_colours_of_the_page() -> None:
    rounds = tuple(lobed(1e-3 * size) for size in range(20))
    page = text_of(Scene("t", rounds=rounds))
    figures = re.findall(r"<figure>.*?</figure>", page, re.S)
    assert len(figures) == MAX_PLOTS == 16
    assert "16 of 20 with the largest" in page
    # The least ones are left out, the order is that of the report.
    assert [int(found) for found in re.findall(r"of circle (\d+)", page)] == [*range(5, 21)]
    assert max(map(len, figures)) < 12_000
    for colour in re.findall(r'(?:fill|stroke)="([^"]*)"', "".join(figures)):
        assert colour == "none" or re.fullmatch(r"var\(--[a-z-]+\)", colour)
    assert set(re.findall(r"var\((--[a-z-]+)\)", page)) <= set(re.findall(r"(--[a-z-]+):", page))
    ids = re.findall(r'id="([^"]*)"', page)
    assert len(set(ids)) == len(ids)
    assert "<figure>" not in text_of(SCENES["toolpath"])


def test_a_circle_in_both_directions_is_plotted_once() -> None:
    both = (replace(lobed(0.01), partner=2), replace(lobed(0.01), ccw=True, partner=1))
    assert text_of(Scene("t", rounds=both)).count("<figure>") == 1


def lobed(size_mm: float) -> Round:
    """A circle whose radius is off by three lobes, seen over three quarters of it."""
    angle = (np.arange(720) + 0.5) * np.pi / 360.0
    radius = 2.0 + size_mm * np.sin(3.0 * angle)
    point = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    square = radius[:, None] ** 2
    bins = np.hstack([np.ones((720, 1)), point, square, point, square, point])
    bins[:180] = 0.0
    error = 2.0 * size_mm
    return Round((0.0, 0.0), 2.0, False, bins, error, (size_mm, -size_mm, 0.0), (0.0, 0.0))


def test_a_run_by_feeds_takes_the_time_of_its_path() -> None:
    path = ToolpathBuilder().rapid(3.0, 4.0).line(3.0, 4.0, -1.0, feed=30.0)
    path.arc(3.0, 4.0, centre=(3.0, 3.0), ccw=True, feed=60.0).event(Kind.DWELL, 2.5)
    run = by_feed(path.finish(), 300.0)
    np.testing.assert_allclose(run.seconds[:4], [1.0, 2.0, 2.0 * np.pi, 2.5])
    assert np.isnan(run.error_mm).all()
    assert by_feed(path.finish(), np.inf).seconds[0] == 0.0


def test_what_does_not_fit_is_refused(scenes: dict[str, Scene]) -> None:
    scene = scenes["toolpath"]
    ints = np.empty(0, dtype=np.int64)
    with pytest.raises(ValueError, match="another toolpath"):
        viewer_page(with_run(scene, Playback(np.zeros(2), np.zeros(2), ints)))
    with pytest.raises(ValueError, match="different lengths"):
        Playback(np.zeros(2), np.zeros(3), ints)
    with pytest.raises(ValueError, match="below 0"):
        Playback(np.array([-1.0]), np.zeros(1), ints)


@pytest.mark.parametrize("count", MANY)
def test_many_moves_stay_small(count: int) -> None:
    assert 50 * count < len(large_text(count)) < MOST_BYTES_A_MOVE * count


def test_the_package_holds_every_file() -> None:
    """All files that the page is made of are installed with the package."""
    root = Path(__file__).parents[2]
    project = tomllib.loads((root / "pyproject.toml").read_text())
    patterns = project["tool"]["setuptools"]["package-data"]["camtool"]
    held = {file for pattern in patterns for file in (root / "camtool").glob(pattern)}
    folder = root / "camtool/pictures/viewer"
    files = {file for file in folder.iterdir() if file.suffix in (".js", ".css", ".html")}
    assert files <= held
    assert {file.name for file in files if file.suffix == ".js"} == set(SCRIPTS)
    assert (folder / "__init__.py").exists()


def test_the_page_lists_the_bounds_of_drawing_stock_and_program() -> None:
    run = camtool.post("samples/plate.dxf", "grbl", camtool.read_job("samples/plate.toml"))
    tables = head_of(viewer_page(run.scene()).decode("utf-8"))["tables"]
    (bounds,) = (each for each in tables if each["title"] == "Bounds")
    cells = {row["cells"][0]: row["cells"][1:] for row in bounds["rows"]}
    assert cells["stock"][2] == "−6.000 to 0.000"
    assert set(cells) == {"drawing", "stock", "program"}
    assert cells["program"][2] == "−6.000 to 25.000"
