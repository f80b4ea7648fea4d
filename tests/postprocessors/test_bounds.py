"""What is too large is refused at once, by every reader and before a file is read."""

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import camtool
from camtool import bounds
from camtool.bounds import TooLongError
from camtool.cli.files import read_bytes
from camtool.errors import ProgramError
from camtool.target.registry import LoadedTarget, load_target, target_names
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind
from tests.importers.test_read import Input
from tests.postprocessors.i8751.machines import SAMPLE

FORMS = [
    *((name, "") for name in target_names()),
    ("matlab-router", "dialect.format=stream"),
    ("i8751", "dialect.format=listing"),
    ("i8751", "dialect.format=hex"),
    ("pic-mmh", "dialect.form=annex"),
]


def loaded(name: str, setting: str = "") -> LoadedTarget:
    machine = SAMPLE if name == "i8751" else None
    return load_target(name, machine_file=machine, settings=[setting] if setting else [])


@pytest.mark.parametrize(("name", "setting"), FORMS)
def test_a_program_of_too_many_moves_is_refused(
    name: str, setting: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = loaded(name, setting)
    path = ToolpathBuilder().rapid(1.0, 1.0).line(z=-1.0, feed=target.machine.feed.default_mm_min)
    for k in range(40):
        path.line(1.0 + k % 2, 1.0 + k // 2, feed=target.machine.feed.default_mm_min)
    data = target.target.write(path.rapid(z=1.0).finish(), target.machine).data
    assert len(target.target.read(data, target.machine)) > 40
    monkeypatch.setattr(bounds, "MAX_MOVES", 30)
    with pytest.raises(ProgramError, match="more than 30") as error:
        target.target.read(data, target.machine)
    assert error.value.where
    assert error.value.mend == "split the program"
    with pytest.raises(ProgramError, match=r"^<bytes>: .*more than 30"):
        camtool.verify(data, target)


@pytest.mark.parametrize(("name", "setting"), FORMS)
def test_a_writer_makes_just_so_many_moves_as_its_reader_takes(
    name: str, setting: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = loaded(name, setting)
    path = ToolpathBuilder().rapid(1.0, 1.0).message("hello")
    path.source = "line 1"
    path.line(z=-1.0, feed=target.machine.feed.default_mm_min)
    for k in range(40):
        path.line(1.0 + k % 2, 1.0 + k // 2, feed=target.machine.feed.default_mm_min)
    moves = path.rapid(z=1.0).event(Kind.END).finish()
    data = target.target.write(moves, target.machine).data

    def refused(call: Callable[[], object], most: int) -> bool:
        monkeypatch.setattr(bounds, "MAX_MOVES", most)
        try:
            call()
        except (TooLongError, ProgramError) as error:
            return f"more than {most} " in str(error)
        return False

    for most in range(30, 80):
        reading = refused(lambda: target.target.read(data, target.machine), most)
        writing = refused(lambda: target.target.write(moves, target.machine), most)
        # The reader of a dump counts its lines, which are about five for each record.
        assert writing == reading or setting == "dialect.format=hex"
    monkeypatch.setattr(bounds, "MAX_MOVES", 30)
    with pytest.raises(TooLongError, match=r"would have more than 30 .*; make several programs"):
        target.target.write(moves, target.machine)


def test_the_lines_of_a_hex_dump_are_no_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    target = loaded("i8751", "dialect.format=hex")
    path = ToolpathBuilder()
    for k in range(20):
        path.line(1.0 + k, feed=10.0)
    data = target.target.write(path.finish(), target.machine).data
    assert data.count(b"\n") > 5 * 20
    monkeypatch.setattr(bounds, "MAX_MOVES", 30)
    assert len(target.target.read(data, target.machine)) > 20


def test_turns_of_arcs_count(monkeypatch: pytest.MonkeyPatch) -> None:
    target = loaded("linuxcnc")
    data = b"F100\nG2 X0 Y0 I1 P%d\nM2\n"
    assert len(target.target.read(data % 29, target.machine)) == 30
    monkeypatch.setattr(bounds, "MAX_MOVES", 30)
    assert len(target.target.read(data % 29, target.machine)) == 30
    with pytest.raises(ProgramError, match=r"line 2, column 13: .*more than 30 moves"):
        target.target.read(data % 31, target.machine)


def test_a_program_file_that_is_too_large_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "large.ngc"
    with path.open("wb") as stream:  # a hole: it takes no room on the disk
        stream.truncate(bounds.MAX_PROGRAM_BYTES + 1)
    for read in (lambda: read_bytes(str(path)), lambda: camtool.verify(path, "linuxcnc")):
        with pytest.raises(ProgramError, match="larger than 500 MB; split the program") as error:
            read()
        assert error.value.file == str(path)
    monkeypatch.setattr(bounds, "MAX_PROGRAM_BYTES", 10)
    monkeypatch.setattr(sys, "stdin", Input(b"G0 X1\nG0 X2\n"))
    with pytest.raises(ProgramError, match="<stdin>: is larger than"):
        read_bytes("-")
    with pytest.raises(ProgramError, match="/dev/zero: is larger than"):
        read_bytes("/dev/zero")
