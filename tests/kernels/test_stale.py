"""Compiled kernels are thrown away when a source has changed, and only then."""

import os
from pathlib import Path

import pytest

from camtool.kernels import _discard_stale


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "__pycache__").mkdir()
    (tmp_path / "one.py").write_text("a = 1\n")
    (tmp_path / "two.py").write_text("b = 2\n")
    _discard_stale(tmp_path)
    (tmp_path / "__pycache__" / "one.f-3.py311.nbi").write_bytes(b"index")
    (tmp_path / "__pycache__" / "one.f-3.py311.1.nbc").write_bytes(b"code")
    (tmp_path / "__pycache__" / "one.cpython-311.pyc").write_bytes(b"python")
    return tmp_path


def kept(folder: Path) -> set[str]:
    return {file.suffix for file in (folder / "__pycache__").iterdir()} - {".digest"}


def test_nothing_is_thrown_away_while_sources_stay(folder: Path) -> None:
    assert not _discard_stale(folder)
    assert kept(folder) == {".nbi", ".nbc", ".pyc"}


def test_a_change_throws_away_what_depends_on_it(folder: Path) -> None:
    (folder / "one.py").write_text("from camtool.kernels.two import b\n")
    assert _discard_stale(folder) == {"one"}
    (folder / "__pycache__" / "one.f-3.py311.nbi").write_bytes(b"index")
    (folder / "__pycache__" / "two.g-3.py311.nbi").write_bytes(b"index")
    (folder / "__pycache__" / "three.h-3.py311.nbi").write_bytes(b"index")
    source = folder / "two.py"
    before = source.stat()
    source.write_text("b = 3\n")
    os.utime(source, ns=(before.st_atime_ns, before.st_mtime_ns))  # as an installer may leave it
    assert _discard_stale(folder) == {"one", "two"}
    left = {file.name for file in (folder / "__pycache__").glob("*.nbi")}
    assert left == {"three.h-3.py311.nbi"}
    assert not _discard_stale(folder)


def test_what_does_not_depend_on_a_change_stays(folder: Path) -> None:
    (folder / "two.py").write_text("b = 3\n")
    assert _discard_stale(folder) == {"two"}
    assert kept(folder) == {".nbi", ".nbc", ".pyc"}


def test_without_a_stamp_everything_is_thrown_away(folder: Path) -> None:
    (folder / "__pycache__" / "camtool-kernels.digest").write_text("not JSON")
    assert _discard_stale(folder) == {"one", "two"}
    assert kept(folder) == {".pyc"}


def test_a_source_more_or_less_is_a_change(folder: Path) -> None:
    (folder / "two.py").unlink()
    assert _discard_stale(folder) == {"two"}
    (folder / "three.py").write_text("c = 3\n")
    assert _discard_stale(folder) == {"three"}


def test_a_folder_without_a_cache_gets_one(tmp_path: Path) -> None:
    (tmp_path / "one.py").write_text("a = 1\n")
    assert _discard_stale(tmp_path)
    assert not _discard_stale(tmp_path)
