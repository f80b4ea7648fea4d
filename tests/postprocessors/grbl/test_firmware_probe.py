"""grbl's own firmware is probed, asked for its settings and given others, in real time on a
pseudo-terminal.

GRBL_SOURCE names a checkout of github.com/gnea/grbl.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from tests.commands import run_camtool
from tests.oracles.grbl_firmware import STEPS_PER_MM, FirmwareTwin, Switch, built, source
from tests.sending.test_ends import hosted

pytestmark = [
    pytest.mark.slow,
    pytest.mark.referee,
    pytest.mark.skipif(source() is None, reason="GRBL_SOURCE names no sources of grbl"),
    pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc"),
]

SPEED = 8.0
NEAR_MM = 1.5 / STEPS_PER_MM


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built(tmp_path_factory.mktemp("grbl"))


def probe_at(axis: int, low_mm: float = -1e5, high_mm: float = 1e5) -> Switch:
    """A probe that is open strictly between two places of an axis."""
    return Switch("P", axis, round(low_mm * STEPS_PER_MM), round(high_mm * STEPS_PER_MM))


@contextmanager
def board(program: Path, folder: Path, *switches: Switch) -> Iterator[tuple[FirmwareTwin, str]]:
    twin = FirmwareTwin(program, folder / "board", switches=switches)
    try:
        with hosted(twin, SPEED) as port:  # type: ignore[arg-type]
            yield twin, port
    finally:
        twin.close()


def camtool(port: str, *words: str) -> tuple[int, dict[str, Any], str]:
    done = run_camtool(*words, "-t", "grbl", "--port", port)
    measured = json.loads(done.stdout) if done.stdout[:1] == "{" else {"shown": done.stdout}
    return done.returncode, measured, done.stderr


ASKED = ("--yes", "--json")


def test_a_plate_twice_the_second_time_in_the_new_frame(program: Path, tmp_path: Path) -> None:
    with board(program, tmp_path, probe_at(2, low_mm=-3.0)) as (twin, port):
        words = ("touch", "plate", "--thickness", "1.5mm", *ASKED)
        code, measured, said = camtool(port, *words)
        assert code == 0, said
        assert measured["top_z_mm"] == pytest.approx(-3.0, abs=NEAR_MM)
        code, measured, said = camtool(port, *words)
        assert code == 0, said
        assert measured["top_z_mm"] == pytest.approx(1.5, abs=2.0 * NEAR_MM)
        assert twin.slides.commanded_mm == pytest.approx([0.0, 0.0, 0.0], abs=NEAR_MM)


def test_a_window_is_measured_from_within(program: Path, tmp_path: Path) -> None:
    window = probe_at(0, -5.0, 6.0), probe_at(1, -4.0, 3.0)
    with board(program, tmp_path, *window) as (twin, port):
        code, measured, said = camtool(port, "touch", "bore", "--tool-diameter", "2mm", *ASKED)
    assert code == 0, said
    assert [measured["x_mm"], measured["y_mm"]] == pytest.approx([0.5, -0.5], abs=NEAR_MM)
    assert measured["width_x_mm"] == pytest.approx(13.0, abs=2.0 * NEAR_MM)
    assert measured["width_y_mm"] == pytest.approx(9.0, abs=2.0 * NEAR_MM)
    assert twin.slides.commanded_mm[:2] == pytest.approx([0.5, -0.5], abs=NEAR_MM)


def test_nothing_touched_and_a_probe_that_touches_lock_nothing(
    program: Path, tmp_path: Path
) -> None:
    with board(program, tmp_path / "far", probe_at(2, low_mm=-30.0)) as (twin, port):
        words = ("touch", "plate", "--thickness", "1mm", "--reach", "3mm", *ASKED)
        code, measured, _ = camtool(port, *words)
        assert code == 1
        assert "did not touch" in measured["why"]
        assert twin.slides.commanded_mm == pytest.approx([0.0, 0.0, 0.0], abs=NEAR_MM)
        # It is not locked: the next order is taken.
        assert camtool(port, "jog", "X1", "F400")[0] == 0
    with board(program, tmp_path / "near", probe_at(2, low_mm=0.0)) as (twin, port):
        code, measured, _ = camtool(port, *words)
        assert code == 1
        assert "touches already" in measured["why"]
        assert b"G38" not in twin.received


def test_settings_are_read_changed_and_read_back(program: Path, tmp_path: Path) -> None:
    file = tmp_path / "mine.txt"
    with board(program, tmp_path) as (twin, port):
        assert camtool(port, "settings", "backup", str(file))[0] == 0
        text = file.read_text()
        changed = text.replace("$110=500.000", "$110=812.5").replace("$20=0", "$20=1")
        file.write_text(changed.replace("$22=0", "$22=1"))
        assert changed != text
        code, _, said = camtool(port, "settings", "restore", str(file), "--yes")
        assert code == 0, said
        assert "3 written and read back" in said
        order = [twin.received.index(each) for each in (b"$22=1", b"$20=1", b"$110=812.5")]
        assert order == sorted(order)
        _, shown, _ = camtool(port, "settings", "read")
        assert "$110=812.500" in shown["shown"]
        # Soft limits without homing: the firmware refuses, and what was taken is said.
        file.write_text("$111=700\n$22=0\n$20=1\n$110=500\n")
        code, _, said = camtool(port, "settings", "restore", str(file), "--yes")
        assert code == 1
        assert "taken:" in said
