"""Nothing of a drawing, a file's name or a machine reaches a terminal but what can be seen."""

import json
import os
import pty
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest

from camtool.plain import MAX_LINE_CHARS, MAX_WORD_CHARS, one_line, to_json
from tests.cli.conftest import Run
from tests.waiting import all_written

EVIL = (
    "A\x1b]0;title\x07",
    "B\x1b[2J\x1b[31mred",
    "C\x9b2J\x90q\x9c",
    "D\u202egpj.exe\u2066",
    "E" + "e" * 4000,
    "F f" * 1500,
    "G\u2028\u200b\x7f\x08\x08",
)
NAME = "n\x1b[31m\u202e\n\udcff.dxf"


def dxf(layers: tuple[str, ...]) -> bytes:
    """A square on each layer, one of them open by a gap that is told."""
    rows = ["0", "SECTION", "2", "HEADER", "9", "$ACADVER", "1", "AC1021", "0", "ENDSEC"]
    rows += ["0", "SECTION", "2", "ENTITIES"]
    for n, layer in enumerate(layers):
        x, ends = 10.0 * n, [(0, 0), (5, 0), (5, 5), (0, 5), (0, 0.05)]
        for (x0, y0), (x1, y1) in pairwise(ends):
            rows += [
                "0",
                "LINE",
                "100",
                "AcDbEntity",
                "8",
                layer,
                "100",
                "AcDbLine",
                "10",
                str(x + x0),
                "20",
                str(y0),
            ]
            rows += ["11", str(x + x1), "21", str(y1)]
        rows += ["0", "TEXT", "100", "AcDbEntity", "8", layer, "100", "AcDbText"]
        rows += ["10", "0", "20", "0", "40", "1", "1", layer[:300]]
    rows += ["0", "ENDSEC", "0", "EOF"]
    return ("\n".join(rows) + "\n").encode("utf-8", "surrogateescape")


@pytest.fixture
def evil(tmp_path: Path) -> Path:
    (tmp_path / NAME).write_bytes(dxf(EVIL))
    (tmp_path / "own.toml").write_text('extends = "grbl"\n[target]\ntitle = "\\u001b[2J\\u202e"\n')
    (tmp_path / "job.toml").write_text(
        '[[operations]]\nname = "\\u001b[31m\\u202e"\nkind = "engrave"\ndepth = 1\n'
    )
    (tmp_path / "bad.toml").write_text('"\\u001b[31m\\u202e" = 1\n')
    (tmp_path / "p.nc").write_bytes(b"G1 X1\x1b[31m\xff\xe2\x80\xae F9\n")
    (tmp_path / "m.toml").write_text('target = "\\u001b[31m"\n')
    return tmp_path


@pytest.mark.parametrize(
    ("code", "line"),
    [
        (0, ("check", NAME)),
        (0, ("check", "-v", NAME)),
        (2, ("check", NAME, "--layer", "NOPE")),
        (2, ("check", NAME, "--layer", "\x1b[31mX")),
        (2, ("check", "no" + NAME)),
        (2, ("check", "no\x1b]0;x\x07", NAME)),
        (2, ("check", NAME, "--\x1b[31m")),
        (2, ("check", NAME, "--format", "\x1b[31m")),
        (2, ("check", NAME, "--units", "\x1b[31m")),
        (2, ("check", NAME, "--gap", "1\x1b[31m")),
        (2, ("check", NAME, "--json", "no/\x1b[31m")),
        (2, ("post", NAME, "-t", "\x1b[31m")),
        (2, ("post", NAME, "-t", "grbl", "--set", "\x1b[31m=1")),
        (2, ("post", NAME, "-t", "grbl", "--machine", "bad.toml")),
        (2, ("post", NAME, "-t", "grbl", "--job", "bad.toml")),
        (2, ("post", NAME, "-t", "grbl", "--job", "job.toml", "--operation", "\x1b")),
        (0, ("post", NAME, "--machine", "own.toml", "-o", "\x1b[31m\n\udcff.nc", "-v")),
        (0, ("job", "check", "job.toml", "--against", NAME)),
        (0, ("job", "new", NAME, "-o", "\x1b[31m.toml")),
        (2, ("verify", "p.nc", "-t", "grbl")),
        (2, ("verify", "no\x1b[31m", "-t", "grbl", "--debug")),
        (2, ("convert", "p.nc", "--from", "grbl", "--to", "\x1b[31m")),
        (2, ("calibrate", "m.toml")),
        (2, ("targets", "\x1b[31m")),
        (0, ("targets", "grbl", "--machine", "own.toml")),
        (2, ("coupon", "\x1b[31m")),
        (0, ("stale", NAME, "-t", "grbl", "-v")),
        (2, ("batch", "no\x1b[31m", "-t", "grbl", "-o", "out")),
        (0, ("preview", NAME, "-o", "\x1b[31m\n\udcff.svg")),
        (2, ("preview", NAME, "-o", "x.svg", "--layers", "\x1b[31m")),
        (2, ("\x1b[31m",)),
    ],
)
def test_what_is_shown_can_be_seen(
    camtool: Run, evil: Path, code: int, line: tuple[str, ...]
) -> None:
    done = camtool(*line)
    assert done.returncode == code, done.stderr.decode()
    for said in (*done.stdout.decode().split("\n"), *done.stderr.decode().split("\n")):
        assert said.isprintable(), said
        assert len(said) <= MAX_LINE_CHARS
        assert max(map(len, said.split()), default=0) <= MAX_WORD_CHARS


def test_a_terminal_is_told_no_more_than_its_own_colours(evil: Path) -> None:
    """On a real terminal, a batch with its bar and tables, a check and an error."""
    (evil / "d").mkdir()
    (evil / NAME).rename(evil / "d" / NAME)
    for line in (
        ("check", f"d/{NAME}"),
        ("check", f"d/{NAME}", "--layer", "NOPE"),
        ("batch", "d", "-t", "grbl", "-o", "out", "-v", "-j", "1", "--layer", "NOPE"),
        ("targets",),
    ):
        ours, theirs = pty.openpty()
        command = [sys.executable, "-m", "camtool", *line]
        run = subprocess.Popen(command, cwd=evil, stdout=theirs, stderr=theirs, stdin=theirs)
        os.close(theirs)
        said = all_written(ours)
        assert run.wait() in (0, 1, 2), said
        # A colour ends in m and a bar moves the cursor: neither a title, nor the names' own.
        for bad in (
            b"\x1b]",
            b"\x1b[31mred",
            b"\x07",
            "\x9b".encode(),
            "\u202e".encode(),
            b"\xff",
        ):
            assert bad not in said, line


def test_json_says_the_very_names(camtool: Run, evil: Path) -> None:
    done = camtool("check", NAME, "--json", "-")
    assert done.returncode == 0, done.stderr.decode()
    text = done.stdout.decode()
    assert all(part.isprintable() for part in text.split("\n"))
    facts = json.loads(text)
    assert list(facts["layers"]) == list(EVIL)
    assert facts["file"] == NAME
    done = camtool("post", NAME, "-t", "grbl", "-o", "x.nc", "--json", "r.json")
    assert done.returncode == 0, done.stderr.decode()
    assert json.loads((evil / "r.json").read_text())["source"] == NAME
    for page in ("r.md", "r.html", "page.json"):
        done = camtool("post", NAME, "-t", "grbl", "-o", "x.nc", "--report", page)
        assert done.returncode == 0, done.stderr.decode()
        assert all(part.isprintable() for part in (evil / page).read_text().split("\n"))


def test_words_are_shortened_in_their_middle() -> None:
    assert one_line("a\tb") == "a\\tb"
    assert one_line("a\u00a0\u3000µ") == "a\u00a0\u3000µ", "blanks of other widths are harmless"
    assert one_line("\udcc3\udca9") == "\\xc3\\xa9"
    long = one_line(f"{'a' * 150}{'b' * 150} end")
    assert len(long) == MAX_WORD_CHARS + 4
    assert long.startswith("a" * 119)
    assert long.endswith("b" * 60 + " end")
    assert len(one_line("word " * 1000)) == MAX_LINE_CHARS
    assert one_line(one_line("\x1b" * 1000)) == one_line("\x1b" * 1000)


def test_json_hides_nothing() -> None:
    names = [chr(code) for code in (*range(0x10000), 0x1D173, 0x1F600, 0xE0041, sys.maxunicode)]
    text = to_json({"": names})
    assert json.loads(text)[""] == names
    shown = [sign for sign in set(text) - {"\n"} if not sign.isprintable()]
    # What is left has no effect: private and unassigned signs, and blanks of other widths.
    assert not [sign for sign in shown if ord(sign) < 0x20 or "\x7f" <= sign <= "\x9f"]
    assert not {"\u202e", "\u2066", "\u200f", "\u2028", "\ufeff", "\udcff"} & set(shown)


def test_findings_that_repeat_are_summed_up(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "gaps.dxf").write_bytes(dxf(tuple(f"L{n}" for n in range(20))))
    done = camtool("check", "gaps.dxf")
    told = [line for line in done.stderr.decode().splitlines() if "GAP_OPEN" in line]
    assert len(told) == 4
    assert told[-1] == "camtool: warning GAP_OPEN: and 17 more (-v shows all)"
    done = camtool("check", "gaps.dxf", "-v")
    assert done.stderr.decode().count("warning GAP_OPEN [") == 20


def test_a_program_is_shown_by_the_target_that_is_named(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "a.x").write_text("G21\nG90\nG1 X5 F100\nM2\n")
    done = camtool("preview", "a.x", "-t", "grbl", "-o", "a.svg")
    assert done.returncode == 0, done.stderr.decode()
    done = camtool("preview", "a.x", "-o", "b.svg")
    assert done.returncode == 2
