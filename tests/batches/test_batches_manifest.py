"""The manifest: by content, and usable however a run ended."""

from importlib import metadata
from pathlib import Path

import pytest

from camtool.batches.manifest import (
    NAME,
    Manifest,
    ManifestEntry,
    content_digest,
    digest_of,
    file_digest,
    packages_digest,
)
from camtool.cli.files import write_all


def entry(folder: Path, name: str, key: str) -> ManifestEntry:
    (folder / name).write_text(name)
    return ManifestEntry(key, {name: content_digest(name.encode())}, 2, {"time_s": 1.5})


def test_what_was_added_is_up_to_date(tmp_path: Path) -> None:
    made = entry(tmp_path, "a.out", "key")
    Manifest(tmp_path).add("a", made)
    again = Manifest(tmp_path)
    assert again.up_to_date("a", "key") == made
    assert again.up_to_date("a", "other key") is None
    assert again.up_to_date("b", "key") is None
    assert again.outputs() == {tmp_path / "a.out"}


@pytest.mark.parametrize("change", [lambda p: p.write_text("other"), Path.unlink])
def test_an_output_that_was_changed_is_not(tmp_path: Path, change: object) -> None:
    Manifest(tmp_path).add("a", entry(tmp_path, "a.out", "key"))
    change(tmp_path / "a.out")  # type: ignore[operator]
    assert Manifest(tmp_path).up_to_date("a", "key") is None


def test_the_last_line_of_a_drawing_counts_and_tidying_keeps_it(tmp_path: Path) -> None:
    manifest = Manifest(tmp_path)
    for key in ("old", "new"):
        manifest.add("a", entry(tmp_path, "a.out", key))
    manifest.tidy(write_all)
    assert len((tmp_path / NAME).read_text().splitlines()) == 1
    assert Manifest(tmp_path).up_to_date("a", "new")


def test_any_cut_loses_at_most_what_it_cuts(tmp_path: Path) -> None:
    manifest = Manifest(tmp_path)
    for stem in "abc":
        manifest.add(stem, entry(tmp_path, f"{stem}.out", "key"))
    place = tmp_path / NAME
    whole = place.read_bytes()
    ends = [n for n, byte in enumerate(whole) if whole[n : n + 2] == b"}\n"]
    for cut in range(len(whole)):
        place.write_bytes(whole[:cut])
        cut_short = Manifest(tmp_path)
        kept = [stem for stem in "abc" if cut_short.up_to_date(stem, "key")]
        assert kept == list("abc")[: sum(end < cut for end in ends)]
    place.write_bytes(whole[:-20])
    Manifest(tmp_path).add("d", entry(tmp_path, "d.out", "key"))
    assert [s for s in "abcd" if Manifest(tmp_path).up_to_date(s, "key")] == ["a", "b", "d"]


@pytest.mark.parametrize("text", ["", "{}", "[]", "null", '{"stem": 1}', "\xff", "{" * 50])
def test_a_damaged_manifest_is_as_none(tmp_path: Path, text: str) -> None:
    (tmp_path / NAME).write_text(text, encoding="latin-1")
    assert Manifest(tmp_path).outputs() == frozenset()


def test_digests_tell_parts_apart(tmp_path: Path) -> None:
    assert digest_of("ab", "c") != digest_of("a", "bc")
    assert digest_of("\udcff") != digest_of("")
    (tmp_path / "a").write_bytes(b"x" * 3_000_000)
    assert file_digest(tmp_path / "a") == content_digest(b"x" * 3_000_000)


def test_it_never_holds_more_than_the_folder_does(tmp_path: Path) -> None:
    sizes = []
    for run in range(100):
        manifest = Manifest(tmp_path)
        for stem in "abc":
            manifest.add(stem, entry(tmp_path, f"{stem}.out", f"key {run:03}"))
        manifest.add("once", entry(tmp_path, f"{run}.out", "key"))  # another file each time
        (tmp_path / f"{run}.out").unlink()
        manifest.tidy(write_all)
        sizes.append((tmp_path / NAME).stat().st_size)
    assert len(set(sizes)) == 1
    assert len((tmp_path / NAME).read_text().splitlines()) == 3
    assert Manifest(tmp_path).outputs() == {tmp_path / f"{stem}.out" for stem in "abc"}


def test_what_is_tidy_is_not_written_again(tmp_path: Path) -> None:
    written: list[str] = []

    def write(files: dict[str, bytes]) -> None:
        written.extend(files)
        write_all(files)

    manifest = Manifest(tmp_path)
    manifest.add("b", entry(tmp_path, "b.out", "key"))
    manifest.add("a", entry(tmp_path, "a.out", "key"))
    Manifest(tmp_path).tidy(write)
    assert len(written) == 1
    Manifest(tmp_path).tidy(write)
    manifest.tidy(lambda files: None)
    assert len(written) == 1
    (tmp_path / "a.out").unlink()
    Manifest(tmp_path).tidy(write)
    assert len(written) == 2


def test_packages_count_by_their_versions(monkeypatch: pytest.MonkeyPatch) -> None:
    before = packages_digest("camtool")
    assert before != packages_digest("numpy")
    assert packages_digest("no such package") == digest_of()
    version = metadata.version
    monkeypatch.setattr(metadata, "version", lambda name: version(name) + ".1" * (name == "ezdxf"))
    assert packages_digest("camtool") != before
