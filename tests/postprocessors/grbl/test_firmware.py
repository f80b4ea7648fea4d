"""grbl's own firmware, compiled for this computer, as referee of its reader and its model:

    GRBL_SOURCE=…/grbl pytest -m slow tests/postprocessors/grbl/test_firmware.py

GRBL_SOURCE names a checkout of github.com/gnea/grbl. Thousands of generated programs are run by
both. What is left out: lengths of tools (the model follows the tip, grbl the holder), and moves
before the first one of a program (its start is where its first frame says).
"""

from __future__ import annotations

import math
import random
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from camtool_postprocessors.gcode.faults import LineFault
from camtool_postprocessors.grbl.parser import GrblParser, ParserNotes
from camtool_postprocessors.grbl.twin import _strip

from camtool.errors import ProgramError
from camtool.simulation.motion import IDEAL, Options
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from tests.operations import adaptive_programs
from tests.oracles.grbl_firmware import Ran, Sent, built, factory, played, run, source
from tests.oracles.motion_rows import rows_of
from tests.targets import simulate
from tests.waveforms.programs import of_text

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(source() is None, reason="GRBL_SOURCE names no sources of grbl"),
    pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc"),
]

MOVING, WORDS = 400, 6000
"""So many programs of each kind."""

PLACE_MM = 0.006
"""A jog leaves grbl's parser at a whole step, and its numbers have 24 bits."""

TIME_PART, TIME_S = 0.003, 0.012

Draw = random.Random


def number(draw: Draw, low: float, high: float, decimals: int = 3) -> str:
    return f"{draw.uniform(low, high):.{decimals}f}"


def axes(draw: Draw, most: float = 3.0) -> str:
    return " ".join(f"{axis}{number(draw, -most, most)}" for axis in "XYZ" if draw.random() < 0.6)


def moving(draw: Draw, *, laser: bool) -> str:
    """A block of a program whose steps and times are compared."""
    power = f" S{draw.choice((0, 100, 200, 300))}" if draw.random() < 0.1 + 0.3 * laser else ""
    which = draw.random()
    if which < 0.55:
        return f"{draw.choice(('G0', 'G1', 'G1', 'G1', ''))} {axes(draw)}{power}"
    if which < 0.62:
        radius = draw.uniform(0.05, 2.0)
        arc = f"{draw.choice(('G2', 'G3'))} X{1.0 + 2.0 * radius:.3f} Y1 I{radius:.3f}{power}"
        return f"G1 X1 Y1\n{arc}"
    if which < 0.8:
        return draw.choice(("M3", "M4", "M5")) + power
    others = "S0|S100|G4 P0.02|M8|M9|G1|G0|G54|G10 L2 P3 X1|G28.1|M1|M0|F300|G1 X0.001|X0.002 Y0"
    others += "|G91 G1 X0\nG90|N5|(c)|G53 G0 Z0|G0 X1.0|G80|G28 Z1|G49|T2 M0|G92.1"
    return draw.choice(others.split("|"))


def worded(draw: Draw) -> str:
    """A line of which grbl's parser may think anything."""
    which = draw.random()
    if which < 0.35:
        return f"{draw.choice(('G0', 'G1', 'g1', '', 'G01', 'G53 G0', 'G53'))} {axes(draw, 20.0)}"
    if which < 0.45:
        plane, turn = draw.choice(("", "G17", "G18", "G19")), draw.choice(("G2", "G3"))
        return f"{plane} {turn} {axes(draw, 20.0)} R{draw.choice((80, -80, 100.5, 3))}"
    if which < 0.55:
        offsets = " ".join(f"{a}{number(draw, -5, 5, 2)}" for a in "IJK" if draw.random() < 0.5)
        return f"{draw.choice(('G2', 'G3', 'G17 G2', 'G18 G3', 'G19 G2'))} {axes(draw)} {offsets}"
    if which < 0.6:
        radius = draw.randint(1, 8)
        height = draw.choice(("", " Z3", " J0", " K1"))
        return (
            f"G90 G17 G1 X1 Y2\n{draw.choice(('G2', 'G3'))} X{1 + 2 * radius} Y2 I{radius}{height}"
        )
    if which < 0.78:
        modes = (
            "G90|G91|G20|G21|G17|F100|F250.5|G94|G93|G94 F100|G54|G55|G59|G40|G49|M3 S100|M5|M4"
        )
        modes += (
            "|S300|M0|M1|M8|M9|G4 P.05|T3|N5|G91.1|G61|G80|G94 F200|/G0 X1|(a) G0 (b Y1) Z1 ; c"
        )
        return draw.choice((modes + "|G21 G90 G94 F300|G1|G93 G1 X1 F2|(open G1 X").split("|"))
    if which < 0.93:
        return draw.choice(
            (
                *(f"G92 {axes(draw)}", "G92.1", f"G10 L2 P{draw.randint(0, 7)} {axes(draw)}"),
                *(
                    f"G10 L20 P{draw.randint(0, 3)} {axes(draw)}",
                    "G28",
                    "G28.1",
                    "G30 Z1",
                    "G30.1",
                ),
                *(f"G43.1 Z{number(draw, -9, 9)}", f"G30 {axes(draw)}", "G90 G0 X1 Y1 Z1"),
                *(
                    f"$J=G91 X{number(draw, -3, 3)} F{draw.randint(50, 99)}",
                    "$J=X1",
                    "$J=G1 X1 F9",
                ),
                *("$J=G53 Z1 F60 S3", "$J=G20 Y0.1 F50", "M2", "M30"),
            )
        )
    wrong = (
        "G77|M77|G1 X|G0 X1 X2|G0 G1 X1|G2 X1 Y1|P5|G28 G0 X1|G43 Z1|G92.2|G10 L3 P1 X1|G10 P1 X1"
    )
    wrong += "|X1 F-1|T300|G90.1|G38.9 X1|M3 M4|G4|G1.5|%|#1=2|G0 X1.2.3|N99999999|N1 N2|G61.1"
    wrong += "|G49 X1|G43.1 X1|X" + "1" * 90 + "|G1 X1 A5|G53 G2 X1 R5|H1|G10 L2 P1 X1 R5|G54 G55"
    wrong += (
        "|G0 X1 I5|G80 X1|G0 X--1|G17.1|M7|M3.5|S-1|P-1|G10 X1|G4 P1 X1|G64|G59.1|G95|D1|Q1|E1"
    )
    wrong += "|G0X1Y|G43.1 Z1 X1|G92|G28.2|G|M|G-1|M256|G256|G10 L20 P7 X1|M6|G41|G1 X1 G4 P.1|,X1"
    return draw.choice(wrong.split("|"))


def program(draw: Draw, block: Callable[[Draw], str], least: int, most: int) -> str:
    return "".join(f"{block(draw)}\n" for _ in range(draw.randint(least, most)))


@pytest.fixture(scope="module")
def firmware(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Ran]:
    folder = tmp_path_factory.mktemp("grbl")
    programs = {smooth: built(folder, smoothing=smooth) for smooth in (False, True)}

    def ran(text: str, settings: dict[str, float], *, smoothing: bool = False) -> Ran:
        return run(programs[smoothing], text.encode(), settings, folder)

    return ran


def model(text: str, *settings: str) -> tuple[np.ndarray, float]:
    """Positions after each event, mm, and the time."""
    target = load_target("grbl", settings=settings)
    path = target.target.read(text.encode(), target.machine)
    rows = rows_of(simulate(path, target.machine, Options(effects=IDEAL)))
    places = [row.commanded for row in rows]
    return np.concatenate([np.zeros((0, 3)), *places]), sum(row.duration_s for row in rows)


@pytest.fixture(scope="module")
def signal_board(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built(tmp_path_factory.mktemp("board"))


@pytest.mark.parametrize("seed", range(MOVING))
def test_steps_and_times(firmware: Callable[..., Ran], seed: int) -> None:
    """Positions of both step for step, and how long they take, with and without laser mode."""
    draw = random.Random(seed)
    laser = draw.random() < 0.6
    text = "G21 G90 F400\n" + program(draw, lambda each: moving(each, laser=laser), 5, 30)
    text += "G0 X0\n"
    idle, (steps, ramp) = draw.choice((255, 25)), draw.choice(((250, 50), (80, 200), (400, 200)))
    given = {"$1": idle, "$32": float(laser), "$100": steps}
    given |= {"$120": ramp, "$121": ramp, "$122": ramp}
    settings = (
        f"controller.idle_delay_ms={idle}",
        f"controller.laser_mode={str(laser).lower()}",
        f"axes.x.coded_step_mm={1 / steps}",
        *(f"axes.{axis}.acceleration_mm_s2={ramp}" for axis in "xyz"),
        "dialect.homes_mm={G28=[0,0,0]}",
    )
    plain, smooth = firmware(text, given), firmware(text, given, smoothing=True)
    if any(plain.errors):
        line = next(k for k, number in enumerate(plain.errors) if number)
        with pytest.raises(ProgramError, match=rf"line {line + 1},.*error:{plain.errors[line]}\)"):
            model(text, *settings)
        return
    places, seconds = model(text, *settings)
    found = np.rint(places / [1 / steps, 0.004, 0.004]).astype(np.int64)
    np.testing.assert_array_equal(found, plain.steps)
    assert abs(seconds - smooth.seconds) <= max(TIME_S, TIME_PART * smooth.seconds), text


@pytest.mark.parametrize("shape", adaptive_programs.SHAPES)
def test_adaptive_pockets(firmware: Callable[..., Ran], shape: str, tmp_path: Path) -> None:
    """Every block is taken, and all steps are those of the model."""
    paths, lift_mm = adaptive_programs.SHAPES[shape], adaptive_programs.LIFT_MM[shape]
    data = adaptive_programs.posted(paths, 1.7, math.radians(65.0), "grbl", tmp_path, lift_mm).data
    ran = firmware(data.decode(), {"$1": 25.0})
    assert not any(ran.errors)
    places, _ = model(data.decode())
    np.testing.assert_array_equal(np.rint(places / 0.004).astype(np.int64), ran.steps)


PIECE_BYTES, PIECE_S = 60, 0.02
"""Programs go to grbl in pieces that its buffer holds; its planner takes 15 blocks."""

TICK_PART, TICK_S = 1e-4, 60e-6
"""Times of steps differ by so much: planned speeds are 64-bit floats here, and 32-bit there."""


@pytest.mark.parametrize("seed", range(100))
def test_ticks_of_signals(tmp_path: Path, signal_board: Path, seed: int) -> None:
    """Each pulse of the step pins, with the direction pins as they then are, and its time."""
    draw = random.Random(seed)
    text = "G21 G90 F100\nG1 X-1.5 Y0.3\n"
    for _ in range(draw.randint(2, 10)):
        where = f"X{number(draw, -2, 2)} Y{number(draw, -2, 2)}"
        which = draw.random()
        if which < 0.2:
            text += f"G0 {where} Z{number(draw, -1, 1)}\n"
        else:
            text += f"G1 {where} F{draw.randint(20, 500)}\n"
    data = f"{text}G4 P0.05\nG0 X1\n".encode()
    pieces = [data[k : k + PIECE_BYTES] for k in range(0, len(data), PIECE_BYTES)]
    sent = [Sent(pieces[0]), *(Sent(piece, PIECE_S) for piece in pieces[1:])]
    session = played(signal_board, factory(signal_board, tmp_path), sent, tmp_path)
    ways = np.diff(session.slides, axis=0, prepend=np.zeros((1, 3), np.int64))
    pulsing = ways.any(axis=1)
    at_s, ways = session.at_s[pulsing], ways[pulsing]

    parts = list(of_text("grbl", data.decode()).pulses())
    ticks = np.rint(np.concatenate([part.at_s for part in parts]) * 16e6).astype(np.int64)
    moments, index = np.unique(ticks, return_inverse=True)
    found = np.zeros((len(moments), 3), dtype=np.int64)
    np.add.at(found, index, np.concatenate([part.moves for part in parts]))
    np.testing.assert_array_equal(found, ways)
    times = (moments - moments[0]) / 16e6
    np.testing.assert_allclose(times, at_s - at_s[0], rtol=TICK_PART, atol=TICK_S)


def test_words(firmware: Callable[..., Ran]) -> None:
    """Each line is taken, or refused by the same number, and leaves the parser at the same place;
    and a program is refused where it first goes wrong."""
    target = load_target("grbl", settings=("dialect.homes_mm={G28=[0,0,0], G30=[0,0,0]}",))
    seen = set[int]()
    for seed in range(WORDS):
        draw = random.Random(seed)
        text = program(draw, worded, 3, 25)
        ran = firmware(text, {"$110": 9000, "$111": 9000, "$112": 9000, "$120": 900, "$121": 900})
        parser = GrblParser(target.machine, ToolpathBuilder(), ParserNotes())
        for k, line in enumerate(text.splitlines()):
            stripped, wrong = _strip(line.encode()), 0
            try:
                if len(stripped) > target.machine.dialect.line_chars:
                    wrong = 11
                elif stripped:
                    parser.line(stripped)
            except LineFault as fault:
                found = re.search(r"\(error:(\d+)\)", fault.message)
                if found is None:  # what grbl takes and nobody can simulate
                    break
                wrong = int(found[1])
            if parser.ended:
                parser.rewind()
            assert wrong == ran.errors[k], (seed, k, line, text)
            seen.add(wrong)
            np.testing.assert_allclose(
                parser.position, ran.places[k], atol=PLACE_MM, rtol=1e-5, err_msg=f"{seed} {text}"
            )
    assert len(seen) > 20, seen
