"""All files of a command or none; old files stay as they were on any error."""

import os
from pathlib import Path

import pytest

from camtool.cli import files
from camtool.cli.files import check_places, write_all
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

    monkeypatch.setattr(files.os, "fsync", full)
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
            check_places([source], [None, bad])
    with pytest.raises(OutputError, match="asked for twice"):
        check_places([source], ["-", "-"])
    check_places([source], ["-", str(tmp_path / "a.pic"), None])


def test_streams_are_written_before_any_file_is_there(tmp_path: Path) -> None:
    old = tmp_path / "a.pic"
    old.write_bytes(b"old")
    for name in (old, tmp_path / "b.pic"):
        with pytest.raises(OutputError, match=r"/dev/full: cannot be written \(No space left"):
            write_all({str(name): b"new", "/dev/full": b"{}"})
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {"a.pic": b"old"}


@pytest.mark.parametrize("fault", [OSError(1, "Operation not permitted"), KeyboardInterrupt()])
@pytest.mark.parametrize("links", [True, False])
def test_a_file_that_cannot_go_to_its_place_takes_the_others_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fault: BaseException, links: bool
) -> None:
    def no_links(self: Path, target: Path) -> None:
        raise PermissionError(1, "no links here")

    first, new, last = (str(tmp_path / name) for name in ("a.pic", "b.json", "c.svg"))
    Path(first).write_bytes(b"old")
    Path(last).write_bytes(b"old")
    replaced = Path.replace

    def replace(self: Path, target: Path) -> Path:
        if str(target) == last and not str(self).endswith(".old"):
            raise fault
        return replaced(self, target)

    monkeypatch.setattr(Path, "replace", replace)
    if not links:
        monkeypatch.setattr(Path, "hardlink_to", no_links)
    with pytest.raises(OutputError if isinstance(fault, OSError) else KeyboardInterrupt):
        write_all({first: b"new", new: b"new", last: b"new"})
    kept = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    # Without links an old file cannot come back; a new one goes all the same.
    assert kept == {"a.pic": b"old" if links else b"new", "c.svg": b"old"}


@pytest.mark.parametrize(
    ("reads", "writes", "words"),
    [
        (["w.dxf"], ["./w.dxf"], "./w.dxf: is the input itself (w.dxf)"),
        (["w.dxf"], ["soft"], "soft: is the input itself (w.dxf)"),
        (["w.dxf"], ["hard"], "hard: is the input itself (w.dxf)"),
        (["soft"], ["w.dxf"], "w.dxf: is the input itself (soft)"),
        (["d/../w.dxf"], ["to/w.dxf"], "to/w.dxf: is the input itself (d/../w.dxf)"),
        ([], ["a.ngc", "./a.ngc"], "./a.ngc: is asked for twice, also as a.ngc"),
        ([], ["d/a.ngc", "to/d/A.NGC"], "to/d/A.NGC: is asked for twice, also as d/a.ngc"),
        ([], ["\u00e9.ngc", "e\u0301.ngc"], "is asked for twice"),
        ([], ["none", "nowhere"], "nowhere: is asked for twice, also as none"),
        ([], ["hard", "w.dxf"], "w.dxf: is asked for twice, also as hard"),
        ([], ["round"], "round: cannot be written (Too many levels of symbolic links)"),
        ([], ["n" * 300], "cannot be written (File name too long)"),
        ([], ["round/a"], "round/a: "),
        ([], ["w.dxf/a"], "w.dxf/a: "),
    ],
)
def test_one_file_is_one_file_by_whatever_name(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    reads: list[str],
    writes: list[str],
    words: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("w.dxf").write_bytes(b"")
    Path("d").mkdir()
    Path("soft").symlink_to("w.dxf")
    Path("hard").hardlink_to("w.dxf")
    Path("to").symlink_to(tmp_path)
    Path("nowhere").symlink_to("none")
    Path("round").symlink_to("round")
    with pytest.raises(OutputError) as refused:
        check_places(reads, [None, *writes])
    assert words in str(refused.value)
    check_places([*reads, "none", "round"], ["d/b.ngc", "d/b.json", "/dev/null"])


def test_what_comes_from_stdin_is_not_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "w.dxf").write_bytes(b"")
    with (tmp_path / "w.dxf").open("rb") as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        with pytest.raises(OutputError, match="is the input itself"):
            check_places(["-"], [str(tmp_path / "w.dxf")])
    with (tmp_path / "a.ngc").open("wb") as stdout:
        monkeypatch.setattr("sys.stdout", stdout)
        with pytest.raises(OutputError, match="is asked for twice, also as -"):
            check_places([], ["-", str(tmp_path / "a.ngc")])


def test_long_names_have_room_for_a_temporary_one(tmp_path: Path) -> None:
    name = "n" * 255
    write_all({str(tmp_path / name): b"new"})
    assert [path.name for path in tmp_path.iterdir()] == [name]
