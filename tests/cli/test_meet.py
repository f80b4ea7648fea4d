"""`camtool meet`: the job with which all dimensions hold, or why there is none."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from camtool.tables import parse_table
from tests.inspection.test_meet import BORE, KNOWN, WIDTH, limited, text_of_rows
from tests.inspection.test_verdicts import SVG

MACHINE = ("-t", "linuxcnc", *(part for each in KNOWN for part in ("--set", each)))
ASKED = ("meet", "plate.svg", *MACHINE, "--tolerances", "limits.toml", "--tool-diameter", "2mm")


@pytest.fixture
def plate(tmp_path: Path) -> Path:
    """A folder with a plate and the limits of its bore, which is to be a little smaller."""
    (tmp_path / "plate.svg").write_text(SVG)
    (tmp_path / "limits.toml").write_text(text_of_rows([limited(BORE, "-0.01/-0.03")]))
    return tmp_path


def test_the_job_that_it_writes_holds(camtool, plate):
    found = camtool(*ASKED, "--json", "-")
    assert found.returncode == 0, found.stderr
    said = found.stderr.decode()
    assert "more left on the walls of circle at line 3" in said
    assert "written: plate.meet.toml, a job with which every dimension holds" in said
    report = json.loads(found.stdout)
    assert report["holds"] is True
    assert report["certificate"] is None
    assert [each["before"]["verdict"] for each in report["dimensions"]] == ["out"]
    assert [each["after"]["verdict"] for each in report["dimensions"]] == ["in"]
    text = (plate / "plate.meet.toml").read_text(encoding="utf-8")
    assert text.startswith("# Every dimension of plate.svg that has limits holds on linuxcnc")
    asked = ("--tolerances", "limits.toml", "--require", "in", "--job", "plate.meet.toml")
    posted = camtool("post", "plate.svg", *MACHINE, *asked, "-o", "plate.ngc")
    assert posted.returncode == 0, posted.stderr
    before = camtool("post", "plate.svg", *MACHINE, *asked[:-2], "--tool-diameter", "2mm")
    assert before.returncode == 1
    # The same again, over a file that is there: what is made from the same is the same.
    assert camtool(*ASKED, "-q").returncode == 0
    assert (plate / "plate.meet.toml").read_text(encoding="utf-8") == text


def test_a_job_file_and_flags_become_one(camtool, plate):
    (plate / "job.toml").write_text('tool_diameter = "1mm"\ndepth = "0.5mm"\nsafe_z = "2mm"\n')
    asked = (*ASKED[:-2], "--job", "job.toml", "--depth", "0.7mm", "-o", "-", "-q")
    found = camtool(*asked)
    assert found.returncode == 0, found.stderr
    job = parse_table(found.stdout.decode())
    assert job["safe_z"] == "2mm"
    assert {each["depth"] for each in job["operations"]} == {"0.7mm"}


def test_what_holds_already_is_left_alone(camtool, plate):
    (plate / "limits.toml").write_text(text_of_rows([limited(BORE, "±0.05")]))
    found = camtool(*ASKED)
    assert found.returncode == 0, found.stderr
    assert b"every dimension holds as it is: no job was written" in found.stderr
    assert not (plate / "plate.meet.toml").exists()


def test_why_nothing_holds_is_said(camtool, plate):
    (plate / "limits.toml").write_text(text_of_rows([limited(WIDTH, "±0.004")]))
    found = camtool(*ASKED, "--most", "3", "--json", "report.json")
    assert found.returncode == 1
    said = found.stderr.decode()
    assert "width decides: 40.0000 mm, and must be 39.996 … 40.004 mm" in said
    assert "it would take uncertainty.tool_diameter_mm at most" in said
    assert "error: plate.svg: no job was found with which every dimension holds" in said
    report = json.loads((plate / "report.json").read_text(encoding="utf-8"))
    assert report["holds"] is False
    assert report["certificate"]["binding"] == "width"
    assert report["certificate"]["needs"]


def test_what_fits_nothing_is_not_passed_over(camtool, plate):
    """Limits as drawn are not known where nothing is drawn; `post --require in` refuses them."""
    ghost = {"name": "ghost", "kind": "diameter", "at": [9, 9], "limits": "±0.1"}
    for rows in ([ghost], [ghost, limited(BORE, "±0.05")]):
        (plate / "limits.toml").write_text(text_of_rows(rows))
        found = camtool(*ASKED)
        assert found.returncode == 2
        assert b"no job can be said to meet it: ghost is not inspected: nothing" in found.stderr
        assert found.stderr.startswith(b"camtool: error: plate.svg, limits.toml, dimension 1, at")


def test_a_job_that_leaves_out_what_has_limits_is_told(camtool, plate):
    (plate / "limits.toml").write_text(text_of_rows([limited(BORE, "±0.05"), WIDTH]))
    holds = camtool(*ASKED, "--select", "inner", "--json", "-")
    assert holds.returncode == 0, holds.stderr
    asked = ("--tolerances", "limits.toml", "--require", "in", "--tool-diameter", "2mm")
    posted = camtool("post", "plate.svg", *MACHINE, *asked, "--select", "inner", "-o", "-")
    assert posted.returncode == 0, posted.stderr  # nothing is asked of the width
    (plate / "limits.toml").write_text(
        text_of_rows([limited(BORE, "±0.05"), limited(WIDTH, "±0.05")])
    )
    lacks = camtool(*ASKED, "--select", "inner", "--most", "2")
    assert lacks.returncode == 1
    assert b"width is not inspected: the program does not cut its edge" in lacks.stderr
    posted = camtool("post", "plate.svg", *MACHINE, *asked, "--select", "inner", "-o", "-")
    assert posted.returncode == 1


def test_wrong_use_is_one_line(camtool, plate):
    none = camtool("meet", "plate.svg", *MACHINE)
    assert none.returncode == 2
    assert b"--tolerances" in none.stderr
    part = camtool(*ASKED, "--operation", "1")
    assert part.returncode == 2
    assert b"--operation leaves a part of the job" in part.stderr
    (plate / "limits.toml").write_text(text_of_rows([BORE]))
    unlimited = camtool(*ASKED)
    assert unlimited.returncode == 2
    assert b"no dimension with limits can be inspected" in unlimited.stderr
    (plate / "job.toml").write_text('tool_diameter = "2mm"\n')
    over = camtool(*ASKED[:-2], "--job", "job.toml", "-o", "job.toml")
    assert over.returncode == 2
    assert (plate / "job.toml").read_text() == 'tool_diameter = "2mm"\n'
    (plate / "limits.toml").write_text(text_of_rows([limited(BORE, "±0.05")]))
    scaled = camtool(*ASKED, "--scale", "2")
    assert scaled.returncode == 2
    assert b"2 times as large as it is drawn" in scaled.stderr
