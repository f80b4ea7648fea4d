from camtool.kernels.types cimport Int

cpdef enum:
    # Samples that are judged together: their columns stay in a processor's second cache, and what
    # a block costs besides them is shared by many.
    BLOCK = 1536

cpdef enum:
    # Bits of the mantissa that tell bins apart: bins are at most 2⁻⁷, 0.8 %, wide.
    MANTISSA_BITS = 7
    # How far a float's bits are shifted to leave those that tell bins apart.
    SHIFT = 52 - MANTISSA_BITS

cpdef enum:
    # The leading bits of an error are its bin plus this. Bin 0 is for errors below 2⁻³⁰ mm, a
    # thousandth of a nanometre.
    BEFORE_FIRST = ((1023 - 30) << MANTISSA_BITS) - 1
    # Number of bins; the last one is for all errors above 2²⁰ mm, a kilometre.
    BINS = ((1023 + 20) << MANTISSA_BITS) - BEFORE_FIRST + 1

cpdef enum:
    # Numbers of an arc: centre x, y; radius; turn (+1 ccw, −1 cw); normals into the wedge at its
    # start x, y and its end x, y; 1 when it is wider than half a turn, 2 for a whole turn, else 0.
    COLUMNS = 9

cpdef enum:
    # Last column of a full circle.
    FULL = 2
    CX = 0, CY, RADIUS, TURN, UX, UY, VX, VY, WIDE

cpdef enum:
    # A box about points, float64: its middle; the direction of their way; half of how long and
    # wide it is along that, and along X and Y.
    MIDDLE_X = 0, MIDDLE_Y, WAY_X, WAY_Y, HALF_LONG, HALF_WIDE, HALF_X, HALF_Y

cpdef enum:
    # The pen, float64: samples of a run, 0 where nothing is wanted; points written, and how many
    # may be besides the ends of rows; the row (−1: none yet); samples in the present run; its
    # largest error and where; the last sample's error and where, and whether it is the largest of
    # its run or written already.
    STRIDE = 0, WRITTEN, ROOM, ROW, IN_RUN, PEAK, PEAK_X, PEAK_Y, LAST_ERROR, LAST_X, LAST_Y,
    LAST_IS_WRITTEN
    # Numbers of a pen.
    PEN = 12

cpdef enum:
    # Columns of the rows: how many samples; of those of rows that cut the largest error and the
    # sum of squares; how many have a total, that with its sum and its place; extents; last
    # positions.
    SAMPLES = 0, INNER_MAX, INNER_SQUARES, LAG_MAX, LAG_SQUARES, KNOWN, TOTAL_MAX, TOTAL_SQUARES,
    TOTAL_SUM, TOTAL_X, TOTAL_Y, LOW_X, LOW_Y, HIGH_X, HIGH_Y, END_X, END_Y, COMMANDED_X,
    COMMANDED_Y
    # How many columns.
    ROW_COLUMNS = 19
    # Columns of `Task.rows`.
    OWN = 0, FIRST, LAST, CIRCLE, SLOT, BESIDE

cdef class Curves:
    cdef const double[:, :] start, end
    cdef double[:, ::1] arcs
    cdef int[::1] arc

cdef class Search:
    cdef Curves curves
    cdef const double[:, :] heights
    cdef double[:, ::1] nodes
    cdef int[::1] order
    cdef Int[::1] candidates, stack, parts, by
    cdef double[::1] box, x, y, error, other
    cdef readonly Int looked

cdef class Judge:
    cdef Int low
    cdef Curves own
    cdef double[:, ::1] window, centre, directions, figures, trace
    cdef Int[:, ::1] rows, histograms
    cdef double[:, :, ::1] bins
    cdef double[::1] off, pen
    cdef Search search
    cdef double[::1] x, y, slide_x, slide_y, errors, size
    cdef Int[::1] bits
    cdef int[::1] places

cdef void judge_block(Int row, Int count, Judge judge) noexcept nogil
cpdef void set_errors(
    Curves curves, Int row, double[::1] x, double[::1] y, double[::1] errors
) noexcept nogil
cdef bint is_searched(
    Int k, Int first, Int last, double z_low, double z_high, const double[:, :] heights
) noexcept nogil
cdef bint node_near(double[:, ::1] nodes, Int node, double[::1] box) noexcept nogil
cdef bint move_near(Curves curves, Int k, double[::1] box) noexcept nogil
cdef bint are_same(Curves curves, Int one, Int other) noexcept nogil
cdef double squareness(Curves curves, Int k, double x, double y) noexcept nogil
cdef void end_run(double[::1] pen, double[:, ::1] trace) noexcept nogil
cdef void end_row(double[::1] pen, double[:, ::1] trace) noexcept nogil
cpdef bint nearest_errors(
    double[::1] x, double[::1] y, Int own, Int first, Int last, double z_low, double z_high,
    Search search, double[::1] out
) noexcept nogil
