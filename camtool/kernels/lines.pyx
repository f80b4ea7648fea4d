"""Judging stepped straight lines: long ones in closed form, short ones step by step.

A line takes a ≤ N steps of its minor axis in N events, s_k = ⌊(2ak + phase) / 2N⌋ after k of them:
phase N − 1 rounds to the nearest (halves down), phase 0 takes the floor. While no slide starts to
move, the positions of both slides are linear in k and s_k, and so is their distance from a
straight move: d_k = A k + B s_k + C. Such a part of a line is a piece; play makes at most three of
them. Sums, extremes and counts of d over a piece come from `camtool.kernels.floors`.

Some events are still visited one by one, and replace what the closed form has for them:

    caps        where the nearest point of the move is one of its ends, or might be
    crossings   where another move might be nearer

A line is stepped as a whole where that is as quick, and where the closed form does not hold: where
Z has the most events, where the row is an arc or is compared with one, goes round a full circle,
or runs along other moves.
"""

from __future__ import annotations

from libc cimport math
from camtool.kernels.floors cimport (
    SawSums, count_up_to, find_most, most_events, negative_sum, saw_sums, square_sum,
)
from camtool.kernels.judging cimport (
    BEFORE_FIRST, BESIDE, BINS, BLOCK, CIRCLE, COMMANDED_X, COMMANDED_Y, CX, CY, Curves, END_X,
    END_Y, FIRST, HALF_LONG, HALF_WIDE, HALF_X, HALF_Y, HIGH_X, HIGH_Y, IN_RUN, INNER_MAX,
    INNER_SQUARES, Judge, KNOWN, LAG_MAX, LAG_SQUARES, LAST, LAST_ERROR, LAST_IS_WRITTEN, LAST_X,
    LAST_Y, LOW_X, LOW_Y, MIDDLE_X, MIDDLE_Y, OWN, PEAK, PEAK_X, PEAK_Y, RADIUS, ROW, SAMPLES,
    SHIFT, STRIDE, TOTAL_MAX, TOTAL_SQUARES, TOTAL_SUM, TOTAL_X, TOTAL_Y, WAY_X, WAY_Y, are_same,
    end_row, end_run, is_searched, judge_block, move_near, nearest_errors, node_near, set_errors,
    squareness,
)
from camtool.kernels.types cimport Int

from typing import Any, NamedTuple

import numpy as np

from camtool.arrays import Floats, Ints
from camtool.kernels import move_tree
from camtool.kernels.judging import Sums, Task

# Moves of a leaf, and the columns of its rows, of `camtool.kernels.move_tree`.
cdef Int LEAF = move_tree.LEAF
cdef Int FIRST_BELOW = move_tree.FIRST
cdef Int LAST_BELOW = move_tree.LAST

cpdef enum:
    # Lines of fewer events are stepped, which is as quick.
    MIN_EVENTS = 1024
    # So are lines of whose path one of fewer points than this is kept for pictures.
    MIN_STRIDE = 64
    # A line with more caps and crossings, or more events in them, is stepped.
    MAX_WINDOWS = 512
    MAX_VISITED = 4096
    # Play makes at most three pieces of a line.
    MAX_PIECES = 3
    # Columns of the pieces whose errors are counted when a percentile is asked for: 0 for
    # interpolation, 1 for the total error; events; the line's minor steps, phase and N; A, B, C;
    # and by how much the errors are larger than |d|.
    WHICH = 0, COUNT, SIZE, PHASE, EVENTS, ALONG, ACROSS, LEVEL, BEYOND, PIECE_COLUMNS

# Moves whose distances differ by no more than this are equally near (`camtool.kernels.judging`).
cdef double TIE_MM = 1e-9

# A point counts as beside a move only where it is by this much more than rounding.
cdef double MARGIN_MM = 1e-9


class StepLines(NamedTuple):
    """B lines in order, each from where the one before ended: row (B,), start and travel (B, 3) in
    steps, none without a step; whether the minor axes are rounded to the nearest step; step_mm
    (3,); axes (3, 5) as in `camtool.kernels.play`; the tangent by which Y leans towards X."""

    row: Ints
    start: Ints
    travel: Ints
    rounds: bool
    step_mm: Floats
    axes: Floats
    lean: float


class Followed(NamedTuple):
    """Results of `follow_lines`: slides (B, 3) mm before each line; added (B, 3) mm by compensation
    from its first step on; of each row steps and reversals (R, 3) and events (R,)."""

    slides: Floats
    added: Floats
    steps: Ints
    reversals: Ints
    events: Ints


def follow_lines(lines: StepLines, states: Floats, low: int, followed: Followed) -> None:
    """Follow the slides from line to line; `states` (3, 6) as in `play_fill`, changed in place;
    `low` is the first row."""
    cdef Int k, axis, sense, row, events, first_row
    cdef Int[::1] row_of, events_of
    cdef Int[:, ::1] start, travel, steps, turns
    cdef double[::1] step_mm
    cdef double[:, ::1] axes, state, slides, added
    cdef double motor
    row_of, start, travel, step_mm, axes = lines.row, lines.start, lines.travel, lines.step_mm, lines.axes
    slides, added, steps, turns, events_of = followed
    state, first_row = states, low
    with nogil:
        for k in range(len(row_of)):
            row, events = row_of[k] - first_row, 0
            for axis in range(3):
                slides[k, axis] = state[axis, 3]
                if travel[k, axis] != 0:
                    sense = 1 if travel[k, axis] > 0 else -1
                    if float(sense) != state[axis, 1]:
                        state[axis, 1] = sense
                        state[axis, 2] += sense * axes[axis, 3]
                        turns[row, axis] += 1
                    state[axis, 0] = float(start[k, axis] + travel[k, axis]) * step_mm[axis]
                    motor = (state[axis, 0] + state[axis, 2]) * axes[axis, 0]
                    if sense > 0:
                        state[axis, 3] = max(state[axis, 3], motor + axes[axis, 1])
                    else:
                        state[axis, 3] = min(state[axis, 3], motor + axes[axis, 2])
                    steps[row, axis] += sense * travel[k, axis]
                    events = max(events, sense * travel[k, axis])
                added[k, axis] = state[axis, 2]
            events_of[row] += events


# One line.


cdef struct Drive:
    # An axis: where it starts, its steps and their sense; from which step on the slide moves, where
    # it stands before that; the numbers of its motor.
    Int start, size, sense, first
    double standing_mm, step, added, scale, flank


cdef struct Line:
    # Events, the steps of the minor axis of X and Y, and the phase; which of X and Y is the major.
    Int row, events, size, phase, major
    double lean
    Drive[2] drives


cdef struct Form:
    # A k + B s_k + C.
    long double along, across, level


cdef struct Piece:
    # Events low … high − 1, and the positions of both slides.
    Int low, high
    Form x, y


cdef struct Straight:
    # A straight move: its start, its way, that way's length, and 1 / length².
    double ax, ay, dx, dy, length, over


cdef struct Found:
    # The largest error, and after how many events.
    double size
    Int at


cdef inline Int _steps(Line* line, Int axis, Int k) noexcept nogil:
    """Return the steps of an axis after k events."""
    if axis == line.major:
        return k
    return (2 * line.drives[axis].size * k + line.phase) // (2 * line.events)


cdef inline double _position(Drive* drive, Int steps) noexcept nogil:
    return float(drive.start + drive.sense * steps) * drive.step


cdef inline double _slide(Drive* drive, Int steps) noexcept nogil:
    if steps < drive.first:
        return drive.standing_mm
    return (_position(drive, steps) + drive.added) * drive.scale + drive.flank


cdef inline void _slides_at(Line* line, Int k, double* x, double* y) noexcept nogil:
    """Set x and y to the position of the slides after k events."""
    y[0] = _slide(&line.drives[1], _steps(line, 1, k))
    x[0] = _slide(&line.drives[0], _steps(line, 0, k))
    if line.lean != 0.0:
        x[0] += y[0] * line.lean


cdef inline void _commanded_at(Line* line, Int k, double* x, double* y) noexcept nogil:
    x[0] = _position(&line.drives[0], _steps(line, 0, k))
    y[0] = _position(&line.drives[1], _steps(line, 1, k))


cdef Int _first_moving(Drive* drive) noexcept nogil:
    """Return the first step from which on the motor moves the slide: beyond the last step where it
    never does, 0 where the slide is already in contact."""
    cdef Int first
    cdef double guess
    if drive.size == 0:
        return 1
    if (_position(drive, 0) + drive.added) * drive.scale + drive.flank == drive.standing_mm:
        return 0
    guess = ((drive.standing_mm - drive.flank) / drive.scale - drive.added) / drive.step
    guess = (guess - float(drive.start)) * drive.sense
    first = max(<Int>min(max(math.floor(guess) - 1.0, 1.0), float(drive.size)), 1)
    while first <= drive.size and not _takes_along(drive, first):
        first += 1
    return first


cdef inline bint _takes_along(Drive* drive, Int steps) noexcept nogil:
    cdef double place
    place = (_position(drive, steps) + drive.added) * drive.scale + drive.flank
    return place >= drive.standing_mm if drive.sense > 0 else place <= drive.standing_mm


cdef class LineJudge:
    """A judge of lines: the judge of samples, the lines and their slides, and scratch
    buffers: crossings; windows of visited events, and what was found there; pieces to be
    counted."""

    cdef Judge judge
    cdef Int[::1] row
    cdef Int[:, ::1] start, travel
    cdef double[:, ::1] axes, slides, added, pieces
    cdef double[::1] step_mm
    cdef bint rounds
    cdef double lean
    cdef Int piece_count, crossing_count, window_count, visited_count
    cdef Int[MAX_WINDOWS] crossing_low, crossing_high, crossing_move
    cdef Int[MAX_WINDOWS] window_low, window_high, window_first
    cdef Int[MAX_VISITED] visited, visited_by
    cdef double[MAX_VISITED] visited_error, visited_x, visited_y

    def __init__(self, lines: StepLines, followed: Followed, task: Task, sums: Sums) -> None:
        self.judge = Judge(task, sums)
        self.row, self.start, self.travel, self.rounds = lines.row, lines.start, lines.travel, lines.rounds
        self.step_mm, self.axes, self.lean = lines.step_mm, lines.axes, lines.lean
        self.slides, self.added = followed.slides, followed.added
        self.pieces = np.empty((2 * MAX_PIECES * len(lines.row), PIECE_COLUMNS))
        self.piece_count = 0


def judge_lines(lines: StepLines, followed: Followed, task: Task, sums: Sums) -> Floats:
    """Judge lines, whose rows all belong to the task, and end the trace of the last one. Return
    the pieces (P, 9) of the lines; their errors are not in any histogram yet."""
    cdef Int k
    cdef LineJudge all_
    all_ = LineJudge(lines, followed, task, sums)
    with nogil:
        for k in range(len(all_.row)):
            _judge_line(k, all_)
        end_row(all_.judge.pen, all_.judge.trace)
    return np.asarray(all_.pieces)[: all_.piece_count].copy()


cdef void _judge_line(Int k, LineJudge all_) noexcept nogil:
    cdef Line line
    cdef Int axis
    line.row, line.lean, line.major, line.events = all_.row[k], all_.lean, -1, 0
    for axis in range(3):
        line.events = max(line.events, abs(all_.travel[k, axis]))
    for axis in range(2):
        _set_drive(&line.drives[axis], k, axis, all_)
        if line.major < 0 and line.drives[axis].size == line.events:
            line.major = axis
    line.phase = line.events - 1 if all_.rounds else 0
    line.size = line.drives[1 - line.major].size if line.major >= 0 else 0
    if not _is_judged_at_once(&line, all_):
        _step(&line, all_)


cdef void _set_drive(Drive* drive, Int k, Int axis, LineJudge all_) noexcept nogil:
    cdef Int travel
    travel = all_.travel[k, axis]
    drive.start, drive.size, drive.sense = all_.start[k, axis], abs(travel), 1 if travel >= 0 else -1
    drive.standing_mm, drive.step = all_.slides[k, axis], all_.step_mm[axis]
    drive.added, drive.scale = all_.added[k, axis], all_.axes[axis, 0]
    drive.flank = all_.axes[axis, 1] if travel >= 0 else all_.axes[axis, 2]
    drive.first = _first_moving(drive)


# A line step by step.


cdef void _fill(
    Drive* drive, Int events, Int phase, Int begin, double[::1] commanded, double[::1] slide
) noexcept nogil:
    """Fill the positions after the events begin + 1, begin + 2, …"""
    cdef Int k, steps, counter, more, all_
    cdef double position
    more, all_ = 2 * drive.size, 2 * events
    steps = (more * begin + phase) // all_
    counter = more * begin + phase - all_ * steps
    for k in range(len(commanded)):
        counter += more
        if counter >= all_:
            counter -= all_
            steps += 1
        position = _position(drive, steps)
        commanded[k] = position
        slide[k] = drive.standing_mm
        if steps >= drive.first:
            slide[k] = (position + drive.added) * drive.scale + drive.flank


cdef void _step(Line* line, LineJudge all_) noexcept nogil:
    """Judge all events of a line one by one."""
    cdef Int begin, count, axis, k, phase
    cdef double[::1] x, y, slide_x, slide_y
    begin = 0
    while begin < line.events:
        count = min(line.events - begin, BLOCK)
        x, y = all_.judge.x[:count], all_.judge.y[:count]
        slide_x, slide_y = all_.judge.slide_x[:count], all_.judge.slide_y[:count]
        phase = line.phase
        _fill(&line.drives[0], line.events, phase, begin, x, slide_x)
        _fill(&line.drives[1], line.events, phase, begin, y, slide_y)
        if line.lean != 0.0:
            for k in range(count):
                slide_x[k] += slide_y[k] * line.lean
        judge_block(line.row, count, all_.judge)
        begin += count


# A line in closed form.


cdef bint _is_judged_at_once(Line* line, LineJudge all_) noexcept nogil:
    """Judge a line in closed form; return False, with nothing judged, where it has to be
    stepped."""
    cdef Int row, own, followed_move, pieces, stride
    cdef Piece[MAX_PIECES] slides
    cdef Piece commanded
    cdef Straight move, nominal
    row = line.row - all_.judge.low
    own, followed_move = all_.judge.rows[row, OWN], all_.judge.rows[row, BESIDE]
    stride = <Int>all_.judge.pen[STRIDE]
    if own < 0 and line.lean == 0.0:
        _judge_still(line, NULL, 0, all_)
        _trace_air(line, all_)
        return True
    if line.events < MIN_EVENTS or line.events >= most_events() or line.major < 0:
        return False
    if own < 0:
        pieces = _set_pieces(line, &slides[0])
        _judge_still(line, &slides[0], pieces, all_)
        _trace_air(line, all_)
        return True
    if (0 < stride < MIN_STRIDE) or all_.judge.rows[row, CIRCLE] >= 0 or followed_move < 0:
        return False
    if not _set_straight(&move, all_.judge.own, own):
        return False
    if not _set_straight(&nominal, all_.judge.search.curves, followed_move):
        return False
    if not is_searched(
        followed_move, all_.judge.rows[row, FIRST], all_.judge.rows[row, LAST],
        all_.judge.window[row, 0], all_.judge.window[row, 1], all_.judge.search.heights,
    ):
        return False
    pieces = _set_pieces(line, &slides[0])
    if not _visit_wanted(line, &nominal, &slides[0], pieces, row, all_):
        return False
    _judge_total(line, &nominal, &slides[0], pieces, row, all_)
    # The commanded path is one piece, of an axis that starts at once and without play.
    _set_commanded(line, &commanded)
    _judge_inner(line, &move, &commanded, row, all_)
    _judge_lag(line, &slides[0], pieces, row, all_)
    _judge_still(line, &slides[0], pieces, all_)
    return True


cdef bint _set_straight(Straight* move, Curves curves, Int k) noexcept nogil:
    """Set a straight move; return False for an arc and for a move without length."""
    if curves.arc[k] >= 0:
        return False
    move.ax, move.ay = curves.start[k, 0], curves.start[k, 1]
    move.dx, move.dy = curves.end[k, 0] - move.ax, curves.end[k, 1] - move.ay
    square = move.dx * move.dx + move.dy * move.dy
    if square <= 0.0:
        return False
    move.length, move.over = math.sqrt(square), 1.0 / square
    return True


cdef inline double _error(Straight* move, double x, double y) noexcept nogil:
    """Return the error of a point as `set_errors` does, to the last bit."""
    cdef double px, py, t, off_x, off_y, distance
    px, py = x - move.ax, y - move.ay
    t = (px * move.dx + py * move.dy) * move.over
    t = min(max(t, 0.0), 1.0)
    off_x, off_y = px - t * move.dx, py - t * move.dy
    distance = math.sqrt(off_x * off_x + off_y * off_y)
    return math.copysign(distance, move.dx * py - move.dy * px)


cdef void _set_forms(Line* line, Piece* piece, bint* moving) noexcept nogil:
    """Set the positions of the slides as linear forms; slides that do not move are constant."""
    cdef Int axis
    cdef Drive* drive
    cdef Form[2] forms
    for axis in range(2):
        drive = &line.drives[axis]
        forms[axis].along, forms[axis].across, forms[axis].level = 0.0, 0.0, drive.standing_mm
        if moving[axis]:
            step = <long double>drive.step * drive.scale * drive.sense
            forms[axis].level = (
                (<long double>drive.start * drive.step + drive.added) * drive.scale + drive.flank
            )
            if axis == line.major:
                forms[axis].along = step
            else:
                forms[axis].across = step
    forms[0].along += forms[1].along * line.lean
    forms[0].across += forms[1].across * line.lean
    forms[0].level += forms[1].level * line.lean
    piece.x, piece.y = forms[0], forms[1]


cdef Int _set_pieces(Line* line, Piece* pieces) noexcept nogil:
    """Set the pieces of a line, and return how many there are."""
    cdef Int minor, major_from, minor_from, count, low, high, k
    cdef Int[4] bounds
    cdef bint[2] moving
    minor = 1 - line.major
    major_from = max(min(line.drives[line.major].first, line.events + 1), 1)
    minor_from, k = line.events + 1, line.drives[minor].first
    if k <= line.size:
        # The first event after which it has made so many steps.
        minor_from = (2 * line.events * k - line.phase + 2 * line.size - 1) // (2 * line.size)
        minor_from = max(min(minor_from, line.events + 1), 1)
    bounds[0], bounds[3] = 1, line.events + 1
    bounds[1], bounds[2] = min(major_from, minor_from), max(major_from, minor_from)
    count = 0
    for k in range(3):
        low, high = bounds[k], bounds[k + 1]
        if low < high:
            pieces[count].low, pieces[count].high = low, high
            moving[line.major], moving[minor] = low >= major_from, low >= minor_from
            _set_forms(line, &pieces[count], &moving[0])
            count += 1
    return count


cdef void _set_commanded(Line* line, Piece* piece) noexcept nogil:
    cdef Int minor
    cdef Drive* major_drive
    cdef Drive* minor_drive
    cdef Form major_form, minor_form
    minor = 1 - line.major
    major_drive, minor_drive = &line.drives[line.major], &line.drives[minor]
    piece.low, piece.high = 1, line.events + 1
    major_form.along = <long double>major_drive.step * major_drive.sense
    major_form.across = 0.0
    major_form.level = <long double>major_drive.start * major_drive.step
    minor_form.along = 0.0
    minor_form.across = <long double>minor_drive.step * minor_drive.sense
    minor_form.level = <long double>minor_drive.start * minor_drive.step
    piece.x = major_form if line.major == 0 else minor_form
    piece.y = minor_form if line.major == 0 else major_form


cdef Form _across_move(Piece* piece, Straight* move) noexcept nogil:
    """Return the signed distance from the infinite line of a move, positive on its left, as a
    linear form."""
    cdef Form form
    form.along = (move.dx * piece.y.along - move.dy * piece.x.along) / move.length
    form.across = (move.dx * piece.y.across - move.dy * piece.x.across) / move.length
    form.level = (
        move.dx * (piece.y.level - move.ay) - move.dy * (piece.x.level - move.ax)
    ) / move.length
    return form


cdef Form _along_move(Piece* piece, Straight* move) noexcept nogil:
    """Return the position along a move, mm from its start, as a linear form."""
    cdef Form form
    form.along = (move.dx * piece.x.along + move.dy * piece.y.along) / move.length
    form.across = (move.dx * piece.x.across + move.dy * piece.y.across) / move.length
    form.level = (
        move.dx * (piece.x.level - move.ax) + move.dy * (piece.y.level - move.ay)
    ) / move.length
    return form


cdef inline long double _value(Line* line, Form* form, Int k) noexcept nogil:
    return form.along * k + form.across * _steps(line, 1 - line.major, k) + form.level


cdef void _set_range(
    Line* line, Piece* piece, Form* form, double low, double high, Int* first, Int* end
) noexcept nogil:
    """Set the range of events of a piece after which a form may lie within low … high: s_k differs
    from a k / N by less than 1."""
    cdef double slope, reach, one, other, level
    slope = <double>(
        form.along + form.across * <long double>line.size / <long double>line.events
    )
    reach, level = math.fabs(<double>form.across), <double>form.level
    low, high = low - reach - level, high + reach - level
    first[0], end[0] = piece.low, piece.high
    if math.fabs(slope) * line.events <= MARGIN_MM:
        if low > MARGIN_MM or high < -MARGIN_MM:
            end[0] = piece.low
        return
    one, other = low / slope, high / slope
    if slope < 0.0:
        one, other = other, one
    if not (low <= high and other >= piece.low and one <= piece.high):
        end[0] = piece.low
        return
    if one > piece.low:
        first[0] = <Int>one
        first[0] += 1 if <double>first[0] < one else 0
    if other < piece.high:
        end[0] = max(first[0], min(<Int>other + 1, piece.high))


cdef void _set_core(
    Line* line, Piece* piece, Straight* move, Int* first, Int* end
) noexcept nogil:
    """Set the range of events of a piece after which the nearest point of the infinite line
    certainly lies on the move; the other events are its caps."""
    cdef Form form
    cdef double reach
    form = _along_move(piece, move)
    reach = 2.0 * math.fabs(<double>form.across) + MARGIN_MM
    _set_range(line, piece, &form, reach, move.length - reach, first, end)


cdef Found _largest(
    Line* line, Form* form, Int low, Int high
) noexcept nogil:
    """Return the event of low … high − 1 at which a form is farthest from 0, and that distance."""
    cdef Found peak
    cdef Int begin, at
    cdef long double base, greatest
    begin = 2 * line.size * low + line.phase
    base = form.level + form.along * low + form.across * (begin // (2 * line.events))
    begin = begin % (2 * line.events)
    at = find_most(
        high - low, form.along, form.across, 2 * line.size, begin, 2 * line.events, &greatest
    )
    peak.size, peak.at = <double>(greatest + base), low + at
    at = find_most(
        high - low, -form.along, -form.across, 2 * line.size, begin, 2 * line.events, &greatest
    )
    if <double>(greatest - base) > peak.size:
        peak.size, peak.at = <double>(greatest - base), low + at
    return peak


# Windows of events that are visited.


cdef bint _add_cap(Int low, Int high, LineJudge all_) noexcept nogil:
    if low >= high:
        return True
    if all_.window_count == MAX_WINDOWS:
        return False
    all_.window_low[all_.window_count], all_.window_high[all_.window_count] = low, high
    all_.window_count += 1
    return all_.visited_count + high - low <= MAX_VISITED


cdef bint _visit_wanted(
    Line* line, Straight* nominal, Piece* pieces, Int count, Int row, LineJudge all_
) noexcept nogil:
    """Visit the events of caps and crossings, with their errors against the nearest moves; return
    False where these are too many."""
    cdef Int k, first, end, group_low, top
    cdef double far
    cdef Form form
    cdef Found peak
    cdef Int[MAX_PIECES] cores, ends
    far = 0.0
    for k in range(count):
        _set_core(line, &pieces[k], nominal, &cores[k], &ends[k])
        if cores[k] < ends[k]:
            form = _across_move(&pieces[k], nominal)
            peak = _largest(line, &form, cores[k], ends[k])
            far = max(far, peak.size)
    if not _list_crossings(line, nominal, pieces, &cores[0], &ends[0], count, far, row, all_):
        return False
    all_.window_count, all_.visited_count, group_low = 0, 0, 0
    for k in range(count):
        first, end = cores[k], ends[k]
        if first >= end:
            first = end = pieces[k].low
        if not _visit_cap(line, pieces[k].low, first, row, all_):
            return False
        while group_low < all_.crossing_count and all_.crossing_low[group_low] < end:
            top = _end_of_group(group_low, all_)
            if not _visit_group(line, nominal, group_low, top, all_):
                return False
            group_low = top
        if not _visit_cap(line, end, pieces[k].high, row, all_):
            return False
    return 3 * all_.visited_count < line.events


cdef bint _visit_cap(Line* line, Int low, Int high, Int row, LineJudge all_) noexcept nogil:
    """Visit the events low:high one by one, and search the nearest move for each; return False
    where they are too many."""
    cdef Int begin, count, k
    cdef double[::1] x, y, errors
    cdef double x_here, y_here
    begin = all_.visited_count
    if not _add_cap(low, high, all_):
        return False
    if low >= high:
        return True
    all_.window_first[all_.window_count - 1] = begin
    while low < high:
        count = min(high - low, BLOCK)
        x, y = all_.judge.slide_x[:count], all_.judge.slide_y[:count]
        errors = all_.judge.errors[:count]
        for k in range(count):
            _slides_at(line, low + k, &x_here, &y_here)
            x[k], y[k] = x_here, y_here
        nearest_errors(
            x, y, all_.judge.rows[row, BESIDE], all_.judge.rows[row, FIRST],
            all_.judge.rows[row, LAST], all_.judge.window[row, 0], all_.judge.window[row, 1],
            all_.judge.search, errors,
        )
        for k in range(count):
            all_.visited[all_.visited_count] = low + k
            all_.visited_error[all_.visited_count] = errors[k]
            all_.visited_count += 1
        low += count
    return True


cdef Int _end_of_group(Int first, LineJudge all_) noexcept nogil:
    """Return the end of the group of crossings that overlap each other, which begins at
    `first`."""
    cdef Int k, high
    k, high = first + 1, all_.crossing_high[first]
    while k < all_.crossing_count and all_.crossing_low[k] < high:
        high = max(high, all_.crossing_high[k])
        k += 1
    return k


cdef bint _visit_group(
    Line* line, Straight* nominal, Int first, Int end, LineJudge all_
) noexcept nogil:
    """Visit the events of the overlapping crossings first … end − 1, and compare each event with
    their moves."""
    cdef Int low, high, k, event, at
    cdef double x, y
    low, high, at = all_.crossing_low[first], 0, all_.visited_count
    for k in range(first, end):
        high = max(high, all_.crossing_high[k])
    if not _add_cap(low, high, all_):
        return False
    all_.window_first[all_.window_count - 1] = at
    for event in range(low, high):
        _slides_at(line, event, &x, &y)
        all_.visited[at], all_.visited_x[at], all_.visited_y[at] = event, x, y
        all_.visited_error[at], all_.visited_by[at] = _error(nominal, x, y), -1
        at += 1
    for k in range(first, end):
        _lower(nominal, k, all_.visited_count - low, all_)
    all_.visited_count = at
    return True


cdef void _lower(Straight* nominal, Int crossing, Int shift, LineJudge all_) noexcept nogil:
    """Lower the errors of a crossing's events, where event e is visited as number e + `shift`, to
    those against its move; of equally near moves the one counts to which a point is more
    square."""
    cdef Straight other
    cdef Int at, move
    cdef bint is_straight
    cdef double x, y, error, less
    move = all_.crossing_move[crossing]
    is_straight = _set_straight(&other, all_.judge.search.curves, move)
    for at in range(
        all_.crossing_low[crossing] + shift, all_.crossing_high[crossing] + shift
    ):
        x, y = all_.visited_x[at], all_.visited_y[at]
        error = _error(&other, x, y) if is_straight else _error_to(move, x, y, all_)
        less = math.fabs(all_.visited_error[at]) - math.fabs(error)
        if less < -TIE_MM:
            continue
        if less > TIE_MM or _is_more_square(nominal, all_.visited_by[at], move, x, y, all_):
            all_.visited_error[at], all_.visited_by[at] = error, move


cdef double _error_to(Int move, double x, double y, LineJudge all_) noexcept nogil:
    """Return the error of a point against a move of the search, signed as `set_errors` does."""
    all_.judge.search.x[0], all_.judge.search.y[0] = x, y
    set_errors(
        all_.judge.search.curves, move, all_.judge.search.x, all_.judge.search.y,
        all_.judge.search.error,
    )
    return all_.judge.search.error[0]


cdef bint _is_more_square(
    Straight* nominal, Int by, Int move, double x, double y, LineJudge all_
) noexcept nogil:
    """Return True if a point is more square to `move` than to the move `by`, or than to the wanted
    move where `by` is −1."""
    cdef double square
    if by < 0:
        square = nominal.dx * (y - nominal.ay) - nominal.dy * (x - nominal.ax)
        square = math.fabs(square) / nominal.length
    else:
        square = squareness(all_.judge.search.curves, by, x, y)
    return squareness(all_.judge.search.curves, move, x, y) > square + TIE_MM


cdef bint _list_crossings(
    Line* line, Straight* nominal, Piece* pieces, Int* cores, Int* ends, Int count, double far,
    Int row, LineJudge all_
) noexcept nogil:
    """List the events within `far` of the wanted move to which another move might be nearer, in
    order; return False where these are too many."""
    cdef Int leaves, height, node, low, place, k, first, last, begin, end, followed_move
    cdef double z_low, z_high, wide
    all_.crossing_count = 0
    first, last = all_.judge.rows[row, FIRST], all_.judge.rows[row, LAST]
    followed_move = all_.judge.rows[row, BESIDE]
    z_low, z_high = all_.judge.window[row, 0], all_.judge.window[row, 1]
    # Whatever is nearer to a point is within twice its distance of the point's foot on the move.
    wide = 2.0 * (far + TIE_MM) + MARGIN_MM
    _set_box(nominal, wide, all_)
    leaves = len(all_.judge.search.nodes) // 2
    height, all_.judge.search.stack[0] = 1, 1
    while height > 0:
        height -= 1
        node = all_.judge.search.stack[height]
        if all_.judge.search.nodes[node, FIRST_BELOW] >= last:
            continue
        if all_.judge.search.nodes[node, LAST_BELOW] <= first:
            continue
        if not node_near(all_.judge.search.nodes, node, all_.judge.search.box):
            continue
        if node < leaves:
            all_.judge.search.stack[height] = 2 * node + 1
            all_.judge.search.stack[height + 1] = 2 * node
            height += 2
            continue
        low = (node - leaves) * LEAF
        for place in range(low, min(low + LEAF, len(all_.judge.search.order))):
            k = all_.judge.search.order[place]
            if k == followed_move or not is_searched(
                k, first, last, z_low, z_high, all_.judge.search.heights
            ):
                continue
            if not move_near(all_.judge.search.curves, k, all_.judge.search.box):
                continue
            if are_same(all_.judge.search.curves, k, followed_move):
                continue
            if not _add_crossings(line, nominal, pieces, cores, ends, count, k, wide, all_):
                return False
    _sort_crossings(all_)
    return True


cdef void _set_box(Straight* nominal, double wide, LineJudge all_) noexcept nogil:
    """Set the box about a move, `wide` mm larger on all sides."""
    cdef double way_x, way_y, half
    cdef double[::1] box
    box = all_.judge.search.box
    way_x, way_y = nominal.dx / nominal.length, nominal.dy / nominal.length
    half = 0.5 * nominal.length + wide
    box[MIDDLE_X], box[MIDDLE_Y] = nominal.ax + 0.5 * nominal.dx, nominal.ay + 0.5 * nominal.dy
    box[WAY_X], box[WAY_Y], box[HALF_LONG], box[HALF_WIDE] = way_x, way_y, half, wide
    box[HALF_X] = math.fabs(way_x) * half + math.fabs(way_y) * wide
    box[HALF_Y] = math.fabs(way_y) * half + math.fabs(way_x) * wide


cdef bint _add_crossings(
    Line* line, Straight* nominal, Piece* pieces, Int* cores, Int* ends, Int count, Int move,
    double wide, LineJudge all_
) noexcept nogil:
    """Add the events whose feet on the wanted move are within `wide` of another move."""
    cdef Int parts, k, part, first, end
    cdef Form form
    cdef double[4] bounds
    parts = _set_near(nominal, move, wide, &bounds[0], all_)
    for k in range(count):
        if cores[k] >= ends[k]:
            continue
        form = _along_move(&pieces[k], nominal)
        for part in range(parts):
            _set_range(
                line, &pieces[k], &form, bounds[2 * part], bounds[2 * part + 1], &first, &end
            )
            first, end = max(first, cores[k]), min(end, ends[k])
            if first >= end:
                continue
            if all_.crossing_count == MAX_WINDOWS or end - first > MAX_VISITED:
                return False
            all_.crossing_low[all_.crossing_count] = first
            all_.crossing_high[all_.crossing_count] = end
            all_.crossing_move[all_.crossing_count] = move
            all_.crossing_count += 1
    return True


cdef Int _set_near(
    Straight* nominal, Int move, double wide, double* bounds, LineJudge all_
) noexcept nogil:
    """Set `bounds` to the parts of the wanted move (mm from its start) within `wide` of another
    move; return their number: at most one for a line, two for an arc, which counts as its full
    circle."""
    cdef Straight other
    cdef Int at
    cdef double way_x, way_y, px, py, along, across, low, high, outer, inner
    way_x, way_y = nominal.dx / nominal.length, nominal.dy / nominal.length
    at = all_.judge.search.curves.arc[move]
    if at >= 0:
        px = all_.judge.search.curves.arcs[at, CX] - nominal.ax
        py = all_.judge.search.curves.arcs[at, CY] - nominal.ay
        along, across = px * way_x + py * way_y, math.fabs(py * way_x - px * way_y)
        outer = all_.judge.search.curves.arcs[at, RADIUS] + wide
        inner = max(all_.judge.search.curves.arcs[at, RADIUS] - wide, 0.0)
        if across > outer:
            return 0
        outer = math.sqrt(outer * outer - across * across) + MARGIN_MM
        if across >= inner:
            bounds[0], bounds[1] = along - outer, along + outer
            return 1
        inner = max(math.sqrt(inner * inner - across * across) - MARGIN_MM, 0.0)
        bounds[0], bounds[1] = along - outer, along - inner
        bounds[2], bounds[3] = along + inner, along + outer
        return 2
    low, high = -wide, nominal.length + wide
    if _set_straight(&other, all_.judge.search.curves, move):
        # The wanted line, clipped by the rectangle about the other move.
        px, py = nominal.ax - other.ax, nominal.ay - other.ay
        along = (px * other.dx + py * other.dy) / other.length
        across = (other.dx * py - other.dy * px) / other.length
        outer = (way_x * other.dx + way_y * other.dy) / other.length
        inner = (other.dx * way_y - other.dy * way_x) / other.length
        _clip(along, outer, -wide, other.length + wide, &low, &high)
        _clip(across, inner, -wide, wide, &low, &high)
    bounds[0], bounds[1] = low - MARGIN_MM, high + MARGIN_MM
    return 1 if low <= high else 0


cdef void _clip(
    double value, double slope, double lowest, double greatest, double* low, double* high
) noexcept nogil:
    """Narrow low … high to the t with lowest ≤ value + slope·t ≤ greatest."""
    cdef double one, other
    if math.fabs(slope) < 1e-15:
        if value < lowest or value > greatest:
            high[0] = low[0] - 1.0
        return
    one, other = (lowest - value) / slope, (greatest - value) / slope
    low[0], high[0] = max(low[0], min(one, other)), min(high[0], max(one, other))


cdef void _sort_crossings(LineJudge all_) noexcept nogil:
    """Sort crossings by their first event; there are some dozens of them."""
    cdef Int k, j, low, high, move
    for k in range(1, all_.crossing_count):
        low, high = all_.crossing_low[k], all_.crossing_high[k]
        move, j = all_.crossing_move[k], k - 1
        while j >= 0 and all_.crossing_low[j] > low:
            all_.crossing_low[j + 1] = all_.crossing_low[j]
            all_.crossing_high[j + 1] = all_.crossing_high[j]
            all_.crossing_move[j + 1] = all_.crossing_move[j]
            j -= 1
        all_.crossing_low[j + 1], all_.crossing_high[j + 1] = low, high
        all_.crossing_move[j + 1] = move


# Figures of a line.


cdef struct Errors:
    # Sums of squares of sizes and of signed errors.
    double squares, signed


cdef Errors _sum_up(
    Line* line, Straight* move, Piece* pieces, Int count, double off, Int which, LineJudge all_
) noexcept nogil:
    """Return the sums of the errors of all events: from the pieces in closed form, with the
    visited events replaced by their real errors. Sizes are `off` larger than errors. The pieces
    are stored, to be counted later, and the histogram is corrected for the visited events."""
    cdef Errors errors
    cdef SawSums sums
    cdef Form form
    cdef Int k, begin, n, at
    cdef long double slope, level, plain, tooth
    cdef double negative, size, value
    errors.squares, errors.signed, at = 0.0, 0.0, 0
    for k in range(count):
        form = _across_move(&pieces[k], move)
        n = pieces[k].high - pieces[k].low
        begin = 2 * line.size * pieces[k].low + line.phase
        level = form.level + form.along * pieces[k].low
        level += form.across * (begin // (2 * line.events))
        begin = begin % (2 * line.events)
        saw_sums(n, line.size, begin, line.events, &sums)
        slope = form.along + form.across * <long double>line.size / <long double>line.events
        tooth = form.across / <long double>line.events
        plain = slope * sums.j + tooth * sums.u + level * sums.count
        errors.squares += square_sum(slope, tooth, level, &sums)
        errors.signed += <double>plain
        if off != 0.0:
            negative = negative_sum(
                n, line.size, begin, line.events, form.along, form.across, level
            )
            errors.squares += off * (2.0 * (<double>plain - 2.0 * negative) + off * n)
        _keep_piece(n, line, begin, &form, level, off, which, all_)
        while at < all_.visited_count and all_.visited[at] < pieces[k].high:
            value = <double>_value(line, &form, all_.visited[at])
            size = math.fabs(value) + off
            errors.squares -= size * size
            errors.signed -= value
            all_.judge.histograms[which, _place(size)] -= 1
            value = all_.visited_error[at]
            size = math.fabs(value) + off
            errors.squares += size * size
            errors.signed += value
            all_.judge.histograms[which, _place(size)] += 1
            at += 1
    errors.squares = max(errors.squares, 0.0)
    return errors


cdef inline Int _place(double size) noexcept nogil:
    """Return the place of a size ≥ 0 in a histogram."""
    cdef Int bits
    bits = (<Int*>&size)[0]
    return 4 * min(max((bits >> SHIFT) - BEFORE_FIRST, 0), BINS - 1)


cdef void _keep_piece(
    Int n, Line* line, Int phase, Form* form, long double level, double off, Int which,
    LineJudge all_
) noexcept nogil:
    cdef double[::1] piece
    piece = all_.pieces[all_.piece_count]
    piece[WHICH], piece[COUNT], piece[SIZE] = which, n, line.size
    piece[PHASE], piece[EVENTS] = phase, line.events
    piece[ALONG], piece[ACROSS] = <double>form.along, <double>form.across
    piece[LEVEL], piece[BEYOND] = <double>level, off
    all_.piece_count += 1


cdef Found _peak(
    Line* line, Straight* move, Piece* pieces, Int count, Int low, Int high, bint commanded,
    LineJudge all_
) noexcept nogil:
    """Return the largest error among the events low … high − 1, and where it is."""
    cdef Found peak
    cdef Int k, window
    cdef double size
    cdef Form form
    peak.size, peak.at = -1.0, low
    for window in range(all_.window_count):
        if all_.window_high[window] <= low or all_.window_low[window] >= high:
            continue
        for k in range(
            max(all_.window_low[window], low), min(all_.window_high[window], high)
        ):
            size = math.fabs(
                all_.visited_error[all_.window_first[window] + k - all_.window_low[window]]
            )
            if size > peak.size:
                peak.size, peak.at = size, k
    for k in range(count):
        if pieces[k].high > low and pieces[k].low < high:
            form = _across_move(&pieces[k], move)
            _raise_peak(
                line, move, &form, max(low, pieces[k].low), min(high, pieces[k].high), commanded,
                &peak, all_,
            )
    return peak


cdef void _raise_peak(
    Line* line, Straight* move, Form* form, Int low, Int high, bint commanded, Found* peak,
    LineJudge all_
) noexcept nogil:
    """Raise `peak` to the largest error of those events of a piece that were not visited. Where
    the closed form is largest at a visited event, the events before and behind that window are
    searched."""
    cdef Found other_peak
    cdef Int window
    cdef double x, y, size
    if low >= high:
        return
    other_peak = _largest(line, form, low, high)
    if other_peak.size < peak.size:
        return
    window = _window_of(other_peak.at, all_)
    if window < 0:
        if commanded:
            _commanded_at(line, other_peak.at, &x, &y)
        else:
            _slides_at(line, other_peak.at, &x, &y)
        size = math.fabs(_error(move, x, y))
        if size > peak.size or (size == peak.size and other_peak.at < peak.at):
            peak.size, peak.at = size, other_peak.at
        return
    _raise_peak(line, move, form, low, all_.window_low[window], commanded, peak, all_)
    _raise_peak(line, move, form, all_.window_high[window], high, commanded, peak, all_)


cdef Int _window_of(Int event, LineJudge all_) noexcept nogil:
    """Return the window of visited events that contains an event, −1 for none; windows are in
    order."""
    cdef Int low, high, middle
    low, high = 0, all_.window_count
    while low < high:
        middle = (low + high) // 2
        if all_.window_high[middle] <= event:
            low = middle + 1
        else:
            high = middle
    if low < all_.window_count and all_.window_low[low] <= event:
        return low
    return -1


cdef void _judge_total(
    Line* line, Straight* nominal, Piece* pieces, Int count, Int row, LineJudge all_
) noexcept nogil:
    """Judge the slides against the wanted moves, and add their path to the trace."""
    cdef Errors errors
    cdef Found peak, other_peak
    cdef double off, x, y, size
    cdef Int low, high, remaining
    cdef double[::1] pen
    cdef double[:, ::1] figures
    off, pen, figures = all_.judge.off[row], all_.judge.pen, all_.judge.figures
    errors = _sum_up(line, nominal, pieces, count, off, 1, all_)
    figures[row, TOTAL_SQUARES] += errors.squares
    figures[row, TOTAL_SUM] += errors.signed
    peak.size, peak.at, low = -1.0, 1, 1
    remaining = _begin_trace(line, all_)
    while low <= line.events:
        high = min(line.events + 1, low + remaining) if remaining > 0 else line.events + 1
        other_peak = _peak(line, nominal, pieces, count, low, high, False, all_)
        if other_peak.size > peak.size:
            peak = other_peak
        if remaining > 0:
            _trace_run(line, &other_peak, off, low, high, all_)
            remaining = <Int>pen[STRIDE]
        low = high
    size = peak.size + off
    if size > figures[row, TOTAL_MAX] or figures[row, KNOWN] == 0.0:
        _slides_at(line, peak.at, &x, &y)
        figures[row, TOTAL_MAX], figures[row, TOTAL_X], figures[row, TOTAL_Y] = size, x, y
    figures[row, KNOWN] += line.events


cdef void _judge_inner(
    Line* line, Straight* move, Piece* commanded, Int row, LineJudge all_
) noexcept nogil:
    """Judge the commanded path against the row's own move."""
    cdef Errors errors
    cdef Found peak
    cdef Int first, end
    cdef double[:, ::1] figures
    figures = all_.judge.figures
    _set_core(line, commanded, move, &first, &end)
    all_.window_count, all_.visited_count = 0, 0
    _visit_ends(line, move, 1, first, all_)
    _visit_ends(line, move, end, line.events + 1, all_)
    errors = _sum_up(line, move, commanded, 1, 0.0, 0, all_)
    peak = _peak(line, move, commanded, 1, 1, line.events + 1, True, all_)
    figures[row, INNER_SQUARES] += errors.squares
    figures[row, INNER_MAX] = max(figures[row, INNER_MAX], peak.size)


cdef void _visit_ends(
    Line* line, Straight* move, Int low, Int high, LineJudge all_
) noexcept nogil:
    """Visit the caps of the commanded path. They are few events: the path ends within some steps
    of the ends of its own move."""
    cdef double x, y
    cdef Int event
    if low >= high:
        return
    all_.window_low[all_.window_count], all_.window_high[all_.window_count] = low, high
    all_.window_first[all_.window_count] = all_.visited_count
    all_.window_count += 1
    for event in range(low, high):
        _commanded_at(line, event, &x, &y)
        all_.visited[all_.visited_count] = event
        all_.visited_error[all_.visited_count] = _error(move, x, y)
        all_.visited_count += 1


cdef void _judge_lag(
    Line* line, Piece* pieces, Int count, Int row, LineJudge all_
) noexcept nogil:
    """Judge the slides against the commanded path. The difference is linear in each piece, and its
    square convex, so the greatest is at a corner of the convex hull of the events: the ends are
    tried, and the events farthest in the direction in which the difference grows there."""
    cdef Piece commanded
    cdef Form x, y
    cdef SawSums sums
    cdef Int k, n, begin, at, end
    cdef long double level_x, level_y, slope_x, slope_y
    cdef double[:, ::1] figures
    figures = all_.judge.figures
    _set_commanded(line, &commanded)
    for k in range(count):
        n = pieces[k].high - pieces[k].low
        x.along, x.across = pieces[k].x.along - commanded.x.along, pieces[k].x.across - commanded.x.across
        y.along, y.across = pieces[k].y.along - commanded.y.along, pieces[k].y.across - commanded.y.across
        x.level, y.level = pieces[k].x.level - commanded.x.level, pieces[k].y.level - commanded.y.level
        begin = 2 * line.size * pieces[k].low + line.phase
        level_x = x.level + x.along * pieces[k].low + x.across * (begin // (2 * line.events))
        level_y = y.level + y.along * pieces[k].low + y.across * (begin // (2 * line.events))
        saw_sums(n, line.size, begin % (2 * line.events), line.events, &sums)
        slope_x = x.along + x.across * <long double>line.size / <long double>line.events
        slope_y = y.along + y.across * <long double>line.size / <long double>line.events
        figures[row, LAG_SQUARES] += square_sum(
            slope_x, x.across / <long double>line.events, level_x, &sums
        )
        figures[row, LAG_SQUARES] += square_sum(
            slope_y, y.across / <long double>line.events, level_y, &sums
        )
        for end in range(2):
            at = pieces[k].low if end == 0 else pieces[k].high - 1
            at = _climb(line, &pieces[k], &x, &y, at)
            figures[row, LAG_MAX] = max(figures[row, LAG_MAX], _lag_at(line, at))


cdef double _lag_at(Line* line, Int k) noexcept nogil:
    cdef double x, y, slide_x, slide_y
    _commanded_at(line, k, &x, &y)
    _slides_at(line, k, &slide_x, &slide_y)
    return math.sqrt((slide_x - x) * (slide_x - x) + (slide_y - y) * (slide_y - y))


cdef Int _climb(Line* line, Piece* piece, Form* x, Form* y, Int at) noexcept nogil:
    """Return an event at which x² + y² is no less than at `at`, and no less than at the events
    farthest in the direction in which it grows there."""
    cdef long double here_x, here_y, best, square, greatest
    cdef Int begin, new, turn
    if x.along == 0.0 and x.across == 0.0 and y.along == 0.0 and y.across == 0.0:
        return at
    begin = 2 * line.size * piece.low + line.phase
    best = -1.0
    for turn in range(8):
        here_x, here_y = _value(line, x, at), _value(line, y, at)
        square = here_x * here_x + here_y * here_y
        if square <= best:
            break
        best = square
        new = piece.low + find_most(
            piece.high - piece.low, here_x * x.along + here_y * y.along,
            here_x * x.across + here_y * y.across, 2 * line.size, begin % (2 * line.events),
            2 * line.events, &greatest,
        )
        here_x, here_y = _value(line, x, new), _value(line, y, new)
        if here_x * here_x + here_y * here_y <= best:
            break
        at = new
    return at


cdef void _judge_still(Line* line, Piece* pieces, Int count, LineJudge all_) noexcept nogil:
    """Widen the extents, and set where the row ends. Each axis moves in one direction, so its
    slide is farthest at an end; only where Y leans towards X is X taken from the pieces."""
    cdef Int row, k, at
    cdef double x, y
    cdef double[:, ::1] figures
    cdef Form form
    row, figures = line.row - all_.judge.low, all_.judge.figures
    figures[row, SAMPLES] += line.events
    _widen(line, 1, row, all_)
    _widen(line, line.events, row, all_)
    if line.lean != 0.0:
        for k in range(count):
            form = pieces[k].x
            at = _most_of(line, &pieces[k], form.along, form.across)
            _widen(line, at, row, all_)
            at = _most_of(line, &pieces[k], -form.along, -form.across)
            _widen(line, at, row, all_)
    _slides_at(line, line.events, &x, &y)
    figures[row, END_X], figures[row, END_Y] = x, y
    _commanded_at(line, line.events, &x, &y)
    figures[row, COMMANDED_X], figures[row, COMMANDED_Y] = x, y


cdef Int _most_of(
    Line* line, Piece* piece, long double along, long double across
) noexcept nogil:
    cdef long double greatest
    cdef Int begin
    begin = (2 * line.size * piece.low + line.phase) % (2 * line.events)
    return piece.low + find_most(
        piece.high - piece.low, along, across, 2 * line.size, begin, 2 * line.events, &greatest
    )


cdef void _widen(Line* line, Int k, Int row, LineJudge all_) noexcept nogil:
    cdef double x, y
    cdef double[:, ::1] figures
    figures = all_.judge.figures
    _slides_at(line, k, &x, &y)
    figures[row, LOW_X], figures[row, LOW_Y] = min(figures[row, LOW_X], x), min(figures[row, LOW_Y], y)
    figures[row, HIGH_X], figures[row, HIGH_Y] = max(figures[row, HIGH_X], x), max(figures[row, HIGH_Y], y)


# The trace of a line, as `camtool.kernels.judging.trace_block` takes it from samples.


cdef Int _begin_trace(Line* line, LineJudge all_) noexcept nogil:
    """Return the number of events that the current run of the trace still takes; 0 where no trace
    is wanted."""
    cdef double[::1] pen
    pen = all_.judge.pen
    if pen[STRIDE] <= 0.0:
        return 0
    if pen[ROW] != line.row:
        end_row(pen, all_.judge.trace)
        pen[ROW] = line.row
    return <Int>(pen[STRIDE] - pen[IN_RUN])


cdef void _trace_run(
    Line* line, Found* peak, double off, Int low, Int high, LineJudge all_
) noexcept nogil:
    """Add the events low … high − 1, all of one run, to the trace, with the largest error."""
    cdef double x, y, size
    cdef double[::1] pen
    pen = all_.judge.pen
    size = peak.size + off
    if size > pen[PEAK]:
        _slides_at(line, peak.at, &x, &y)
        pen[PEAK], pen[PEAK_X], pen[PEAK_Y] = size, x, y
        pen[LAST_IS_WRITTEN] = 1.0 if peak.at == high - 1 else 0.0
    else:
        pen[LAST_IS_WRITTEN] = 0.0
    pen[IN_RUN] += high - low
    _slides_at(line, high - 1, &x, &y)
    pen[LAST_X], pen[LAST_Y] = x, y
    pen[LAST_ERROR] = _error_of(line, high - 1, all_) + off
    if pen[IN_RUN] >= pen[STRIDE]:
        end_run(pen, all_.judge.trace)


cdef double _error_of(Line* line, Int event, LineJudge all_) noexcept nogil:
    """Return the size of the total error after an event, without the tolerance that the drawing
    adds."""
    cdef Int window, row
    cdef Straight nominal
    cdef double x, y
    window = _window_of(event, all_)
    if window >= 0:
        return math.fabs(
            all_.visited_error[all_.window_first[window] + event - all_.window_low[window]]
        )
    row = line.row - all_.judge.low
    _set_straight(&nominal, all_.judge.search.curves, all_.judge.rows[row, BESIDE])
    _slides_at(line, event, &x, &y)
    return math.fabs(_error(&nominal, x, y))


cdef void _trace_air(Line* line, LineJudge all_) noexcept nogil:
    """Add a line that cuts nothing to the trace: the first event of each run and the last one."""
    cdef Found peak
    cdef Int low, high, remaining
    cdef double x, y
    cdef double[::1] pen
    pen = all_.judge.pen
    remaining, low = _begin_trace(line, all_), 1
    while remaining > 0 and low <= line.events:
        high = min(line.events + 1, low + remaining)
        if pen[PEAK] < 0.0:
            _slides_at(line, low, &x, &y)
            pen[PEAK], pen[PEAK_X], pen[PEAK_Y] = 0.0, x, y
            pen[LAST_IS_WRITTEN] = 1.0 if low == high - 1 else 0.0
        else:
            pen[LAST_IS_WRITTEN] = 0.0
        pen[IN_RUN] += high - low
        _slides_at(line, high - 1, &x, &y)
        pen[LAST_X], pen[LAST_Y], pen[LAST_ERROR] = x, y, 0.0
        if pen[IN_RUN] >= pen[STRIDE]:
            end_run(pen, all_.judge.trace)
        remaining, low = <Int>pen[STRIDE], high


# Percentiles: how many errors of pieces are below a size.


def count_below(pieces: Floats, size: float) -> int:
    """Count the errors of the pieces (P, 9) that are below a size."""
    cdef Int k, total
    cdef double limit
    cdef double[:, :] table
    table, limit, total = pieces, size, 0
    with nogil:
        for k in range(len(table)):
            total += count_up_to(
                <Int>table[k, COUNT], <Int>table[k, SIZE], <Int>table[k, PHASE],
                <Int>table[k, EVENTS], table[k, ALONG], table[k, ACROSS], table[k, LEVEL],
                limit - table[k, BEYOND],
            )
    return total
