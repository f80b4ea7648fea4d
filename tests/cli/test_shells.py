"""Completion in the shells themselves: typed at a terminal, then the tabulator, then return.

In each shell `camtool` is a function that says what it was given, one word in <> each, so that a
name which the shell takes apart or runs is seen. The answers come from camtool itself.
"""

import os
import re
import select
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.waiting import HANG_S

pty = pytest.importorskip("pty")

AT_TERMINAL = (
    "import fcntl, os, sys, termios; os.setsid(); fcntl.ioctl(0, termios.TIOCSCTTY, 0); "
    "os.execvp(sys.argv[1], sys.argv[1:])"
)
"""Begins a shell with its stdin as its terminal."""

LAYERS = (
    "My Layer",
    "Größe",
    "a,b",
    "$(touch owned)",
    "d`touch owned`",
    "q'uote",
    "back\\slash",
    "co:lon",
    "w[1]",
)
FILES = ("my part.dxf", "größe.dxf", "plain.dxf", "it's.dxf")
SHOWN = "printf 'GIV''EN'; printf '<%s>' {}; echo '/GIV''EN'"
POSIX, OF_FISH = SHOWN.format('"$@"'), SHOWN.format("$argv")
BEGUN = {
    "bash": (
        ["bash", "--norc", "--noprofile", "-i"],
        "bind 'set enable-bracketed-paste off'; eval \"$(camtool completion bash)\"; "
        f"camtool() {{ {POSIX}; }}",
    ),
    "zsh": (
        ["zsh", "-f", "-i"],
        "autoload -Uz compinit && compinit -D -u; eval \"$(camtool completion zsh)\"; "
        f"camtool() {{ {POSIX}; }}",
    ),
    "fish": (
        ["fish", "--no-config", "-i"],
        f"camtool completion fish | source; function camtool; {OF_FISH}; end",
    ),
}  # fmt: skip
TYPED = [
    ("post pla", "<post><plain.dxf>"),
    ("post my", "<post><my part.dxf>"),
    ("post grö", "<post><größe.dxf>"),
    ("post it", "<post><it's.dxf>"),
    ("post plain.dxf --tar", "<post><plain.dxf><--target>"),
    ("post plain.dxf -t pic", "<post><plain.dxf><-t><pic-mmh>"),
    ("post plain.dxf --target=pic", "<post><plain.dxf><--target=pic-mmh>"),
    ("post plain.dxf --job=my", "<post><plain.dxf><--job=my part.dxf>"),
    (r"post my\ part.dxf --layer Gr", "<post><my part.dxf><--layer><Größe>"),
    ("post plain.dxf --layer 'My", "<post><plain.dxf><--layer><My Layer>"),
    ('post "my part.dxf" --layer "My', "<post><my part.dxf><--layer><My Layer>"),
    (r"post plain.dxf --layer My\ L", "<post><plain.dxf><--layer><My Layer>"),
    ("post plain.dxf --layer=My", "<post><plain.dxf><--layer=My Layer>"),
    ("post plain.dxf --layer a", "<post><plain.dxf><--layer><a,b>"),
    (r"post plain.dxf --layer \$", "<post><plain.dxf><--layer><$(touch owned)>"),
    ("post plain.dxf --layer d", "<post><plain.dxf><--layer><d`touch owned`>"),
    ("post plain.dxf --layer q", "<post><plain.dxf><--layer><q'uote>"),
    ("post plain.dxf --layer back", r"<post><plain.dxf><--layer><back\slash>"),
    ("post plain.dxf --layer co", "<post><plain.dxf><--layer><co:lon>"),
    ("post plain.dxf --layer w", "<post><plain.dxf><--layer><w[[]1]>"),
    ("post -t grbl --set axes.x.backl", "<post><-t><grbl><--set><axes.x.backlash_mm=>"),
    (
        "post --set axes.x.backlash_mm=0.1 plain.dxf --layer Gr",
        "<post><--set><axes.x.backlash_mm=0.1><plain.dxf><--layer><Größe>",
    ),
    ("verify x.nc --without pl", "<verify><x.nc><--without><play>"),
]


class Terminal:
    """A shell at a terminal of 250 columns, in this folder."""

    def __init__(self, shell: str, folder: Path) -> None:
        command, begun = BEGUN[shell]
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        more = {"TERM": "xterm", "LC_ALL": "C.UTF-8", "HOME": str(folder), "PATH": path}
        self.place, theirs = pty.openpty()
        self.process = subprocess.Popen(
            [sys.executable, "-c", AT_TERMINAL, *command],
            stdin=theirs, stdout=theirs, stderr=theirs, cwd=folder,
            env=os.environ | more | {"COLUMNS": "250"},
        )  # fmt: skip
        os.close(theirs)
        self.send(f"{begun}; echo 'BEG''UN'\n")
        self.until("BEGUN")

    def send(self, keys: str) -> None:
        os.write(self.place, keys.encode())

    def until(self, what: str) -> str:
        """Read the terminal until this text comes, and return all that was read."""
        shown = b""
        while what.encode() not in shown:
            ready, _, _ = select.select([self.place], [], [], HANG_S)
            assert ready, f"{what} never came: {shown[-500:]!r}"
            shown += os.read(self.place, 65536)
        return shown.decode(errors="replace")

    def given(self, line: str) -> str:
        """The words that camtool gets of this line when it is completed."""
        self.send(f"camtool {line}\t\n")
        found = re.search("GIVEN(.*?)/GIVEN", self.until("/GIVEN"), re.DOTALL)
        assert found is not None
        return found[1]

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        os.close(self.place)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    circles = "".join(f"0\nCIRCLE\n8\n{name}\n10\n9\n20\n9\n40\n3\n" for name in LAYERS)
    for name in FILES:
        text = f"0\nSECTION\n2\nENTITIES\n{circles}0\nENDSEC\n0\nEOF\n"
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def completed(shell: str, folder: Path, lines: list[tuple[str, str]]) -> None:
    if shutil.which(shell) is None:
        pytest.skip(f"no {shell} here")
    terminal = Terminal(shell, folder)
    try:
        found = [(line, terminal.given(line)) for line, _ in lines]
    finally:
        terminal.close()
    assert found == lines
    assert not (folder / "owned").exists()


@pytest.mark.parametrize("shell", BEGUN)
def test_a_shell_completes(shell: str, folder: Path) -> None:
    """The few that need the shell most: a value behind a sign, and a layer that would be run."""
    completed(shell, folder, [TYPED[6], TYPED[14]])


@pytest.mark.slow
@pytest.mark.parametrize("shell", BEGUN)
def test_a_shell_completes_all(shell: str, folder: Path) -> None:
    completed(shell, folder, TYPED)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash here")
def test_bash_offers_nothing_that_would_run_in_quotes(folder: Path) -> None:
    terminal = Terminal("bash", folder)
    try:
        for typed in "dq":
            line = f'post plain.dxf --layer "{typed}\t"'
            assert terminal.given(line) == f"<post><plain.dxf><--layer><{typed}>"
    finally:
        terminal.close()
    assert not (folder / "owned").exists()


@pytest.mark.parametrize(
    ("shell", "flag"), [("bash", "-n"), ("zsh", "-n"), ("fish", "--no-execute")]
)
def test_a_shell_takes_its_script(shell: str, flag: str, tmp_path: Path) -> None:
    if shutil.which(shell) is None:
        pytest.skip(f"no {shell} here")
    command = [sys.executable, "-m", "camtool", "completion", shell]
    script = tmp_path / "script"
    script.write_bytes(subprocess.run(command, capture_output=True, check=True).stdout)
    subprocess.run([shell, flag, str(script)], check=True)


@pytest.mark.skipif(shutil.which("fish") is None, reason="no fish here")
def test_fish_says_what_targets_are(tmp_path: Path) -> None:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    code = "camtool completion fish | source; complete -C 'camtool post --target g'"
    done = subprocess.run(
        ["fish", "--no-config", "-c", code], capture_output=True, text=True, check=True,
        env=os.environ | {"PATH": path, "HOME": str(tmp_path)},
    )  # fmt: skip
    value, _, said = done.stdout.strip().partition("\t")
    assert value == "grbl"
    assert "grbl 1.1" in said
