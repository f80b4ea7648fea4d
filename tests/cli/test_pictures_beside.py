"""`--beside` and `--before-after`: two pictures in one."""

from pathlib import Path

import click
import pytest

from camtool.cli.main import cli
from camtool.errors import OptionError, ProgramError
from tests.oracles import svg_page

PIC = ("-t", "pic-mmh", "--set", "dialect.form=annex")
SMALL, LARGE = "0,0\n0.1,0\n0.1,0.1\n0,0\n", "0,0\n0.4,0\n0.4,0.4\n0,0\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("a.csv").write_text(SMALL, encoding="utf-8")
    Path("b.csv").write_text(LARGE, encoding="utf-8")
    return tmp_path


def run(*arguments: str) -> int:
    code: int = cli.main([*arguments, "-q"], standalone_mode=False)
    return code


def titles(picture: str) -> list[list[str]]:
    """The words over each panel of a picture."""
    root = svg_page.parse(Path(picture).read_text(encoding="utf-8"))
    heads = [group for group in root.iter() if group.get("id", "").endswith("-head")]
    return [[part.get("aria-label", "") for part in head] for head in heads]


def test_two_drawings_stand_beside_each_other(folder: Path) -> None:
    run("preview", "a.csv", "--beside", "b.csv", "-o", "x.svg")
    assert [words[:2] for words in titles("x.svg")] == [
        ["a.csv", "0.1 × 0.1 mm"],
        ["b.csv", "0.4 × 0.4 mm"],
    ]


def test_two_programs_stand_beside_each_other(folder: Path) -> None:
    for name in ("a", "b"):
        run("post", f"{name}.csv", *PIC, "-o", f"{name}.pic", "--no-verify")
    run("preview", "a.pic", *PIC, "--simulate", "--beside", "b.pic", "--dark", "-o", "x.svg")
    code = run("verify", "a.pic", *PIC, "--beside", "b.pic", "--dark", "--preview", "y.svg",
               "--json", "y.json", "--report", "y.md")  # fmt: skip
    assert code == 0
    assert [words[0] for words in titles("x.svg")] == ["a.pic", "b.pic"]
    assert Path("x.svg").read_bytes() == Path("y.svg").read_bytes()
    assert '"a.pic"' in Path("y.json").read_text(encoding="utf-8")  # the report is of one
    assert "b.pic" not in Path("y.md").read_text(encoding="utf-8")


def test_the_drawing_counts_for_both_programs(folder: Path) -> None:
    for flags in ((), ("--compensate",)):
        run("post", "b.csv", *PIC, *flags, "-o", f"b{len(flags)}.pic", "--no-verify")
    line = ("verify", "b0.pic", *PIC, "--against", "b.csv", "--beside", "b1.pic")
    assert run(*line, "--preview", "x.svg") == 0
    before, after = (_error_um(words) for words in titles("x.svg"))
    assert after < 0.7 * before


def _error_um(words: list[str]) -> float:
    """The largest error that the notes of a panel name."""
    (note,) = [word for word in words if word.startswith("predicted error")]
    return float(note.split()[2])


@pytest.mark.parametrize("flags", [("--compensate",), ("--minimise", "reversals")])
def test_what_is_done_against_play_is_shown_before_and_after(
    folder: Path, flags: tuple[str, ...]
) -> None:
    run("post", "b.csv", *PIC, *flags, "--before-after", "-o", "b.pic", "--preview", "x.svg",
        "--report", "x.md")  # fmt: skip
    before, after = titles("x.svg")
    assert (before[0], after[0]) == ("b.csv, before", "b.csv, after")
    assert _error_um(after) < 0.7 * _error_um(before)
    assert "before-after" not in Path("x.md").read_text(encoding="utf-8")


POST = ("post", "a.csv", *PIC, "-o", "a.pic", "--before-after")


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (("preview", "a.csv", "--beside", "b.csv", "-o", "x.html"), "shows a single one"),
        (("verify", "a.pic", *PIC, "--beside", "b.pic"), "--beside: there is no picture"),
        (("verify", "a.pic", *PIC, "--beside", "b.pic", "--preview", "x.svg", "--compare",
          "mechanics"), "--beside is for a single variant; drop --compare"),
        ((*POST, "--preview", "x.svg"), "--before-after: .* add --compensate, --minimise"),
        ((*POST, "--compensate"), "--before-after: there is no picture"),
        ((*POST, "--compensate", "--preview", "x.html"), "shows a single one"),
        ((*POST, "--compensate", "--preview", "x.svg", "--no-verify"), "drop --no-verify"),
    ],
)  # fmt: skip
def test_what_cannot_stand_beside_is_refused(
    folder: Path, line: tuple[str, ...], words: str
) -> None:
    with pytest.raises((click.UsageError, OptionError), match=words):
        run(*line)
    assert sorted(path.name for path in folder.iterdir()) == ["a.csv", "b.csv"]


def test_a_fault_of_the_other_file_is_its_own(folder: Path) -> None:
    run("post", "a.csv", *PIC, "-o", "a.pic", "--no-verify")
    with pytest.raises(ProgramError, match=r"none\.pic"):
        run("verify", "a.pic", *PIC, "--beside", "none.pic", "--preview", "x.svg")
    with pytest.raises(OptionError, match="no full circle"):
        run("preview", "a.csv", *PIC, "--simulate", "--beside", "b.csv", "--polar", "1", "-o",
            "x.svg")  # fmt: skip
    assert not Path("x.svg").exists()
