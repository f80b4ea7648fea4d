"""Fewer reversals while cutting: contours cut as runs in which no axis turns round.

Each change of an axis's direction makes its slide cross the play, costs a compensation, and
leaves an error where it happens. The PIC thesis saw parts fail above 16 of them (L3052-3057,
L3207-3211) and saved them by machining in mirror halves (L2816-2841). So each contour is divided
where an axis turns (`mirror`), the runs are cut in the directions that leave the smaller error,
and every run is approached so that its axes are engaged (`approach`): all reversals happen in the
air.

A contour stays in one piece where the job asks for what only a whole one can have: leads, tabs,
a ramp, a start by rule or by hand. Of the others of those, only the start is chosen. What cuts
climb or conventionally keeps its direction, divided or not.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from camtool.findings import Code, Finding, Severity
from camtool.geometry.polylines import Polyline, reverse
from camtool.machine.model import Machine
from camtool.planning.items import Contour, Fixed, Item, Run
from camtool.planning.job import Operation
from camtool.planning.reversing.approach import flat, least_turn_mm
from camtool.planning.reversing.mirror import Division, drawn_error_mm
from camtool.planning.reversing.residual import Residual, residuals
from camtool.planning.reversing.turns import Parts, Turns, no_turns, parts_of, turns_of
from camtool.units import UM_PER_MM

LEAST_TURN_MM = 1e-6
"""How far back an axis must come for a reversal, where no machine says how fine its steps are."""


def reversals_of(cut: Polyline | Run, machine: Machine | None = None) -> tuple[int, int]:
    """How often X and Y turn round between the first point of a path or run and its last one.

    What comes back by less than half a step of the machine (`LEAST_TURN_MM` without one) is no
    reversal; nor is the first motion, which an approach takes care of.
    """
    path = flat(cut.vertices) if isinstance(cut, Run) else cut
    if path is None:
        return 0, 0
    parts = parts_of(path)
    least = (LEAST_TURN_MM,) * 2
    if machine is not None:
        least = least_turn_mm(machine.axes.x), least_turn_mm(machine.axes.y)
    x, y = (turns_of(parts.places[:, axis], path.closed, least[axis]) for axis in (0, 1))
    return _within(x, parts), _within(y, parts)


def _within(turns: Turns, parts: Parts) -> int:
    """Turns of a way from the first place to the last: those at the start of a closed path are
    no part of it."""
    return int(((turns.first > 0) & (turns.last < len(parts))).sum())


@dataclass
class _Sums:
    """Sums over all contours: runs, reversals while cutting, the greatest predicted error."""

    runs: int = 0
    reversals: int = 0
    error_mm: float = 0.0

    def add(self, runs: int, reversals: int, error_mm: float) -> None:
        """One contour more."""
        self.runs += runs
        self.reversals += reversals
        self.error_mm = max(self.error_mm, error_mm)


@dataclass
class _Counts:
    """What changes; `whole`: why contours stayed in one piece, with the names of those."""

    before: _Sums = field(default_factory=_Sums)
    after: _Sums = field(default_factory=_Sums)
    whole: dict[str, list[str]] = field(default_factory=dict)


def fewer_reversals(
    items: Sequence[Item], machine: Machine
) -> tuple[tuple[Item, ...], tuple[Finding, ...]]:
    """The items with contours replaced by runs that reverse no axis while cutting, in the order
    of the contours, and what that changes; items of `Fixed` runs stay.

    An axis without play and compensation may reverse as it likes. The runs of a contour together
    are the contour: they meet exactly, keep its name, source and setting, and know the whole path
    as their `outline`. `PLAY_NOT_KNOWN` when neither axis has any: nothing is changed then.
    """
    residual = residuals(machine)
    if not any(each.matters for each in residual):
        return tuple(items), (_no_play(machine),)
    counts = _Counts()
    found: list[Item] = []
    for item in items:
        if isinstance(item, Fixed):
            found.append(item)
        else:
            found.extend(_runs_of(item, machine, residual, counts))
    return tuple(found), tuple(_told(counts))


def _runs_of(
    contour: Contour, machine: Machine, residual: tuple[Residual, Residual], counts: _Counts
) -> list[Item]:
    parts = parts_of(contour.path)
    turns = _turns(parts, machine, residual)
    division = Division.of(parts, turns, residual, either_way=not _keeps_direction(contour))
    closed, levels = contour.path.closed, len(contour.setting.levels_mm)
    count, error_mm = len(turns[0]) + len(turns[1]), drawn_error_mm(division)
    at_start = count - sum(_within(each, parts) for each in turns)
    runs = 1 if closed or contour.reversible else levels
    counts.before.add(runs, count * levels - at_start, error_mm)
    reason = _stays_whole(contour.setting.operation)
    if not count and (closed or reason):
        counts.after.add(runs, 0, error_mm)
        return [contour]
    if not reason:
        pieces = division.pieces()
        counts.after.add(len(pieces) * levels, 0, max(piece.error_mm for piece in pieces))
        return [
            _part(contour, parts.stretch(piece.first, piece.last), piece.backward)
            for piece in pieces
        ]
    counts.whole.setdefault(reason, []).append(contour.name)
    if closed and contour.setting.operation.start == "nearest":
        contour, at_start = _begun_at_turns(contour, parts, turns)
    counts.after.add(runs, count * levels - at_start, error_mm)
    return [contour]


def _turns(
    parts: Parts, machine: Machine, residual: tuple[Residual, Residual]
) -> tuple[Turns, Turns]:
    x, y = (
        turns_of(parts.places[:, index], parts.path.closed, least_turn_mm(axis))
        if residual[index].matters
        else no_turns(len(parts))
        for index, axis in enumerate((machine.axes.x, machine.axes.y))
    )
    return x, y


def _keeps_direction(contour: Contour) -> bool:
    """Whether the side on which the teeth cut was asked for, and there is a side."""
    operation = contour.setting.operation
    wide = operation.tool.diameter_mm > 0.0 and contour.material_left is not None
    return operation.direction != "drawn" and wide


def may_divide(operation: Operation) -> bool:
    """Whether contours of this operation may be cut as several runs."""
    return not _stays_whole(operation)


def _stays_whole(operation: Operation) -> str:
    """Why contours of this operation are not divided; "" when they may be."""
    if operation.tabs is not None:
        return "tabs are counted along whole contours"
    if operation.lead_in.kind != "none" or operation.lead_out.kind != "none":
        return "each run would need leads of its own"
    if operation.entry.kind != "plunge":
        return "the way down along the contour would reverse in each run"
    if operation.start != "nearest":
        return "the job says where contours start"
    return ""


def _part(contour: Contour, path: Polyline, backward: bool) -> Contour:
    """A run of a contour; one that is the whole of an open contour keeps no other outline."""
    left = contour.material_left
    return replace(
        contour,
        path=reverse(path) if backward else path,
        reversible=False,
        starts=np.empty(0, dtype=np.int64),
        material_left=left if left is None else left != backward,
        outline=contour.path if contour.path.closed else contour.outline,
    )


def _begun_at_turns(
    contour: Contour, parts: Parts, turns: tuple[Turns, Turns]
) -> tuple[Contour, int]:
    """The closed contour with only those starts at which the most turns happen in the air, and
    how many do: two at most, one of X and one of Y."""
    count = len(parts)
    if len(contour.starts):
        at = np.flatnonzero(parts.begin == 0.0)[contour.starts]
    else:
        ends = [np.append(each.first, each.last) for each in turns]
        at = np.unique(np.concatenate(ends) % count)
    if len(at) == 0:
        return contour, 0
    held = [
        ((at[:, None] - each.first) % count <= each.last - each.first).any(axis=1)
        for each in turns
    ]
    saved = held[0].astype(np.int64) + held[1]
    best = saved == saved.max()
    if len(contour.starts):
        return replace(contour, starts=contour.starts[best]), int(saved.max())
    path, starts = parts.with_vertices(at[best])
    return replace(contour, path=path, starts=starts), int(saved.max())


def _told(counts: _Counts) -> Iterator[Finding]:
    before, after = counts.before, counts.after
    if before.reversals:
        yield Finding(
            Code.REVERSALS_IN_AIR,
            Severity.INFO,
            f"{before.reversals} reversals while cutting become {after.reversals}: {before.runs}"
            f" runs are cut as {after.runs}; what play leaves over is at most"
            f" {after.error_mm * UM_PER_MM:.3g} µm, not {before.error_mm * UM_PER_MM:.3g} µm",
            measured=float(after.reversals),
            limit=float(before.reversals),
        )
    for reason, names in counts.whole.items():
        yield Finding(
            Code.REVERSALS_IN_AIR,
            Severity.INFO,
            f"{len(names)} contours that turn back are cut in one piece: {reason}",
            where=names[0],
            measured=float(len(names)),
        )


def _no_play(machine: Machine) -> Finding:
    return Finding(
        Code.PLAY_NOT_KNOWN,
        Severity.WARNING,
        f"{machine.target.name} has no play in X and Y, so that fewer reversals would gain"
        " nothing: give it with --set axes.x.backlash_mm=...",
        where="axes x, y",
    )
