"""Streams that are closed, full or not read, and names that no system likes: never exit code 3."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.cli.conftest import Run

CAMTOOL = f"{sys.executable} -m camtool"
DRAWN = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="9mm" height="9mm" viewBox="0 0 9 9">'
    '<path d="M1 1h5v5h-5z" fill="none" stroke="#000"/></svg>'
)


@pytest.fixture
def here(tmp_path: Path) -> Path:
    (tmp_path / "w.svg").write_text(DRAWN)
    (tmp_path / "p.nc").write_text("G21\nG90\nG1 X1 F100\nM2\n")
    return tmp_path


def shell(line: str, folder: Path) -> subprocess.CompletedProcess[bytes]:
    """A line as bash runs it; `camtool` is ours."""
    script = f'camtool() {{ {CAMTOOL} "$@"; }}; {line}'
    return subprocess.run(["bash", "-c", script], cwd=folder, capture_output=True, check=False)


FULL = b"camtool: error: <stdout>: cannot be written (No space left on device)"
CLOSED = b"camtool: error: <stdout>: is closed; give a file name"


@pytest.mark.parametrize(
    ("line", "code", "said"),
    [
        ("camtool --help > /dev/full", 2, FULL),
        ("camtool check w.svg > /dev/full", 2, FULL),
        ("camtool check w.svg --json - > /dev/full", 2, FULL),
        ("camtool targets --json > /dev/full", 2, FULL),
        ("camtool completion bash > /dev/full", 2, FULL),
        # Who closes stdout wants no words; what was asked for on it is missed.
        ("camtool --help >&-", 0, b""),
        ("camtool check w.svg >&-", 0, b""),
        ("camtool check w.svg --json - >&-", 2, CLOSED),
        ("camtool post w.svg -t grbl --no-verify -o - >&-", 2, CLOSED),
        ("camtool check no.svg 2>&-", 2, b""),
        ("camtool check no.svg 2> /dev/full", 2, b""),
        ("camtool check w.svg 2>&- >&- <&-", 0, b""),
        ("camtool check - <&-", 2, b"<stdin>: there is no standard input; name a file"),
        ("camtool verify - -t grbl <&-", 2, b"<stdin>: there is no standard input"),
        ("camtool verify p.nc -t grbl 2>&- >&-", 0, b""),
    ],
)
def test_streams_that_take_nothing(here: Path, line: str, code: int, said: bytes) -> None:
    done = shell(line, here)
    assert done.returncode == code, done.stderr.decode()
    assert said in done.stderr
    assert b"Traceback" not in done.stderr
    assert b"Exception ignored" not in done.stderr
    if not said:
        assert done.stderr == b""


@pytest.mark.parametrize(
    "line",
    [
        "--help",
        "check w.svg",
        "check w.svg --json -",
        "targets grbl",
        "completion bash",
        "post w.svg -t grbl -o - --json r.json -q",
    ],
)
def test_a_reader_that_is_gone_hears_nothing_and_leaves_no_file(here: Path, line: str) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(
        [*CAMTOOL.split(), *line.split()],
        cwd=here,
        stdout=writer,
        stderr=subprocess.PIPE,
        check=False,
    )
    os.close(writer)
    assert (done.returncode, done.stderr) == (141, b"")
    assert sorted(path.name for path in here.iterdir()) == ["p.nc", "w.svg"]


ODD = ("n" * 300, "loop", "loop/x.nc", "w.svg/x.nc", "folder", "", ".", "/", "no/x.nc")
POSTED = ("-t", "grbl", "--no-verify", "-q")


def no_outcomes(*order: object) -> Iterator[None]:
    """A batch that finds its drawings and places, and makes nothing."""
    yield from ()


@pytest.mark.parametrize(
    "name", [*ODD[:2], *(pytest.param(name, marks=pytest.mark.slow) for name in ODD[2:])]
)
@pytest.mark.parametrize(
    "line",
    [
        ("post", "w.svg", *POSTED, "-o"),
        ("post", "w.svg", "-t", "grbl", "-q", "--json"),
        ("post", "w.svg", *POSTED, "--job"),
        ("post", "w.svg", *POSTED, "--machine"),
        ("post", "w.svg", *POSTED, "--tool", "1", "--tool-table"),
        ("post", *POSTED, "--"),
        ("verify", "-t", "grbl", "--"),
        ("verify", "p.nc", "-t", "grbl", "--against"),
        ("verify", "p.nc", "-t", "grbl", "--json"),
        ("convert", "p.nc", "--from", "grbl", "--to", "linuxcnc", "-o"),
        ("convert", "--from", "grbl", "--to", "linuxcnc", "--"),
        ("check", "--"),
        ("check", "w.svg", "--json"),
        ("job", "new", "w.svg", "-o"),
        ("job", "new", "--"),
        ("job", "check", "--"),
        ("job", "check", "/dev/null", "--against"),
        ("targets", "new", "mine", "--extends", "grbl", "-o"),
        ("targets", "grbl", "--machine"),
        ("coupon", "lines", "--measurements"),
        ("calibrate", "-t", "grbl", "--"),
        ("calibrate", "p.nc", "-t", "grbl", "-o"),
        ("batch", "-t", "grbl", "-o", "out", "--"),
        ("batch", "w.svg", "-t", "grbl", "-j", "1", "-o"),
        ("batch", "w.svg", "-t", "grbl", "-j", "1", "-o", "out", "--json"),
        ("stale", "-t", "grbl", "--"),
        ("stale", "w.svg", "-t", "grbl", "--programs"),
        ("filter", "--"),
    ],
)
def test_odd_places_are_refused(
    camtool: Run, here: Path, line: tuple[str, ...], name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if line[0] in ("batch", "stale") and name == "/":
        return  # a folder like another, and a large one
    monkeypatch.setattr("camtool.batches.run.run_batch", no_outcomes)
    (here / "loop").symlink_to("loop")
    (here / "folder").mkdir()
    done = camtool(*line, name)
    assert done.returncode in (0, 1, 2), done.stderr.decode()
    assert b"Traceback" not in done.stderr


@pytest.mark.parametrize(
    "text",
    [
        "a = " + "[" * 100_000,
        "a = " + "[" * 500 + "]" * 500,
        "a" + ".a" * 100_000 + " = 1",
        "[a" + ".a" * 100_000 + "]",
        "a = " + "{a=" * 60 + "1" + "}" * 60,
        "a = " + "1" * 5000,
    ],
)
@pytest.mark.parametrize(
    "line",
    [
        ("post", "w.svg", "-t", "grbl", "--job", "deep.toml"),
        ("post", "w.svg", "-t", "grbl", "--machine", "deep.toml"),
        ("post", "w.svg", "--machine", "deep.toml"),
        ("calibrate", "deep.toml", "-t", "grbl"),
        ("job", "check", "deep.toml"),
    ],
)
def test_toml_that_is_nested_deeply(
    camtool: Run, here: Path, line: tuple[str, ...], text: str
) -> None:
    (here / "deep.toml").write_text(text)
    done = camtool(*line)
    assert done.returncode == 2, done.stderr.decode()
    assert b"deep.toml: is no TOML: " in done.stderr


def test_settings_that_are_nested_deeply(camtool: Run, here: Path) -> None:
    for setting in ("a" + ".a" * 5000 + "=1", "axes.x.backlash_mm=" + "[" * 5000 + "]" * 5000):
        done = camtool("post", "w.svg", "-t", "grbl", "--set", setting)
        assert done.returncode == 2, done.stderr.decode()


def test_a_name_that_is_no_text(camtool: Run, here: Path) -> None:
    name = "\udcff\udc80.svg"
    (here / "w.svg").rename(here / name)
    for flags in (
        ("--json", "-"),
        ("--report", "-"),
        ("--report", "r.html"),
        ("--report", "\udcfe.md"),
        ("--report", "\udcfe.json"),
        ("--preview", "\udcfe.html"),
    ):
        done = camtool("post", name, "-t", "grbl", "-o", "\udcfd.nc", *flags)
        assert done.returncode == 0, done.stderr.decode()
    done = camtool("check", name, "--json", "-")
    assert done.returncode == 0
    assert done.stderr + done.stdout.replace(b"\\udcff\\udc80", b"") != b""


def test_a_terminal_that_knows_no_greek(here: Path) -> None:
    line = "PYTHONIOENCODING=latin-1 camtool verify p.nc -t grbl"
    done = shell(line, here)
    assert done.returncode in (0, 1), done.stderr.decode()
    assert b"\\u2013" in done.stdout


LATE = """
import atexit, os, signal, sys
from camtool.cli import main
class Ends:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
atexit.register(os.kill, os.getpid(), signal.SIGINT)
{}
sys.argv = ["camtool", "targets"]
main.main()
"""


def test_ctrl_c_at_the_end_changes_nothing(here: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", LATE.format("")], capture_output=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, b"")


def test_ctrl_c_where_python_can_raise_nothing_is_not_lost() -> None:
    early = """
import click, time
echo = click.echo
def slow(*words, err=False):
    if err:
        return echo(*words, err=err)
    Ends()
    time.sleep(60)
    print("went on")
click.echo = slow
"""
    done = subprocess.run(
        [sys.executable, "-c", LATE.format(early)], capture_output=True, check=False
    )
    assert done.returncode == 128 + signal.SIGINT
    assert done.stderr.strip() == b"camtool: interrupted; written files are complete"
    assert b"went on" not in done.stdout


MADE = f"{CAMTOOL} post w.svg -t grbl --no-verify -q"


def test_a_pipe_that_nobody_reads_is_refused(
    camtool: Run, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("camtool.cli.files.READER_S", 0.2)
    os.mkfifo(here / "pipe")
    line = ("post", "w.svg", "-t", "grbl", "--no-verify", "-o", "pipe", "--preview", "w2.svg")
    done = camtool(*line)
    assert done.returncode == 2
    assert b"pipe: is a pipe that nobody reads; open its reader first" in done.stderr
    assert sorted(path.name for path in here.iterdir()) == ["p.nc", "pipe", "w.svg"]


@pytest.mark.parametrize(
    "line",
    [
        f"mkfifo pipe; cat pipe > got & {MADE} -o pipe; wait",
        f"mkfifo pipe; {MADE} -o pipe & sleep 0.5; cat pipe > got; wait",
        f"{MADE} -o >(cat > got); while [ ! -s got ]; do sleep 0.05; done; sleep 0.2",
        f"{MADE} -o /dev/stdout | cat > got",
    ],
)
def test_pipes_with_a_reader_get_all_of_it(here: Path, line: str) -> None:
    assert shell(f"{MADE} -o w.nc", here).returncode == 0
    assert shell(line, here).returncode == 0
    assert (here / "got").read_bytes() == (here / "w.nc").read_bytes()
