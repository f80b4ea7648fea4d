"""`camtool tolerances`: a file begun from a drawing, and what it says."""

from __future__ import annotations

import json
from pathlib import Path

from tests.importers.test_dxf import data_of
from tests.inspection.test_tolerances import BORE, part, with_text

SAMPLES = Path(__file__).parents[2] / "samples"


def test_a_file_is_begun_filled_in_and_shown(camtool, tmp_path):
    drawing = tmp_path / "part.dxf"
    drawing.write_bytes(data_of(with_text(part(), "%%c6 H7")))
    made = camtool("tolerances", "new", "part.dxf")
    assert made.returncode == 0
    assert b"written: tolerances.toml, 7 dimensions" in made.stderr
    file = tmp_path / "tolerances.toml"
    text = file.read_text(encoding="utf-8")
    filled = text.replace('# general = "ISO 2768-m"', 'general = "ISO 2768-m"')
    file.write_text(filled.replace('# limits = "H7"', 'limits = "±0.02"', 1), encoding="utf-8")
    asked = ("tolerances", "show", "tolerances.toml", "--against", "part.dxf")
    shown = camtool(*asked)
    lines = shown.stdout.decode().splitlines()
    assert shown.returncode == 0
    assert lines[0].split() == [
        *("Ø6", "diameter", "6", "mm", "+0.012/0", "6", "…", "6.012", "mm"),
        *("H7", "tolerances.toml,", "dimension", "1"),
    ]
    assert "4.98 … 5.02 mm" in lines[1]
    assert "39.7 … 40.3 mm" in lines[5]
    assert "ISO 2768-m" in lines[5]
    again = camtool("tolerances", "new", "part.dxf")
    assert again.returncode == 2
    assert b"exists already" in again.stderr
    report = camtool(
        "tolerances", "show", "tolerances.toml", "--against", "part.dxf", "--json", "-"
    )
    said = json.loads(report.stdout)
    assert said["dimensions"][0]["upper_mm"] == 0.012
    assert said["dimensions"][0]["limits"] == "H7"
    assert [each["code"] for each in said["findings"]].count("DIMENSION_TWICE") == 1


def test_a_dimension_on_nothing_is_a_comment_and_a_warning(camtool, tmp_path):
    """As in drawings that were stretched without their dimensions."""
    doc = with_text(part(), "<>")
    doc.modelspace().add_linear_dim(base=(0, -5), p1=(60, 40), p2=(75, 40)).render()
    (tmp_path / "part.dxf").write_bytes(data_of(doc))
    made = camtool("tolerances", "new", "part.dxf")
    assert made.returncode == 0
    assert b"15 is not inspected: nothing that is drawn fits" in made.stderr
    assert b"DIMENSION left out" not in made.stderr  # they are read
    text = (tmp_path / "tolerances.toml").read_text(encoding="utf-8")
    assert (
        "nothing that is drawn fits; give it places on edges or circles\n# [[dimension]]" in text
    )
    assert "\n# from = [60, 40]\n" in text
    count = made.stderr.decode().partition(" dimensions;")[0].rpartition(" ")[2]
    assert text.count("\n[[dimension]]") == int(count)
    asked = ("tolerances", "show", "tolerances.toml", "--against", "part.dxf")
    shown = camtool(*asked)
    assert shown.returncode == 0
    assert b"DIMENSION_UNBOUND" in shown.stderr
    # Whoever takes the comment away has it once.
    lines = text.splitlines()
    begin = lines.index("# [[dimension]]")
    lines[begin:] = [line.removeprefix("# ") for line in lines[begin:]]
    (tmp_path / "tolerances.toml").write_text("\n".join(lines), encoding="utf-8")
    shown = camtool(*asked)
    assert shown.stdout.decode().count("15 mm") == 1
    assert shown.stderr.decode().count("DIMENSION_UNBOUND") == 1


def test_without_a_drawing_sizes_are_as_drawn(camtool, tmp_path):
    (tmp_path / "t.toml").write_text(BORE + 'limits = "H7"', encoding="utf-8")
    shown = camtool("tolerances", "show", "t.toml")
    assert shown.stdout.decode().split() == [
        *("diameter", "1", "diameter", "as", "drawn", "H7", "t.toml,", "dimension", "1")
    ]


def test_errors_of_a_file_are_one_line_and_code_2(camtool, tmp_path):
    (tmp_path / "t.toml").write_text(BORE + 'limits = "-0.2/+0.1"', encoding="utf-8")
    told = camtool("tolerances", "show", "t.toml")
    assert told.returncode == 2
    assert told.stderr.decode() == (
        "camtool: error: t.toml: dimension 1, key limits: "
        "limits '-0.2/+0.1' are the wrong way round; write +0.1/-0.2 if that is meant\n"
    )
    assert camtool("tolerances", "show", "none.toml").returncode == 2


def test_a_size_that_is_not_drawn_gives_code_1(camtool, tmp_path):
    (tmp_path / "part.dxf").write_bytes(data_of(part()))
    (tmp_path / "t.toml").write_text(BORE + 'nominal = "7mm"', encoding="utf-8")
    told = camtool("tolerances", "show", "t.toml", "--against", "part.dxf")
    assert told.returncode == 1
    assert b"error DIMENSION_DIFFERS" in told.stderr


def test_escape_sequences_in_names_stay_out_of_terminals(camtool, tmp_path):
    text = f'name = "\\u001b[2J"\n{BORE.partition(chr(10))[2]}'
    (tmp_path / "t.toml").write_text(f"[[dimension]]\n{text}", encoding="utf-8")
    assert b"\x1b" not in camtool("tolerances", "show", "t.toml").stdout
