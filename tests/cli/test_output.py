"""All files of a command or none; old files stay as they were on any error."""

import os
from pathlib import Path

import pytest

from camtool.cli import output
from camtool.cli.output import check_writable, write_all
from camtool.errors import OutputError


def test_writes_all_and_leaves_no_temporary_file(tmp_path: Path) -> None:
    files = {str(tmp_path / "a.pic"): b"A", str(tmp_path / "b.png"): b"B"}
    write_all(files)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {
        "a.pic": b"A",
        "b.png": b"B",
    }


def test_one_bad_place_leaves_every_old_file_untouched(tmp_path: Path) -> None:
    old = tmp_path / "a.pic"
    old.write_bytes(b"old")
    with pytest.raises(OutputError, match=r"b\.png"):
        write_all({str(old): b"new", str(tmp_path / "none" / "b.png"): b"B"})
    assert old.read_bytes() == b"old"
    assert [path.name for path in tmp_path.iterdir()] == ["a.pic"]


def test_a_disk_that_fills_up_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(handle: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(output.os, "fsync", full)
    with pytest.raises(OutputError, match="No space left"):
        write_all({str(tmp_path / "a.pic"): b"new"})
    assert list(tmp_path.iterdir()) == []


def test_an_old_files_permissions_stay(tmp_path: Path) -> None:
    old = tmp_path / "a.pic"
    old.write_bytes(b"old")
    old.chmod(0o640)
    write_all({str(old): b"new"})
    assert old.stat().st_mode & 0o777 == 0o640
    mask = os.umask(0)
    os.umask(mask)
    write_all({str(tmp_path / "b.pic"): b"new"})
    assert (tmp_path / "b.pic").stat().st_mode & 0o777 == 0o666 & ~mask


def test_a_link_is_followed_not_replaced(tmp_path: Path) -> None:
    real = tmp_path / "real.pic"
    real.write_bytes(b"old")
    link = tmp_path / "link.pic"
    link.symlink_to(real)
    write_all({str(link): b"new"})
    assert link.is_symlink()
    assert real.read_bytes() == b"new"


def test_devices_are_written_in_place() -> None:
    write_all({os.devnull: b"gone"})
    assert not Path(os.devnull).is_file()


def test_places_are_checked_before_any_work(tmp_path: Path) -> None:
    (tmp_path / "logo.dxf").write_bytes(b"")
    source = str(tmp_path / "logo.dxf")
    for bad, words in [
        (str(tmp_path), "is a folder"),
        (str(tmp_path / "none" / "a.pic"), "does not exist"),
        (source, "is the input itself"),
    ]:
        with pytest.raises(OutputError, match=words):
            check_writable([None, bad], [source])
    with pytest.raises(OutputError, match="asked for twice"):
        check_writable(["-", "-"], [source])
    check_writable(["-", str(tmp_path / "a.pic"), None], [source])
