"""Preparation of a program for its machine: it is verified, simulated and cut into packets; and
the rest of a program from any of its blocks, with a safe way back into the cut.

This module opens no port and reads no file."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from itertools import accumulate
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.errors import MachineError, OptionError, PostError, ProgramError
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.pipeline import Judging, read_program, verify_program
from camtool.records import replace
from camtool.sending.journal import JournalState, digest
from camtool.sending.line import wire_of
from camtool.simulation.motion import Ledger, Options, still_ledger
from camtool.target.wire import (
    Conversation,
    Forecast,
    Packet,
    Place,
    ResumePoint,
    ToolAt,
    Wire,
    place_words,
)
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import COLUMNS, Kind, PolarArcs, Toolpath, toolpath_extents
from camtool.units import clock

if TYPE_CHECKING:
    from camtool.progress import Progress
    from camtool.run import Run
    from camtool.target.registry import LoadedTarget

_SETTINGS = re.compile(rb"settings ([0-9a-f]{8})\b")
"""The comment in a program with the digest of the machine file that it was written for."""

HEAD_BYTES = 4096
"""Bytes at the beginning of a program that are searched for it."""


class Rest(Struct, frozen=True, eq=False):
    """The rest of a program, from its block `first` on. `data`: its bytes, of which the first
    `entry` blocks bring the machine to where that block begins; `done` (B,): for each block of
    `data`, the last block of the original program that is done with it, −1 within the entry."""

    data: bytes
    first: int
    entry: int
    done: Ints


class Consignment(Struct, frozen=True, eq=False):
    """A program ready to be sent. `run`: the verified program; `rest`: the bytes that are sent
    instead of the whole program; `forecast`: the simulation of what is sent, `data`."""

    run: Run
    wire: Wire
    forecast: Forecast
    packets: tuple[Packet, ...]
    data: bytes = b""
    rest: Rest | None = None
    standing: ResumePoint | None = None

    @property
    def first(self) -> int:
        """Block with which it begins."""
        return 0 if self.rest is None else self.rest.first

    @property
    def blocks(self) -> int:
        """Number of blocks of the program."""
        return int(self.run.decoded.block.max(initial=-1)) + 1 if self.run.decoded else 0

    @property
    def sha256(self) -> str:
        """Digest of the whole program, hexadecimal."""
        return digest(self.run.program.data if self.run.program else b"")

    @property
    def seconds(self) -> float:
        """Duration of what is sent on the machine, s."""
        return float(sum(packet.seconds for packet in self.packets))

    def times_left_s(self) -> list[float]:
        """Return (P + 1) times, s: how long sending still takes when 0, 1, … P packets are
        acknowledged."""
        seconds = [packet.seconds for packet in reversed(self.packets)]
        return list(accumulate(seconds, initial=0.0))[::-1]

    @property
    def begin_mm(self) -> Place:
        """Place at which the tool stands when it begins, in the work frame."""
        x, y, z = self.forecast.decoded.start.tolist()
        return x, y, z

    def place_of(self, conversation: Conversation) -> Place | None:
        """Return the place that the machine reports, or else the end of the last block that is
        done, mm in the program's work frame; None if neither is known."""
        if self.wire.place == "told":
            return conversation.at_mm
        path = self.forecast.decoded
        rows = np.flatnonzero((path.block <= conversation.block) & (path.block >= 0))
        x, y, z = (path.end[rows[-1]] if len(rows) else path.start).tolist()
        return x, y, z

    @property
    def reach_mm(self) -> tuple[Place, Place] | None:
        """Lowest and highest place that its moves reach, in the work frame; None if nothing moves.
        The start of the first move is not counted: the tool may stand anywhere."""
        path = self.forecast.decoded
        path = path.first(path.executed_rows)
        moves = np.flatnonzero(path.is_motion)
        if not len(moves):
            return None
        first = int(moves[0]) + (not path.is_arc[moves[0]])
        (x, x1), (y, y1), (z, z1) = toolpath_extents(path.part(first, len(path))).tolist()
        return (x, y, z), (x1, y1, z1)

    def block_of(self, sent_block: int) -> int:
        """Convert a block `sent_block` (from 0) of what is sent to the last block of the program
        that is done with it; −1 within the entry."""
        return (
            sent_block if self.rest is None or sent_block < 0 else int(self.rest.done[sent_block])
        )


def check_settings(data: bytes, target: LoadedTarget, file: str) -> None:
    """Raise ProgramError for a program made with other values of the machine than its file has
    now."""
    match = _SETTINGS.search(data[:HEAD_BYTES])
    if match is None or match[1].decode() == target.machine.short_digest:
        return
    raise ProgramError(
        f"was written for another machine file (settings {match[1].decode()}, the machine has "
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
    state: JournalState | None = None,
    tool_at: ToolAt = "",
    despite_errors: bool = False,
    progress: Progress | None = None,
) -> Consignment:
    """Verify a program and divide it into packets; with `first` (a block, from 0), only its rest
    from there on. `state`: the state in its journal; `tool_at`: where the user says that the tool
    is. A program with errors has no packets, unless `despite_errors`. Raises ProgramError for a
    program that cannot be read, or that belongs to another machine."""
    wire = wire_of(target)
    check_settings(data, target, source)
    judging = Judging(keep_ledger=True)
    run = verify_program(data, target, source=source, judging=judging, progress=progress)
    if run.failed and not (despite_errors and run.decoded is not None):
        return Consignment(run, wire, _no_forecast(run), ())
    decoded, rest_program = run.decoded, None
    assert decoded is not None
    resume_point = None if state is None else _resume_point(state, decoded, tool_at)
    begin_mm = None
    if (
        resume_point is not None
        and wire.place in ("kept", "steps")
        and tool_at in ("journal", "known")
    ):
        begin_mm = resume_point.place_mm
    resumes_midway = resume_point is not None and resume_point.place_mm is not None
    resumes_midway = resumes_midway and wire.place in ("told", "steps") and tool_at != "zero"
    if first or resumes_midway:
        rest_program = rest_of(decoded, target, first, data, begin_mm=begin_mm)
        data = rest_program.data
        decoded = read_program(data, target, source=source).decoded
        assert decoded is not None
        if begin_mm is not None:
            decoded = _shift(decoded, np.array(begin_mm))
        if progress is not None:
            progress.begin(f"simulating {PurePath(source).name}")
        forecast = forecast_of(decoded, target)
    else:
        forecast = forecast_of_run(run)
    data = wire.with_stops(data, target.machine, decoded)
    packets = tuple(wire.packets(data, target.machine, forecast))
    return Consignment(run, wire, forecast, packets, data, rest_program, resume_point)


def _resume_point(state: JournalState, decoded: Toolpath, tool_at: ToolAt) -> ResumePoint:
    """Return the point from which the program resumes. If it was not stopped in an orderly way, an
    unknown number of the sent blocks is done."""
    under_way = (decoded.block >= state.block - 1) & (decoded.block <= state.last)
    return ResumePoint(state.tool_mm, state.is_still, decoded.end[under_way], tool_at)


def _shift(path: Toolpath, by_mm: Floats) -> Toolpath:
    """Return the path shifted by `by_mm` (3,)."""
    return replace(
        path, start=path.start + by_mm, end=path.end + by_mm, centre=path.centre + by_mm[:2]
    )


def tool_at_of(wire: Wire, state: JournalState, answer: ToolAt, name: str) -> tuple[ToolAt, str]:
    """Return where the tool is when a program resumes, as the user said or as follows from the
    journal, and the question to ask the user ("" for none). MachineError and OptionError for
    answers that the controller or the journal does not allow."""
    place = f"--tool-at {answer}" if answer else "--tool-at"
    if wire.place == "homed":
        if answer:
            raise MachineError(f"{name} homes before each piece", where=place, mend="leave it out")
        return "", ""
    unknown = OptionError(
        "the journal does not say where the tool stands: it was not stopped at a known place",
        where=place,
        mend="bring the tool to part zero, where the program begins, and give --tool-at zero",
    )
    is_sure = state.is_still and state.tool_mm is not None
    if wire.place == "told":
        if answer == "journal" and not is_sure:
            raise unknown
        return answer, ""
    if answer == "zero" or (not answer and state.last < 0):
        return "zero", ""
    left_words = f"the program was left at {place_words(state.tool_mm)} by the simulation"
    if wire.place == "kept":
        if answer:
            raise MachineError(
                f"{name} does not say where it stands, and has no command to set its place",
                where=place,
                mend="bring the tool to part zero, where the program begins, and give --tool-at "
                "zero",
            )
        left_words = left_words if is_sure else "nobody knows where the program was left"
        return (
            "zero",
            f"{left_words}, and it goes on from part zero: does the tool stand there now",
        )
    if answer == "known":
        raise MachineError(
            f"{name} knows only steps",
            where=place,
            mend="give --tool-at journal where the tool has stayed, zero where you have brought "
            "it to part zero",
        )
    if not is_sure:
        raise unknown
    question = f"{left_words}, and goes on from there: has the tool stayed there"
    return "journal", "" if answer else question


def _no_forecast(run: Run) -> Forecast:
    no_times, no_steps = np.zeros(0), np.zeros((0, 3), dtype=np.int64)
    assert run.decoded is not None
    return Forecast(
        run.decoded, no_times, no_times, no_steps[:, 0], no_steps, no_steps, np.zeros((0, 3))
    )


def forecast_of_run(run: Run) -> Forecast:
    """Return the forecast (time of each block) of a program that was judged with `keep_ledger`."""
    assert run.decoded is not None
    assert run.verification is not None
    books = run.verification.rows.books
    assert books.ledger is not None
    return _forecast(run.decoded, books.ledger, books.samples)


def forecast_of(decoded: Toolpath, target: LoadedTarget) -> Forecast:
    """Simulate moves without judging them; return the forecast of each block."""
    count = len(decoded)
    ledger, samples = still_ledger(np.arange(count)), np.zeros(count, dtype=np.int64)
    for chunk in target.simulate(decoded, Options()):
        ledger.add(chunk.ledger)
        samples += np.bincount(chunk.row, minlength=count)
    return _forecast(decoded, ledger, samples)


def _forecast(decoded: Toolpath, ledger: Ledger, samples: Ints) -> Forecast:
    """Return the forecast by blocks, from the ledger and the samples (N,) of each row; blocks
    after the end of the program take no time."""
    blocks = int(decoded.block.max(initial=-1)) + 1
    seconds, compensation = np.zeros(blocks), np.zeros(blocks)
    outputs = np.zeros(blocks, dtype=np.int64)
    steps = np.zeros((blocks, 3), dtype=np.int64)
    reversals = np.zeros((blocks, 3), dtype=np.int64)
    np.add.at(seconds, decoded.block, ledger.duration_s)
    np.add.at(compensation, decoded.block, ledger.compensation_s)
    np.add.at(outputs, decoded.block, samples)
    np.add.at(steps, decoded.block, ledger.steps)
    np.add.at(reversals, decoded.block, ledger.reversals)
    ends = np.full((blocks, 3), np.nan)
    ends[decoded.block] = decoded.end  # the last row of a block wins
    return Forecast(decoded, seconds, compensation, outputs, steps, reversals, ends)


# The rest of a program.


def rest_of(
    decoded: Toolpath,
    target: LoadedTarget,
    first: int,
    data: bytes | None = None,
    *,
    begin_mm: Place | None = None,
) -> Rest:
    """Write the rest of a program from block `first` (from 0) on, with an entry before it; a
    target may have its own function for that. `data`: the program, if at hand.

    It begins like the program, at part zero, or at `begin_mm` if part zero is known: up; tool,
    spindle and coolant as they are at the block; across to above the place; down to it at the
    plunge feed. Then the same moves follow, which are read back and compared. OptionError for a
    block that does not exist, and for one after which nothing moves."""
    rows = np.flatnonzero(decoded.block >= first)
    blocks = int(decoded.block.max(initial=-1)) + 1
    if first == blocks:
        raise OptionError("nothing moves behind its last block", mend="it is finished")
    if not 0 <= first < blocks or not len(rows):
        raise OptionError(f"there is no block {first + 1}", mend=f"blocks are 1 to {blocks}")
    low, high = int(rows[0]), decoded.executed_rows
    if low >= high or not _has_moves(decoded.part(low, high)):
        raise OptionError(f"nothing moves from block {first + 1} on", mend="it is finished")
    machine = target.machine
    target_rest = None if data is None else target.target.rest(data, machine, first)
    if target_rest is not None:
        done_blocks = np.arange(first - target_rest[1], blocks)
        done_blocks[: target_rest[1]] = -1
        return Rest(target_rest[0], first, target_rest[1], done_blocks)
    if begin_mm is not None and (decoded.kind[low:high] == Kind.SET_ZERO).any():
        raise OptionError(
            f"the program sets part zero behind block {first + 1}",
            mend="bring the tool to part zero, and give --tool-at zero",
        )
    data, reread = _write_rest(decoded, low, high, target, begin_mm)
    wanted_path = decoded.part(low, high)
    pairs = _MovePairs(wanted_path, reread, target).match()
    if pairs is None:
        raise PostError(
            f"the rest of the program cannot be written again as it is from block {first + 1} on",
            mend="choose the block at the beginning of a contour",
        )
    ends, entry_end = pairs
    # A block of the program is done when all its moves are.
    moves = np.flatnonzero(wanted_path.is_motion)
    last = np.append(wanted_path.block[moves[1:]] > wanted_path.block[moves[:-1]], True)
    done_blocks = np.full(int(reread.block.max()) + 1, -1)
    np.maximum.at(done_blocks, reread.block[ends[last]], wanted_path.block[moves[last]])
    done_blocks[: reread.block[entry_end]] = -1
    return Rest(data, first, int(reread.block[entry_end]), np.maximum.accumulate(done_blocks))


def _write_rest(
    decoded: Toolpath, low: int, high: int, target: LoadedTarget, begin_mm: Place | None
) -> tuple[bytes, Toolpath]:
    """Write a program of the entry and the rows `low` to `high`; return its bytes and the toolpath
    read back from them."""
    entry = _entry(decoded, low, target, begin_mm)
    count = len(entry)
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(entry, name), getattr(decoded, name)[low:high]])
        for name in COLUMNS
        if name not in ("source", "mode")
    }
    columns["source"] = np.concatenate([np.full(count, -1), decoded.source[low:high]])
    columns["mode"] = np.concatenate([np.full(count, -1), decoded.mode[low:high]])
    rest_path = replace(decoded, **columns, findings=(), drawn=None, operations=None)
    if begin_mm is not None:
        rest_path = replace(_shift(rest_path, -np.array(begin_mm)), start=decoded.start)
    program = target.target.write(rest_path, target.machine)
    reread = target.target.read(program.data, target.machine)
    return program.data, reread if begin_mm is None else _shift(reread, np.array(begin_mm))


def _has_moves(path: Toolpath) -> bool:
    """Return True if anything moves in the path."""
    somewhere = (path.starts != path.end).any(axis=1) | path.is_arc
    return bool((path.is_motion & somewhere).any())


def _entry(decoded: Toolpath, low: int, target: LoadedTarget, begin_mm: Place | None) -> Toolpath:
    """Return the moves and events that bring the machine from the beginning of the program, or
    from `begin_mm`, to the start of row `low`."""
    machine = target.machine
    x, y, z = decoded.starts_of(np.array([low]))[0].tolist()
    before = decoded.part(0, low)
    top = float(toolpath_extents(decoded.first(decoded.executed_rows))[2, 1])
    safe = max(top, z, float(decoded.start[2]))
    start = decoded.start.tolist() if begin_mm is None else begin_mm
    safe = max(safe, start[2])
    path = ToolpathBuilder(start=(start[0], start[1], start[2]))
    kinds = before.kind
    zeros = np.flatnonzero(kinds == Kind.SET_ZERO)
    if len(zeros) and begin_mm is None:
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
        after = before.kind[spindle[-1] :]
        moves = np.flatnonzero(before.is_motion[spindle[-1] :])
        waits = np.flatnonzero(after[: moves[0] if len(moves) else None] == Kind.DWELL)
        spin_up_s = float(
            before.value[spindle[-1] :][waits].sum()
        )  # the program's own wait for it
        if (after == Kind.DWELL).any():
            spin_up_s = max(spin_up_s, machine.spindle.spin_up_s or 0.0)
        if spin_up_s:
            path.event(Kind.DWELL, spin_up_s)
    coolants = (Kind.COOLANT_MIST, Kind.COOLANT_FLOOD, Kind.COOLANT_OFF)
    cooled = np.flatnonzero(np.isin(kinds, coolants))
    off_rows = cooled[kinds[cooled] == Kind.COOLANT_OFF]
    for row in cooled[cooled > (off_rows[-1] if len(off_rows) else -1)].tolist():
        path.event(Kind(int(kinds[row])))
    path.rapid(x, y)
    if z < safe:
        path.line(z=z, feed=_plunge_feed(decoded, low, target))
    return path.finish()


def _plunge_feed(decoded: Toolpath, low: int, target: LoadedTarget) -> float:
    """Return the feed (mm/min) of the last plunge before the row, else of the first plunge, else
    the machine's plunge feed."""
    machine = target.machine
    drops = (decoded.kind == Kind.LINE) & (decoded.end[:, 2] < decoded.starts[:, 2])
    plunges = np.flatnonzero(drops)
    if len(plunges):
        earlier = plunges[plunges < low]
        return float(decoded.feed[earlier[-1] if len(earlier) else plunges[0]])
    feed = machine.feed.default_mm_min * (machine.defaults.plunge_share or 1.0)
    return min(feed, machine.max_plunge_mm_min)


class _MovePairs:
    """Pairs of moves: those of a program (`wanted_path`), and those that were written for them
    after an entry and read back (`reread`). Both are equal, or, where the writer splits a move,
    lines that lie on it; moves shorter than the resolution of the dialect may be missing."""

    def __init__(self, wanted_path: Toolpath, reread: Toolpath, target: LoadedTarget) -> None:
        machine = target.machine
        self._wanted, self._again = wanted_path, reread
        self._begins, self._others = wanted_path.starts, reread.starts
        unit = [target.target.unit_mm(machine, axis) for axis in machine.axes]
        self._slack = np.array(unit) + POSITION_EPS_MM
        self._max_deviation = float(self._slack.max()) + machine.defaults.fit_tolerance_mm
        self._arms = PolarArcs(wanted_path, wanted_path.is_arc)

    def match(self) -> tuple[Ints, int] | None:
        """Return the last row of `reread` for each wanted move (M,), and the first row of `reread`
        after the entry; None if the moves differ."""
        rows = np.flatnonzero(self._wanted.is_motion)
        moves = np.flatnonzero(self._again.is_motion)
        tail = moves[max(len(moves) - len(rows), 0) :]
        if len(tail) == len(rows) and self._are_equal(rows, tail).all():
            return tail, int(tail[0])
        ends, end = np.empty(len(rows), dtype=np.int64), len(self._again)
        for k in range(len(rows) - 1, -1, -1):
            row = rows[k : k + 1]
            ends[k], begin = self._last_move(end), None
            if self._is_negligible(self._wanted, self._begins, row):
                continue
            if ends[k] >= 0:
                begin = self._begin(row, int(ends[k]))
            if begin is None:
                return None
            end = begin
        return np.maximum(ends, end), end

    def _last_move(self, end: int) -> int:
        """Return the last row before `end` that moves, −1 if none does."""
        end -= 1
        while end >= 0 and self._is_negligible(self._again, self._others, np.array([end])):
            end -= 1
        return end

    def _begin(self, row: Ints, end: int) -> int | None:
        """Return the index of the first row that, together with the rows up to `end`, makes up a
        wanted move; None if they do not."""
        part = np.array([end])
        if self._are_equal(row, part).all():
            return end
        if not self._are_near(self._wanted.end[row], self._again.end[part]).all():
            return None
        while self._lies_on(row, part):
            if self._are_near(self._begins[row], self._others[part]).all():
                return int(part[0])
            part = np.array([self._last_move(int(part[0]))])
            if part[0] < 0:
                return None
        return None

    def _is_negligible(self, path: Toolpath, starts: Floats, row: Ints) -> bool:
        """Return True if a row does not move, or moves less than the resolution of the dialect."""
        if path.is_arc[row].any():
            return False
        return not path.is_motion[row].any() or bool(
            self._are_near(starts[row], path.end[row]).all()
        )

    def _are_near(self, ones: Floats, other_points: Floats) -> Bools:
        """Return the mask (K,) of pairs of points (K, 3) that are within the resolution of each
        other."""
        return np.asarray((np.abs(ones - other_points) <= self._slack).all(axis=1))

    def _are_equal(self, rows: Ints, other_rows: Ints) -> Bools:
        """Return the mask (K,) of pairs of rows whose moves are equal within the resolution."""
        wanted_path, reread = self._wanted, self._again
        deviations = np.nan_to_num(
            np.abs(wanted_path.centre[rows] - reread.centre[other_rows])
        ).max(axis=1)
        is_same: Bools = (wanted_path.kind[rows] == reread.kind[other_rows]) & (
            deviations <= self._slack.max()
        )
        is_same &= self._are_near(self._begins[rows], self._others[other_rows])
        return is_same & self._are_near(wanted_path.end[rows], reread.end[other_rows])

    def _lies_on(self, row: Ints, part: Ints) -> bool:
        """Return True if a line, or an arc about the same centre, is a part of a wanted move."""
        wanted_path, reread = self._wanted, self._again
        rapid = wanted_path.kind[row] == Kind.RAPID, reread.kind[part] == Kind.RAPID
        if rapid[0] != rapid[1] or not reread.is_motion[part].all():
            return False
        points = np.concatenate([self._others[part], reread.end[part]])
        if reread.is_arc[part].any():
            deviation = np.abs(wanted_path.centre[row] - reread.centre[part]).max()
            if wanted_path.kind[row] != reread.kind[part] or deviation > self._slack.max():
                return False
        else:
            points = np.concatenate([points, points.mean(axis=0)[None, :]])
        if wanted_path.is_arc[row].any():
            arms, k = self._arms, int(np.searchsorted(self._arms.row, row[0]))
            radius = np.hypot(*(points[:, :2] - arms.centre[k]).T)
            low, high = sorted((float(arms.radius[k]), float(arms.end_radius[k])))
            distances = np.maximum(low - radius, radius - high)
        else:
            begin, step = self._begins[row[0]], wanted_path.end[row[0]] - self._begins[row[0]]
            share = np.clip((points - begin) @ step / (step @ step), 0.0, 1.0)
            distances = np.linalg.norm(begin + share[:, None] * step - points, axis=1)
        return bool((distances <= self._max_deviation).all())


def lines_of(one: Consignment, target: LoadedTarget) -> Sequence[tuple[str, str]]:
    """Return the lines of a dry run as (name, text) pairs."""
    machine, run = target.machine, one.run
    decoded = one.forecast.decoded
    low_high = toolpath_extents(decoded.first(decoded.executed_rows))
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
        ("begin", _begin_words(one)),
    ]
    if one.rest is not None:
        x, y, z = decoded.starts_of(
            np.array([int(np.flatnonzero(decoded.block >= one.rest.entry)[0])])
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


def _begin_words(one: Consignment) -> str:
    """Return a sentence on where the tool must stand when the program begins or resumes."""
    resume_point, is_told = one.standing, one.wire.place == "told"
    tool_at = "zero" if resume_point is None else resume_point.tool_at
    if tool_at == "zero":
        x, y, z = one.forecast.decoded.start.tolist()
        suffix = ", and the controller is told so" if resume_point is not None and is_told else ""
        return f"the tool stands at part zero: {place_words((x, y, z))}{suffix}"
    if one.wire.place == "homed":
        return "it homes first"
    if tool_at == "known" and is_told:
        return "the controller knows where the tool stands"
    assert resume_point is not None
    place = place_words(resume_point.place_mm) or "a place that nobody knows"
    if not tool_at:
        return f"the program was left at {place}; the controller must say the same"
    return f"the tool stands where the program was left, at {place}"


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
