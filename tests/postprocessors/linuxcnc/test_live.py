"""LinuxCNC itself, without a screen: camtool's sender drives it through linuxcncrsh, and its
joints go where `verify` says."""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shapely import LineString, points

from camtool.arrays import Floats
from camtool.sending.drive import Driver
from camtool.sending.line import Port, opened_line
from camtool.target.registry import LoadedTarget, load_target
from camtool.target.wire import Hand, Manner, WireState
from camtool.toolpath.surface import surface_of_text
from tests.feeding import motion
from tests.oracles.linuxcnc_headless import COMMAND, alone, laid_out

NEAR_MM = 0.012
"""A blend of G64 P0.01, and what lies between two samples of the motion."""

DISPLAY = """#!/bin/sh
halsampler -t > samples.txt &
linuxcncrsh -p $RSH_PORT -- -ini machine.ini
kill %1
"""

PROGRAM = (
    b"G21 G90 G17\nG64 P0.01\nF900\nG0 Z5\nG0 X2 Y1\nM3 S1000\nG4 P0.3\nG1 Z-1 F300\n"
    b"G1 X14 F900\nG2 X18 Y5 I0 J4\nG1 Y9\nG3 X14 Y13 I-4 J0\nG1 X2\nG1 X2 Y1\nG0 Z5\nG0 X0 Y0\n"
    b"M5\nM2\n"
)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.referee,
    pytest.mark.skipif(
        shutil.which("linuxcnc") is None or shutil.which("linuxcncrsh") is None,
        reason="LinuxCNC (Debian's linuxcnc-uspace) is not installed",
    ),
]


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


class Hands:
    """Who stands at the machine: speaks to linuxcncrsh beside camtool."""

    def __init__(self, port: int) -> None:
        self._port = port

    def do(self, *orders: str) -> str:
        """Each on a connection of its own, since the last that is enabled has the say; what is
        answered to them."""
        said = ""
        for order in orders:
            with socket.create_connection(("127.0.0.1", self._port), timeout=5.0) as line:
                for each in ("hello EMC test 1.0", "set enable EMCTOO", order):
                    line.sendall(each.encode() + b"\r\n")
                    time.sleep(0.3)
                with suppress(OSError):
                    said += line.recv(4096).decode()
        return said


BLANK = """loadrt sum2
loadrt comp
addf sum2.0 servo-thread
addf comp.0 servo-thread
setp sum2.0.gain0 0.01
setp sum2.0.gain1 -0.02
setp sum2.0.offset -2
net p0 => sum2.0.in0
net p1 => sum2.0.in1
net surface sum2.0.out => comp.0.in1
net p2 => comp.0.in0
net probe comp.0.out => motion.probe-input
"""
"""A probe that touches below -2 mm + 0.01 X - 0.02 Y."""


@contextmanager
def live(folder: Path, hal: str = "") -> Iterator[tuple[int, Hands]]:
    """LinuxCNC, switched on, with these lines at the end of its HAL file; the port of
    linuxcncrsh."""
    port = free_port()
    environment = laid_out(folder, DISPLAY, folder.parents[:2]) | {"RSH_PORT": str(port)}
    with (folder / "machine.hal").open("a", encoding="ascii") as file:
        file.write(hal)
    with alone(), (folder / "linuxcnc.log").open("w") as log:
        running = subprocess.Popen(
            COMMAND, cwd=folder, env=environment, stdout=log, stderr=log, start_new_session=True
        )
        try:
            yield port, _switched_on(port)
        finally:
            with suppress(OSError):
                Hands(port).do("shutdown")
            try:
                running.wait(20.0)
            except subprocess.TimeoutExpired:
                os.killpg(running.pid, signal.SIGTERM)
                running.wait(20.0)
            for left in _begun_in(folder):
                os.kill(left, signal.SIGKILL)


def _begun_in(folder: Path) -> list[int]:
    """The processes of LinuxCNC that were left behind there."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if (process / "cwd").readlink() == folder and "python" not in (
                process / "cmdline"
            ).read_text(errors="replace"):
                found.append(int(process.name))
    return found


def _switched_on(port: int) -> Hands:
    end = time.monotonic() + 40.0
    hands = Hands(port)
    while True:
        with suppress(OSError):
            if "MACHINE ON" in hands.do("set estop off", "set machine on", "get machine"):
                return hands
        assert time.monotonic() < end, "LinuxCNC does not begin"
        time.sleep(0.3)


def camtool(*words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "camtool", *words]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=200)


def sampled(folder: Path) -> Floats:
    """(K, 3) mm: where the joints were, at 1 kHz, each place once."""
    rows = [line.split() for line in (folder / "samples.txt").read_text().splitlines()]
    places = np.array([row[1:4] for row in rows if len(row) >= 5], dtype=np.float64)
    moved = np.append(True, (np.diff(places, axis=0) != 0.0).any(axis=1))
    return np.asarray(places[moved])


def apart_mm(path: Floats, places: Floats) -> float:
    """Largest distances of places from a path, mm, in XY and in XZ."""
    found = 0.0
    for columns in ([0, 1], [0, 2]):
        line = LineString(path[:, columns])
        found = max(found, float(line.distance(points(places[:, columns])).max()))
    return found


class Held:
    """A hand that holds X for two seconds, lets go and closes; how far it went, mm, and how far
    after it was let go."""

    def __init__(self, loaded: LoadedTarget) -> None:
        wire: Any = loaded.target.wire()
        self.hand: Hand = wire.hand(loaded.machine, Manner())
        self.went_mm = self.after_mm = 0.0
        self._held_s = self._let_go_s = 0.0
        self._begin_mm = self._let_go_mm = 0.0

    def wish(self) -> Any:
        hand, now = self.hand, time.monotonic()
        if hand.state is WireState.READY and not self._held_s:
            self._held_s = now
            return lambda talk, at: talk.hold({"x": 1.0, "feed": 180.0}, at)
        if hand.place_mm is None:
            return None
        if not self._let_go_s:
            self._begin_mm = self._begin_mm or hand.place_mm[0]
            if now - self._held_s < 2.0:
                return None
            self._let_go_s, self._let_go_mm = now, hand.place_mm[0]
            return lambda talk, at: talk.release(at)
        if hand.state is WireState.READY:
            self.went_mm = hand.place_mm[0] - self._begin_mm
            self.after_mm = hand.place_mm[0] - self._let_go_mm
            return lambda talk, at: talk.close(at)
        return None


def test_a_program_is_driven_and_its_path_is_the_predicted_one(tmp_path: Path) -> None:
    loaded = load_target("linuxcnc")
    predicted = motion(PROGRAM, loaded).commanded
    program = tmp_path / "part.ngc"
    program.write_bytes(PROGRAM)
    words = ["send", str(program), "-t", "linuxcnc", "--yes", "--json"]
    with live(tmp_path) as (port, hands):
        at = ["--port", f"socket://127.0.0.1:{port}"]
        refused = camtool(*words, *at)
        assert refused.returncode == 1
        assert "not homed" in refused.stderr
        done = camtool(*words, *at, "--home")
        assert done.returncode == 0, done.stderr
        time.sleep(0.5)
        first = sampled(tmp_path)
        assert apart_mm(predicted, first) < NEAR_MM
        assert apart_mm(first, predicted) < NEAR_MM
        # From a block: up, across, down, and the rest.
        rest = camtool(*words, *at, "--from", "10")
        assert rest.returncode == 0, rest.stderr
        # A stop: it stands, and the journal knows where.
        slow = tmp_path / "slow.ngc"
        slow.write_bytes(PROGRAM.replace(b"F900", b"F60"))
        command = [sys.executable, "-m", "camtool", "send", str(slow), *words[2:], *at]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as sending:
            time.sleep(8.0)
            sending.send_signal(signal.SIGINT)
            _, said = sending.communicate(timeout=30.0)
        assert sending.returncode == 1, said
        assert b"stopped" in said
        before = len(sampled(tmp_path))
        time.sleep(1.0)
        assert len(sampled(tmp_path)) == before
        # By hand.
        for action in (["jog", "X1.5", "Y-2", "F600"], ["zero", "X0"], ["home"]):
            by_hand = camtool(*action, "-t", "linuxcnc", *at)
            assert by_hand.returncode == 0, by_hand.stderr
        # Held, as in the panel: increments that LinuxCNC adds to where it is going.
        with opened_line(Port(at[1])) as line:
            hand = Held(loaded)
            Driver(line, wish=hand.wish).carry(hand.hand)
        assert hand.hand.state is WireState.FINISHED, hand.hand.why
        assert 4.0 < hand.went_mm < 6.0  # 2 s at 3 mm/s, and it speeds up and slows down
        assert hand.after_mm < 0.6
        hands.do("set estop on")
        stopped = camtool(*words, *at)
        assert stopped.returncode == 1
        assert "emergency stop" in stopped.stderr


def test_it_stops_behind_a_tool_change(tmp_path: Path) -> None:
    program = tmp_path / "part.ngc"
    program.write_bytes(
        b"G21 G90 G17\nT1 M6\nG43 H1\nG0 Z3\nG1 X2 F300\n(T2: end mill 3 mm)\nT2 M6\nG43 H2\n"
        b"G1 X4\nG0 Z3\nM2\n"
    )
    stops = tmp_path / "stops"
    with live(tmp_path) as (port, _):
        at = ["-t", "linuxcnc", "--port", f"socket://127.0.0.1:{port}", "--yes"]
        command = f'echo "$CAMTOOL_WHY" >> {stops}'
        sent = camtool("send", str(program), *at, "--home", "--at-stop", command)
        assert sent.returncode == 0, sent.stderr
    assert stops.read_text() == "the program waits: T2: end mill 3 mm\n"


def test_its_probe_finds_a_blank_that_lies_aslant(tmp_path: Path) -> None:
    program = tmp_path / "part.ngc"
    program.write_bytes(b"G21 G90 G17\nG0 Z3\nG0 X2 Y1\nG1 Z-1 F300\nG1 X22\nG1 Y11\nG0 Z3\nM2\n")
    with live(tmp_path, BLANK) as (port, _):
        at = ["-t", "linuxcnc", "--port", f"socket://127.0.0.1:{port}", "--yes"]
        assert camtool("home", *at[:-1]).returncode == 0
        probed = camtool("probe", str(program), *at, "--lowest", "-4mm", "--feed", "120")
        assert probed.returncode == 0, probed.stderr
        surface = surface_of_text(program.with_suffix(".surface.csv").read_text(), "")
        wanted = -2.0 + 0.01 * surface.x[None, :] - 0.02 * surface.y[:, None]
        assert surface.z == pytest.approx(wanted, abs=0.005)
        x, y = float(surface.x[0]), float(surface.y[0])
        # The tool stands above the last point; the plate is touched there.
        touched = camtool("touch", "plate", "--thickness", "1.5mm", *at, "--json")
        assert touched.returncode == 0, touched.stderr
        found = json.loads(touched.stdout)
        assert -2.5 < found["top_z_mm"] < -1.5
        again = camtool("touch", "plate", "--thickness", "1.5mm", *at, "--json")
        assert json.loads(again.stdout)["top_z_mm"] == pytest.approx(1.5, abs=0.005), (x, y)
        missed = camtool("touch", "edge", "--towards", "x+", "--tool-diameter", "1", *at)
        assert missed.returncode == 1
        assert "nothing was touched" in missed.stderr
        camtool("jog", "Z-9", "F600", *at[:-1])
        touching = camtool("touch", "plate", "--thickness", "1.5mm", *at)
        assert touching.returncode == 1
        assert "touches already" in touching.stderr
