"""`camtool targets`: the list, one machine, and a new machine file."""

import json
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from camtool.target.registry import target_names
from tests.cli.conftest import Run
from tests.postprocessors.iso.test_sample import SAMPLE


def test_all_are_listed_and_what_the_user_must_give_is_said(camtool: Run) -> None:
    done = camtool("targets")
    assert done.returncode == 0
    lines = done.stdout.decode().splitlines()
    headings = [line for line in lines if line.startswith("# ")]
    assert [line.partition(":")[0] for line in headings] == [
        "# step-true",
        "# timed",
        "# path only",
    ]
    names = [line.split()[0] for line in lines if line[0] not in "# "]
    assert sorted(names) == target_names()
    assert sum("needs --machine FILE: axes.x.coded_step_mm" in line for line in lines) == 1
    rows = json.loads(camtool("targets", "--json").stdout)["targets"]
    assert sorted(row["name"] for row in rows) == target_names()
    grades = {row["name"]: row["grade"] for row in rows}
    assert (grades["grbl"], grades["linuxcnc"]) == ("step-true", "timed")
    assert grades["haas"] == "path only"
    assert all(row["rests_on"] for row in rows if row["name"] in ("haas", "fluidnc"))


def values_in(table: dict[str, Any]) -> Iterator[Any]:
    """All values of the tables in a table."""
    for value in table.values():
        yield from values_in(value) if isinstance(value, dict) else [True]


@pytest.mark.parametrize("base", target_names())
def test_a_new_machine_file_is_whole_and_changes_nothing_yet(
    camtool: Run, tmp_path: Path, base: str
) -> None:
    done = camtool("targets", "new", "my-mill", "--extends", base)
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "my-mill.toml").read_text()
    said = tomllib.loads(text)
    assert said.pop("extends") == base
    assert said.pop("target") == {"name": "my-mill", "title": "my-mill"}
    assert not any(values_in(said))
    shown = camtool("targets", base, "--machine", "my-mill.toml", "--json")
    plain = camtool("targets", base, "--json")
    if plain.returncode:  # a machine that needs the user
        assert b"key is missing" in shown.stderr
        assert "# coded_step_mm =     # you must say this" in text
        return
    mine, its = json.loads(shown.stdout), json.loads(plain.stdout)
    assert mine.pop("target")["name"] == "my-mill"
    its.pop("target")
    assert mine == its


def test_every_comment_of_a_new_file_is_a_value_when_uncommented(
    camtool: Run, tmp_path: Path
) -> None:
    text = camtool("targets", "new", "my-mill", "--extends", "grbl", "-o", "-").stdout.decode()
    head, _, rest = text.partition("[axes.x]")
    whole = head + "[axes.x]" + rest.replace("\n# ", "\n")
    (tmp_path / "whole.toml").write_text(whole)
    mine = camtool("targets", "grbl", "--machine", "whole.toml", "--json")
    assert mine.returncode == 0, mine.stderr
    its = json.loads(camtool("targets", "grbl", "--json").stdout)
    assert json.loads(mine.stdout)["axes"] == its["axes"]


def test_a_machine_file_alone_says_which_target(camtool: Run, samples: Path) -> None:
    camtool("targets", "new", "my-mill", "--extends", "grbl")
    done = camtool("post", samples / "logo.dxf", "--machine", "my-mill.toml", "-o", "-")
    assert done.returncode == 0, done.stderr
    assert b"G21" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("new", "My Mill", "--extends", "grbl"), b"is no name for a machine"),
        (("new", "../mill", "--extends", "grbl"), b"is no name for a machine"),
        (("new", "mill", "--extends", "gbrl"), b"did you mean grbl"),
        (("new", "mill"), b"--extends"),
        (("gbrl",), b"did you mean grbl"),
    ],
)
def test_wrong_use_says_what_to_do(
    camtool: Run, tmp_path: Path, arguments: tuple[str, ...], words: bytes
) -> None:
    done = camtool("targets", *arguments)
    assert done.returncode == 2
    assert words in done.stderr
    assert not list(tmp_path.iterdir())


def test_an_existing_file_is_not_touched(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "my-mill.toml").write_text("mine")
    done = camtool("targets", "new", "my-mill", "--extends", "grbl")
    assert done.returncode == 2
    assert (tmp_path / "my-mill.toml").read_text() == "mine"


def test_a_machine_file_that_extends_nothing_is_refused(
    camtool: Run, tmp_path: Path, samples: Path
) -> None:
    (tmp_path / "m.toml").write_text("[axes.x]\ntravel_mm = 5.0\n")
    done = camtool("post", samples / "logo.dxf", "--machine", "m.toml")
    assert done.returncode == 2
    assert b"which target it extends" in done.stderr


def test_play_by_region_is_shown_as_it_lies_on_the_table(camtool: Run) -> None:
    shown = camtool("targets", "pic-mmh").stderr.decode()
    head = "backlash of X by region of the table, µm, not used: play_map.use; 192.5 everywhere"
    assert head in shown
    lines = [line.split() for line in shown.splitlines()]
    assert ["y", "\\", "x", "mm", "0…3.333", "3.333…6.667", "6.667…10"] in lines
    assert ["0…7", "190", "201", "187"] in lines
    at = lines.index(["4.667…7", "173"])
    assert lines[at + 1 : at + 3] == [["2.333…4.667", "180"], ["0…2.333", "152"]]
    used = camtool("targets", "pic-mmh", "--set", "play_map.use=true").stderr.decode()
    assert "backlash of Y by region of the table, µm\n" in used
    assert "not used" not in used
    assert "play of" not in camtool("targets", "grbl").stderr.decode()


def test_the_command_writes_it_and_reads_the_program_back(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "part.nc").write_bytes(SAMPLE)
    done = camtool("targets", "new", "mine", "--from-program", "part.nc")
    assert done.returncode == 0, done.stderr
    assert b"part.nc is read with it: 5 moves, 2 of them arcs" in done.stderr
    text = (tmp_path / "mine.toml").read_text()
    assert 'extends = "iso"' in text
    assert "# whole_letters =" in text
    again = camtool("targets", "new", "mine", "--from-program", "part.nc")
    assert again.returncode == 2
    assert (tmp_path / "mine.toml").read_text() == text


def test_flags_say_what_the_program_does_not(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "part.nc").write_bytes(SAMPLE)
    flags = ["--set", "dialect.arcs.difference_mm=0.6", "--set", "dialect.lines.max_chars=80"]
    done = camtool("targets", "new", "mine", "--from-program", "part.nc", *flags)
    assert done.returncode == 0, done.stderr
    table = tomllib.loads((tmp_path / "mine.toml").read_text())["dialect"]
    assert table["arcs"]["difference_mm"] == 0.6
    assert table["lines"]["max_chars"] == 80
    for wrong in (["--extends", "grbl", "--from-program", "part.nc"], [], ["--set", "x"]):
        assert camtool("targets", "new", "other", *wrong).returncode == 2
    assert not (tmp_path / "other.toml").exists()


def test_the_command_in_a_new_file_works_where_it_stands(camtool: Run, tmp_path: Path) -> None:
    sample = str(Path("samples/logo.dxf").absolute())
    assert camtool("targets", "new", "mine", "--extends", "iso").returncode == 0
    command = (tmp_path / "mine.toml").read_text(encoding="utf-8").splitlines()[2]
    assert command == "# camtool post drawing.dxf --machine mine.toml"
    assert camtool("post", sample, *command.split()[4:], "-o", "a.nc").returncode == 0
    by_name = camtool("post", sample, "--machine", "mine")
    assert b"--machine mine.toml is the file of this folder" in by_name.stderr


def test_questions_can_be_answered_by_nothing(camtool: Run, tmp_path: Path) -> None:
    answers = b"\n\n\nnone\n\n\n"
    done = camtool("targets", "new", "mine", "--ask", "--extends", "iso", stdin=answers)
    assert done.returncode == 0, done.stderr
    assert b"The last block (M2, M30, none) [M30]" in done.stderr
    assert 'end = "" ' in (tmp_path / "mine.toml").read_text(encoding="utf-8")
