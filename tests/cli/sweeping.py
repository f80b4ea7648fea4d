"""Commands with bad values, each in a process of its own that comes from a warm one.

The flags come from the commands themselves, so that a new flag is tried like all others.
"""

import contextlib
import os
import resource
import signal
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import click

from camtool.cli.main import cli, main
from camtool.jobs.keys import OPERATION, TOOL_KEYS, flag_name, is_known
from camtool.planning.kinds import installed_kinds
from tests.waiting import HANG_S

BAD = ("nan", "inf", "-inf", "-1", "0", "1e308", "1e-308", "", "9" * 5000, "\x1b[31m")
"""What every flag is given: no number, too large, too small, too long, no text for a terminal."""

WIDE = (*BAD, "1e9", "1e6", "1e4", "1e-4", "1e-6", "1e-9", "9" * 9, "1x", "1e9x1e9", "1:1e-9:1e9")
"""And what is a number, but makes too much or too little of everything."""

CHEWED_S = 120
"""A run that takes more seconds of a processor has unbounded work: the slowest takes some."""

MOST_BYTES = 6 << 30
"""Address space of a run: libraries map some 2 GB."""

DRAWING = "part.svg"
SVG = (
    b'<svg xmlns="http://www.w3.org/2000/svg" width="20mm" height="12mm" viewBox="0 0 20 12">'
    b'<path d="M2,2 H12 V10 H2 Z M4,4 C5,8 8,8 9,4 Z"/><circle cx="16" cy="6" r="2"/></svg>'
)
DIMPLES = (
    b'<svg xmlns="http://www.w3.org/2000/svg" width="20mm" height="12mm" viewBox="0 0 20 12">'
    b'<circle cx="4" cy="4" r="0.5"/><circle cx="9" cy="4" r="0.5"/></svg>'
)
PROGRAM = (
    b"G21\nG90\nG17\nG94\nG0 Z5\nG0 X1 Y1\nG1 Z-1 F100\nG1 X9 F200\nG2 X9 Y5 I0 J2\nG0 Z5\nM2\n"
)
TABLE = b"T1 P1 D3.0 ;flat\n"
TOLERANCES = b'[[dimension]]\nkind = "diameter"\nat = [16, 6]\nlimits = "H7"\n'
JOB = b'[[operation]]\nname = "all"\nlayers = ["*"]\n'


def set_up(folder: Path) -> None:
    """The files that the commands work on."""
    (folder / DRAWING).write_bytes(SVG)
    (folder / "holes.svg").write_bytes(DIMPLES)
    (folder / "a.nc").write_bytes(PROGRAM)
    (folder / "a.ngc").write_bytes(b"G00 X1.0 Y0.0 Z0.0\nG01 X1.25 Y0.5 Z0.0\n")
    (folder / "tool.tbl").write_bytes(TABLE)
    (folder / "job.toml").write_bytes(JOB)
    (folder / "tolerances.toml").write_bytes(TOLERANCES)


TOOL = ("--tool-diameter", "1", "--depth", "1")
KINDS: Mapping[str, tuple[str, ...]] = {
    "profile": ("--kind", "profile", "--side", "outside", *TOOL),
    "pocket": ("--kind", "pocket", *TOOL),
    "engrave": ("--kind", "engrave", "--depth", "1"),
    "drill": ("--kind", "drill", "--tool-kind", "drill", "--depth", "2"),
    "vcarve": ("--kind", "vcarve", "--tool-kind", "v", "--tool-angle", "60", *TOOL),
    "chamfer": (
        *("--kind", "chamfer", "--tool-kind", "v", "--tool-angle", "60", "--chamfer", "0.2"),
        *("--select", "closed", *TOOL),
    ),
}
"""Flags of a plain operation of each kind."""

BASES: Mapping[str, tuple[str, ...]] = {
    "post": ("-t", "linuxcnc", "-o", "out.ngc"),
    "batch": ("-t", "linuxcnc", "-o", "build", "-j", "1"),
    "filter": ("-t", "linuxcnc"),
    "preview": ("-o", "out.svg", "-t", "linuxcnc"),
    "stale": ("-t", "linuxcnc"),
    "verify": ("-t", "grbl"),
    "lint": ("-t", "grbl"),
    "explain": ("-t", "grbl"),
    "inkscape": ("-o", "extensions"),
    "convert": ("--from", "grbl", "--to", "linuxcnc", "-o", "out.ngc"),
    "signals": ("-t", "valcnc", "-o", "out.svg"),
    "check": (),
    "job new": (),
    "job check": (),
    "targets new": ("--extends", "grbl", "-o", "mine.toml"),
    "init": ("-t", "grbl", "-o", "mine.toml"),
    "tools new": (),
    "draw": ("-o", "out.html"),
    "tolerances new": ("-o", "-"),
    "tolerances show": ("--against", DRAWING),
    "coupon": ("-t", "linuxcnc", "-o", "out.svg"),
    "calibrate": ("-t", "linuxcnc"),
}
"""Flags that each command needs."""

ARGUMENTS: Mapping[str, str] = {
    "post": DRAWING,
    "batch": DRAWING,
    "filter": DRAWING,
    "preview": DRAWING,
    "stale": DRAWING,
    "verify": "a.nc",
    "lint": "a.nc",
    "explain": "a.nc",
    "inkscape": "",
    "convert": "a.nc",
    "signals": "a.ngc",
    "check": DRAWING,
    "job new": DRAWING,
    "job check": "job.toml",
    "targets new": "mine",
    "init": "mine",
    "tools new": "",
    "draw": "",
    "tolerances new": DRAWING,
    "tolerances show": "tolerances.toml",
    "coupon": "lines",
    "calibrate": "lengths.toml",
}


@dataclass(frozen=True)
class Flag:
    """A flag that takes a value, of a command such as "job new"."""

    command: str
    name: str

    @property
    def base(self) -> list[str]:
        """The command with all that the flag needs beside it."""
        words = [*self.command.split(), ARGUMENTS[self.command]]
        needs = list(BASES[self.command])
        if self.name in _KINDS and self.command not in ("verify", "stale"):
            kind = _KINDS[self.name]
            words[-1] = "holes.svg" if kind == "drill" else words[-1]
            plain = KINDS.get(kind, ("--kind", kind, *TOOL))
            needs += [*plain, *_NEEDED.get(self.name, ())]
        if self.command == "verify":
            needs += ["--against", DRAWING]
        if self.name in _BESIDE:
            needs += _BESIDE[self.name]
        return [*words, *_without(needs, self.name)]

    def call(self, value: str) -> list[str]:
        """The words of a command line that gives the flag a value."""
        return [*self.base, f"{self.name}={value}" if self.name[:2] == "--" else self.name + value]


_KINDS = {
    flag_name(name): next(kind for kind in (*KINDS, *installed_kinds()) if is_known(name, kind))
    for name, key in OPERATION.items()
    if key.help
} | {flag_name(name): "vcarve" if "tip" in name else "profile" for name in TOOL_KEYS}
_NEEDED = {
    "--last-pass": ("--step-down", "0.5"),
    "--mitre-limit": ("--joins", "mitre"),
    "--angle": ("--pattern", "zigzag"),
}
_BESIDE = {
    "--pitch": ("--copies", "2x2"),
    "--copies": ("--pitch", "30x20"),
    "--tool": ("--tool-table", "tool.tbl"),
    "--tool-table-units": ("--tool-table", "tool.tbl", "--tool", "1"),
    "--operation": ("--job", "job.toml"),
    "--section-z": ("--format", "svg"),
    "--view": ("--preview", "p.svg", "--tool-diameter", "1mm"),
    "--size": ("--preview", "p.svg"),
    "--crop": ("--preview", "p.svg"),
    "--exaggerate": ("--preview", "p.svg"),
    "--layers": ("--preview", "p.svg"),
    "--no-layer": ("--preview", "p.svg"),
    "--polar": ("--preview", "p.svg"),
    "--regions": (),
}
"""Flags without which others have no effect."""


def _without(words: Sequence[str], name: str) -> list[str]:
    """The words without a flag and its value: the one that is given takes their place."""
    pairs = list(zip(words[::2], words[1::2], strict=True))
    return [word for pair in pairs if pair[0] != name for word in pair]


def flags_of(command: click.Command = cli, path: tuple[str, ...] = ()) -> Iterator[Flag]:
    """Every flag that takes a value, of every command."""
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            below = command.get_command(context, name)
            assert below is not None
            yield from flags_of(below, (*path, name))
        if command is cli or not command.params:
            return
    for option in command.params:
        if isinstance(option, click.Option) and not option.is_flag and " ".join(path) in BASES:
            yield Flag(" ".join(path), option.opts[0])


@dataclass(frozen=True)
class Ran:
    """The end of a run: exit code (negative: the signal; None: it hung), output and duration."""

    words: tuple[str, ...]
    code: int | None
    said: str
    seconds: float

    @property
    def fine(self) -> bool:
        """True if the run ended as every run must and sent no escape to a terminal."""
        return self.code in (0, 1, 2) and "\x1b" not in self.said

    def __str__(self) -> str:
        line = " ".join(word if len(word) < 60 else word[:60] + "…" for word in self.words)
        return f"{line!r}: {self.code} in {self.seconds:.1f} s: {self.said[-400:]!r}"


def ran(words: Sequence[str], folder: Path) -> Ran:
    """A command line in a process of its own, forked from this one, in a folder."""
    said = folder / "said.txt"
    begun = time.monotonic()
    pid = os.fork()
    if pid == 0:
        _become(words, folder, said)
    code = _waited(pid, begun + HANG_S)
    return Ran(tuple(words), code, said.read_text("utf-8", "replace"), time.monotonic() - begun)


def _become(words: Sequence[str], folder: Path, said: Path) -> None:
    """Run the command and end with its exit code; never returns."""
    code = 70
    try:
        out = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
        nothing = os.open(os.devnull, os.O_RDONLY)
        for to, stream in ((nothing, 0), (out, 1), (out, 2)):
            os.dup2(to, stream)
        sys.stdin = open(0, closefd=False)  # noqa: SIM115
        sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
        sys.stderr = open(2, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
        os.chdir(folder)
        resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, MOST_BYTES))
        resource.setrlimit(resource.RLIMIT_CPU, (CHEWED_S, CHEWED_S))
        sys.argv = ["camtool", *words]
        main()
    except SystemExit as stop:
        code = stop.code if isinstance(stop.code, int) else 0
    finally:
        with contextlib.suppress(OSError, ValueError):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code)


def _waited(pid: int, until: float) -> int | None:
    while time.monotonic() < until:
        done, status = os.waitpid(pid, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.002)
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    return None
