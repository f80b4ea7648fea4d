"""From a program to what goes over the line: checked, simulated, cut into packets; and the rest of
a program from any of its blocks, with a safe way back into the cut.

Nothing here opens a port or reads a file.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from camtool.errors import MachineError, OptionError, PostError, ProgramError
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.pipeline import read_program, verify_program
from camtool.sending.line import Port
from camtool.simulation.motion import Options
from camtool.target.wire import Forecast, NoWire, Packet, Wire
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import COLUMNS, Kind, Toolpath, toolpath_extents
from camtool.verification.report import clock

if TYPE_CHECKING:
    from camtool.progress import Progress
    from camtool.run import Run
    from camtool.target.registry import LoadedTarget

_SETTINGS = re.compile(rb"settings ([0-9a-f]{8})\b")
"""What programs say of the machine file that they were written for, where their dialect has
comments."""

HEAD = 4096
"""It stands within so many bytes of their beginning."""


@dataclass(frozen=True, eq=False)
class Consignment:
    """A program ready to be sent. `run`: the program as verified; `data`: the bytes that are sent,
    which are the program's own, or those of its rest from `first` on, behind an entry of `entry`
    blocks; `forecast` is of `data`."""

    run: Run
    wire: Wire
    data: bytes
    forecast: Forecast
    packets: tuple[Packet, ...]
    first: int = 0
    entry: int = 0

    @property
    def sha256(self) -> str:
        """The digest of the program as a whole, hex."""
        return digest(self.run.program.data if self.run.program else b"")

    @property
    def seconds(self) -> float:
        """How long the machine works on what is sent, s."""
        return float(sum(packet.seconds for packet in self.packets))

    def block_of(self, sent: int) -> int:
        """The block of the program of a block (from 0) of what is sent; −1 within the entry."""
        return sent if not self.first else max(sent - self.entry + self.first, -1)


def digest(data: bytes) -> str:
    """SHA-256, hex."""
    return hashlib.sha256(data).hexdigest()


def wire_of(target: LoadedTarget) -> Wire:
    """The wire of a machine; MachineError, which says why and what instead, where it has none."""
    wire = target.target.wire()
    if isinstance(wire, NoWire):
        name = target.machine.target.name
        raise MachineError(f"camtool does not drive {name}: {wire.why}", mend=wire.mend)
    return wire


def port_of(name: str, baud: int | None, wire: Wire, target: LoadedTarget) -> Port:
    """The port of that name at the rate that is given, or that of the wire, or of the machine
    file; OptionError where none is known and the port has one."""
    link = target.machine.link
    rate = baud or wire.baud or (round(link.baud) if link.baud else None)
    port = Port(name, rate, wire.frame)
    if rate is None and not port.is_virtual:
        raise OptionError("the rate of the port is not known", where="--baud", mend="give it")
    return port


def check_settings(data: bytes, target: LoadedTarget, file: str) -> None:
    """ProgramError for a program that says that it was written for other values of the machine."""
    said = _SETTINGS.search(data[:HEAD])
    if said is None or said[1].decode() == target.machine.short_digest:
        return
    raise ProgramError(
        f"was written for another machine file (settings {said[1].decode()}, the machine has "
        f"{target.machine.short_digest})",
        file=file,
        mend="post it again for this machine, or give the machine file it was made with",
    )


def consignment(
    data: bytes,
    target: LoadedTarget,
    *,
    source: str,
    first: int = 0,
    progress: Progress | None = None,
) -> Consignment:
    """The program, verified and cut into packets; with `first` (a block, from 0) its rest from
    there on. ProgramError for a program with errors, or for another machine's."""
    wire = wire_of(target)
    check_settings(data, target, source)
    run = verify_program(data, target, source=source, progress=progress)
    if run.failed:
        return Consignment(run, wire, b"", _no_forecast(run), (), first)
    decoded = run.decoded
    assert decoded is not None
    rest, entry = data, 0
    if first:
        rest, entry = rest_of(decoded, target, first)
        decoded = read_program(rest, target, source=source).decoded
        assert decoded is not None
    if progress is not None:
        progress.begin(f"simulating {PurePath(source).name}")
    forecast = forecast_of(decoded, target)
    packets = tuple(wire.packets(rest, target.machine, forecast))
    return Consignment(run, wire, rest, forecast, packets, first, entry)


def _no_forecast(run: Run) -> Forecast:
    none, whole = np.zeros(0), np.zeros((0, 3), dtype=np.int64)
    assert run.decoded is not None
    return Forecast(run.decoded, none, none, whole[:, 0], whole, whole, np.zeros((0, 3)))


def forecast_of(decoded: Toolpath, target: LoadedTarget) -> Forecast:
    """What the simulation says of each block; those behind the end of the program take no time."""
    blocks = int(decoded.block.max(initial=-1)) + 1
    seconds, compensation = np.zeros(blocks), np.zeros(blocks)
    outputs = np.zeros(blocks, dtype=np.int64)
    steps = np.zeros((blocks, 3), dtype=np.int64)
    reversals = np.zeros((blocks, 3), dtype=np.int64)
    for chunk in target.simulate(decoded, Options()):
        ledger = chunk.ledger
        of = decoded.block[ledger.row]
        np.add.at(seconds, of, ledger.duration_s)
        np.add.at(compensation, of, ledger.compensation_s)
        outputs += np.bincount(decoded.block[chunk.row], minlength=blocks)
        np.add.at(steps, of, ledger.steps)
        np.add.at(reversals, of, ledger.reversals)
    ends = np.full((blocks, 3), np.nan)
    ends[decoded.block] = decoded.end  # the last row of a block wins
    return Forecast(decoded, seconds, compensation, outputs, steps, reversals, ends)


# The rest of a program.


def rest_of(decoded: Toolpath, target: LoadedTarget, first: int) -> tuple[bytes, int]:
    """The program from a block on, and how many of its blocks are the entry.

    It begins as the program does, at part zero: up, tool, spindle and coolant on as they are
    there, across above the place, down to it at the feed of plunges. Behind that come the same
    moves, which are read back and compared. OptionError for a block that is none, and for one in
    which nothing moves any more.
    """
    rows = np.flatnonzero(decoded.block >= first)
    blocks = int(decoded.block.max(initial=-1)) + 1
    if not 0 <= first < blocks or not len(rows):
        raise OptionError(f"there is no block {first + 1}", mend=f"blocks are 1 to {blocks}")
    low, high = int(rows[0]), decoded.running
    if low >= high or not decoded.is_motion[low:high].any():
        raise OptionError(f"nothing moves from block {first + 1} on", mend="it is finished")
    machine = target.machine
    entry = _entry(decoded, low, target)
    count = len(entry)
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(entry, name), getattr(decoded, name)[low:high]])
        for name in COLUMNS
        if name not in ("source", "mode")
    }
    columns["source"] = np.concatenate([np.full(count, -1), decoded.source[low:high]])
    columns["mode"] = np.concatenate([np.full(count, -1), decoded.mode[low:high]])
    whole = replace(decoded, **columns, findings=(), drawn=None, operations=None)
    program = target.target.write(whole, machine)
    again = target.target.read(program.data, machine)
    at = _same_end(decoded.part(low, high), again, target, first)
    return program.data, int(again.block[at])


def _entry(decoded: Toolpath, low: int, target: LoadedTarget) -> Toolpath:
    """The moves and events that bring the machine from the beginning of the program to the begin
    of a row."""
    machine = target.machine
    x, y, z = decoded.starts_of(np.array([low]))[0].tolist()
    before = decoded.part(0, low)
    top = float(toolpath_extents(decoded.first(decoded.running))[2, 1])
    safe = max(top, z, float(decoded.start[2]))
    path = ToolpathBuilder(start=(decoded.start[0], decoded.start[1], decoded.start[2]))
    kinds = before.kind
    zeros = np.flatnonzero(kinds == Kind.SET_ZERO)
    if len(zeros):
        path.event(Kind.SET_ZERO)
    tools = np.flatnonzero(kinds == Kind.TOOL_CHANGE)
    path.rapid(z=safe)
    if len(tools):
        path.event(Kind.TOOL_CHANGE, float(before.value[tools[-1]]))
    spindle = np.flatnonzero(np.isin(kinds, (Kind.SPINDLE_CW, Kind.SPINDLE_CCW, Kind.SPINDLE_OFF)))
    turns = len(spindle) and kinds[spindle[-1]] != Kind.SPINDLE_OFF
    if turns:
        value = float(before.value[spindle[-1]])
        path.event(Kind(int(kinds[spindle[-1]])), None if math.isnan(value) else value)
        waits = np.flatnonzero(kinds[spindle[-1] :] == Kind.DWELL)
        if len(waits) and machine.spindle.spin_up_s:
            path.event(Kind.DWELL, machine.spindle.spin_up_s)
    coolants = (Kind.COOLANT_MIST, Kind.COOLANT_FLOOD, Kind.COOLANT_OFF)
    cooled = np.flatnonzero(np.isin(kinds, coolants))
    off = cooled[kinds[cooled] == Kind.COOLANT_OFF]
    for row in cooled[cooled > (off[-1] if len(off) else -1)].tolist():
        path.event(Kind(int(kinds[row])))
    path.rapid(x, y)
    if z < safe:
        path.line(z=z, feed=_plunge_feed(decoded, low, target))
    return path.finish()


def _plunge_feed(decoded: Toolpath, low: int, target: LoadedTarget) -> float:
    """mm/min: the feed of the last plunge before the row, else the first, else the machine's."""
    machine = target.machine
    drops = (decoded.kind == Kind.LINE) & (decoded.end[:, 2] < decoded.starts[:, 2])
    plunges = np.flatnonzero(drops)
    if len(plunges):
        earlier = plunges[plunges < low]
        return float(decoded.feed[earlier[-1] if len(earlier) else plunges[0]])
    feed = machine.feed.default_mm_min * (machine.defaults.plunge_share or 1.0)
    return min(feed, machine.max_plunge_mm_min)


def _same_end(wanted: Toolpath, again: Toolpath, target: LoadedTarget, first: int) -> int:
    """The row of `again` from which on it makes the wanted moves; PostError where it does not."""
    moves, others = np.flatnonzero(wanted.is_motion), np.flatnonzero(again.is_motion)
    if len(others) >= len(moves):
        tail = others[len(others) - len(moves) :]
        one, other = wanted.end[moves], again.end[tail]
        slack = np.array([target.target.unit_mm(target.machine, a) for a in target.machine.axes])
        arcs = wanted.is_arc[moves]
        centres = np.nan_to_num(np.abs(wanted.centre[moves] - again.centre[tail])).max(initial=0.0)
        same = (
            (np.abs(one - other) <= slack + POSITION_EPS_MM).all()
            and (wanted.kind[moves] == again.kind[tail]).all()
            and (not arcs.any() or centres <= float(slack.max()) + POSITION_EPS_MM)
        )
        if same:
            return int(tail[0])
    raise PostError(
        f"the rest of the program cannot be written again as it is from block {first + 1} on",
        mend="choose the block at the beginning of a contour",
    )


def lines_of(one: Consignment, target: LoadedTarget) -> Sequence[tuple[str, str]]:
    """What a dry run says: (name, words)."""
    machine, run = target.machine, one.run
    decoded = one.forecast.decoded
    low_high = toolpath_extents(decoded.first(decoded.running))
    size = ", ".join(
        f"{axis} {low:.3f} to {high:.3f}"
        for axis, (low, high) in zip("XYZ", low_high, strict=True)
    )
    size_bytes = sum(len(packet.data) for packet in one.packets)
    lines = [
        ("machine", f"{machine.target.name}: {machine.target.title}"),
        ("program", f"{PurePath(run.source).name}: {len(one.forecast)} blocks"),
        ("sent", f"{size_bytes} bytes in {len(one.packets)} packets"),
        ("time", f"{clock(one.seconds)} by the simulation"),
        ("travel", f"{size} mm"),
        ("begin", _stand(decoded, target)),
    ]
    if one.first:
        x, y, z = decoded.starts_of(
            np.array([int(np.flatnonzero(decoded.block >= one.entry)[0])])
        )[0]
        lines.append(
            (
                "entry",
                f"from block {one.first + 1}: up, across, spindle as it is there, then down to "
                f"X{x:.3f} Y{y:.3f} Z{z:.3f}",
            )
        )
    lines += [("spindle", words) for words in _spindle(decoded, target)]
    lines += [("ask", f"{packet.ask}") for packet in one.packets[:1] if packet.ask]
    lines += [("note", words) for words in one.wire.ready]
    if one.wire.stopping:
        lines.append(("stop", one.wire.stopping))
    return lines


def _stand(decoded: Toolpath, target: LoadedTarget) -> str:
    x, y, z = decoded.start.tolist()
    return f"the tool stands at part zero: X{x:.3f} Y{y:.3f} Z{z:.3f}"


def _spindle(decoded: Toolpath, target: LoadedTarget) -> list[str]:
    spindle = target.machine.spindle
    if spindle.switched == "hand":
        return ["switch it on by hand before"]
    starts = np.isin(decoded.kind, (Kind.SPINDLE_CW, Kind.SPINDLE_CCW))
    speeds = decoded.value[starts & ~np.isnan(decoded.value)]
    if len(speeds) and speeds.max() > 0.0:
        return [f"the program starts it, at {speeds.max():g} rev/min at most"]
    if target.target.starts_spindle and spindle.switched == "program":
        return ["the program does not start it"]
    return []
