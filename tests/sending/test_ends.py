"""`camtool send` as a process that is killed, or whose disk is full: the machine is stopped where
anybody is left to stop it, and `--resume` completes the part."""

from __future__ import annotations

import random
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from camtool.arrays import Floats, Ints
from camtool.sending.faults import WiredTwin
from camtool.sending.journal import read_journal
from camtool.sending.twin import Clock, PseudoTerminal, serve
from camtool.target.registry import load_target
from camtool.target.twin import Twin
from tests.feeding import motion
from tests.sending.test_any_order import PROGRAMS

ARC = b"G02X00009.00Y00005.00I00006.00J00005.00F08;"
PARTS = {
    "grbl": PROGRAMS["grbl"],
    # Its arcs may end beside their ends, where the rest of a program does not begin.
    "pic-mmh": PROGRAMS["pic-mmh"].replace(ARC, b"G01X00009.00Y00005.00F08;"),
}

SPEED = {"grbl": 12.0, "pic-mmh": 60.0}
"""Of the clocks of both ends."""


class Over(Exception):
    """The end of a host."""


@contextmanager
def hosted(twin: Twin, speed: float) -> Iterator[str]:
    """The port of a virtual machine that works in a thread."""
    port, over = PseudoTerminal(), threading.Event()

    def look() -> None:
        if over.is_set():
            raise Over

    def work() -> None:
        try:
            serve(WiredTwin(twin), port, Clock(speed), each=look)
        except Over:
            return

    host = threading.Thread(target=work)
    host.start()
    try:
        yield port.name
    finally:
        over.set()
        host.join()
        port.close()


def command(name: str, program: Path, port: str, *more: str) -> list[str]:
    words = ["send", str(program), "-t", name, "--port", port, "--baud", "9600", "--yes", "--json"]
    return [sys.executable, "-m", "camtool", *words, "--speed", str(SPEED[name]), *more]


def at_rest(twin: Twin) -> None:
    """Wait until a machine that nobody speaks to has done what it has."""
    still = 0
    while still < 5:
        time.sleep(0.05)
        still = 0 if twin.is_moving else still + 1


def wanted(name: str) -> tuple[Floats, Ints]:
    """Return the commanded places of a program, (K, 3) mm, and the block of each, (K,)."""
    loaded = load_target(name)
    trace = motion(PARTS[name], loaded)
    of = loaded.target.read(PARTS[name], loaded.machine).block[trace.block]
    return trace.commanded, of.astype(np.int64)


def killed_and_resumed(name: str, folder: Path, seed: int) -> bool:
    """Kill the sending of a program at a random time, resume it, and return True if the kill came
    before its end."""
    chance, loaded = random.Random(f"{name} {seed}"), load_target(name)
    program = folder / f"part{seed}.txt"
    program.write_bytes(PARTS[name])
    first: Any = loaded.twin([])
    seconds = float(motion(PARTS[name], loaded).time_s[-1]) / SPEED[name]
    with hosted(first, SPEED[name]) as port:
        with subprocess.Popen(
            command(name, program, port), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        ) as sending:
            assert sending.stdout is not None
            assert sending.stdout.readline()  # it has begun
            time.sleep(chance.uniform(0.0, 0.95 * seconds))
            sending.send_signal(signal.SIGKILL)
            killed = sending.wait() != 0
        at_rest(first)
    whole, of = wanted(name)
    done = first.slides.trace.commanded
    np.testing.assert_array_equal(done, whole[: len(done)])
    place = read_journal(Path(f"{program}.journal"))
    if place.finished:
        assert len(done) == len(whole)
        return killed
    begin = int(np.searchsorted(of, place.block))
    assert begin <= len(done)  # what is said to be done is done
    second: Any = loaded.twin([])  # somebody has brought it to part zero
    with hosted(second, SPEED[name]) as port:
        words = command(name, program, port, "--resume")
        if place.last >= 0 and begin < len(whole):
            refused = subprocess.run(words, capture_output=True, text=True, check=False)
            assert refused.returncode in (1, 2)
            assert "--tool-at" in refused.stderr
            assert not len(second.slides.trace)
            assert read_journal(Path(f"{program}.journal")) == place
        again = subprocess.run(
            [*words, "--tool-at", "zero"], capture_output=True, text=True, check=False
        )
        at_rest(second)
    if begin == len(whole):
        assert "nothing moves" in again.stderr
        return killed
    assert again.returncode == 0, again.stderr
    assert read_journal(Path(f"{program}.journal")).finished
    trace = second.slides.trace
    entry = trace.commanded[: len(trace) - (len(whole) - begin)]
    np.testing.assert_array_equal(trace.commanded[len(entry) :], whole[begin:])
    if place.block:
        across = (np.diff(entry, axis=0, prepend=np.zeros((1, 3)))[:, :2] != 0.0).any(axis=1)
        assert (entry[across, 2] >= whole[:, 2].max()).all()
    return killed


@pytest.mark.parametrize("name", sorted(SPEED))
@pytest.mark.parametrize("seed", range(2))
def test_a_killed_sender_is_gone_on_with(name: str, seed: int, tmp_path: Path) -> None:
    killed_and_resumed(name, tmp_path, seed)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(SPEED))
def test_fifty_kills(name: str, tmp_path: Path) -> None:
    killed = [killed_and_resumed(name, tmp_path, seed) for seed in range(100, 150)]
    assert sum(killed) > 40


@pytest.mark.parametrize("name", sorted(SPEED))
@pytest.mark.parametrize("room", [900, 1300])
def test_a_full_disk_stops_the_machine(name: str, room: int, tmp_path: Path) -> None:
    program = tmp_path / "part.txt"
    program.write_bytes(PARTS[name])
    twin: Any = load_target(name).twin([])

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))

    with hosted(twin, SPEED[name]) as port:
        done = subprocess.run(
            command(name, Path(program.name), port),  # the journal names it: a short name
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
            preexec_fn=limited,
        )
        stood = len(twin.slides.trace)
        time.sleep(0.3)
        assert not twin.is_moving
        assert len(twin.slides.trace) == stood
    assert done.returncode == 1, done.stderr
    lines = [line for line in done.stderr.splitlines() if line.startswith("camtool: error")]
    assert len(lines) == 1
    assert "the journal cannot be written" in lines[0]
    assert "Traceback" not in done.stderr
    whole, of = wanted(name)
    assert 0 < stood < len(whole)
    place = read_journal(Path(f"{program}.journal"))
    assert not place.finished
    assert int(np.searchsorted(of, place.block)) <= stood


def test_a_journal_without_any_room_lets_nothing_out(tmp_path: Path) -> None:
    program = tmp_path / "part.txt"
    program.write_bytes(PARTS["grbl"])
    twin: Any = load_target("grbl").twin([])
    with hosted(twin, SPEED["grbl"]) as port:
        words = [*command("grbl", program, port), "--journal", "/dev/full"]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    assert "No space left" in done.stderr
    assert twin.decoded == []
