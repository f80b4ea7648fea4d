"""Find the cheapest change of a job with which all dimensions hold, or the reason why none does.

A trial is a job file: it is read, posted, read back from its bytes, simulated and inspected, as
`camtool post --job FILE --tolerances …` would. What a trial may change:

    allowance              of each contour that cuts a dimension: in closed form, see below
    compensate             of the job
    direction, start       of the operations that cut a dimension that does not hold
    approach, minimise     of the job
    feed                   of these operations
    how arcs, corners …    are drawn, where the controller has a choice (`Target.ways`)

Trials with fewer changes come first, all allowances together counting as one change; among these
the order is that of the list above: changes that cost no cutting time come before those that do.
The first job that satisfies all dimensions is returned. Programs of the same bytes are judged
once. The search is deterministic.

Allowances. If a wall keeps an allowance a, the tool's path and the edge that it cuts move outwards
by a. So the sizes of a part follow for any allowances from the edges of one simulation
(`Inspector.sizes`): they are linear in the allowances, except the profile of a line, which is
convex. With the upper limit U, the lower L and the standard uncertainty u of a dimension,

    maximise Σ_d t_d − ε Σ_c |a_c|
    with t_d ≤ FAR_ENOUGH,   u t_d ≤ U − high(a),   u t_d ≤ low(a) − L

is a linear programme; a convex size enters by its tangents at all a that were tried. The trial
that follows confirms the result, or not.

A certificate explains why no job holds: the dimension that is farthest from holding, and for each
number of the machine the value that it alone would need. The value is found by bisection, and each
step posts, simulates and inspects a job anew."""

from __future__ import annotations

import hashlib
import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np
from msgspec import Struct, field

from camtool.arrays import Floats
from camtool.errors import CamtoolError, OptionError
from camtool.findings import Severity
from camtool.inspection.dimensions import DEPTHS
from camtool.inspection.inspector import Inspected, Inspector
from camtool.inspection.sizes import minimise
from camtool.inspection.tolerances import unbound_findings
from camtool.inspection.uncertainty import CERTAIN, Machined, MachineVariant
from camtool.inspection.verdicts import GUARD, NOT_INSPECTED, Tolerances, inspect, verdicts_of
from camtool.jobs.changes import LEFT_DIGITS, Change, Left, changed_tables_of, text_of
from camtool.jobs.keys import OPERATION, is_known
from camtool.machine.model import Machine, Uncertainty
from camtool.pipeline import post_drawing
from camtool.plain import one_line
from camtool.planning.place import place
from camtool.planning.sides import Sides
from camtool.progress import Progress
from camtool.records import replace
from camtool.run import Run
from camtool.units import UM_PER_MM
from camtool.verification.report import InspectedReport

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing
    from camtool.planning.job import Job, Operation
    from camtool.tables import Table
    from camtool.target.registry import LoadedTarget

MAX_CHANGES = 3

DEFAULT_TRIALS = 100

FEED_SHARES = (0.5, 0.25)
"""Slower feeds to try, as shares of the operation's own."""

MAX_LEFT_SHARE = 0.25
"""Largest change of an allowance, as a share of the radius of the tool."""

FAR_ENOUGH = 3.0
"""A dimension that is within its limits by so many standard uncertainties (99.9 %) needs no more
allowance."""

PER_MM = 1e-3
"""ε: cost of a millimetre of allowance, in standard uncertainties."""

STEP_MM = 1e-6
"""Step, mm, for the slopes of sizes by differences."""

ROUNDS = 8
"""At most this many allowances are tried to find tangents of sizes."""

SETTLED = 1e-6
"""The search ends when sizes differ from their tangents by at most this, mm."""

NO_STANDARD_MM = 1e-3
"""Replaces an unknown standard uncertainty, mm: sizes are then centred within their limits."""

BISECTIONS = 6
"""Number of bisections for the needed value of a number of the machine."""

NEEDED_DIGITS = 3

REFINED = 2
"""Number of times that allowances are corrected by the sizes that they gave."""

MAX_INPUTS_ASKED = 2
"""At most this many uncertainties, the largest first, are examined for the value that would be
needed."""


# The question (`MeetingCase`), proposals, trials, and the answer (`Meeting`).


class MeetingCase(Struct, frozen=True, eq=False):
    """A drawing, its machine, its job as the tables of a file, and the required dimensions.
    `job_of` converts tables as a job file is read; OptionError for wrong ones."""

    drawing: Drawing
    target: LoadedTarget
    tables: Table
    job_of: Callable[[Table], Job]
    tolerances: Tolerances


class JobChanges(Struct, frozen=True):
    """A proposal: changes of keys of a job, of allowances, and of settings of its machine in the
    form of `--set`."""

    changes: tuple[Change, ...] = ()
    left: tuple[Left, ...] = ()
    settings: tuple[str, ...] = ()

    @property
    def count(self) -> int:
        """Number of changes; all allowances together count as one."""
        return len(self.changes) + len(self.settings) + bool(self.left)

    def __add__(self, other: JobChanges) -> JobChanges:
        return JobChanges(
            self.changes + other.changes, self.left + other.left, self.settings + other.settings
        )


class MeetingTrial(Struct, frozen=True, eq=False):
    """The result of a proposal.

    `verdicts` of the dimensions, with the `paths` of the drawing that form each; `missing`: number
    of dimensions that could not be inspected; `time_s` of the program; `left`: the allowances that
    should improve it, computed from its edges."""

    proposal: JobChanges
    verdicts: tuple[InspectedReport, ...]
    paths: tuple[tuple[int, ...], ...]
    missing: int
    time_s: float
    left: tuple[Left, ...] = ()

    @property
    def short(self) -> list[int]:
        """Indices of the dimensions that are not within their limits."""
        return [k for k, each in enumerate(self.verdicts) if each.verdict != "in"]

    @property
    def holds(self) -> bool:
        """True if all dimensions are within their limits."""
        return not self.short and not self.missing

    @property
    def score(self) -> tuple[int, int, float]:
        """Sort key, less is better: number of dimensions that cannot be inspected, number that do
        not hold, and the largest shortfall in standard uncertainties."""
        worst = -min(map(margin, self.verdicts), default=math.inf)
        return self.missing, len(self.short), worst

    @property
    def binding(self) -> InspectedReport | None:
        """Dimension that is farthest from holding; None if all are in or missing."""
        return min((self.verdicts[k] for k in self.short), key=margin, default=None)


def margin(each: InspectedReport) -> float:
    """Return the distance of a dimension within its nearer limit, in standard uncertainties,
    negative beyond it.

    Unknown inputs have their worst values within their bounds."""
    lower, upper = _limits_mm(each)
    return min(upper - each.high_mm, each.low_mm - lower) / _standard_mm(each)


def _limits_mm(each: InspectedReport) -> tuple[float, float]:
    """Return the limits, narrowed by the bounds of unknown inputs; the lower one is −∞ without
    one."""
    assert each.upper_mm is not None
    narrower = (each.unknown_um or 0.0) / UM_PER_MM
    lower = -math.inf if each.lower_mm is None else each.lower_mm + narrower
    return lower, each.upper_mm - narrower


def _standard_mm(each: InspectedReport) -> float:
    standard_mm = (each.standard_um or 0.0) / UM_PER_MM
    return standard_mm or NO_STANDARD_MM


class Need(Struct, frozen=True):
    """A number of the machine that would have to be better: its key as for `--set`, its name, and
    the required value in the unit of the key."""

    key: str
    now: float
    needed: float


class Certificate(Struct, frozen=True):
    """The reason why no proposal holds.

    `binding` is the dimension that is farthest from holding, `unknown` are its uncertain inputs
    that are unknown and unbounded, and `needs` the numbers of the machine that would each, if it
    alone were better, make all dimensions hold. `exact`: True if all would hold with every one of
    these numbers at its best. `together`: names of its contours that other contours share, so that
    one allowance applies to all of them."""

    binding: InspectedReport | None
    unknown: tuple[str, ...] = ()
    needs: tuple[Need, ...] = ()
    exact: bool = False
    together: tuple[str, ...] = ()


class Meeting(Struct, frozen=True, eq=False):
    """The result of `meet`.

    `before` is the original job, `after` the best proposal with its `run`, posted (`brief` as
    `post_drawing` has it) and inspected; `trials` counts the programs tried besides the original
    one, and `all` is True if every necessary one was tried. `text`: the job file of the proposal.
    `certificate`: the reason why it does not hold, else None."""

    before: MeetingTrial
    after: MeetingTrial
    run: Run
    text: str
    trials: int
    all: bool
    certificate: Certificate | None

    @property
    def holds(self) -> bool:
        """True if all dimensions with limits hold."""
        return self.after.holds

    @property
    def changed(self) -> bool:
        """True if the proposal differs from the job as it was."""
        return bool(self.after.proposal.count)


def meet(
    case: MeetingCase, max_trials: int = DEFAULT_TRIALS, progress: Progress | None = None
) -> Meeting:
    """Find the cheapest change of the job after which all dimensions hold; if there is none, the
    best one and a certificate.

    The result is never worse than the job as it is. Raises the errors of `post` and `inspect` for
    that job."""
    _check_readable(case)
    asked_dimensions = tuple(
        each
        for each in case.tolerances.dimensions
        if each.limits is not None or (each.kind in DEPTHS and each.asks)
    )
    case = replace(case, tolerances=replace(case.tolerances, dimensions=asked_dimensions))
    bench = Bench(case, progress or Progress())
    bench.progress.begin("trying programs", max_trials)
    before = bench.first()
    after, every = before, True
    if not before.holds:
        after, every = find_cheapest(before, levers(bench, before), bench.try_changes, max_trials)
    trials = bench.trials
    run, tables = bench.run_of(after.proposal), bench.tables_of(after.proposal)
    assert run.report is not None
    missing = sum(each.code in NOT_INSPECTED for each in run.findings)
    after = replace(after, verdicts=run.report.inspection, missing=missing)
    certificate = None if after.holds else bench.certificate(after)
    text = text_of(tables, list(_head(case, after)))
    return Meeting(before, after, run, text, trials, every, certificate)


def _check_readable(case: MeetingCase) -> None:
    """Raise OptionError for dimensions that no change of the job can make inspectable."""
    wanted_dimensions = [each for each in case.tolerances.dimensions if each.asks]
    read = (
        each
        for each in case.tolerances.findings
        if each.severity is Severity.ERROR or each.code in NOT_INSPECTED
    )
    unreadable = [*read, *unbound_findings(case.drawing, wanted_dimensions)]
    if unreadable:
        suffix = f" (and {len(unreadable) - 1} more)" if len(unreadable) > 1 else ""
        raise OptionError(
            f"no job can be said to meet it: {unreadable[0].message}{suffix}",
            where=unreadable[0].where,
            mend=f"{unreadable[0].code.mend}; or leave it out",
        )


Tried = Callable[[JobChanges], "MeetingTrial | None"]
"""Function that tries a proposal; it returns None for one that cannot be cut."""


def find_cheapest(
    before: MeetingTrial,
    choices: Sequence[Sequence[JobChanges]],
    try_changes: Tried,
    max_trials: int,
) -> tuple[MeetingTrial, bool]:
    """Return the trial with the fewest changes that holds, the first of several, or else the one
    with the best score.

    The second value is True if every proposal before it was tried, False if `max_trials` ended the
    search. At most one proposal of each list in `choices`, the cheapest first, is applied."""
    best, trials = before, {JobChanges(): before}
    for count, proposal in enumerate(_proposals(choices, trials), start=1):
        if count > max_trials:
            return best, False
        trial = try_changes(proposal)
        if trial is None:
            continue
        trials[proposal] = trial
        if trial.holds:
            return trial, True
        if trial.score < best.score:
            best = trial
    return best, True


def _proposals(
    choices: Sequence[Sequence[JobChanges]], trials: Mapping[JobChanges, MeetingTrial]
) -> Iterator[JobChanges]:
    """Yield all proposals of up to MAX_CHANGES changes, those with fewer changes first.

    Among those with the same number, allowances that a trial with one change less has computed
    come first."""
    for count in range(1, MAX_CHANGES + 1):
        for base in list(trials.values()):
            if base.proposal.count == count - 1 and base.left and not base.proposal.left:
                yield replace(base.proposal, left=base.left)
        for chosen_levers in itertools.combinations(choices, count):
            for each in itertools.product(*chosen_levers):
                yield sum(each, JobChanges())


def levers(bench: Bench, before: MeetingTrial) -> list[list[JobChanges]]:
    """Return lists of alternative changes, the cheapest list first; at most one change of each
    list is applied."""
    job, target = bench.job, bench.case.target
    machine = target.machine
    short_paths = {path for k in before.short for path in before.paths[k]}
    cutting = bench.contours.cutting(short_paths)
    own_rows = [(row, operation) for row, _, operation in _rows(job) if row in cutting]
    lever_list = [
        _job_lever("compensate", True, job.compensate),
        *(_other_words("direction", row, each) for row, each in own_rows),
        *(_other_words("start", row, each) for row, each in own_rows),
        _job_lever("approach", True, job.approach),
        _job_lever("minimise", "reversals", job.minimise),
        *(_slower_feeds(row, each, machine) for row, each in own_rows),
    ]
    for key, values in target.target.ways.items():
        value_now = _value_at(machine, key)
        lever_list.append(
            [JobChanges(settings=(f'{key}="{each}"',)) for each in values if each != value_now]
        )
    return [each for each in lever_list if each]


def _job_lever(key: str, value: Any, value_now: Any) -> list[JobChanges]:
    return (
        []
        if value_now == value
        else [JobChanges((Change(key, value, None, str(value_now).lower()),))]
    )


OTHER_WORDS = {"direction": ("climb", "conventional"), "start": ("longest-line", "corner")}
"""Alternative values of keys of operations."""


def _other_words(key: str, row: int, operation: Operation) -> list[JobChanges]:
    """Return a change to each other value of a key of an operation; none if its kind lacks that
    key."""
    if not is_known(key, operation.kind):
        return []
    value_now = getattr(operation, OPERATION[key].field)
    text = value_now if isinstance(value_now, str) else f"{value_now[0]:g},{value_now[1]:g}"
    return [
        JobChanges((Change(key, word, row, text),))
        for word in OTHER_WORDS[key]
        if word != value_now
    ]


def _slower_feeds(row: int, operation: Operation, machine: Machine) -> list[JobChanges]:
    """Return changes to slower feeds of an operation, FEED_SHARES of its own."""
    feed = operation.feed_mm_min or machine.feed.default_mm_min
    words = (f"{share * feed:.6g}mm/min" for share in FEED_SHARES)
    return [JobChanges((Change("feed", word, row, f"{feed:.6g}mm/min"),)) for word in words]


def _rows(job: Job) -> Iterator[tuple[int, int, Operation]]:
    """Return an iterator over the operations except finishing passes: row in the file, index in
    the job, operation."""
    first = [k for k, each in enumerate(job.operations) if each.stage != "finish"]
    return ((row, k, job.operations[k]) for row, k in enumerate(first))


# The contours whose walls are moved.


class JobContours(Struct, frozen=True, eq=False):
    """The contours of a job, by the names of their entities.

    `cut`: names that the operation in each row of the file cuts; `walls`: those of operations with
    an allowance; `depth`: number of contours around each; `head`: walls with the same head move
    alike, since an operation cannot be divided; `most_mm`: largest change of the allowance of a
    wall; `of_path`: name of each drawn path."""

    cut: dict[int, tuple[str, ...]]
    walls: dict[int, tuple[str, ...]]
    depth: dict[str, int]
    head: dict[str, str]
    most_mm: dict[str, float]
    of_path: tuple[str, ...]

    @classmethod
    def of(cls, case: MeetingCase, job: Job) -> JobContours:
        """Return the contours of a job that cuts the drawing of this case."""
        placed_drawing = place(case.drawing, job)
        sides = Sides.of(placed_drawing, job, case.target.machine.defaults.cut_depth_mm)
        depths: dict[str, set[int]] = {}
        nesting = placed_drawing.nesting.among(np.arange(len(placed_drawing.paths)))
        for name, depth in zip(placed_drawing.sources, nesting.levels.depth.tolist(), strict=True):
            depths.setdefault(name, set()).add(depth)
        rests = {each.rest for each in job.operations} - {""}
        head = {name: name for name in depths}
        cut: dict[int, tuple[str, ...]] = {}
        walls: dict[int, tuple[str, ...]] = {}
        max_allowance: dict[str, float] = {}
        for row, index, operation in _rows(job):
            cut_rows = np.flatnonzero(sides.cuts[index, : len(placed_drawing.paths)])
            names = cut[row] = tuple(dict.fromkeys(placed_drawing.sources[k] for k in cut_rows))
            if not is_known("allowance", operation.kind) or not operation.tool.radius_mm:
                continue
            walls[row] = names
            for name in names:
                max_allowance[name] = min(
                    max_allowance.get(name, math.inf), MAX_LEFT_SHARE * operation.tool.radius_mm
                )
            is_alone = not (operation.rest or operation.name in rests)
            if not operation.contract.runs_beside:
                # A contour within another one is an island of its pocket, or bored with it.
                is_alone = is_alone and not nesting.among(cut_rows).levels.depth.any()
            if not (is_alone and all(name and len(depths[name]) == 1 for name in names)):
                heads = {head[name] for name in names}
                head = {name: min(heads) if each in heads else each for name, each in head.items()}
        depth = {name: min(each) for name, each in depths.items()}
        return cls(cut, walls, depth, head, max_allowance, case.drawing.sources)

    def cutting(self, paths: Iterable[int]) -> set[int]:
        """Return the rows of the job file whose operations cut any of these paths of the
        drawing."""
        names = {self.of_path[path] for path in paths}
        return {row for row, cut_names in self.cut.items() if names.intersection(cut_names)}

    def together(self, paths: Iterable[int]) -> tuple[str, ...]:
        """Return the names of these paths of the drawing that other paths have as well."""
        names = dict.fromkeys(self.of_path[path] for path in paths)
        return tuple(name for name in names if self.of_path.count(name) > 1)

    def left(self, by_name: Mapping[str, float]) -> tuple[Left, ...]:
        """Return the allowances on walls, mm by the name of the contour, as changes of operations.

        An operation with several allowances is divided: inner contours come before those around
        them."""
        parts_found: list[Left] = []
        for row, names in self.walls.items():
            if not any(by_name.get(name) for name in names):
                continue
            parts: list[tuple[float, list[str]]] = []
            order = sorted(names, key=lambda name: -self.depth[name])
            for _, level in itertools.groupby(order, key=lambda name: self.depth[name]):
                names_by_mm: dict[float, list[str]] = {}
                for name in level:
                    names_by_mm.setdefault(by_name.get(name, 0.0), []).append(name)
                for by_mm, contour_names in names_by_mm.items():
                    if parts and parts[-1][0] == by_mm:
                        parts[-1][1].extend(contour_names)
                    else:
                        parts.append((by_mm, contour_names))
            parts_found += [
                Left(row, by_mm, tuple(contour_names) if len(parts) > 1 else ())
                for by_mm, contour_names in parts
            ]
        return tuple(parts_found)

    def by_name(self, allowances: Iterable[Left]) -> dict[str, float]:
        """Return the allowances, mm by the name of the contour, of changes of operations: the
        inverse of `left`."""
        return {
            name: each.by_mm
            for each in allowances
            for name in each.entities or self.walls[each.operation]
        }


def closed_form(
    inspector: Inspector, verdicts: Sequence[InspectedReport | None], contours: JobContours
) -> dict[str, float]:
    """Return the additional allowance on the wall of each contour, mm by its name, that centres
    the sizes best; {} if none helps.

    `verdicts` are those of the inspector's dimensions, None for those that could not be measured.
    """
    rows = [(k, each) for k, each in enumerate(verdicts) if each is not None]
    short_names = {
        contours.of_path[path]
        for k, each in rows
        if each.verdict != "in"
        for path in paths_of(inspector.dimensions[k])
    }
    heads = sorted({contours.head[name] for name in short_names if name in contours.most_mm})
    head_rows = {name: heads.index(head) for name, head in contours.head.items() if head in heads}
    max_allowances = np.full(len(heads), math.inf)
    for name, index in head_rows.items():
        max_allowances[index] = min(max_allowances[index], contours.most_mm.get(name, math.inf))
    if not heads:
        return {}

    def sizes(allowances: Floats) -> Floats:
        """Return (D, 2) the largest and the least local size of each dimension."""
        by_path = {
            path: float(allowances[head_rows[name]])
            for path, name in enumerate(contours.of_path)
            if name in head_rows
        }
        new_sizes = inspector.sizes(left_mm=by_path)
        return np.array([(new_sizes[k].high_mm, new_sizes[k].low_mm) for k, _ in rows])

    limits = np.array([_limits_mm(each)[::-1] for _, each in rows])
    standards = np.array([_standard_mm(each) for _, each in rows])
    left_mm = np.round(_best_left(sizes, limits, standards, max_allowances), LEFT_DIGITS)
    return (
        {name: float(left_mm[index]) for name, index in head_rows.items()} if left_mm.any() else {}
    )


def _best_left(
    sizes: Callable[[Floats], Floats], limits: Floats, standards: Floats, max_allowances: Floats
) -> Floats:
    """Solve the linear programme at the top for the allowances (C,), mm.

    `sizes` maps (C,) to sizes (D, 2), and `limits` (D, 2) are the upper and the lower ones,
    infinite for none."""
    count, dims = len(max_allowances), len(limits)
    # Unknowns x: t_1 … t_D, then for each contour the allowance as two parts, positive and
    # negative, both 0 or more.
    goal = np.concatenate([-np.ones(dims), np.full(2 * count, PER_MM)])
    unit = np.eye(dims)
    conditions = [
        (np.hstack([-unit, np.zeros((dims, 2 * count))]), np.full(dims, -FAR_ENOUGH)),
        (np.hstack([np.zeros((2 * count, dims)), np.eye(2 * count)]), np.zeros(2 * count)),
        (
            np.hstack([np.zeros((2 * count, dims)), -np.eye(2 * count)]),
            -np.tile(max_allowances, 2),
        ),
    ]
    allowances = np.zeros(count)
    for _ in range(ROUNDS):
        base = sizes(allowances)
        # Slopes are taken to both sides: where a zone is centred, its width grows with a change in
        # either direction, and a single slope would be wrong for one of them.
        steps = STEP_MM * np.eye(count)
        slopes = np.stack(
            [0.5 * (sizes(allowances + dx) - sizes(allowances - dx)) / STEP_MM for dx in steps],
            axis=2,
        )  # (D, 2, C)
        for side, sign in ((0, 1.0), (1, -1.0)):
            # sign·size(a) + u t ≤ sign·limit, with size(a) = here + slopes·(a − left).
            is_finite = np.isfinite(limits[:, side]) & np.isfinite(base[:, side])
            slope = sign * slopes[is_finite, side]
            row = np.hstack([-standards[is_finite, None] * unit[is_finite], -slope, slope])
            bound = sign * (base[is_finite, side] - limits[is_finite, side]) - slope @ allowances
            conditions.append((row, bound))
        rows, bounds = zip(*conditions, strict=True)
        x = minimise(goal, np.vstack(rows), np.hstack(bounds))
        solution = x[dims : dims + count] - x[dims + count :]
        expected = base + slopes @ (solution - allowances)
        allowances = solution
        if np.nanmax(np.abs(sizes(allowances) - expected), initial=0.0) <= SETTLED:
            break
    return allowances


def paths_of(each: Inspected) -> tuple[int, ...]:
    """Return the paths of the drawing that form a dimension."""
    return tuple(dict.fromkeys(feature.path for feature in each.bound.features))


# Trials.


class Bench(Struct, eq=False, dict=True):
    """The test bench for proposals: it posts, simulates and inspects their jobs; equal programs
    are judged once."""

    case: MeetingCase
    progress: Progress
    trials: int = 0
    _known: dict[bytes, MeetingTrial] = field(default_factory=dict)
    _simulated: dict[tuple[bytes, object], Floats] = field(default_factory=dict)
    _first: dict[tuple[str, int | None], InspectedReport] = field(default_factory=dict)

    @cached_property
    def job(self) -> Job:
        """The original job."""
        return self.case.job_of(self.case.tables)

    @cached_property
    def contours(self) -> JobContours:
        """The contours of the original job."""
        return JobContours.of(self.case, self.job)

    def first(self) -> MeetingTrial:
        """Try the original job.

        Raises the errors of posting it, and OptionError for a program with errors or if no
        dimension with limits can be inspected."""
        run = self._posted(JobChanges(), self.case.target)
        if run.report is None or run.failed:
            errors = (each for each in run.findings if each.severity is Severity.ERROR)
            first_error = next((f": {each.message}" for each in errors), "")
            raise OptionError(
                f"the job has errors, so that no dimension can be inspected{first_error}",
                file=self.case.drawing.file,
                mend="" if first_error else "see what camtool post says of it",
            )
        trial = self._judge(run, JobChanges())
        if not trial.verdicts:
            raise OptionError(
                "no dimension with limits can be inspected",
                file=self.case.drawing.file,
                where="tolerances",
                mend="give limits: camtool tolerances new begins a file",
            )
        self._known[_digest(run, self.case.target.machine)] = trial
        return trial

    def try_changes(self, proposal: JobChanges) -> MeetingTrial | None:
        """Post the job with the changes of a proposal, inspect the part, and return the trial;
        None if the job cannot be cut or the program has errors."""
        self.trials += 1
        self.progress.done += 1
        try:
            target = self._target(proposal)
            run = self._posted(proposal, target)
            if run.report is None or run.failed:
                return None
            digest = _digest(run, target.machine)
            if digest not in self._known:
                self._known[digest] = self._judge(run, proposal)
        except CamtoolError:
            return None
        return replace(self._known[digest], proposal=proposal)

    def run_of(self, proposal: JobChanges) -> Run:
        """Return the run of a proposal's job, posted and inspected."""
        return inspect(self._posted(proposal, self._target(proposal)), self.case.tolerances)

    def tables_of(self, proposal: JobChanges) -> Table:
        """Return the tables of the job file with the changes of a proposal."""
        return changed_tables_of(self.case.tables, proposal.changes, proposal.left)

    def _target(self, proposal: JobChanges) -> LoadedTarget:
        return self.case.target.with_settings(proposal.settings)

    def _posted(self, proposal: JobChanges, target: LoadedTarget) -> Run:
        job = self.case.job_of(self.tables_of(proposal))
        return post_drawing(self.case.drawing, job, target, brief=True)

    def _judge(self, run: Run, proposal: JobChanges) -> MeetingTrial:
        """Judge the program of a proposal.

        A size beyond its limit is within it with a probability of at most one half: then the
        simulations for its uncertainty are skipped, and the uncertainty of the original job is
        used."""
        inspector = Inspector(run, self.case.tolerances.dimensions)
        verdicts: list[InspectedReport | None] = list(self._predict_verdicts(inspector))
        is_beyond = any(each is None or each.verdict == "out" for each in verdicts)
        new = any(_key_of(each) not in self._first for each in inspector.dimensions)
        if new or not is_beyond:
            verdicts = [
                each if isinstance(each, InspectedReport) else None
                for each in verdicts_of(inspector, run, self._simulate_once(inspector, run))
            ]
        present = [k for k, each in enumerate(verdicts) if each is not None]
        assert run.report is not None
        trial = MeetingTrial(
            proposal,
            verdicts=tuple(each for each in verdicts if each is not None),
            paths=tuple(paths_of(inspector.dimensions[k]) for k in present),
            missing=len(inspector.left_out) + len(verdicts) - len(present),
            time_s=run.report.time_s,
        )
        if new:
            for one, each in zip(inspector.dimensions, verdicts, strict=True):
                if each is not None:
                    self._first.setdefault(_key_of(one), each)
        allowances = closed_form(inspector, verdicts, self.contours) if trial.short else {}
        if not allowances:
            return trial
        so_far = self.contours.by_name(proposal.left)
        total = {
            name: round(so_far.get(name, 0.0) + by_mm, LEFT_DIGITS)
            for name, by_mm in allowances.items()
        }
        return replace(trial, left=self.contours.left({**so_far, **total}))

    def _simulate_once(self, inspector: Inspector, run: Run) -> Machined:
        """Return `inspector.machined`, but simulate a program on a machine once, whatever the
        uncertainties of its numbers are: a certificate tries seven or eight values of each."""

        def machined(variant: MachineVariant) -> Floats:
            machine = replace(variant.machine, uncertainty=Uncertainty())
            offsets = variant.wider_mm, variant.deeper_mm, variant.thicker_mm, variant.beside_mm
            key = _digest(run, machine), offsets
            if key not in self._simulated:
                self._simulated[key] = inspector.machined(variant)
            return self._simulated[key]

        return machined

    def _predict_verdicts(self, inspector: Inspector) -> Iterator[InspectedReport | None]:
        """Yield each dimension with its sizes, and the verdict that follows if its uncertainty is
        that of the original job.

        None for a dimension that is not cut, or that the original job did not cut."""
        for one, size in zip(inspector.dimensions, inspector.sizes(), strict=True):
            stated = self._first.get(_key_of(one))
            if stated is None or not math.isfinite(size.low_mm + size.high_mm):
                yield None
                continue
            predicted = replace(
                stated, fit_mm=size.fit_mm, low_mm=size.low_mm, high_mm=size.high_mm
            )
            distance = margin(predicted)
            verdict = "in" if distance >= GUARD else "out" if distance < 0.0 else "undecided"
            yield replace(predicted, verdict=verdict)

    def certificate(self, best: MeetingTrial) -> Certificate:
        """Return the explanation why the best trial does not hold, and which better numbers of the
        machine would make it hold."""
        binding = best.binding
        if binding is None:
            return Certificate(None)
        unknown = tuple(
            each.input
            for each in binding.contributions
            if each.um is None and each.at_most_um is None
        )
        if unknown:
            return Certificate(binding, unknown)
        machine = self._target(best.proposal).machine
        mechanics, standards = list(_mechanics(machine)), list(_standards(machine, binding))
        needs = []
        for each in (*mechanics, *standards[:MAX_INPUTS_ASKED]):
            needed = self._needed_value(each, best)
            if needed is not None:
                needs.append(Need(each.key, each.now, needed))

        exact = [each.setting(each.best) for each in (*mechanics, *standards)]
        paths = best.paths[best.verdicts.index(binding)]
        exactly = bool(needs) or self._holds(best, exact)
        return Certificate(binding, (), tuple(needs), exactly, self.contours.together(paths))

    def _needed_value(self, number: _Number, best: MeetingTrial) -> float | None:
        """Return, by bisection, the value of a number of the machine nearest to its present one
        with which all dimensions hold; None if there is none."""

        def holds(value: float) -> bool:
            return self._holds(best, [number.setting(value)])

        if not holds(number.best):
            return None
        holding, failing = 1.0, 0.0  # shares of the way from its present to its best value
        for _ in range(BISECTIONS):
            middle = 0.5 * (holding + failing)
            holding, failing = (middle, failing) if holds(number.at(middle)) else (holding, middle)
        rounded = _rounded(number.at(holding), number.best)
        return rounded if holds(rounded) else number.at(holding)

    def _holds(self, best: MeetingTrial, settings: Sequence[str]) -> bool:
        """Return True if the proposal holds on a machine with these settings, allowances being
        adapted to it."""
        proposal = best.proposal + JobChanges(settings=tuple(settings))
        trial = self.try_changes(proposal)
        for _ in range(REFINED):
            if trial is None or trial.holds or not trial.left:
                break
            trial = self.try_changes(replace(proposal, left=trial.left))
        return trial is not None and trial.holds


def _key_of(each: Inspected) -> tuple[str, int | None]:
    """Return a key that identifies a dimension in every program: its source and its copy."""
    return each.bound.dimension.source, each.copy


def _digest(run: Run, machine: Machine) -> bytes:
    """Return a digest of everything that determines the result of a program: its bytes, its
    machine and the planned moves."""
    assert run.program is not None
    assert run.wanted is not None
    digest = hashlib.sha256(run.program.data)
    digest.update(msgspec.json.encode(machine))
    for column in (run.wanted.kind, run.wanted.end, run.wanted.centre):
        digest.update(np.ascontiguousarray(column).tobytes())
    return digest.digest()


# Numbers of a machine that may have to be better.


class _Number(Struct, frozen=True):
    """A number of a machine that could be better: its key, its present and its best value."""

    key: str
    now: float
    best: float
    cells: tuple[tuple[float, ...], ...] = ()
    """Of a map of backlash, whose mean it is: each cell is as much nearer to the best as that."""

    def setting(self, value: float) -> str:
        """Return the setting, in the form of `--set`, that gives the number this value."""
        if not self.cells:
            return f"{self.key}={value!r}"
        share = (value - self.best) / (self.now - self.best)
        rows = [
            [max(0.0, self.best + share * (each - self.best)) for each in row]
            for row in self.cells
        ]
        return f"{self.key}={rows}"

    def at(self, share: float) -> float:
        """Return the value at a share of the way from the present value, 0, to the best one, 1."""
        return self.now + share * (self.best - self.now)


def _mechanics(machine: Machine) -> Iterator[_Number]:
    """Yield backlash, scale and squareness, each unless it is at its best.

    Backlash is at its best where it equals the compensation that the controller adds at reversals
    (`camtool.inspection.uncertainty`)."""
    for index, name in enumerate("xy"):
        axis, cells = (machine.axes.x, machine.axes.y)[index], machine.play_map.used[index]
        ratio = axis.real_step_mm / axis.coded_step_mm
        plays = [play for row in cells.play_mm for play in row] if cells else [axis.backlash_mm]
        present, best = sum(plays) / len(plays), axis.compensation_mm * ratio
        if abs(present - best) > CERTAIN:
            key = f"play_map.{name}.play_mm" if cells else f"axes.{name}.backlash_mm"
            yield _Number(key, present, best, cells.play_mm if cells else ())
        if abs(ratio - 1.0) > CERTAIN:
            yield _Number(f"axes.{name}.real_step_mm", axis.real_step_mm, axis.coded_step_mm)
    lean = machine.mechanics.squareness_rad
    if abs(lean) > CERTAIN:
        yield _Number("mechanics.squareness_rad", lean, 0.0)


def _standards(machine: Machine, binding: InspectedReport) -> Iterator[_Number]:
    """Yield the standard uncertainties of the machine that contribute to that of a dimension, the
    largest first."""
    for each in binding.contributions:
        scatter = each.input.endswith(REPEATABILITY)
        key = f"{'axes' if scatter else 'uncertainty'}.{each.input}"
        present = _value_at(machine, key)
        if isinstance(present, float) and present > 0.0:
            yield _Number(key, present, 0.0)


REPEATABILITY = "repeatability_mm"
"""Ending of the key of the input whose standard uncertainty stands in the table of its axis."""


def _value_at(record: object, key: str) -> object:
    """Return the value of a record at a key such as "axes.x.backlash_mm"."""
    for name in key.split("."):
        record = getattr(record, name)
    return record


def _rounded(value: float, best: float) -> float:
    """Return the value rounded to few digits, towards the best one."""
    difference = abs(value - best)
    if difference == 0.0:
        return value
    unit = 10.0 ** (math.floor(math.log10(difference)) + 1 - NEEDED_DIGITS)
    return best + math.copysign(math.floor(difference / unit) * unit, value - best)


# The result as text, as JSON, and as a job file.

MAX_NAMED = 4


def to_text(meeting: Meeting) -> str:
    """Format the dimensions before and after, the changes and the certificate as readable text,
    not JSON."""
    before = {each.name: each for each in meeting.before.verdicts}
    rows = [("", "limits, mm", "as it is", "", "then", "")]
    for each in meeting.after.verdicts:
        earlier = before.get(each.name)
        earlier_words = (
            ("not cut", "") if earlier is None else (_extreme(earlier), earlier.verdict)
        )
        rows.append((each.name, _limits(each), *earlier_words, _extreme(each), each.verdict))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [
        "  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
    lines_of_changes = list(change_lines(meeting.after.proposal))
    lines += ["", *(f"change: {line}" for line in lines_of_changes or ["none"])]
    took, takes = meeting.before.time_s, meeting.after.time_s
    lines.append(f"time: {took:.1f} s, then {takes:.1f} s")
    suffix = "" if meeting.all else "; --most allows no more"
    plural = "" if meeting.trials == 1 else "s"
    lines.append(f"tried: {meeting.trials} program{plural}{suffix}")
    if meeting.certificate is not None:
        lines += ["", *_certificate_lines(meeting)]
    return "\n".join(lines)


def _extreme(each: InspectedReport) -> str:
    """Format the predicted size, from the least to the largest."""
    low, high = f"{each.low_mm:.4f}", f"{each.high_mm:.4f}"
    return low if low == high else f"{low} … {high}"


def _limits(each: InspectedReport) -> str:
    lower = "" if each.lower_mm is None else f"{each.lower_mm:.7g} … "
    return f"{lower}{each.upper_mm:.7g}"


def change_lines(proposal: JobChanges) -> Iterator[str]:
    """Yield a line of text for each change."""
    for each in proposal.left:
        if not each.by_mm:
            continue
        direction = "more left" if each.by_mm > 0.0 else "less left"
        names = ", ".join(each.entities[:MAX_NAMED])
        if len(each.entities) > MAX_NAMED:
            names += f" and {len(each.entities) - MAX_NAMED} more"
        walls = f"the walls of {names}" if names else "all its walls"
        depth = f"{abs(each.by_mm):.{LEFT_DIGITS}f} mm {direction}"
        yield f"operation {each.operation + 1}: {depth} on {walls}"
    for change in proposal.changes:
        whose = "job" if change.operation is None else f"operation {change.operation + 1}"
        value = str(change.value).lower() if isinstance(change.value, bool) else change.value
        earlier_words = f", was {change.instead}" if change.instead else ""
        yield f"{whose}: {change.key} = {value}{earlier_words}"
    for setting in proposal.settings:
        yield f"machine: --set {setting}"


def _certificate_lines(meeting: Meeting) -> Iterator[str]:
    """Yield the lines of text of the certificate."""
    certificate = meeting.certificate
    assert certificate is not None
    if certificate.binding is None:
        yield "a dimension cannot be inspected: the findings say which, and why"
        return
    each = certificate.binding
    yield f"{each.name} decides: {_extreme(each)} mm, and must be {_limits(each)} mm"
    if certificate.unknown:
        yield (
            "nothing can make it hold while [uncertainty] of the machine file does not say "
            f"{', '.join(certificate.unknown)}"
        )
        return
    if each.unknown and each.unknown_um:
        unsaid = ", ".join(each.unknown)
        yield f"{each.unknown_um:.3g} µm of that is what [uncertainty] does not say: {unsaid}"
    for need in certificate.needs:
        better = "at most" if abs(need.needed) < abs(need.now) else "at least"
        unit = need.key.rpartition("_")[2]
        yield f"it would take {need.key} {better} {need.needed:.9g} (it is {need.now:.6g}), {unit}"
    for name in certificate.together:
        yield (
            f"several contours are named {name}, and have one allowance: with names of their own "
            "(an id, or an element each) each would have its own"
        )
    if not certificate.needs and certificate.exact:
        yield "no single number of the machine would do: all of them must be better"
    if not certificate.needs and not certificate.exact:
        yield (
            "not even a machine without play, errors of scale and these uncertainties would do: "
            "the tool, its controller or the limits must be others"
        )


def to_data(meeting: Meeting) -> dict[str, Any]:
    """Return the result as data for JSON: mm and s, standard uncertainties in µm."""
    before = {each.name: each for each in meeting.before.verdicts}
    certificate, proposal = meeting.certificate, meeting.after.proposal
    return {
        "holds": meeting.holds,
        "changes": [
            {"operation": row, "key": each.key, "value": each.value, "was": each.instead}
            for each in proposal.changes
            for row in [None if each.operation is None else each.operation + 1]
        ],
        "allowances": [
            {"operation": each.operation + 1, "entities": each.entities, "by_mm": each.by_mm}
            for each in proposal.left
            if each.by_mm
        ],
        "settings": list(proposal.settings),
        "dimensions": [
            {
                "name": each.name,
                "lower_mm": each.lower_mm,
                "upper_mm": each.upper_mm,
                "before": _verdict_data(before.get(each.name)),
                "after": _verdict_data(each),
            }
            for each in meeting.after.verdicts
        ],
        "not_inspected": meeting.after.missing,
        "time_s": {"before": meeting.before.time_s, "after": meeting.after.time_s},
        "trials": meeting.trials,
        "all_tried": meeting.all,
        "certificate": None
        if certificate is None
        else {
            "binding": None if certificate.binding is None else certificate.binding.name,
            "unknown": certificate.unknown,
            "needs": [
                {"key": each.key, "now": each.now, "needed": each.needed}
                for each in certificate.needs
            ],
            "exact_machine": certificate.exact,
            "together": certificate.together,
        },
    }


def _verdict_data(each: InspectedReport | None) -> dict[str, Any] | None:
    if each is None:
        return None
    return {
        "low_mm": each.low_mm,
        "high_mm": each.high_mm,
        "standard_um": each.standard_um,
        "probability": each.probability,
        "verdict": each.verdict,
    }


ALL_HOLD, NOT_ALL_HOLD = "Every dimension of ", "NOT ALL dimensions of "
"""The comment at the top of a proposed job file begins with one of these."""


def is_proposal(data: bytes) -> bool:
    """Return True if this is the content of a job file that `meet` has written."""
    return data.startswith((f"# {ALL_HOLD}".encode(), f"# {NOT_ALL_HOLD}".encode()))


def _head(case: MeetingCase, best: MeetingTrial) -> Iterator[str]:
    """Yield the lines of the comment at the top of the proposed job file."""
    name = one_line(PurePath(case.drawing.file).name)
    target = case.target.machine.target.name
    count, short_count = len(best.verdicts) + best.missing, len(best.short) + best.missing
    if best.holds:
        yield f"{ALL_HOLD}{name} that has limits holds on {target} ({count})."
    else:
        yield f"{NOT_ALL_HOLD}{name} hold on {target}: {short_count} of {count} do not."
    for line in change_lines(best.proposal):
        yield one_line(line)
