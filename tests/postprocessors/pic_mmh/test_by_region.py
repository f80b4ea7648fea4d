"""Compensation by region: what is sent between blocks, and what the slides make of it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from camtool_postprocessors.pic_mmh.wire import PicMmhWire

from camtool.arrays import Floats
from camtool.errors import MachineError
from camtool.records import replace
from camtool.sending.faults import WiredTwin
from camtool.sending.prepare import forecast_of
from camtool.target.registry import load_target
from camtool.target.wire import Manner, WireState
from tests.feeding import logo, made, motion, same_motion
from tests.sending.talking import talked

SETTINGS = ("play_map.use=true", "controller.compensation=by-region")
STEP_MM = 0.00014
ACROSS = (
    b"G54;G90;G01X00500.00Y00500.00F08;G01X09000.00Y00500.00F08;G01X08000.00Y06500.00F08;"
    b"G01X01000.00Y06000.00F08;G01X05000.00Y03000.00F08;G01X04000.00Y02000.00F08;"
    b"G03X05000.00Y02000.00I04500.00J02000.00F08;G02X05000.00Y02000.00I05000.00J03000.00F08;"
    b"G01X00500.00Y00500.00F08;G01X01000.00Y01000.00F08;M30;"
)
"""Lines and arcs over all regions, a full circle over two of Y; back to the beginning."""


def play_um(axis: int, x_mm: float, y_mm: float) -> int:
    """The regions of the machine file, written out (L2353-2373)."""
    if axis == 0:
        return 190 if x_mm < 3.333 else 201 if x_mm < 6.667 else 187
    return 152 if y_mm < 2.333 else 180 if y_mm < 4.667 else 173


def sent(program: bytes, *settings: str) -> list[bytes]:
    _, loaded = made("pic-mmh", settings=settings)
    decoded = loaded.target.read(program, loaded.machine)
    packets = PicMmhWire().packets(program, loaded.machine, forecast_of(decoded, loaded))
    return [packet.data for packet in packets]


def slides_by_hand(program: bytes, strings: list[bytes]) -> list[tuple[float, float]]:
    """Where the slides go when these strings are executed: one step after the other, a nut that
    lags behind its screw by the play of the place where the controller counts."""
    loaded = load_target("pic-mmh")
    trace = motion(program, loaded)
    block_of = loaded.target.read(program, loaded.machine).block.tolist()
    places = [tuple(round(value / STEP_MM) for value in row) for row in trace.commanded.tolist()]
    blocks: list[list[tuple[int, ...]]] = [[] for _ in strings]
    for row, place in zip(trace.block.tolist(), places, strict=True):
        blocks[block_of[row]].append(place)
    added = {"X": 0, "Y": 0}
    counted, motor, sense = [0, 0], [0, 0], [1, 1]
    slide, found, block = [0.0, 0.0], list[tuple[float, float]](), 0
    for text in strings:
        if text[:1] == b"B":
            added[text[1:2].decode()] = round(int(text[2:5]) / 1000.0 / STEP_MM)
            continue
        for place in blocks[block]:
            x, y = place[0] * STEP_MM, place[1] * STEP_MM
            for axis, letter in ((0, "X"), (1, "Y")):
                step = place[axis] - counted[axis]
                if step and (step > 0) != (sense[axis] > 0):
                    sense[axis] = 1 if step > 0 else -1
                    motor[axis] += sense[axis] * added[letter]
                motor[axis] += step
                counted[axis] = place[axis]
                at, play = motor[axis] * STEP_MM, play_um(axis, x, y) / 1000.0
                slide[axis] = min(max(slide[axis], at), at + play)
            found.append((slide[0], slide[1]))
        block += 1
    return found


@pytest.mark.parametrize(
    "program",
    [
        pytest.param(ACROSS, id="across"),
        pytest.param(logo("pic-mmh"), id="logo", marks=pytest.mark.slow),
    ],
)
def test_what_is_predicted_is_what_the_strings_make(program: bytes) -> None:
    strings = sent(program, *SETTINGS)
    predicted = motion(program, load_target("pic-mmh", settings=SETTINGS)).slide[:, :2]
    assert predicted == pytest.approx(np.array(slides_by_hand(program, strings)), abs=1e-9)


def test_the_twin_makes_the_same_of_what_the_sender_sends() -> None:
    twin, loaded = made("pic-mmh", settings=SETTINGS)
    decoded = loaded.target.read(ACROSS, loaded.machine)
    packets = PicMmhWire().packets(ACROSS, loaded.machine, forecast_of(decoded, loaded))
    talk = PicMmhWire().conversation(packets, loaded.machine, Manner())
    talked(talk, WiredTwin(twin), latest_s=100_000.0, coarse=True)
    assert talk.state is WireState.FINISHED, talk.why
    assert [each for each in twin.commands if each[:1] == b"B"] == [
        each for each in sent(ACROSS, *SETTINGS) if each[:1] == b"B"
    ]
    same_motion(twin, ACROSS, loaded)


def test_reports_of_compensation_are_counted_by_region() -> None:
    more = (*SETTINGS, "link.compensation=reported")
    twin, loaded = made("pic-mmh", ["compensation=reported"], more)
    program = ACROSS.split(b"G03")[0] + b"M30;"
    decoded = loaded.target.read(program, loaded.machine)
    packets = PicMmhWire().packets(program, loaded.machine, forecast_of(decoded, loaded))
    talk = PicMmhWire().conversation(packets, loaded.machine, Manner())
    talked(talk, WiredTwin(twin), latest_s=100_000.0, coarse=True)
    assert talk.state is WireState.FINISHED, talk.why


def test_the_play_is_sent_where_an_axis_turns_away() -> None:
    strings = sent(ACROSS.split(b"G03")[0] + b"M30;", *SETTINGS)
    # Before that a program that goes on may have an axis to turn back, by what it was given.
    assert strings[:2] == [b"G54;", b"G90;"]
    turns = [(a, b) for a, b in pairwise(strings) if a[:1] == b"B" and b[:1] == b"G"]
    # X turns back at X9 mm (H3), Y at Y6.5 mm (V3), X away again at X5 mm (H2).
    assert turns[0] == (b"BX187;", b"G01X08000.00Y06500.00F08;")
    assert turns[1] == (b"BY173;", b"G01X01000.00Y06000.00F08;")
    assert turns[2] == (b"BX201;", b"G01X04000.00Y02000.00F08;")
    assert len(turns) == 3


def test_an_axis_without_regions_keeps_its_own() -> None:
    loaded = load_target("pic-mmh", settings=SETTINGS)
    machine = replace(loaded.machine, play_map=replace(loaded.machine.play_map, y=None))
    decoded = loaded.target.read(ACROSS, machine)
    forecast = forecast_of(decoded, replace(loaded, machine=machine))
    strings = [each.data for each in PicMmhWire().packets(ACROSS, machine, forecast)]
    assert strings[0] == b"BY178;"
    assert [each for each in strings if each[:2] == b"BY"] == [b"BY178;"]
    assert {each for each in strings if each[:2] == b"BX"} >= {b"BX187;", b"BX201;"}


def error_um(program: bytes, *settings: str) -> Floats:
    trace = motion(program, load_target("pic-mmh", settings=settings))
    return np.asarray(np.abs(trace.slide - trace.commanded)[:, :2] * 1000.0)


def test_nothing_adds_up() -> None:
    """Twenty rounds through three regions: at the end the slides stand where the controller
    counts, though another value was taken in each round."""
    once = (
        b"G01X09000.00Y06500.00F08;G01X05000.00Y06500.00F08;G01X05500.00Y03000.00F08;"
        b"G01X01000.00Y03500.00F08;G01X00500.00Y00500.00F08;G01X01500.00Y01500.00F08;"
    )
    errors = error_um(b"G54;G90;" + 20 * once + b"M30;", *SETTINGS)
    assert errors[-1].max() < 0.15


def test_turns_within_a_region_are_exact_and_better_than_one_value() -> None:
    lines = b"".join(
        b"G01X%05d.00Y%05d.00F08;G01X%05d.00Y%05d.00F08;G01X%05d.00Y%05d.00F08;"
        % (x + 900, y + 900, x, y, x + 900, y + 900)
        for x, y in ((500, 500), (4000, 3000), (8000, 5500))
    )
    program = b"G54;G90;" + lines + b"M30;"
    by_region = error_um(program, *SETTINGS).max()
    everywhere = error_um(program, "play_map.use=true").max()
    assert by_region < 0.4  # the last steps of the two axes come one after the other
    assert everywhere > 16.0  # 204 against 187 µm


def test_without_regions_it_is_refused() -> None:
    with pytest.raises(MachineError, match=r"play_map\.use = true"):
        motion(ACROSS, load_target("pic-mmh", settings=["controller.compensation=by-region"]))


def test_a_play_that_three_digits_cannot_say_is_refused() -> None:
    wide = "play_map.x.play_mm=[[1.2, 1.2, 1.2]]"
    with pytest.raises(MachineError, match=r"up to 999, not 1200.*|cells of \[play_map\]"):
        sent(ACROSS, *SETTINGS, wide)
