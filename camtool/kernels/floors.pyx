"""Sums, extremes and counts along stepped lines in closed form, without visiting the steps.

A stepped line of N events takes `size` = a ≤ N steps of its minor axis. After j events they are

    t_j = ⌊(2aj + phase) / 2N⌋,        u_j = N t_j − a j     ("tooth": N times the rounding error)

and every linear function of the position is A j + B t_j + C. Each function below reduces
(2a, 2N) as Euclid's algorithm does, so it takes O(log N) divisions however long the line is.
Divisions are of 64 bits. Sums are whole numbers modulo 2¹²⁸; their last result always fits, so
that an overflow on the way does no harm.

Sums: "euclidean-like algorithm" (OI-wiki); AtCoder Library, `floor_sum`. Extremes: the vertices
of the convex hull of a digital line (Lachaud and Said, "Two efficient algorithms for computing the
characteristics of a subsegment of a digital straight line", 2013).
"""

from __future__ import annotations

from libc cimport math
from libc.stdint cimport uint64_t
from camtool.kernels.types cimport Int

cdef extern from *:
    """
    #ifdef __SIZEOF_INT128__
    typedef unsigned __int128 camtool_total;
    static double camtool_signed(camtool_total value) { return (double)(__int128)value; }
    #else
    typedef unsigned long long camtool_total;
    static double camtool_signed(camtool_total value) { return (double)(long long)value; }
    #endif
    """
    ctypedef unsigned long long Total "camtool_total"
    double signed_of "camtool_signed"(Total value) nogil

cpdef enum:
    # Counts use fixed-point slopes; so many events at a time keep them finer than 1e-6 of a step.
    COUNTED_AT_ONCE = 1 << 20
    # Reductions of two numbers below 2⁶³ by Euclid's algorithm: at most 91.
    MAX_LEVELS = 96

# No line has as many steps.
cdef Int MAX_LEVEL = 1LL << 40

# A form that changes with the position, or begins, by so many times what a step changes is that of
# a straight line: a billion steps are 1e-21 of it.
cdef double STEPS_DO_NOT_COUNT = 1e30


cdef Int most_events() noexcept nogil:
    """Return an upper bound of the events of a line whose sums do not overflow: it is smaller
    where the compiler has no integers of 128 bits."""
    return (<Int>1 << 30) if sizeof(Total) > 8 else (<Int>1 << 20)


# Sums of floors.


cdef inline Total _squares_up_to(Int last) noexcept nogil:
    """Return Σ j², j = 0 … last."""
    cdef Int pairs, odd
    pairs, odd = last * (last + 1) // 2, 2 * last + 1
    if pairs % 3 == 0:
        pairs = pairs // 3
    else:
        odd = odd // 3
    return <Total>pairs * <Total>odd


cdef void _floor_sums(
    Int last, Int slope, Int offset, Int modulus, Total* sums
) noexcept nogil:
    """Set sums to Σ t, 2 Σ j t and Σ t² of t = ⌊(slope·j + offset) / modulus⌋, j = 0 … last."""
    cdef Int top, steep, lift
    cdef Total n, m, f, g, q, p, pairs, squares
    cdef Total[3] inner
    steep, lift = slope // modulus, offset // modulus
    slope, offset = slope - steep * modulus, offset - lift * modulus
    top = (slope * last + offset) // modulus
    n = <Total>last
    sums[0], sums[1], sums[2] = 0, 0, 0
    if top > 0:
        _floor_sums(top - 1, modulus, modulus - offset - 1, slope, &inner[0])
        m = <Total>top
        f = n * m - inner[0]
        sums[0], sums[1] = f, m * n * (n + 1) - inner[2] - inner[0]
        sums[2] = n * m * (m + 1) - inner[1] - 2 * inner[0] - f
    if steep == 0 and lift == 0:
        return
    f, g, q, p = sums[0], sums[1], <Total>steep, <Total>lift
    pairs, squares = <Total>(last * (last + 1) // 2), _squares_up_to(last)
    sums[0] = f + q * pairs + p * (n + 1)
    sums[1] = g + 2 * (q * squares + p * pairs)
    sums[2] += q * q * squares + p * p * (n + 1) + 2 * q * p * pairs + q * g + 2 * p * f


cdef Int _floor_sum(Int count, Int slope, Int offset, Int modulus) noexcept nogil:
    """Return Σ ⌊(slope·j + offset) / modulus⌋ over j = 0 … count − 1, as AtCoder's `floor_sum`."""
    cdef uint64_t total, n, a, b, m, reach
    total = 0
    n, a, b, m = count, slope, offset, modulus
    while True:
        if a >= m:
            total += (n * (n - 1) // 2) * (a // m)
            a = a % m
        if b >= m:
            total += n * (b // m)
            b = b % m
        reach = a * n + b
        if reach < m:
            return <Int>total
        n, b = reach // m, reach % m
        a, m = m, a


cdef void saw_sums(Int count, Int size, Int phase, Int events, SawSums* sums) noexcept nogil:
    """Set the sums of a window of `count` ≥ 1 events; 0 ≤ phase < 2 events."""
    cdef Total[3] floors
    cdef Total a, big, pairs, squares, u, uu, ju
    _floor_sums(count - 1, 2 * size, phase, 2 * events, &floors[0])
    a, big = <Total>size, <Total>events
    pairs, squares = <Total>(count * (count - 1) // 2), _squares_up_to(count - 1)
    u = big * floors[0] - a * pairs
    uu = big * big * floors[2] - a * big * floors[1] + a * a * squares
    # 2 Σ j t is known, its half only without the highest bit: so twice the sum.
    ju = big * floors[1] - 2 * a * squares
    sums.count, sums.j, sums.jj = <double>count, signed_of(pairs), signed_of(squares)
    sums.u, sums.uu, sums.ju = signed_of(u), signed_of(uu), 0.5 * signed_of(ju)


cdef double square_sum(
    long double along, long double tooth, long double level, SawSums* sums
) noexcept nogil:
    """Return Σ (along·j + tooth·u_j + level)²."""
    cdef long double squares
    squares = along * along * sums.jj + tooth * tooth * sums.uu + level * level * sums.count
    squares += 2.0 * along * tooth * sums.ju + 2.0 * level * (along * sums.j + tooth * sums.u)
    return max(<double>squares, 0.0)


# Extremes.


cdef Int find_most(
    Int count, long double along, long double across, Int slope, Int offset, Int modulus,
    long double* greatest
) noexcept nogil:
    """Return the j at which along·j + across·⌊(slope·j + offset) / modulus⌋ is greatest among j =
    0 … count − 1, and set `greatest` to that value.

    Both ends are candidates. Between them, if the two terms pull in opposite directions, the
    greatest is at the first j of a level, or just before one: the same problem with levels and
    positions exchanged.
    """
    cdef Int level, best_level, best, steep, lift, top, index, k
    cdef long double base, value
    cdef Int[MAX_LEVELS] slopes, offsets, moduli, backs
    level, best_level, best, base = 0, 0, 0, 0.0
    greatest[0] = -math.INFINITY
    while True:
        steep, lift = slope // modulus, offset // modulus
        along += across * steep
        base += across * lift
        slope -= steep * modulus
        offset -= lift * modulus
        top = (slope * (count - 1) + offset) // modulus
        if base > greatest[0]:
            greatest[0], best_level, best = base, level, 0
        value = base + along * (count - 1) + across * top
        if value > greatest[0]:
            greatest[0], best_level, best = value, level, count - 1
        if top == 0 or (along >= 0.0 and across >= 0.0) or (along <= 0.0 and across <= 0.0):
            break
        backs[level] = 0 if along < 0.0 else 1
        base += across if along < 0.0 else -along
        slopes[level], offsets[level] = modulus, modulus - offset + slope - 1
        moduli[level] = slope
        count = top
        along, across = across, along
        slope, offset, modulus = slopes[level], offsets[level], moduli[level]
        level += 1
    index = best
    for k in range(best_level - 1, -1, -1):
        index = (slopes[k] * index + offsets[k]) // moduli[k] - backs[k]
    return index


# Counts, and sums of those below zero.


cdef struct Below:
    # Where a linear function is at most a limit: for all of `sure` events from `sure_from` on, for
    # some of `some` events from `some_from` on, and for no others.
    Int sure_from, sure, some_from, some


cdef inline Int _floored(double value) noexcept nogil:
    """Return the integer part of a number, limited to ±MAX_LEVEL: where a form hardly depends on
    the steps, its levels lie farther away than that, and at most one event is undecided."""
    cdef Int integer
    if not -<double>MAX_LEVEL < value < <double>MAX_LEVEL:
        return MAX_LEVEL if value > 0.0 else -MAX_LEVEL
    integer = <Int>value
    return integer - 1 if value < <double>integer else integer


cdef inline Int _clamped(double value, Int count) noexcept nogil:
    """Return the integer part of a number, limited to 0 … count."""
    if not value > 0.0:
        return 0
    return count if value >= <double>count else <Int>value


cdef inline Int _clamped_up(double value, Int count) noexcept nogil:
    """Return the smallest integer not below a number, limited to 0 … count."""
    cdef Int integer
    integer = _clamped(value, count)
    return integer + 1 if <double>integer < value and integer < count else integer


cdef inline bint _is_straight(
    Int count, Int size, Int phase, Int events, double along, double across, double level
) noexcept nogil:
    """Return True if the steps can be ignored: there are none, or all of them together contribute
    less than a billionth of a rounding error of the rest."""
    return (
        math.fabs(across) * STEPS_DO_NOT_COUNT < max(math.fabs(along), level)
        or across == 0.0
        or (2 * size * (count - 1) + phase) < 2 * events
    )


cdef Below _split(
    Int count, Int size, Int phase, Int events, double along, double across, double room
) noexcept nogil:
    """Split events by h_j = (room − along·j) / across − (2aj + phase) / 2N, which is linear in j:
    t_j is at most (room − along·j) / across where h ≥ 0, and greater where h < −1."""
    cdef double slope, first
    cdef Below parts
    cdef Int certain, rest
    slope = along / across + <double>size / <double>events
    first = room / across - <double>phase / <double>(2 * events)
    if slope > 0.0:
        certain = _clamped(first / slope + 1.0, count)
        rest = _clamped((first + 1.0) / slope + 1.0, count)
        parts.sure_from, parts.sure, parts.some_from, parts.some = 0, certain, certain, rest - certain
    elif slope < 0.0:
        certain = _clamped_up(first / slope, count)
        rest = _clamped_up((first + 1.0) / slope, count)
        parts.sure_from, parts.sure = certain, count - certain
        parts.some_from, parts.some = rest, certain - rest
    else:
        certain, rest = count if first >= 0.0 else 0, count if first >= -1.0 else 0
        parts.sure_from, parts.sure, parts.some_from, parts.some = 0, certain, certain, rest - certain
    return parts


cdef struct Fixed:
    # A real line as ⌊(slope·j + offset) / modulus⌋ + lift + steep·j.
    Int slope, offset, modulus, lift, steep


cdef Fixed _fixed(double first, double step, Int count) noexcept nogil:
    """Return first + step·j in fixed point, with as many fraction bits as keep a product with
    `count` within 62 bits."""
    cdef Fixed line
    cdef Int bits
    bits = 61
    while (count >> (61 - bits)) > 0 and bits > 1:
        bits -= 1
    line.modulus = (<Int>1) << bits
    line.lift, line.steep = _floored(first), _floored(step)
    line.offset = <Int>(_share(first - <double>line.lift) * <double>line.modulus)
    line.slope = <Int>(_share(step - <double>line.steep) * <double>line.modulus)
    return line


cdef inline double _share(double value) noexcept nogil:
    """Return the number itself if it is between 0 and 1, else 0."""
    return value if 0.0 <= value <= 1.0 else 0.0


cdef Int _count(
    Int count, Int size, Int phase, Int events, double along, double across,
    double room
) noexcept nogil:
    """Count the events with along·j + across·t_j ≤ room, across > 0."""
    cdef Below parts
    cdef Fixed line
    cdef Int begin, before, total
    cdef double value
    parts = _split(count, size, phase, events, along, across, room)
    if parts.some == 0:
        return parts.sure
    begin = parts.some_from
    before = 2 * size * begin + phase
    if parts.some == 1:
        value = along * begin + across * (before // (2 * events))
        return parts.sure + 1 if value <= room else parts.sure
    line = _fixed((room - along * begin) / across, -along / across, parts.some)
    total = parts.sure + parts.some * (line.lift + 1)
    total += line.steep * (parts.some * (parts.some - 1) // 2)
    total += _floor_sum(parts.some, line.slope, line.offset, line.modulus)
    total -= parts.some * (before // (2 * events))
    return total - _floor_sum(parts.some, 2 * size, before % (2 * events), 2 * events)


cdef Int count_up_to(
    Int count, Int size, Int phase, Int events, long double along, long double across,
    long double level, long double limit
) noexcept nogil:
    """Count the events with |along·j + across·t_j + level| ≤ limit. A value nearer to the limit
    than 1e-6 |across| may be counted on either side."""
    cdef Int begin, some, total, before, within, first
    cdef double base_level
    if limit < 0.0:
        return 0
    total = 0
    begin = 0
    while begin < count:
        some = min(count - begin, COUNTED_AT_ONCE)
        before = 2 * size * begin + phase
        first = before // (2 * events)
        base_level = <double>(level + along * begin + across * first)
        within = _count_window(
            some, size, before % (2 * events), events, <double>along, <double>across, base_level,
            <double>limit,
        )
        total += within
        begin += some
    return total


cdef Int _count_window(
    Int count, Int size, Int phase, Int events, double along, double across,
    double level, double limit
) noexcept nogil:
    cdef Int below, above
    if _is_straight(count, size, phase, events, along, across, max(math.fabs(level), limit)):
        return _count_straight(count, along, level, limit)
    if across < 0.0:
        along, across, level = -along, -across, -level
    below = _count(count, size, phase, events, along, across, limit - level)
    above = _count(count, size, phase, events, along, across, -limit - level)
    return below - above


cdef Int _count_straight(
    Int count, double along, double level, double limit
) noexcept nogil:
    """Count j = 0 … count − 1 with |along·j + level| ≤ limit."""
    cdef Int low, high
    if along == 0.0:
        return count if math.fabs(level) <= limit else 0
    if along < 0.0:
        along, level = -along, -level
    low = _clamped_up((-limit - level) / along, count)
    high = _clamped((limit - level) / along + 1.0, count)
    return max(high - low, 0)


cdef double negative_sum(
    Int count, Int size, Int phase, Int events, long double along, long double across,
    long double level
) noexcept nogil:
    """Return the sum of along·j + across·t_j + level over those events where it is below 0.

    Where t is either G = ⌊g⌋ (counted, I = 1) or G + 1 (not counted, I = 0): I = G + 1 − t, and
    Σ t I = (Σ (G + 1)² − Σ t² − Σ I) / 2, so that no product of two floors has to be summed up.
    """
    cdef Int begin, some, before
    cdef double total
    cdef long double base_level
    total = 0.0
    begin = 0
    while begin < count:
        some = min(count - begin, COUNTED_AT_ONCE)
        before = 2 * size * begin + phase
        base_level = level + along * begin + across * (before // (2 * events))
        total += _negative_window(
            some, size, before % (2 * events), events, along, across, base_level
        )
        begin += some
    return total


cdef double _negative_window(
    Int count, Int size, Int phase, Int events, long double along, long double across,
    long double level
) noexcept nogil:
    cdef SawSums sums
    cdef Below parts
    cdef double all_
    if _is_straight(
        count, size, phase, events, <double>along, <double>across, math.fabs(<double>level)
    ):
        return _negative_straight(count, along, level)
    if across < 0.0:
        # The negative ones are all less the positive ones, which are the negative ones of −d.
        saw_sums(count, size, phase, events, &sums)
        all_ = _linear_sum(size, events, along, across, level, &sums)
        return all_ + _negative_window(count, size, phase, events, -along, -across, -level)
    parts = _split(
        count, size, phase, events, <double>along, <double>across, -<double>level
    )
    return _sure_sum(&parts, size, phase, events, along, across, level) + _some_sum(
        &parts, size, phase, events, along, across, level
    )


cdef double _linear_sum(
    Int size, Int events, long double along, long double across, long double level, SawSums* sums
) noexcept nogil:
    """Return Σ (along·j + across·t_j + level), without the cancellation of its two first terms."""
    cdef long double slope
    slope = along + across * <long double>size / <long double>events
    return <double>(
        slope * sums.j + across / <long double>events * sums.u + level * sums.count
    )


cdef double _sure_sum(
    Below* parts, Int size, Int phase, Int events, long double along, long double across,
    long double level
) noexcept nogil:
    cdef SawSums sums
    cdef Int before
    cdef long double base_level
    if parts.sure == 0:
        return 0.0
    before = 2 * size * parts.sure_from + phase
    base_level = level + along * parts.sure_from + across * (before // (2 * events))
    saw_sums(parts.sure, size, before % (2 * events), events, &sums)
    return _linear_sum(size, events, along, across, base_level, &sums)


cdef double _some_sum(
    Below* parts, Int size, Int phase, Int events, long double along, long double across,
    long double level
) noexcept nogil:
    cdef Int n, before
    cdef long double base_level, slope
    cdef Fixed line
    cdef Total[3] real_sums, step_sums
    cdef Total j, jj, rows, steps, products, double_sum, big, a, lift, steep
    n = parts.some
    if n == 0:
        return 0.0
    before = 2 * size * parts.some_from + phase
    base_level = level + along * parts.some_from + across * (before // (2 * events))
    if n == 1:
        return <double>base_level if base_level < 0.0 else 0.0
    line = _fixed(<double>(-base_level / across), <double>(-along / across), n)
    _floor_sums(n - 1, line.slope, line.offset, line.modulus, &real_sums[0])
    _floor_sums(n - 1, 2 * size, before % (2 * events), 2 * events, &step_sums[0])
    j, jj = <Total>(n * (n - 1) // 2), _squares_up_to(n - 1)
    lift, steep = <Total>line.lift + 1, <Total>line.steep
    # G + 1 = w + lift + steep·j with the floors w: its sum, twice that by j, and its squares.
    rows = real_sums[0] + lift * <Total>n + steep * j
    double_sum = real_sums[1] + 2 * lift * j + 2 * steep * jj
    products = real_sums[2] + lift * lift * <Total>n + steep * steep * jj
    products += 2 * lift * real_sums[0] + steep * real_sums[1] + 2 * lift * steep * j
    rows, double_sum = rows - step_sums[0], double_sum - step_sums[1]  # Σ I and 2 Σ j I
    products = products - step_sums[2] - rows  # 2 Σ t I
    big, a = <Total>events, <Total>size
    steps = big * products - a * double_sum  # 2 Σ u I
    slope = along + across * <long double>size / <long double>events
    return <double>(
        slope * 0.5 * signed_of(double_sum)
        + across / <long double>events * 0.5 * signed_of(steps)
        + base_level * signed_of(rows)
    )


cdef double _negative_straight(Int count, long double along, long double level) noexcept nogil:
    """Return the sum of along·j + level over j = 0 … count − 1 where it is below 0."""
    cdef Int low, high
    cdef long double first, last
    low, high = 0, count
    if along > 0.0:
        high = _clamped_up(<double>(-level / along), count)
    elif along < 0.0:
        low = _clamped(<double>(-level / along + 1.0), count)
    elif level >= 0.0:
        return 0.0
    if high <= low:
        return 0.0
    first, last = level + along * low, level + along * (high - 1)
    return <double>(0.5 * (first + last) * (high - low))


# The same for Python.


def sums_along(count: int, size: int, phase: int, events: int) -> tuple[float, ...]:
    """Return Σ 1, Σ j, Σ j², Σ u, Σ u² and Σ j u."""
    cdef SawSums sums
    saw_sums(count, size, phase, events, &sums)
    return sums.count, sums.j, sums.jj, sums.u, sums.uu, sums.ju


def most_along(
    count: int, along: float, across: float, size: int, phase: int, events: int
) -> tuple[int, float]:
    """Return the j at which along·j + across·t_j is greatest, and that value."""
    cdef long double greatest
    cdef Int index
    index = find_most(count, along, across, 2 * size, phase, 2 * events, &greatest)
    return index, <double>greatest


def counted_along(
    count: int, line: tuple[int, int, int], form: tuple[float, float, float], limit: float
) -> int:
    """Count the events with |along·j + across·t_j + level| ≤ limit: `line` is size, phase and
    events, `form` along, across and level."""
    cdef Int size, phase, events
    cdef double along, across, level
    size, phase, events = line
    along, across, level = form
    return count_up_to(count, size, phase, events, along, across, level, limit)


def negative_along(
    count: int, line: tuple[int, int, int], form: tuple[float, float, float]
) -> float:
    """Return the sum of along·j + across·t_j + level over those events where it is below 0."""
    cdef Int size, phase, events
    cdef double along, across, level
    size, phase, events = line
    along, across, level = form
    return negative_sum(count, size, phase, events, along, across, level)
