"""Bad input is normal input: one clear line, the right exit code, and no output file touched."""

from pathlib import Path

import pytest

from camtool import bounds
from tests.cli.conftest import ROOT, Run

LOGO = (ROOT / "samples" / "logo.dxf").read_bytes()
LINE_100 = b"0,0\n100,0\n"
BOMB = (
    b'<?xml version="1.0"?><!DOCTYPE svg [<!ENTITY a "xxxxxxxxxx">'
    b'<!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>'
    b'<svg xmlns="http://www.w3.org/2000/svg" width="5mm" height="5mm"><text>&b;</text></svg>'
)
EXTERNAL = (
    b'<?xml version="1.0"?><!DOCTYPE svg [<!ENTITY x SYSTEM "file:///etc/passwd">]>'
    b'<svg xmlns="http://www.w3.org/2000/svg" width="5mm" height="5mm"><text>&x;</text></svg>'
)
NAN_DXF = (
    b"0\nSECTION\n2\nENTITIES\n0\nLINE\n8\nCUT\n10\nnan\n20\n0\n11\n1\n21\n1\n0\nENDSEC\n0\nEOF\n"
)
INF_SVG = (
    b'<svg xmlns="http://www.w3.org/2000/svg" width="5mm" height="5mm" viewBox="0 0 5 5">'
    b'<path id="wild" d="M 0 0 L 1e999 0"/></svg>'
)

# name, content, flags, exit code, words that the one line holds
CASES = [
    ("not_a.dxf", b"this is no drawing at all\n", [], 2, ["not_a.dxf"]),
    ("empty.dxf", b"", [], 2, ["empty.dxf", "empty"]),
    ("empty.svg", b"", [], 2, ["empty.svg", "empty"]),
    ("cut_off.dxf", LOGO[: len(LOGO) // 3], [], 2, ["cut_off.dxf"]),
    ("bomb.svg", BOMB, [], 2, ["bomb.svg", "entit"]),
    ("external.svg", EXTERNAL, [], 2, ["external.svg"]),
    ("nan.dxf", NAN_DXF, [], 2, ["nan.dxf", "CUT"]),
    ("nan.csv", b"0,0\nnan,1\n", [], 2, ["nan.csv", "line 2"]),
    ("inf.svg", INF_SVG, [], 2, ["inf.svg", "wild"]),
    ("inf.json", b"[[0,0],[1e999,0]]", [], 2, ["inf.json"]),
    ("large.csv", LINE_100, [], 1, ["OUT_OF_TRAVEL", "10", "scale"]),
    ("far.csv", b"0,0\n999,0\n", ["--set", "axes.x.travel_mm=2000"], 2, ["five digits"]),
    ("a.csv", b"0,0\n1,0\n", ["--feed", "0"], 2, ["feed"]),
    ("a.csv", b"0,0\n1,0\n", ["--feed", "-1"], 2, ["feed"]),
    ("a.csv", b"0,0\n1,0\n", ["--feed", "1.4"], 2, ["feed", "1.3"]),
    ("a.csv", b"0,0\n1,0\n", ["--feed", "nan"], 2, ["feed"]),
    ("a.csv", b"0,0\n1,0\n", ["--tool-diameter", "-1"], 2, ["diameter"]),
    ("a.csv", b"0,0\n1,0\n", ["--depth", "deep"], 2, ["--depth"]),
    ("a.csv", b"0,0\n1,0\n", ["--units", "parsec"], 2, ["parsec"]),
    ("a.csv", b"0,0\n1,0\n", ["--layer", "NONE"], 2, ["NONE"]),
    ("a.csv", b"0,0\n1,0\n", ["--job", "none.toml"], 2, ["none.toml"]),
    ("a.csv", b"0,0\n1,0\n", ["--machine", "none.toml"], 2, ["none.toml"]),
    ("a.csv", b"0,0\n1,0\n", ["--set", "axes.x.paly_mm=1"], 2, ["paly_mm"]),
    ("a.csv", b"0,0\n1,0\n", ["--preview", "a.jpeg"], 2, [".png"]),
    ("a.csv", b"0,0\n1,0\n", ["--preview", "none/a.png"], 2, ["none/a.png"]),
    ("a.csv", b"0,0\n1,0\n", ["--no-verify", "--json", "a.json"], 2, ["--no-verify"]),
]


@pytest.mark.parametrize(("name", "content", "flags", "code", "words"), CASES)
def test_post_refuses(
    camtool: Run,
    tmp_path: Path,
    name: str,
    content: bytes,
    flags: list[str],
    code: int,
    words: list[str],
) -> None:
    (tmp_path / name).write_bytes(content)
    (tmp_path / "old.pic").write_bytes(b"old")
    before = sorted(path.name for path in tmp_path.iterdir())
    done = camtool("post", name, "-t", "pic-mmh", "-o", "old.pic", *flags)
    message = done.stderr.decode()
    assert done.returncode == code, message
    for word in words:
        assert word in message, message
    assert "Traceback" not in message
    errors = [line for line in message.splitlines() if "error" in line.lower()]
    assert 1 <= len(errors) <= code % 2 + 1, message
    assert done.stdout == b""
    assert (tmp_path / "old.pic").read_bytes() == b"old"
    assert sorted(path.name for path in tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["post", "a.csv", "-t", "pic-mhm", "-o", "a.pic"], ["pic-mhm", "did you mean pic-mmh"]),
        (["post", "a.csv", "-o", "a.pic"], ["--target"]),
        (["post", "none.dxf", "-t", "pic-mmh"], ["none.dxf"]),
        (["post", "a.csv", "-t", "pic-mmh", "-o", "none/a.pic"], ["none/a.pic", "does not exist"]),
        (["post", "a.csv", "-t", "pic-mmh", "-o", "."], ["folder"]),
        (["post", "a.csv", "-t", "pic-mmh", "-o", "a.csv"], ["input itself"]),
        (["post", "a.csv", "-t", "pic-mmh", "-o", "/dev/full"], ["/dev/full", "No space"]),
        (["verify", "none.pic", "-t", "pic-mmh"], ["none.pic"]),
        (["verify", "a.csv", "-t", "pic-mmh"], ["a.csv", "block 1", "column"]),
        (["preview", "a.pic", "-o", "a.png"], ["a.pic", "--target"]),
        (["preview", "a.csv", "-o", "a.gif"], [".svg"]),
        (["preview", "a.csv", "-o", "a.svg", "--simulate"], ["--target"]),
        (["check", "."], ["."]),
        (["targets", "pic"], ["pic-mmh"]),
        (["drill", "a.csv"], ["drill"]),
    ],
)
def test_wrong_use(camtool: Run, tmp_path: Path, arguments: list[str], words: list[str]) -> None:
    (tmp_path / "a.csv").write_bytes(b"0,0\n1,0\n")
    (tmp_path / "a.csv.sum").write_bytes(b"")
    before = sorted(path.name for path in tmp_path.iterdir())
    done = camtool(*arguments)
    message = done.stderr.decode()
    assert done.returncode == 2, message
    for word in words:
        assert word in message, message
    assert "Traceback" not in message
    assert (tmp_path / "a.csv").read_bytes() == b"0,0\n1,0\n"
    assert sorted(path.name for path in tmp_path.iterdir()) == before


def test_an_arc_that_never_ends_is_an_error_by_the_reading_that_says_so(
    camtool: Run, tmp_path: Path
) -> None:
    # From (0,0) about (1000,0) µm the direct search passes no step at (1000.14, 1000.14) µm.
    program = b"G54;G90;G01Z-00010.08F08;G02X01000.16Y01000.44I01000.00J00000.00F08;M30;"
    (tmp_path / "a.pic").write_bytes(program)
    verify = ("verify", "a.pic", "-t", "pic-mmh")
    done = camtool(*verify, "--set", "controller.arc_end=equal")
    assert done.returncode == 1
    assert b"error ARC_MISSES_END" in done.stderr
    done = camtool(*verify)  # by the other readings of the thesis it ends beside its end
    assert done.returncode == 0
    assert b"warning ARC_END_UNSURE" in done.stderr


@pytest.mark.parametrize("size", [0, 1, 7, 20, 38, 60])
def test_truncated_programs(camtool: Run, tmp_path: Path, size: int) -> None:
    program = b"G54;G90;G02X02969.00Y03400.00I03012.00J03040.00F08;M30;"
    (tmp_path / "a.pic").write_bytes(program[:size])
    done = camtool("verify", "a.pic", "-t", "pic-mmh")
    assert done.returncode in (0, 1, 2)
    assert b"Traceback" not in done.stderr
    if program[:size].rstrip()[-1:] not in (b";", b""):
        assert done.returncode == 2
        assert b"block" in done.stderr


def test_a_fault_of_ours_is_said_to_be_one(camtool: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    from camtool.cli import main as module

    def broken(*args: object, **kwargs: object) -> None:
        raise ZeroDivisionError("oh")

    monkeypatch.setattr(module.cli, "main", broken)
    done = camtool("check")
    assert done.returncode == 3
    assert b"fault in camtool itself (ZeroDivisionError: oh)" in done.stderr


def test_debug_shows_the_traceback(camtool_process: Run) -> None:
    done = camtool_process("check", "none.dxf", "--debug")
    assert done.returncode == 2
    assert b"Traceback" in done.stderr


def test_a_real_process_gives_the_same_codes(camtool_process: Run, tmp_path: Path) -> None:
    (tmp_path / "large.csv").write_bytes(LINE_100)
    assert camtool_process("post", "large.csv", "-t", "pic-mmh").returncode == 1
    assert camtool_process("post", "none.csv", "-t", "pic-mmh").returncode == 2
    assert camtool_process("--version").returncode == 0
    assert [path.name for path in tmp_path.iterdir()] == ["large.csv"]


def test_what_would_be_too_long_is_refused_before_it_is_written(
    camtool: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "zigzag.csv").write_text("".join(f"{k % 2},{k}\n" for k in range(40)))
    lines = "".join(f"G1 F100 X{k}\n" for k in range(27))
    (tmp_path / "long.ngc").write_text(f"G21 G90\n{lines}M2\n")
    (tmp_path / "a.gc").write_text("old")
    monkeypatch.setattr(bounds, "MAX_MOVES", 30)
    for job in (
        ["post", "zigzag.csv", "--no-verify", "-t", "grbl"],
        ["convert", "long.ngc", "--from", "linuxcnc", "--to", "grbl"],
    ):
        done = camtool(*job, "-o", "a.gc")
        assert done.returncode == 2
        assert (
            f"{job[1]}: the program would have more than 30 lines; make several"
            in done.stderr.decode()
        )
        assert (tmp_path / "a.gc").read_text() == "old"


@pytest.mark.parametrize("command", ["post", "touch"])
def test_an_option_given_twice_is_refused(camtool: Run, command: str) -> None:
    done = camtool(command, "a.csv", "--feed", "100", "--feed", "200")
    assert done.returncode == 2
    assert b"--feed is given 2 times, but takes one value" in done.stderr


def test_options_that_collect_and_switches_may_stand_twice(camtool: Run, samples: Path) -> None:
    layers = ("--layer", "CUT", "--layer", "ENGRAVE")
    assert camtool("check", samples / "logo.dxf", *layers, "-q", "-q").returncode == 0
