"""Findings for other programs: SARIF, JUnit's XML and annotations, and `camtool lint`.

CAMTOOL_SCHEMAS=…   a folder with sarif-2.1.0.json (SchemaStore) and junit-10.xsd (the Jenkins
                    plug-in xunit-plugin); without it their tests are skipped, and SARIF is
                    held against the types of `pydantic-sarif` alone
"""

import importlib
import json
import os
import re
import string
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as tree

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic_sarif.model import StaticAnalysisResultsFormatSarifVersion210JsonSchema as Sarif

from camtool.cli import check_formats
from camtool.cli.check_formats import CheckedFile, junit, sarif, workflow_commands
from camtool.findings import Code, FoundAt
from tests.cli.conftest import Run

SCHEMAS = Path(os.environ.get("CAMTOOL_SCHEMAS", "none"))
HAS_SCHEMAS = "CAMTOOL_SCHEMAS" in os.environ
RING = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="40mm" viewBox="0 0 40 40">\n'
    '<circle cx="20" cy="20" r="10"/>\n<circle cx="20" cy="20" r="0.2"/></svg>'
)
GOOD = "G21 G90\n\nG0 Z5\n(a comment)\nG0 X1 Y1\nG1 Z-1 F100\nG1 X9\nG0 Z5\nM2\n"
BAD = GOOD.replace("G1 X9", "G1 X9 Q3 P1 G99")
FAR = GOOD.replace("G1 X9", "G1 X900")
FLAGS = ("--sarif", "a.sarif", "--junit", "a.xml", "--annotations", "a.txt")


def validated(folder: Path) -> tuple[dict[str, Any], tree.Element, list[str]]:
    """The three files, valid by what is here of their definitions."""
    report = json.loads((folder / "a.sarif").read_text(encoding="utf-8"))
    Sarif.model_validate(report)
    suite = tree.parse(folder / "a.xml").getroot()
    if HAS_SCHEMAS:
        jsonschema = pytest.importorskip("jsonschema")
        xmlschema = pytest.importorskip("xmlschema")
        schema = json.loads((SCHEMAS / "sarif-2.1.0.json").read_text(encoding="utf-8"))
        jsonschema.validate(report, schema)
        xmlschema.XMLSchema(SCHEMAS / "junit-10.xsd").validate(folder / "a.xml")
    return report, suite, (folder / "a.txt").read_text(encoding="utf-8").splitlines()


def results(report: dict[str, Any]) -> list[tuple[str, str, str, int | None]]:
    """Return code, level, file and line of each result."""
    rows = []
    for each in report["runs"][0]["results"]:
        place = each["locations"][0]["physicalLocation"]
        line = place.get("region", {}).get("startLine")
        rows.append((each["ruleId"], each["level"], place["artifactLocation"]["uri"], line))
    return rows


def counts(suite: tree.Element) -> list[int]:
    return [int(suite.attrib[name]) for name in ("tests", "failures", "errors", "skipped")]


@pytest.mark.skipif(not HAS_SCHEMAS, reason="CAMTOOL_SCHEMAS names no folder of schemas")
def test_the_schemas_refuse_what_is_wrong(tmp_path: Path) -> None:
    jsonschema = pytest.importorskip("jsonschema")
    xmlschema = pytest.importorskip("xmlschema")
    schema = json.loads((SCHEMAS / "sarif-2.1.0.json").read_text(encoding="utf-8"))
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({"version": "2.1.0", "runs": [{"tool": {}}]}, schema)
    (tmp_path / "a.xml").write_text("<testsuite name='a'/>")
    assert not xmlschema.XMLSchema(SCHEMAS / "junit-10.xsd").is_valid(tmp_path / "a.xml")


def test_every_code_of_every_room_has_a_rule() -> None:
    rooms = [
        importlib.import_module(f"camtool.{path.parent.name}.findings")
        for path in Path(check_formats.__file__).parents[1].glob("*/findings.py")
    ]
    enums = {
        value
        for room in rooms
        for value in vars(room).values()
        if isinstance(value, type) and issubclass(value, Code) and value is not Code
    }
    assert len(enums) > 5
    assert set(check_formats.CODES) == {code.name for enum in enums for code in enum}


def test_post_names_the_line_of_the_drawing(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "ring.svg").write_text(RING)
    flags = ("-t", "grbl", "--tool-diameter", "1", "--depth", "1", "-o", "ring.nc")
    assert camtool("post", "ring.svg", *flags, *FLAGS).returncode == 0
    report, suite, lines = validated(tmp_path)
    assert ("CONTOUR_TOO_SMALL", "warning", "ring.svg", 3) in results(report)
    rule = report["runs"][0]["tool"]["driver"]["rules"][0]
    code = check_formats.CODES[rule["id"]]
    assert (rule["shortDescription"]["text"], rule["help"]["text"]) == (code.means, code.mend)
    assert counts(suite) == [1, 0, 0, 0]
    assert "CONTOUR_TOO_SMALL" in str(suite[0].findtext("system-out"))
    assert any(line.startswith("::warning file=ring.svg,line=3,title=") for line in lines)
    first = {name: (tmp_path / name).read_bytes() for name in ("a.sarif", "a.xml", "a.txt")}
    assert camtool("post", "ring.svg", *flags, *FLAGS).returncode == 0
    assert first == {name: (tmp_path / name).read_bytes() for name in first}, "deterministic"


def test_an_entity_of_a_dxf_has_a_line(camtool: Run, samples: Path, tmp_path: Path) -> None:
    drawing = samples / "board.dxf"
    flags = ("-t", "grbl", "--tool-diameter", "3", "--depth", "1", "-o", "board.nc")
    assert camtool("post", drawing, *flags, *FLAGS).returncode == 0
    report = json.loads((tmp_path / "a.sarif").read_text())
    text = drawing.read_text(encoding="latin-1").splitlines()
    rows = [row for row in report["runs"][0]["results"] if row["ruleId"] == "CONTOUR_TOO_SMALL"]
    assert len(rows) > 3
    for row in rows:
        handle = re.search(r"CIRCLE (\w+)", row["message"]["text"])
        place = row["locations"][0]["physicalLocation"]
        line = place["region"]["startLine"]
        assert handle is not None
        assert (text[line - 1].strip(), text[line].strip()) == ("5", handle[1])
        assert place["artifactLocation"]["uri"] == drawing.as_uri()


def test_a_job_that_fails_has_a_failure_and_no_program(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "ring.svg").write_text(RING)
    flags = ("-t", "grbl", "--depth", "1", "-o", "ring.nc", "--scale", "100")
    assert camtool("post", "ring.svg", *flags, *FLAGS).returncode == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "a.sarif", "a.txt", "a.xml", "ring.svg",
    ]  # fmt: skip
    report, suite, lines = validated(tmp_path)
    assert ("OUT_OF_TRAVEL", "error", "ring.svg", None) in results(report)
    assert counts(suite) == [1, 1, 0, 0]
    failure = suite[0].find("failure")
    assert failure is not None
    assert failure.attrib["type"] == "OUT_OF_TRAVEL"
    assert lines[0].startswith("::error file=ring.svg,title=OUT_OF_TRAVEL::")


def test_each_set_up_is_a_case(camtool: Run, samples: Path, tmp_path: Path) -> None:
    drawing = samples / "logo.dxf"
    flags = ("-t", "grbl", "-o", "logo.nc", "--split", "tool", "--job", samples / "logo.toml")
    done = camtool("post", drawing, *flags, *FLAGS)
    assert done.returncode == 0, done.stderr.decode()
    _, suite, _ = validated(tmp_path)
    programs = [path for path in tmp_path.iterdir() if path.suffix == ".nc"]
    assert counts(suite) == [len(programs), 0, 0, 0]


@pytest.mark.parametrize("command", ["verify", "lint"])
def test_a_block_is_a_line_of_the_program(command: str, camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "part.nc").write_text(BAD)
    done = camtool(command, "part.nc", "-t", "grbl", *FLAGS)
    assert done.returncode == (2 if command == "verify" else 1), "lint finds it, verify needs it"
    report, suite, lines = validated(tmp_path)
    assert results(report) == [("INPUT_REFUSED", "error", "part.nc", 7)]
    assert counts(suite) == [1, 0, 1, 0]
    assert lines[0].startswith("::error file=part.nc,line=7,title=INPUT_REFUSED::")


def test_lines_count_blank_ones_and_comments(camtool: Run, tmp_path: Path) -> None:
    slow = GOOD.replace("G1 X9", "G1 X9 F0.001")
    (tmp_path / "part.nc").write_text(slow)
    assert camtool("lint", "part.nc", "-t", "grbl", *FLAGS).returncode == 0
    assert ("FEED_TOO_SLOW", "warning", "part.nc", 7) in results(validated(tmp_path)[0])


def test_lint_looks_at_all_programs(camtool: Run, tmp_path: Path) -> None:
    for name, text in (("good.nc", GOOD), ("bad.nc", BAD), ("far.nc", FAR)):
        (tmp_path / name).write_text(text)
    done = camtool("lint", "good.nc", "bad.nc", "far.nc", "-t", "grbl", *FLAGS, "--json", "a.json")
    assert done.returncode == 1
    said = done.stderr.decode()
    assert "camtool: far.nc: error OUT_OF_TRAVEL" in said
    assert "3 programs: 2 errors, 0 warnings" in said
    report, suite, _ = validated(tmp_path)
    assert counts(suite) == [3, 1, 1, 0]
    assert {row[2] for row in results(report)} >= {"bad.nc", "far.nc"}
    rows = json.loads((tmp_path / "a.json").read_text())
    assert [(row["program"], row["errors"]) for row in rows] == [
        ("good.nc", 0), ("bad.nc", 1), ("far.nc", 1),
    ]  # fmt: skip
    done = camtool("lint", "good.nc", "none.nc", "-t", "grbl", *FLAGS)
    assert done.returncode == 2, "a file that is not there is wrong use, whatever the others say"
    assert counts(validated(tmp_path)[1]) == [2, 0, 1, 0]
    assert camtool("lint", "-", "-t", "grbl", "-q", stdin=GOOD.encode()).stderr == b""


@pytest.mark.parametrize(
    ("name", "target"), [("ball-bar.nc", "linuxcnc"), ("circle-30-steps.pic", "pic-mmh")]
)
def test_lint_finds_what_verify_finds(
    name: str, target: str, camtool: Run, samples: Path, tmp_path: Path
) -> None:
    """And nothing else; what verify finds besides is of the motion."""
    camtool("lint", samples / name, "-t", target, "--json", "lint.json")
    camtool("verify", samples / name, "-t", target, "--json", "verify.json")
    sets = []
    for row in (
        json.loads((tmp_path / "lint.json").read_text())[0],
        json.loads((tmp_path / "verify.json").read_text()),
    ):
        sets.append({(each["code"], each["where"], each["message"]) for each in row["findings"]})
    assert sets[0] <= sets[1]
    motion = {"PLAY_NOT_KNOWN", "END_NOT_REACHED", "MANY_REVERSALS", "ARC_MISSES_END"}
    assert {code for code, *_ in sets[1] - sets[0]} <= motion


def test_a_batch_has_a_case_for_each_drawing(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "a.svg").write_text(RING)
    (tmp_path / "b.svg").write_text("no drawing")
    (tmp_path / "c.svg").write_text(RING.replace("40mm", "4000mm"))
    flags = ("-t", "grbl", "-o", "out", "-j", "1", "--tool-diameter", "1", "--depth", "1")
    assert camtool("batch", "a.svg", "b.svg", "c.svg", *flags, *FLAGS).returncode == 1
    report, suite, _ = validated(tmp_path)
    assert counts(suite) == [3, 1, 1, 0]
    assert ("CONTOUR_TOO_SMALL", "warning", "a.svg", 3) in results(report)
    first = [(tmp_path / name).read_bytes() for name in ("a.sarif", "a.xml", "a.txt")]
    done = camtool("batch", "a.svg", "b.svg", "c.svg", *flags, *FLAGS, "--json", "a.json")
    assert done.returncode == 1
    assert "2 failed before and did not change (--again)" in done.stderr.decode()
    assert first == [(tmp_path / name).read_bytes() for name in ("a.sarif", "a.xml", "a.txt")]
    rows = json.loads((tmp_path / "a.json").read_text())["drawings"]
    assert [row["remembered"] for row in rows] == [False, True, True]
    assert [row["seconds"] for row in rows] == [0.0, 0.0, 0.0]
    done = camtool("batch", "b.svg", *flags, "--again", "--json", "a.json")
    assert not json.loads((tmp_path / "a.json").read_text())["drawings"][0]["remembered"]
    (tmp_path / "b.svg").write_text(RING)
    done = camtool("batch", "b.svg", *flags)
    assert (done.returncode, (tmp_path / "out" / "b.nc").exists()) == (0, True)
    entries = (tmp_path / "out" / ".camtool-batch.jsonl").read_text().splitlines()
    assert [(json.loads(each)["stem"], bool(json.loads(each)["error"])) for each in entries] == [
        ("a", False), ("b", False), ("c", True),
    ]  # fmt: skip


def test_what_cannot_be_written_is_refused_before_any_work(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "a.nc").write_text(GOOD)
    for name in ("a.nc", "none/a.sarif", "."):
        done = camtool("lint", "a.nc", "-t", "grbl", "--sarif", name)
        assert done.returncode == 2, name
    done = camtool("lint", "a.nc", "-t", "grbl", "--sarif", "x", "--junit", "x")
    assert done.returncode == 2
    assert "is asked for twice" in done.stderr.decode()
    assert (tmp_path / "a.nc").read_text() == GOOD
    done = camtool("verify", "a.nc", "-t", "grbl", "--compare", "interpolators", "--sarif", "x")
    assert "drop --compare" in done.stderr.decode()


@pytest.mark.parametrize(
    "data",
    [b"", b"\0\1\2\xff" * 99, b"\x89PNG\r\n", b"G1 " * 50_000, b"\n" * 9],
    ids=["empty", "binary", "picture", "long", "blank"],
)
def test_rubbish_is_an_error_of_one_line(
    data: bytes, camtool: Run, samples: Path, tmp_path: Path
) -> None:
    (tmp_path / "a.nc").write_bytes(data)
    for target in ("grbl", "linuxcnc", "pic-mmh", "valcnc", "flashcut", "i8751", "matlab-router"):
        machine = ("--machine", samples / "i8751-sample.toml") if target == "i8751" else ()
        done = camtool("lint", "a.nc", "-t", target, *machine, "-q", *FLAGS)
        assert done.returncode in (0, 1), target
        assert len(done.stderr.splitlines()) <= 3
        validated(tmp_path)


# Texts of drawings: nothing in them ends a value, or begins another command.

TEXTS = st.text(
    st.one_of(st.characters(), st.sampled_from("%\r\n:,]<&>\"'\x1b\x00\ufffe\ud800#[")),
    max_size=60,
)


@given(TEXTS, TEXTS, TEXTS, st.integers(0, 3))
def test_no_text_escapes(message: str, where: str, file: str, line: int) -> None:
    finding = FoundAt("GOUGE", "error", message, where, file=file or "a", line=line or None)
    checked = [CheckedFile(file, (finding,))]
    commands = workflow_commands(checked).decode()
    assert commands.count("\n") == 1
    assert commands.endswith("\n")
    match = re.fullmatch(r"::error file=([^:,]*)(,line=\d)?,title=GOUGE::(.*)\n", commands)
    assert match is not None
    assert not re.search(r"%(?!25|0A|0D|3A|2C)", match[1])
    assert not set(match[3]) & set("\r\n\x1b\x00\x85\u2028")
    suite = tree.fromstring(junit(checked, "post"))
    failure = suite[0].find("failure")
    assert failure is not None
    assert len(suite) == len(suite[0]) == 1
    report = json.loads(sarif(checked))
    Sarif.model_validate(report)
    uri = report["runs"][0]["results"][0]["locations"][0]["physicalLocation"]["artifactLocation"]
    assert set(uri["uri"]) <= set(string.ascii_letters + string.digits + "-._~/%:")


def test_github_gets_as_many_annotations_as_it_shows() -> None:
    findings = [FoundAt("A", "warning", str(k), "", file="a") for k in range(30)]
    findings += [FoundAt("B", "error", str(k), "", file="a") for k in range(12)]
    findings.append(FoundAt("C", "info", "nobody needs to know", "", file="a"))
    lines = workflow_commands([CheckedFile("a", tuple(findings))]).decode().splitlines()
    assert [line.split()[0] for line in lines] == ["::error"] * 10 + ["::warning"] * 10
    assert lines[0] == "::error file=a,title=B::0"


def test_a_code_of_a_plug_in_has_a_rule_too() -> None:
    finding = FoundAt("mill.TOO_HOT", "warning", "hot", "", file="a")
    report = json.loads(sarif([CheckedFile("a", (finding,))]))
    Sarif.model_validate(report)
    assert report["runs"][0]["tool"]["driver"]["rules"] == [{"id": "mill.TOO_HOT"}]
