"""The commands that make pages: what the viewer gets to know of a program."""

from pathlib import Path

import click
import pytest

from camtool.cli.main import cli
from tests.pictures.viewer_pages import head_of


@pytest.fixture
def drawing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    Path("a.csv").write_text("0,0\n4,0\n4,3\n0,0\n", encoding="utf-8")
    return "a.csv"


def head(*arguments: str, page: str = "a.html") -> dict[str, object]:
    cli.main([*arguments, "-q"], standalone_mode=False)
    return head_of(Path(page).read_text(encoding="utf-8"))


def counts(page: dict[str, object]) -> dict[str, int]:
    """Return the length of each column of the page."""
    columns = page["columns"]
    assert isinstance(columns, dict)
    return {name: count for name, (_, _, count, *_) in columns.items()}


def test_a_drawing_alone_has_no_time(drawing: str) -> None:
    page = head("preview", drawing, "-o", "a.html")
    assert page["blocks"] is None
    assert counts(page)["move_seconds"] == 0
    assert counts(page)["drawn_path"] == 3


def test_post_verify_and_preview_show_the_same_program(drawing: str) -> None:
    posted = head("post", drawing, "--target", "pic-mmh", "-o", "a.pic", "--preview", "a.html")
    program = Path("a.pic").read_text(encoding="ascii")
    assert str(posted["blocks"]).split() == program.split()
    assert counts(posted)["move_seconds"] > 5
    assert counts(posted)["trace_row"] > 5
    judged = head("verify", "a.pic", "--target", "pic-mmh", "--preview", "a.html")
    shown = head("preview", "a.pic", "--target", "pic-mmh", "-o", "a.html")
    assert judged["blocks"] == shown["blocks"] == posted["blocks"]
    assert judged["tables"] == shown["tables"] != []
    planned = head("preview", drawing, "--target", "pic-mmh", "-o", "a.html")
    assert planned["blocks"] == posted["blocks"]
    assert planned["worst"] == posted["worst"] != []


def test_the_report_names_the_moves_that_it_speaks_of(drawing: str) -> None:
    page = head("post", drawing, "--target", "grbl", "-o", "a.nc", "--preview", "a.html")
    tables = page["tables"]
    assert isinstance(tables, list)
    named = {table["title"]: table for table in tables}
    facts = {row["cells"][0]: row["cells"][1] for row in named["Report"]["rows"]}
    assert "grbl" in facts["target"]
    assert "mechanics" in facts["by source"]
    assert all(isinstance(row["move"], int) for row in named["Worst moves"]["rows"])
    assert str(page["blocks"]).split("\n")[-1] == Path("a.nc").read_text().strip().split("\n")[-1]


def test_dimensions_and_contours_have_their_places(drawing: str) -> None:
    limits = """[[dimension]]
    name = "length"
    kind = "distance"
    from = [0, 1]
    to = [4, 1]
    limits = "±0.5"
    """
    Path("limits.toml").write_text(limits, encoding="utf-8")
    Path("b.csv").write_text("0,0\n4,0\n4,3\n0,3\n0,0\n", encoding="utf-8")
    line = ("post", "b.csv", "--target", "grbl", "--tool-diameter", "1mm", "-o", "a.nc")
    page = head(*line, "--tolerances", "limits.toml", "--preview", "a.html")
    tables = page["tables"]
    assert isinstance(tables, list)
    named = {table["title"]: table for table in tables}
    (row,) = named["Dimensions"]["rows"]
    assert row["cells"][:3] == ["length", "±0.5", "4.0000"]
    assert row["cells"][-1] in ("in", "undecided")
    assert row["at"] == [2.0, 1.0]
    for row in named["Contours"]["rows"]:
        assert row["cells"][-1] == f"({row['at'][0]:.3f}, {row['at'][1]:.3f})"


def test_a_finding_has_the_place_of_its_words(drawing: str) -> None:
    samples = Path(__file__).parents[2] / "samples"
    line = ("post", str(samples / "plate.dxf"), "--job", str(samples / "plate.toml"))
    page = head(*line, "-t", "linuxcnc", "-o", "b.ngc", "--preview", "b.html", page="b.html")
    tables = page["tables"]
    assert isinstance(tables, list)
    (found,) = (table for table in tables if table["title"] == "Findings")
    placed = {row["cells"][1]: row["at"] for row in found["rows"] if row["at"]}
    # The window's corner, and the point of the star.
    assert placed["LOOSE_PIECE"] == pytest.approx([17.0, 17.0], abs=0.02)
    assert placed["DEPTH_LIMITED"] == [66.0, 35.0]
    stock = page["stock"]
    assert isinstance(stock, dict)
    stock.pop("grid")
    assert stock == {"box": [-8.0, -8.0, 88.0, 58.0], "bottom": -6.0}
    cutters = page["cutters"]
    assert isinstance(cutters, list)
    # Seven operations with four turns of a tool: the mill, the drill, the bit, the mill again.
    assert [round(each[1], 3) for each in cutters] == [1.5, 1.5, 3.0, 1.5]
    bodies = page["bodies"]
    assert isinstance(bodies, list)
    assert len(bodies) == 7
    assert [each[4] > 0.0 for each in cutters] == [False, True, True, False]


def test_several_ways_make_no_page(drawing: str) -> None:
    head("post", drawing, "--target", "pic-mmh", "-o", "a.pic", "--preview", "a.html")
    compared = ["verify", "a.pic", "--target", "pic-mmh", "--compare", "mechanics"]
    with pytest.raises(click.UsageError, match=r"draws only \.svg and \.png"):
        head(*compared, "--preview", "b.html")
