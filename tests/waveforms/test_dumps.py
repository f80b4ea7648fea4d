"""Dumps and tables, read back by others' readers, against pulses counted one by one."""

from __future__ import annotations

import csv
import io
import itertools
from collections import defaultdict
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from vcd.reader import TokenKind, tokenize

import camtool
from camtool.errors import OptionError
from camtool.target.signals import Coils, StepDirection
from camtool.waveforms.levels import lines_of, port_names
from camtool.waveforms.signals import Signals
from camtool.waveforms.table import table
from tests.strategies import examples
from tests.waveforms.programs import BENCHES, of_text, paths, signals

ROOT = Path(__file__).parents[2]

Changes = dict[str, list[tuple[int, int]]]


def dump_of(
    found: Signals, from_s: float = 0.0, span_s: float | None = None
) -> tuple[str, Changes]:
    """Timescale of the dump, and of each variable (tick, value) of its changes, by pyvcd."""
    data = b"".join(found.content("a.vcd", from_s, span_s))
    names: dict[str, str] = {}
    changes: Changes = defaultdict(list)
    scale, tick, scope = "", 0, ""
    for token in tokenize(io.BytesIO(data)):
        value: Any = token.data
        if token.kind is TokenKind.TIMESCALE:
            scale = f"{int(value.magnitude)} {value.unit.value}"
        elif token.kind is TokenKind.SCOPE:
            scope = value.ident
        elif token.kind is TokenKind.VAR:
            names[value.id_code] = f"{scope}.{value.reference}"
        elif token.kind is TokenKind.CHANGE_TIME:
            assert value >= tick
            tick = value
        elif token.kind is TokenKind.CHANGE_SCALAR or token.kind is TokenKind.CHANGE_VECTOR:
            changes[names[value.id_code]].append((tick, int(value.value)))
    return scale, changes


def module(port: str) -> str:
    return f"port_{port}" if port.startswith("0x") else port


def rows_of(found: Signals) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(b"".join(found.content("a.csv")).decode())))


def literally(found: Signals) -> dict[int, dict[str, int]]:
    """Bytes of the ports after each tick with a pulse of coils, pulse by pulse."""
    board = found.board
    phases: dict[str, int | None] = {
        motor.name: 0 if motor.at_start == "first" else None
        for motor in board.motors
        if isinstance(motor, Coils)
    }
    ports = dict.fromkeys(port_names(board), 0)
    for motor in board.motors:
        if isinstance(motor, Coils) and motor.at_start == "first":
            ports[motor.port] |= motor.states[0] << motor.shift
    after: dict[int, dict[str, int]] = {}
    for part in found.pulses():
        for at_s, moves in zip(part.at_s.tolist(), part.moves.tolist(), strict=True):
            for motor, way in zip(board.motors, moves, strict=True):
                if not way:
                    continue
                assert isinstance(motor, Coils)
                phase = phases[motor.name]
                count = len(motor.states)
                phase = (0 if way > 0 else count - 1) if phase is None else (phase + way) % count
                phases[motor.name] = phase
                mask = (1 << len(motor.lines)) - 1
                kept = ports[motor.port] & ~(mask << motor.shift)
                ports[motor.port] = kept | motor.states[phase] << motor.shift
            after[round(at_s / board.tick_s)] = dict(ports)
    return after


@pytest.mark.parametrize("name", ["pic-mmh", "i8751", "flashcut"])
@examples(25, 1000)
@given(data=st.data())
def test_bytes_are_those_of_the_pulses(name: str, data: st.DataObject) -> None:
    bench = BENCHES[name]
    found = signals(data.draw(paths(bench, reach=60)), bench.target())
    after, board = literally(found), found.board
    per_unit = round({"ms": 1e-3, "us": 1e-6}[board.unit] / board.tick_s)
    rows = rows_of(found)
    for row in rows[1:]:
        tick = round(float(row[f"time_{board.unit}"]) * per_unit)
        assert {port: int(row[port]) for port in port_names(board)} == after.pop(tick)
    assert not after
    assert {*rows[0]} >= {"block", "x", "y", "z"}


@pytest.mark.parametrize("name", BENCHES)
@examples(15, 500)
@given(data=st.data())
def test_a_dump_says_the_same_as_the_table(name: str, data: st.DataObject) -> None:
    bench = BENCHES[name]
    found = signals(data.draw(paths(bench, reach=60)), bench.target())
    scale, changes = dump_of(found)
    board = found.board
    assert scale == {1e-3: "1 ms", 1e-6: "1 us", 1e-7: "100 ns"}[board.tick_s]
    per_unit = round({"ms": 1e-3, "us": 1e-6}[board.unit] / board.tick_s)
    last: dict[str, int] = {}
    wanted: Changes = defaultdict(list)
    ports = port_names(board)
    for row in rows_of(found):
        tick = round(float(row[f"time_{board.unit}"]) * per_unit)
        values = {
            f"{module(ports[line.column])}.{line.name}": int(row[ports[line.column]]) >> line.bit
            & 1
            for line in lines_of(board)
        }
        values |= {f"motors.{m.name}": int(row[m.name.lower()]) % 2**32 for m in board.motors}
        values["motors.block"] = int(row["block"])
        for key, value in values.items():
            if last.get(key) != value:
                wanted[key].append((tick, value))
                last[key] = value
    assert changes == wanted


@pytest.mark.parametrize("name", ["valcnc", "grbl"])
@examples(25, 1000)
@given(data=st.data())
def test_step_lines_rise_once_a_step_with_the_direction_set(
    name: str, data: st.DataObject
) -> None:
    bench = BENCHES[name]
    found = signals(data.draw(paths(bench, reach=60)), bench.target())
    _, changes = dump_of(found)
    counts = found.count()
    for k, motor in enumerate(found.board.motors):
        assert isinstance(motor, StepDirection)
        port = motor.step[0]
        steps = changes[f"{port}.{motor.name}_step"]
        rises = [tick for tick, level in steps[1:] if level]
        assert len(rises) == counts.steps[k] + counts.added[k]
        falls = [tick for tick, level in steps[1:] if not level]
        assert len(falls) == len(rises)
        directions = changes[f"{port}.{motor.name}_dir"]
        places = changes[f"motors.{motor.name}"]
        for (_, before), (tick, place) in itertools.pairwise(places):
            level = [level for at, level in directions if at <= tick][-1]
            forward = (place - before) % 2**32 == 1
            assert level == (motor.positive if forward else 1 - motor.positive)


LINE = "M03\nG01 X0.2 Y0.1 F14.1\nM30\n"


def test_a_stretch_is_the_part_of_the_whole() -> None:
    found = of_text("flashcut", LINE)
    rows = rows_of(found)
    part = b"".join(found.content("a.csv", 0.1, 0.1)).decode().splitlines()[1:]
    whole = [",".join(row.values()) for row in rows]
    inner = [
        line for line, row in zip(whole, rows, strict=True) if 100 < int(row["time_ms"]) <= 200
    ]
    before = [line for line, row in zip(whole, rows, strict=True) if int(row["time_ms"]) <= 100]
    assert part[0] == "100," + before[-1].partition(",")[2]
    assert part[1:] == inner
    assert len(inner) > 4


def test_a_table_of_too_many_rows_is_refused() -> None:
    found = of_text("flashcut", LINE)
    with pytest.raises(OptionError, match=r"more than 20 rows; give --from and --span"):
        list(table(found.board, found.levels(), found.blocks, max_rows=20))


def test_the_page_shows_the_bytes_of_the_thesis_line(tmp_path: Path) -> None:
    """The rows of docs/signals.md are the first ones of its line at 3 ms; and `save` writes what
    `content` gives, whole or not at all."""
    program = (ROOT / "samples" / "oscilloscope" / "flashcut-10x5.nc").read_text()
    found = of_text("flashcut", program, ("controller.half_period_ms=3",))
    file = tmp_path / "a.csv"
    found.save(file)
    lines = file.read_text().splitlines()
    page = (ROOT / "docs" / "signals.md").read_text(encoding="utf-8")
    assert "```\n" + "\n".join(lines[:5]) + "\n```" in page
    with pytest.raises(OptionError, match=r"the program ends after 42\.104 s"):
        found.save(file, from_s=50.0)
    assert file.read_text().splitlines() == lines
    assert [each.name for each in tmp_path.iterdir()] == ["a.csv"]


def test_signals_in_python() -> None:
    found = camtool.signals(LINE.encode(), "flashcut")
    assert isinstance(found, camtool.Signals)
    assert found.count().steps.tolist() == [105, 55, 0, 105]
    assert sum(len(part.tick) for part in found.levels()) > 400
