"""A file and flags written as one job file, with and without changes."""

import itertools
import re
from pathlib import Path
from typing import Any

import pytest

from camtool.errors import OptionError
from camtool.jobs.build import JobTables, build_job, read_job_file, tables_of, tables_of_flags
from camtool.jobs.changes import Change, Left, changed_tables_of, merged_tables, text_of
from camtool.tables import parse_table

# All but those that are no job, and those that know no depth, no leads, or no tabs.
SAMPLES = [
    path
    for path in sorted(Path("samples").glob("*.toml"))
    if "[machine" not in path.read_text(encoding="utf-8")
    and path.stem not in ("adaptive", "i8751-sample", "open", "screw", "slots")
]
FLAGS: list[dict[str, Any]] = [
    {},
    {"depth": "0.05mm", "feed": "33mm/min"},
    {"breakthrough": "0.1mm"},
    {"scale": "0.5", "origin": "centre"},
    {"minimise": "reversals", "approach": True, "safe_z": "2mm"},
    {"entry": "ramp:5deg", "lead_in": "arc:0.2mm", "tabs": "3:1mm:0.2mm"},
]
KEYED = """depth = "1mm"
tool_diameter = "2mm"
[stock]
thickness = "3mm"
[[keep_out]]
name = "left clamp"
x = "-20..-2mm"
y = [0, 10]
z = "..15mm"
[[keep_out]]
x = "90mm.."
y = ["0mm", "1in"]
[tools.mill]
diameter = "3mm"
flutes = 2
[tools.mill.presets.plywood]
feed = "800mm/min"
[[operations]]
name = "holes"
select = ["inner", "circle"]
kind = "bore"
entry = {kind = "helix", angle = "4deg"}
[[operations]]
tool = "mill"
tabs = {count = 2, width = "3mm"}
"""


def written(file: JobTables, flags: JobTables, folder: Path) -> str:
    return text_of(merged_tables(file, flags, folder))


def read(text: str, folder: Path) -> JobTables:
    return tables_of(parse_table(text), folder / "made.toml")


@pytest.mark.parametrize("given", FLAGS)
@pytest.mark.parametrize("path", SAMPLES, ids=lambda path: path.stem)
def test_one_file_says_what_file_and_flags_say(
    path: Path, given: dict[str, Any], tmp_path: Path
) -> None:
    file, flags = read_job_file(path), tables_of_flags(given)
    text = written(file, flags, tmp_path)
    try:
        expected = build_job(file, flags)
    except OptionError as error:  # then the file says what is wrong too
        with pytest.raises(OptionError, match=re.escape(error.message)):
            build_job(read(text, tmp_path), JobTables())
        return
    assert build_job(read(text, tmp_path), JobTables()) == expected
    # And once more, of what was written.
    assert written(read(text, tmp_path), JobTables(), tmp_path) == text


@pytest.mark.parametrize("given", [each for each in FLAGS if "breakthrough" not in each])
def test_flags_alone_are_a_file(given: dict[str, Any], tmp_path: Path) -> None:
    flags = tables_of_flags({"tool_diameter": "0.5mm", **given})
    text = written(JobTables(), flags, tmp_path)
    assert "[[operations]]" not in text
    assert build_job(read(text, tmp_path), JobTables()) == build_job(JobTables(), flags)


def test_layers_of_keys_and_tools_stay(tmp_path: Path) -> None:
    file = tables_of(parse_table(KEYED), tmp_path / "job.toml")
    for given in ({}, {"depth": "2mm"}, {"tool": "mill"}, {"direction": "climb"}):
        flags = tables_of_flags(given)
        expected = build_job(file, flags)
        assert build_job(read(written(file, flags, tmp_path), tmp_path), JobTables()) == expected
    with pytest.raises(OptionError, match="names its tool"):
        written(file, tables_of_flags({"tool_diameter": "1mm"}), tmp_path)


def test_files_are_named_from_the_new_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "jobs").mkdir()
    (tmp_path / "out").mkdir()
    (tmp_path / "tool.tbl").write_text("T1 P1 D3 ;mill\n")
    (tmp_path / "jobs" / "lib.toml").write_text('[tools.v]\ndiameter = "1mm"\n')
    monkeypatch.chdir(tmp_path)
    values = {"tool_library": "lib.toml", "tool": "v"}
    file = tables_of(values, tmp_path / "jobs" / "job.toml")
    tables = merged_tables(file, tables_of_flags({"tool_table": "tool.tbl"}), tmp_path / "out")
    assert tables["tool_library"] == "../jobs/lib.toml"
    assert tables["tool_table"] == "../tool.tbl"
    job = build_job(tables_of(tables, tmp_path / "out" / "made.toml"), JobTables())
    assert job.operations[0].tool.diameter_mm == 1.0


def test_changes_take_the_place_of_what_was_said(tmp_path: Path) -> None:
    tables = parse_table(KEYED)
    made = changed_tables_of(tables, [Change("approach", True), Change("direction", "climb", 1)])
    job = build_job(tables_of(made, tmp_path / "job.toml"), JobTables())
    assert job.approach
    assert [each.direction for each in job.operations] == ["drawn", "climb"]
    assert tables == parse_table(KEYED)


def test_what_is_left_divides_an_operation(tmp_path: Path) -> None:
    tables = parse_table(KEYED + 'name = "outline"\nallowance = "0.1mm"\n')
    whole = changed_tables_of(tables, [], [Left(1, 0.02)])
    assert [each.get("allowance") for each in whole["operations"]] == [None, "0.12mm"]
    parts = [Left(1, -0.25, ("CIRCLE 2F",)), Left(1, 0.0, ("LINE [3]", "LINE 4"))]
    made = changed_tables_of(tables, [], parts)["operations"]
    assert [each["name"] for each in made] == ["holes", "outline", "outline (2)"]
    assert [each.get("allowance") for each in made[1:]] == ["-0.15mm", "0.1mm"]
    assert made[2]["select_entities"] == ["LINE [[]3]", "LINE 4"]
    both = itertools.chain.from_iterable(each["select_entities"] for each in made[1:])
    assert len(list(both)) == 3
