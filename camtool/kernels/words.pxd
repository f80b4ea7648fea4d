"""The C types of `words`."""

cimport cython
from camtool.kernels.types cimport Int

@cython.locals(size=Int, decimals=Int, digits=Int, rest=Int, end=Int, k=Int, place=Int)
cdef Int _put_number(Int value, Int[::1] style, unsigned char[::1] out, Int at) noexcept

@cython.locals(columns=Int, at=Int, row=Int, begin=Int, column=Int, k=Int)
cpdef void put_words(
    Int[:, ::1] values, unsigned char[:, ::1] written, unsigned char[::1] fixed,
    Int[::1] fixed_ends, Int[:, ::1] styles, bint blanks, unsigned char[::1] out, Int[::1] ends
) noexcept

cdef Int _column_of(Int sign) noexcept  # inline

@cython.locals(
    negative=bint, mantissa=Int, digits=Int, exact=Int, scale=double, point=bint, sign=Int,
    value=double
)
cdef Int _number(
    const unsigned char[::1] data, Int at, Int end, double[::1] numbers, Int column
) noexcept

@cython.locals(first=Int)
cdef bint _is_comment(const unsigned char[::1] data, Int at, Int end) noexcept

@cython.locals(
    words=Int, form=Int, mask=Int, one_blank=Int, numbered=bint, blanks=Int, sign=Int, first=Int,
    column=Int, code=double, plain_digits=bint
)
cdef Int _plain_line(
    const unsigned char[::1] data, Int at, Int end, bint free, double[::1] numbers, Int[::1] facts
) noexcept

@cython.locals(rows=Int, size=Int, end=Int, first=Int, words=Int)
cpdef (Int, Int, Int) plain_lines(
    const unsigned char[::1] data, Int at, Int line, Int most_chars, bint free,
    double[:, ::1] numbers, Int[:, ::1] facts
) noexcept
