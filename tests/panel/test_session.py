"""The panel's session with virtual machines: by hand, programs, stops and ends."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from camtool.errors import MachineError, OptionError
from camtool.panel.program import LoadedProgram
from camtool.panel.session import Session
from camtool.sending.drive import Request
from camtool.sending.journal import read_journal
from camtool.sending.line import Port, opened_line
from camtool.target.registry import load_target
from tests.sending.test_ends import hosted
from tests.waiting import HANG_S

SPEED = 10.0
PROGRAM = b"G21 G90 G17 G94\nG1 X2 Y0 F300\nG1 X2 Y3\nG2 X4 Y5 I2 J0\nG1 X0 Y5\nG0 X0 Y0\n"


class AtPanel:
    """A session, its machine, and a way to wait for what it says."""

    def __init__(self, name: str, twin: Any, port: str) -> None:
        self.twin = twin
        self.changed = threading.Condition()
        self.history: list[str] = []
        """All states, in order: a busy computer may see some of them only afterwards."""
        self._seen = 0
        self.session = Session(
            load_target(name), Port(port), opened_line, speed=SPEED, watch=self._changed
        )

    def _changed(self) -> None:
        with self.changed:
            self.history.append(self.session.state.state)
            self.changed.notify_all()

    def until(self, true: Callable[[], bool]) -> None:
        with self.changed:
            assert self.changed.wait_for(true, HANG_S), self.session.state

    def until_state(self, state: str) -> None:
        """Wait until the machine is, or has been, in a state since the last one waited for."""
        self.until(lambda: state in self.history[self._seen :])
        self._seen = self.history.index(state, self._seen) + 1

    @property
    def told(self) -> list[str]:
        return [each.text for each in self.session.messages]


@contextmanager
def at_panel(name: str) -> Iterator[AtPanel]:
    twin = load_target(name).twin([])
    with hosted(twin, SPEED) as port:
        at = AtPanel(name, twin, port)
        at.session.start()
        try:
            yield at
        finally:
            at.session.close()


def program(folder: Path, data: bytes = PROGRAM) -> LoadedProgram:
    file = folder / "part.nc"
    file.write_bytes(data)
    return LoadedProgram.read(str(file), load_target("grbl"))


def start(at: AtPanel, loaded: LoadedProgram, **how: Any) -> None:
    options = {"single": False, "first": 0, "resumes": False, "despite_errors": False, **how}
    at.session.run_program(*loaded.prepared(speed=SPEED, **options))


def test_a_machine_is_moved_by_hand_and_then_runs_a_program(tmp_path: Path) -> None:
    loaded = program(tmp_path)
    with at_panel("grbl") as at:
        at.until_state("ready")
        at.session.order("jog", {"x": 1.5, "feed": 300.0})
        at.until_state("sending")
        at.until_state("ready")
        assert at.twin.slides.commanded_mm[0] == pytest.approx(1.5, abs=0.01)
        at.session.order("zero", {"x": 0.0, "y": 0.0, "z": 0.0})
        at.until_state("sending")
        at.until_state("ready")
        start(at, loaded)
        at.until(lambda: any("finished" in each for each in at.told))
        at.until_state("ready")
    # Beside the program its own queries count, which stand in the order of the lines.
    assert at.twin.slides.commanded_mm[:2] == pytest.approx([1.5, 0.0], abs=0.01)
    assert read_journal(loaded.journal).finished


def test_a_program_is_paused_stopped_and_resumed(tmp_path: Path) -> None:
    loaded = program(tmp_path)
    with at_panel("grbl") as at:
        at.until_state("ready")
        start(at, loaded)
        at.until(lambda: at.session.state.runs and at.session.state.acknowledged > 2)
        with pytest.raises(MachineError, match="not ready"):
            start(at, loaded)
        at.session.order("jog", {"x": 1.0, "feed": 300.0})
        at.until(lambda: any("stop it first" in each for each in at.told))
        at.session.request(Request.PAUSE)
        at.until_state("paused")
        assert not at.twin.is_moving
        at.session.request(Request.RESUME)
        at.until_state("sending")
        at.session.stop()
        at.until(lambda: any("can be resumed" in each for each in at.told))
        at.until_state("ready")
        assert not at.twin.is_moving
        state = read_journal(loaded.journal)
        assert not state.finished
        assert state.is_still
        start(at, loaded, resumes=True)
        at.until(lambda: any("finished" in each for each in at.told))
    assert read_journal(loaded.journal).finished
    assert at.twin.slides.commanded_mm[:2] == pytest.approx([0.0, 0.0], abs=0.01)


def test_a_key_that_nobody_confirms_is_let_go() -> None:
    """A page that is gone, or whose network is: the machine stands."""
    with at_panel("grbl") as at:
        at.until_state("ready")
        at.session.hold({"x": 1.0, "feed": 300.0})
        at.until(lambda: any("not confirmed" in each for each in at.told))
        at.until_state("ready")
        assert not at.twin.is_moving
        assert at.twin.slides.commanded_mm[0] < 30.0


def test_a_key_that_is_confirmed_moves_on_until_it_is_let_go() -> None:
    with at_panel("pic-mmh") as at:
        at.until_state("ready")
        at.session.hold({"x": 1.0, "feed": 300.0})
        while at.twin.slides.commanded_mm[0] < 0.05:
            at.session.keep()
            time.sleep(0.002)
            if at.session.state.state == "ready":  # a busy computer did not come to confirm it
                at.session.hold({"x": 1.0, "feed": 300.0})
        at.session.release()
        at.until_state("ready")
        place = at.twin.slides.commanded_mm[0]
        assert not at.twin.is_moving
        assert at.twin.slides.commanded_mm[0] == place


def test_the_end_of_the_panel_stops_the_machine() -> None:
    with at_panel("grbl") as at:
        at.until_state("ready")
        at.session.order("jog", {"x": 80.0, "feed": 500.0})
        at.until(lambda: at.session.state.says == "Jog")
        at.session.close()
        assert at.session.state.state == "closed"
    assert not at.twin.is_moving
    assert at.twin.slides.commanded_mm[0] < 79.0


def test_a_port_that_is_gone_is_said_and_opened_again(tmp_path: Path) -> None:
    twin = load_target("grbl").twin([])
    with hosted(twin, SPEED) as port:
        link = tmp_path / "port"
        at = AtPanel("grbl", twin, str(link))
        at.session.start()
        at.until(lambda: any("cannot be opened" in each for each in at.told))
        at.until_state("closed")
        link.symlink_to(port)
        at.session.reopen()
        at.until_state("ready")
        at.session.close()


def test_a_program_with_errors_needs_an_explicit_yes(tmp_path: Path) -> None:
    loaded = program(tmp_path, b"G21 G90\nG1 X500 F300\nG1 X0\n")
    assert loaded.one.run.failed
    with pytest.raises(OptionError, match="spoil the part"):
        loaded.prepared(single=False, first=0, resumes=False, despite_errors=False, speed=1.0)
    one, _ = loaded.prepared(single=False, first=0, resumes=False, despite_errors=True, speed=1.0)
    assert len(one.packets) == 3


def test_an_override_is_what_the_controller_reports(tmp_path: Path) -> None:
    """Each step goes out when grbl has reported the one before: it counts no flags twice."""
    loaded = program(tmp_path, b"G21 G90\nG1 X150 F50\nG1 X0\n")
    with at_panel("grbl") as at:
        at.until_state("ready")
        start(at, loaded)
        at.until_state("sending")
        for percent in (57, 200, 100):
            at.session.override("feed", percent)
            at.until(lambda percent=percent: at.session.state.overrides.get("feed") == percent)  # type: ignore[misc]
            assert at.twin._feed_percent == percent
        at.session.override("rapid", 30)
        at.until(lambda: at.session.state.overrides.get("rapid") == 25)
        at.session.stop()
        at.until(lambda: any("can be resumed" in each for each in at.told))
