"""The sample logo sent to each virtual machine over a real pseudo-terminal: what the machine took
is the program, and its slides did what `verify` says, to the last step.

Clocks run fast, and no machine is timed: each is let finish what it is told, however late.
"""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from camtool.sending.faults import WiredTwin
from camtool.sending.journal import read_journal
from camtool.sending.twin import Clock, PseudoTerminal, serve
from camtool.target.twin import Twin
from tests.commands import run_camtool
from tests.feeding import at_rest, logo, made, same_motion
from tests.waiting import HANG_S

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")


@contextmanager
def at_a_port(twin: Twin) -> Iterator[str]:
    """The port at which a machine answers as fast as it can, until the first client has gone."""
    port = PseudoTerminal()
    serving = threading.Thread(
        target=serve,
        args=(WiredTwin(twin), port, Clock(None)),
        kwargs={"ends_with_client": True},
        daemon=True,
    )
    serving.start()
    try:
        yield port.name
        serving.join(HANG_S)
        assert not serving.is_alive()
        at_rest(twin, twin.now)
    finally:
        port.close()


def sent(
    name: str, port: str, program: bytes, folder: Path, *flags: str
) -> subprocess.CompletedProcess[str]:
    """`camtool send` to the end."""
    file = folder / "logo.program"
    file.write_bytes(program)
    words = ["send", str(file), "-t", name, "--port", port, "--yes", *flags]
    return run_camtool(*words)


def check(
    name: str, folder: Path, *, settings: list[str], choices: list[str], speed: float
) -> Twin:
    """Post, send, compare; the machine as it is then."""
    program = logo(name, *settings)
    twin, loaded = made(name, choices, settings)
    assert isinstance(twin, Twin)
    flags = [word for setting in settings for word in ("--set", setting)]
    with at_a_port(twin) as port:
        done = sent(name, port, program, folder, "--speed", f"{speed:g}", *flags)
    assert done.returncode == 0, done.stderr
    assert read_journal(folder / "logo.program.journal").finished
    same_motion(twin, program, loaded)
    return twin


def test_valcnc(tmp_path: Path) -> None:
    # Nothing is acknowledged: what comes too early must wait, as a busy computer makes it late.
    twin = check(
        "valcnc", tmp_path, settings=["link.margin_s=0.002"], choices=["busy=kept"], speed=100
    )
    assert b"".join(twin.decoded) == logo("valcnc").replace(b" ", b"")
    assert twin.commands == [b"C\n"]


def test_valcnc_that_answers(tmp_path: Path) -> None:
    twin = check(
        "valcnc", tmp_path, settings=["link.answer=ok"], choices=["answer=ok"], speed=1000
    )
    assert b"".join(twin.decoded) == logo("valcnc").replace(b" ", b"")


def test_pic_mmh(tmp_path: Path) -> None:
    twin = check("pic-mmh", tmp_path, settings=[], choices=[], speed=1e6)
    assert b"".join(twin.decoded) == logo("pic-mmh").replace(b"\n", b"")


def test_grbl(tmp_path: Path) -> None:
    check("grbl", tmp_path, settings=[], choices=[], speed=10)


def test_i8751(tmp_path: Path) -> None:
    steps = [f"axes.{axis}.coded_step_mm=0.0125" for axis in "xyz"]
    settings = [*steps, "feed.default_mm_min=78.3"]
    twin = check("i8751", tmp_path, settings=settings, choices=[], speed=1e5)
    assert b"\x13" + b"".join(twin.decoded) + b"\x54" == logo("i8751", *settings)


def test_matlab_router(tmp_path: Path) -> None:
    # A mended master, which takes job after job: nobody is there to reset it.
    settings = ["link.echo=echo", "link.reset=none", "link.margin_s=0"]
    choices = ["echo=characters", "reset=itself"]
    twin = check("matlab-router", tmp_path, settings=settings, choices=choices, speed=1000)
    assert b"".join(twin.decoded) == logo("matlab-router", "dialect.format=stream")


def test_a_program_that_asks_is_not_begun_where_nobody_can_answer(tmp_path: Path) -> None:
    done = sent("matlab-router", "/dev/null", logo("matlab-router"), tmp_path)
    assert done.returncode == 2
    assert "it waits for an answer 31 times: run it at a terminal" in done.stderr
