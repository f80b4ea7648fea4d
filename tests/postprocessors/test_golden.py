"""The comparison with golden programs fails when it should, and the pages show these programs and
every option."""

import re
from pathlib import Path

import pytest
from camtool_postprocessors.i8751.pulses import Firmware

from camtool.machine.model import SlideStart
from camtool.target.registry import find_target
from tests.postprocessors.golden import GOLDEN, compare_golden

DOCS = GOLDEN.parents[1] / "docs"
EXAMPLES = {
    "grbl": ("gcode", ["grbl.nc"]),
    "linuxcnc": ("gcode", ["linuxcnc.ngc"]),
    "flashcut": ("flashcut", ["flashcut-part.nc"]),
    "valcnc": ("valcnc", ["valcnc-part.ngc", "valcnc-part-unscaled.ngc"]),
    "pic-mmh": ("pic", ["pic-mmh-example.pic", "pic-mmh-annex.pic"]),
}


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_worked_examples_of_a_page_are_what_is_sent(name: str) -> None:
    fence, files = EXAMPLES[name]
    page = (DOCS / "dialects" / f"{name}.md").read_text(encoding="utf-8")
    examples = re.findall(rf"```{fence}\n(.+?)```", page, re.DOTALL)
    for file, example in zip(files, examples, strict=True):
        program = (GOLDEN / file).read_text(encoding="ascii")
        assert example == program if fence == "gcode" else example in program


@pytest.mark.parametrize(
    ("page", "form"),
    [
        ("dialects/grbl", r"\| `{}` \|"),
        ("dialects/linuxcnc", r"\| `{}` \|"),
        ("dialects/flashcut", r"`dialect\.{}`"),
        ("dialects/valcnc", r"`dialect\.{}[`=]"),
        ("controllers/flashcut", r"controller\.{}\b"),
        ("controllers/valcnc", r"`controller\.{}`"),
        ("controllers/i8751", r"`dialect\.{}`"),
    ],
)
def test_a_page_names_every_option(page: str, form: str) -> None:
    kind, name = page.split("/")
    target, _ = find_target(name)
    keys = set(target.dialect.__struct_fields__)
    if name == "i8751":
        keys = set(Firmware.__struct_fields__)
    elif kind == "controllers":
        keys = set(target.controllers[0].__struct_fields__) - set(SlideStart.__struct_fields__)
    assert keys
    text = (DOCS / f"{page}.md").read_text(encoding="utf-8")
    assert [key for key in sorted(keys) if not re.search(form.format(key), text)] == []


@pytest.mark.parametrize(
    ("held", "written"),
    [(b"G54;\n", b"G90;\n"), (b"G0 X1.000\n", b"G0 X1.001\n"), (b"\x13\x01", b"\x13\x02")],
)
def test_a_changed_byte_fails(held: bytes, written: bytes, tmp_path: Path) -> None:
    file = tmp_path / "program"
    file.write_bytes(held)
    compare_golden(file, held, bless=False)
    with pytest.raises(AssertionError):
        compare_golden(file, written, bless=False)
    assert file.read_bytes() == held


def test_a_missing_file_fails_and_is_not_made(tmp_path: Path) -> None:
    file = tmp_path / "program"
    with pytest.raises(pytest.fail.Exception, match="--bless"):
        compare_golden(file, b"G54;\n", bless=False)
    assert not file.exists()


def test_blessing_writes_the_file(tmp_path: Path) -> None:
    file = tmp_path / "program"
    compare_golden(file, b"\x13\x01", bless=True)
    assert file.read_bytes() == b"\x13\x01"
