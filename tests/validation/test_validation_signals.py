"""What the oscilloscopes of the theses showed, and the bytes that they print, from dumps."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from camtool.arrays import Ints
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.waveforms.signals import Signals
from tests.validation.page import check
from tests.validation.pieces import ROOT
from tests.waveforms.programs import STEP_I8751, signals
from tests.waveforms.test_dumps import Changes, dump_of

PROGRAMS = ROOT / "samples" / "oscilloscope"
AT_3_MS = ("controller.half_period_ms=3",)
WITHOUT = ("axes.x.compensation_mm=0", "axes.y.compensation_mm=0")


def of_file(file: Path, target: str, settings: Sequence[str] = ()) -> Signals:
    return Signals.of(file.read_bytes(), load_target(target, settings=settings), file.name)


def widths(changes: Changes, name: str) -> set[int]:
    """Ticks for which a line is high or low, from its second change on: the first state may be the
    last one of its pulse."""
    ticks = [tick for tick, _ in changes[name]]
    return set(np.diff(ticks[2:]).tolist())


def bytes_of(found: Signals, column: int, count: int) -> list[int]:
    """The first bytes of a port that are not 0."""
    ports: Ints = np.concatenate([part.ports[:, column] for part in found.levels()])
    turns = np.flatnonzero(np.diff(ports)) + 1
    return [int(value) for value in ports[turns][:count]]


def hertz(name: str, rate_hz: int) -> str:
    """The frequency of a phase line of the PIC at so many steps a second."""
    settings = (f"limits.rapid_step_rate_hz={rate_hz}", f"limits.max_step_rate_hz={rate_hz}")
    found = of_file(PROGRAMS / "pic-mmh-three-axes.pic", "pic-mmh", settings)
    _, changes = dump_of(found)
    port = "PORTE" if name == "Z" else "PORTD"
    lengths = widths(changes, f"{port}.{name}_phase2")
    assert max(lengths) - min(lengths) <= 1  # whole microseconds
    return f"{1e6 / (2.0 * min(lengths)):.1f}"


def test_signals_of_the_theses(bless: bool) -> None:
    found = of_file(PROGRAMS / "flashcut-10x5.nc", "flashcut", AT_3_MS)
    _, changes = dump_of(found)
    shown = {
        axis: [widths(changes, f"port_0x378.{axis}_{terminal}") for terminal in "ADBC"]
        for axis in "XY"
    }
    assert shown == {"X": [{4}] * 4, "Y": [{6}] * 4}
    along_x = Signals.of(b"G01 X0.1 Y0.0 F3.0\nM30\n", load_target("flashcut"))
    nibbles = [f"{value & 15:04b}" for value in bytes_of(along_x, 0, 4)]
    i8751 = load_target("i8751", settings=(*STEP_I8751, "feed.default_mm_min=20"))
    forward = signals(ToolpathBuilder().rapid(0.1).finish(), i8751)
    backward = signals(ToolpathBuilder().rapid(-0.1).finish(), i8751)
    hexes = [
        " ".join(f"{value:02X}H" for value in bytes_of(each, 0, 4)) for each in (forward, backward)
    ]
    rows = [
        [
            "flashcut",
            "terminals of X and Y, 10 × 5 mm at 3 ms: high, low",
            "L1188",
            "4 and 6 ms",
            "4 and 6 ms",
        ],
        ["flashcut", "states A D B C", "L1117-1122", "1001 1100 0110 0011", " ".join(nibbles)],
        [
            "pic-mmh",
            "a phase line of X, Y, Z at the limit of the link, 166 steps/s, Hz",
            "L2259-2261",
            "42",
            ", ".join(hertz(axis, 166) for axis in "XYZ"),
        ],
        [
            "pic-mmh",
            "… by joystick, 170 steps/s (L1789), Hz",
            "L2259-2261",
            "42",
            ", ".join(hertz(axis, 170) for axis in "XYZ"),
        ],
        ["i8751", "pulses forward", "L1888-1898", "03H 06H 0CH 09H", hexes[0]],
        ["i8751", "pulses backward", "L1888-1898", "09H 0CH 06H 03H", hexes[1]],
        ["valcnc", "a pass at 1800 rpm, µs", "L1336", "166.667", passes_us()],
    ]
    check("signals", ["machine", "signal", "lines", "thesis", "camtool"], rows, bless)


def passes_us() -> str:
    found = Signals.of(b"G00 X1.0 Y0.0 Z0.0\n", load_target("valcnc"))
    _, changes = dump_of(found)
    rises = [tick for tick, level in changes["PORTD.X_step"] if level]
    return f"{(rises[-1] - rises[0]) / (len(rises) - 1) / 10.0:.3f}"


def test_an_arc_goes_from_a_quadrant_to_the_next() -> None:
    """Figure 51: below its centre a clockwise arc of 100 µm goes on along X, and Y turns round:
    its phases come back in the opposite order, in times that mirror each other."""
    found = of_file(PROGRAMS / "pic-mmh-quadrant.pic", "pic-mmh", WITHOUT)
    parts = list(found.levels())
    tick, x, y = (
        np.concatenate([part.tick for part in parts]),
        *np.concatenate([part.places for part in parts]).T[:2],
    )
    ports = np.concatenate([part.ports for part in parts])[:, 0]
    lowest = np.flatnonzero(y == y.min())
    assert (x[lowest[0]], y.min()) == (26, -714)
    near = slice(lowest[0] - 300, lowest[-1] + 300)
    assert (np.diff(x[near]) == -1).all()
    turns = np.flatnonzero(np.diff(y[near]))
    assert len(turns) > 10
    before, after = turns[turns < lowest[0] - near.start], turns[turns >= lowest[0] - near.start]
    count = min(len(before), len(after))
    before, after = before[-count:], after[:count]
    states = ports[near] >> 2 & 3
    assert states[before].tolist() == states[after + 1][::-1].tolist()
    middle = (tick[lowest[0]] + tick[lowest[-1] + 1]) / 2.0
    mirrored = 2.0 * middle - tick[near][after + 1]
    np.testing.assert_allclose(mirrored[::-1], tick[near][before + 1], atol=2.0)
