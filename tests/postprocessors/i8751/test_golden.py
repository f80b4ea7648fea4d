"""A program of every kind of row, byte for byte, in all three formats (`--bless` writes it)."""

import re

import pytest

from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from tests.postprocessors.golden import GOLDEN, compare_golden
from tests.postprocessors.i8751.machines import ROOT, STEP_MM, loaded

PAGE = ROOT / "docs" / "dialects" / "i8751.md"
FILES = {
    "packets": "i8751-part.bin",
    "listing": "i8751-part-listing.txt",
    "hex": "i8751-part-hex.txt",
}


def part() -> Toolpath:
    """Rapids, a plunge, a line with its dog-leg, an arc, waits, a message, a far move."""
    path = ToolpathBuilder().rapid(z=1.0).rapid(2.5, 1.25).line(z=-0.5, feed=30)
    path.line(5.0, 2.25, feed=30).arc(6.0, 3.25, centre=(5.0, 3.25), ccw=True, feed=30)
    path.event(Kind.DWELL, 2).line(2.5, 1.25, feed=30).rapid(z=1.0)
    path.message("turn the part").event(Kind.DWELL, 300).rapid(700 * STEP_MM, 0.0)
    path.rapid(4.0, 4.0, 0.5).rapid(0.0, 0.0, 1.0)
    return path.event(Kind.END).finish()


@pytest.mark.parametrize("form", FILES)
def test_program(form: str, bless: bool) -> None:
    target = loaded(f"format={form}", "arc_tolerance_mm=0.05")
    compare_golden(
        GOLDEN / FILES[form], target.target.write(part(), target.machine).data, bless=bless
    )


def test_the_dump_is_that_of_the_packets() -> None:
    """By other means than the reader's: the digits in the columns of the dump."""
    dump = (GOLDEN / FILES["hex"]).read_text(encoding="ascii")
    rows = [line[6:30] for line in dump.splitlines() if not line.startswith(";")]
    assert bytes.fromhex("".join(rows)) == (GOLDEN / FILES["packets"]).read_bytes()


def test_the_worked_examples_of_the_page() -> None:
    """The records on the page are read and written as it shows."""
    page = PAGE.read_text(encoding="utf-8")
    dumps = re.findall(r"```hex\n(.+?)```", page, re.DOTALL)
    assert len(dumps) == 2
    target = loaded("format=hex")
    for dump in dumps:
        target.target.read(dump.encode("ascii"), target.machine)
    path = ToolpathBuilder().line(z=-0.5, feed=30).line(100 * STEP_MM, 25 * STEP_MM, feed=30)
    written = target.target.write(path.finish(), target.machine).data.decode("ascii")
    assert written == dumps[1]
    (listing,) = re.findall(r"```listing\n(.+?)```", page, re.DOTALL)
    target = loaded("format=listing")
    assert target.target.write(path.finish(), target.machine).data.decode("ascii") == listing


def test_every_option_has_its_line_on_the_page() -> None:
    from camtool_postprocessors.i8751.dialect import I8751Dialect

    page = PAGE.read_text(encoding="utf-8")
    keys = I8751Dialect.__struct_fields__
    assert [key for key in keys if not re.search(rf"`(dialect\.)?{key}\b", page)] == []
