"""Values at the end of a notebook's cell show their picture and one line of text.

The formatter here asks as IPython's does: for each kind of data, a method `_repr_KIND_` of the
object (not of a class), whose None means nothing.
"""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

import camtool

KINDS = {
    "image/svg+xml": "_repr_svg_",
    "text/html": "_repr_html_",
    "image/png": "_repr_png_",
    "application/json": "_repr_json_",
}
SQUARE = "0,0\n4,0\n4,4\n0,4\n0,0\n"


def displayed(value: object) -> dict[str, Any]:
    """Return the data that a front end gets for the value, by MIME type."""
    bundle = {"text/plain": repr(value)}
    for kind, name in KINDS.items():
        method = None if isinstance(value, type) else getattr(value, name, None)
        data = method() if callable(method) else None
        if data is not None:
            bundle[kind] = data
    return bundle


@pytest.fixture(scope="module")
def values(tmp_path_factory: pytest.TempPathFactory) -> dict[str, object]:
    """Make one value of each type that the calls return."""
    file = tmp_path_factory.mktemp("notebook") / "square.csv"
    file.write_text(SQUARE)
    posted = camtool.post(file, "grbl")
    return {
        "drawing": posted.drawing,
        "toolpath": camtool.plan(posted.drawing, "grbl"),
        "posted": posted,
        "verification": camtool.verify(posted.data, "grbl"),
        "converted": camtool.convert(posted.data, "grbl", "linuxcnc"),
        "comparison": camtool.compare(posted.data, "grbl", "backlash=0,0.1"),
        "picture": camtool.preview(posted, size_px=400),
    }


def test_everything_with_a_picture_shows_it(values: dict[str, object]) -> None:
    for name, value in values.items():
        bundle = displayed(value)
        page = {"text/html"} if isinstance(value, camtool.Run) else set()
        assert set(bundle) == {"text/plain", "image/svg+xml"} | page, name
        assert "\n" not in bundle["text/plain"], name
        page = ElementTree.fromstring(bundle["image/svg+xml"])
        assert page.tag == "{http://www.w3.org/2000/svg}svg", name
        assert len(page) > 5, name


def test_the_rest_is_text(values: dict[str, object]) -> None:
    found = camtool.calibrate(Path("samples") / "measured" / "pic-mmh-lines.toml")
    assert list(displayed(found)) == ["text/plain"]
    assert list(displayed(camtool.Run)) == ["text/plain"]
    assert displayed(values["posted"]) == displayed(values["posted"])


def test_a_run_shows_its_page_in_a_frame(values: dict[str, object]) -> None:
    """The frame holds the page of `--report`, which runs no script: the picture, and figures."""
    frame = ElementTree.fromstring(
        displayed(values["posted"])["text/html"].replace(" sandbox", "")
    )
    page = frame.attrib["srcdoc"]
    assert page.startswith("<!")
    assert "<script" not in page
    assert "square.csv" in page
    assert "data:image/svg+xml;base64," in page
    assert "µm" in page
