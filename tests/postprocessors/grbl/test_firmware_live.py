"""grbl's own firmware at the other end of camtool's line, with its steps as evidence: how fast it
is fed, and in real time on a pseudo-terminal by each command and by the panel.

GRBL_SOURCE names a checkout of github.com/gnea/grbl.
"""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from camtool.panel.program import LoadedProgram
from camtool.panel.session import Session
from camtool.sending.carry import SendOptions
from camtool.sending.drive import Request
from camtool.sending.faults import WiredTwin
from camtool.sending.journal import read_journal
from camtool.sending.line import Port, opened_line
from camtool.sending.prepare import consignment, forecast_of
from camtool.target.registry import LoadedTarget, load_target
from camtool.target.wire import Manner, WireState
from tests.commands import run_camtool
from tests.feeding import logo
from tests.oracles.grbl_counter import CharacterCounter
from tests.oracles.grbl_firmware import FirmwareTwin, Switch, built, source
from tests.panel import test_server
from tests.pictures.viewer_browser import NEEDS_BROWSER, browser
from tests.sending.talking import Talking
from tests.sending.test_ends import hosted

HANG_S = 60.0

pytestmark = [
    pytest.mark.slow,
    pytest.mark.referee,
    pytest.mark.skipif(source() is None, reason="GRBL_SOURCE names no sources of grbl"),
    pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc"),
]

__all__ = ["browser"]

page_of_panel = test_server.TestPage
"""Its helpers; its tests are not collected here."""

FAST = ("$110=10000", "$111=10000", "$112=10000", "$120=1000", "$121=1000", "$122=1000", "$32=1")
FAST_MACHINE = (
    "controller.laser_mode=true",
    *(f"axes.{axis}.max_rate_mm_min=10000" for axis in "xyz"),
    *(f"axes.{axis}.acceleration_mm_s2=1000" for axis in "xyz"),
)
RASTER = b"G21G90\nM4S0\nF4000\n" + b"".join(
    b"G1X%d.%dS%d\n" % (*divmod(k, 10), 100 + 37 * k % 900) for k in range(1, 400)
)
MAX_TIME_RATIO = 1.05
"""Largest time of camtool in multiples of a plain character counter."""


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built(tmp_path_factory.mktemp("grbl"))


def streamed_s(twin: FirmwareTwin, talk: Any) -> float:
    """Send a program over a line of 115200 baud; the time from the first step to the last, s."""
    both = Talking(talk, WiredTwin(twin, paced=True), now=twin.now)  # type: ignore[arg-type]
    both.until(twin.now + 5000.0)
    assert talk.is_over
    end = twin.now
    while twin.is_moving:
        end += 0.1
        twin.advance(end)
    times = twin.slides.trace.time_s
    assert len(times)
    return float(times[-1] - times[0])


def stream_times(program: Path, folder: Path, which: str) -> tuple[float, float]:
    """The times, s, of camtool and of a plain character counter for a program."""
    settings, machine = (FAST, FAST_MACHINE) if which == "raster" else ((), ())
    data = RASTER if which == "raster" else logo("grbl")
    target = load_target("grbl", settings=[*machine, "spindle.max_rpm=1000"])
    forecast = forecast_of(target.target.read(data, target.machine), target)
    wire: Any = target.target.wire()
    packets = wire.packets(data, target.machine, forecast)
    talk = wire.conversation(packets, target.machine, Manner())
    ours = FirmwareTwin(program, folder / "ours", settings)
    plain = FirmwareTwin(program, folder / "plain", settings)
    counter = CharacterCounter(packet.data.rstrip() for packet in packets)
    times = streamed_s(ours, talk), streamed_s(plain, counter)
    assert talk.state is WireState.FINISHED, talk.why
    assert not counter.refusals
    for twin in (ours, plain):
        twin.close()
    one, other = (twin.slides.trace.commanded for twin in (ours, plain))
    np.testing.assert_array_equal(one, other)
    return times


@pytest.mark.parametrize("which", ["logo", "raster"])
def test_it_is_fed_as_fast_as_by_a_plain_character_counter(
    program: Path, tmp_path: Path, which: str
) -> None:
    ours, plain = stream_times(program, tmp_path, which)
    print(f"{which}: {ours:.2f} s, a plain character counter {plain:.2f} s, {ours / plain:.4f}")
    assert ours <= MAX_TIME_RATIO * plain


# In real time.

SPEED = 4.0
PART = b"G21 G90\nM3 S500\nG0 X2 Y1\nG1 X6 Y4 F400\nG2 X9 Y7 I3 J0 F300\nM0\nG1 X2 Y1 F500\nM5\n"
SQUARE = b"G21 G90\nG1 X40 F450\nG1 Y20\nG1 X0\nG1 Y0\n"
SWITCHES = tuple(Switch(pin, axis, most=10 * 250) for axis, pin in enumerate("XYZ"))
"""Limit switches 10 mm from where the power came on."""


class Machine:
    """The firmware at a port."""

    def __init__(self, twin: FirmwareTwin, port: str) -> None:
        self.twin, self.port = twin, port

    @property
    def place(self) -> Any:
        return self.twin.slides.commanded_mm.copy()

    def command(self, *words: str, folder: Path) -> subprocess.CompletedProcess[str]:
        fast = ["--speed", str(SPEED)] if words[0] == "send" else []
        return run_camtool(*words, "-t", "grbl", "--port", self.port, *fast, cwd=folder)


@contextmanager
def machine(
    program: Path,
    folder: Path,
    settings: tuple[str, ...] = (),
    switches: tuple[Switch, ...] = (),
    speed: float = SPEED,
) -> Iterator[Machine]:
    twin = FirmwareTwin(program, folder / "firmware", settings, switches)
    with hosted(twin, speed) as port:  # type: ignore[arg-type]
        yield Machine(twin, port)
    twin.close()


def wait_until(is_true: Callable[[], object]) -> None:
    end = time.monotonic() + HANG_S
    while not is_true():
        assert time.monotonic() < end
        time.sleep(0.005)


def test_each_command(program: Path, tmp_path: Path) -> None:
    """Home, jog, zero, probe and a program that stops, is let go on, is stopped and resumed."""
    probe = Switch("P", 2, least=5 * 250)  # closed below 5 mm
    settings = ("$22=1", "$25=400", "$24=100", "$X")
    with machine(program, tmp_path, settings, (*SWITCHES, probe)) as at:
        homed = at.command("home", folder=tmp_path)
        assert homed.returncode == 0, homed.stderr
        assert at.place == pytest.approx([9.0] * 3, abs=0.1)  # $27 pulls off by 1 mm
        before = at.place
        jogged = at.command("jog", "X-3", "Y-1.5", "F400", folder=tmp_path)
        assert jogged.returncode == 0, jogged.stderr
        assert at.place - before == pytest.approx([-3.0, -1.5, 0.0], abs=0.004)
        assert at.command("zero", folder=tmp_path).returncode == 0
        zero = at.place
        (tmp_path / "part.nc").write_bytes(b"G21 G90\nG0 Z0\nG1 X0 Y-2 F300\nG1 X-2 Y0\n")
        probed = at.command(
            *("probe", "part.nc", "--step", "2mm", "--yes"),
            *("--clear", "0.5", "--lowest", "-6"),
            folder=tmp_path,
        )
        assert probed.returncode == 0, probed.stderr + probed.stdout
        (tmp_path / "part.nc").write_bytes(PART)
        sent = at.command("send", "part.nc", "--yes", "--at-stop", "true", folder=tmp_path)
        assert sent.returncode == 0, sent.stderr
        assert at.place - zero == pytest.approx([2.0, 1.0, 0.5], abs=0.004)  # above the probe
        assert read_journal(tmp_path / "part.nc.journal").finished


def test_a_program_that_is_stopped_is_resumed_and_nothing_stays_uncut(
    program: Path, tmp_path: Path
) -> None:
    (tmp_path / "square.nc").write_bytes(SQUARE)
    with machine(program, tmp_path) as at:
        words = [sys.executable, "-m", "camtool", "send", "square.nc", "-t", "grbl", "--yes"]
        words += ["--port", at.port, "--speed", str(SPEED)]
        with subprocess.Popen(
            words, cwd=tmp_path, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        ) as sending:
            wait_until(lambda: at.place[0] > 30.0)
            sending.send_signal(signal.SIGINT)
            _, said = sending.communicate(timeout=HANG_S)
        assert sending.returncode == 1
        assert "stopped" in said
        left = read_journal(tmp_path / "square.nc.journal")
        assert left.is_still
        assert left.tool_mm == pytest.approx(tuple(at.place), abs=0.001)
        done = at.command("send", "square.nc", "--yes", "--resume", folder=tmp_path)
        assert done.returncode == 0, done.stderr
        trace = at.twin.slides.trace.commanded
    cells = {tuple(cell) for cell in np.rint(trace[:, :2] * 250).astype(int).tolist()}
    wanted = {(x, y) for x in range(10001) for y in (0, 5000)}
    wanted |= {(x, y) for x in (0, 10000) for y in range(5001)}
    assert wanted <= cells  # nothing uncut
    low = trace[trace[:, 2] < 1e-9][:, :2]
    elsewhere = {tuple(cell) for cell in np.rint(low * 250).astype(int).tolist()} - wanted
    assert not elsewhere


class Panel:
    """A session of the panel at the firmware."""

    def __init__(self, at: Machine, speed: float) -> None:
        self.target: LoadedTarget = load_target("grbl")
        self.session = Session(self.target, Port(at.port), opened_line, speed=speed)
        self.session.start()
        self.at = at

    def until(self, *words: str) -> None:
        wait_until(lambda: self.session.state.state in words)


def test_the_session_of_the_panel(program: Path, tmp_path: Path) -> None:
    """Connect, home, a held jog, zero, run, hold, override, stop, run again."""
    settings = ("$22=1", "$25=400", "$24=100")
    with machine(program, tmp_path, settings, SWITCHES, speed=1.0) as at:
        panel = Panel(at, 1.0)
        session = panel.session
        panel.until("ready")
        session.order("home", {})
        wait_until(lambda: np.abs(at.place - 9.0).max() < 0.1 and not at.twin.is_moving)
        panel.until("ready")
        # A held jog: what moves after it is let go.
        session.hold({"x": -1.0, "feed": 400.0})
        for _ in range(40):
            time.sleep(0.02)
            session.keep()
        let_go = at.place
        session.release()
        panel.until("ready")
        wait_until(lambda: not at.twin.is_moving)
        after_mm = let_go[0] - at.place[0]
        speed = 400.0 / 60.0
        print(f"a held jog at 400 mm/min moves {after_mm:.2f} mm after it is let go")
        assert let_go[0] < 8.0
        assert 0.0 <= after_mm <= speed * speed / 20.0 + speed * 0.35
        # The page is gone: nobody confirms the key.
        session.hold({"y": -1.0, "feed": 400.0})
        wait_until(lambda: any("let go" in message.text for message in session.messages))
        panel.until("ready")
        wait_until(lambda: not at.twin.is_moving)
        assert 8.0 < at.place[1] < 9.1
        session.order("zero", dict.fromkeys("xyz", 0.0))
        panel.until("ready")
        zero = at.place
        (tmp_path / "square.nc").write_bytes(SQUARE)
        one = consignment(SQUARE, panel.target, source="square.nc")
        options = SendOptions(journal=tmp_path / "square.nc.journal")
        wait_until(lambda: session.state.state == "ready")
        session.run_program(one, options)
        panel.until("sending")
        wait_until(lambda: at.place[0] - zero[0] > 2.0)
        session.override("feed", 50)
        wait_until(lambda: session.state.overrides.get("feed") == 50)
        session.request(Request.PAUSE)
        panel.until("paused")
        held = at.place
        time.sleep(0.3)
        assert (at.place == held).all()
        session.request(Request.RESUME)
        wait_until(lambda: at.place[0] > held[0] + 0.5)
        session.stop()
        panel.until("ready")
        wait_until(lambda: not at.twin.is_moving)
        assert not read_journal(options.journal).finished
        assert 2.0 < at.place[0] - zero[0] < 39.0
        session.close()
    assert b"\x85" in at.twin.received  # the held jogs were cancelled


class TestInABrowser:
    pytestmark = NEEDS_BROWSER

    def test_the_page_of_the_panel(self, program: Path, tmp_path: Path, browser: Any) -> None:
        """The page in Chromium: a step, a held key, zero, run, pause, go on, stop."""
        file = tmp_path / "square.nc"
        file.write_bytes(SQUARE)
        loaded = LoadedProgram.read(str(file), load_target("grbl"))
        twin = FirmwareTwin(program, tmp_path / "firmware")
        with test_server.served("grbl", loaded, machine=twin) as (server, _):
            page = browser.new_page(viewport={"width": 1280, "height": 900})
            page.set_default_timeout(HANG_S * 1000)
            page.goto(server.address)
            page_of_panel.state(page, "ready")
            page.locator("#step-size").select_option("1")
            page.locator("#pad .e").click()
            page_of_panel.place(page, "at === 1")
            page_of_panel.state(page, "ready")
            page.locator("#step-size").select_option("held")
            page.locator("#machine").click()
            page.keyboard.down("ArrowRight")
            page_of_panel.place(page, "at > 1.5")
            page.keyboard.up("ArrowRight")
            page_of_panel.state(page, "ready")
            wait_until(lambda: not twin.is_moving)
            assert twin.slides.commanded_mm[0] > 1.5
            page.locator("#places button").first.click()
            page_of_panel.place(page, "at === 0")
            page_of_panel.state(page, "ready")
            zero = twin.slides.commanded_mm.copy()
            page.locator("#start").click()
            wait_until(lambda: twin.slides.commanded_mm[0] > zero[0] + 2.0)
            page.locator("#pause").click()
            page_of_panel.state(page, "paused")
            held = twin.slides.commanded_mm.copy()
            page.locator("#go-on").click()
            wait_until(lambda: twin.slides.commanded_mm[0] > held[0] + 1.0)
            page.keyboard.press("Escape")
            page_of_panel.state(page, "ready")
            wait_until(lambda: not twin.is_moving)
            assert twin.slides.commanded_mm[0] < zero[0] + 39.0
            page.close()
        twin.close()
