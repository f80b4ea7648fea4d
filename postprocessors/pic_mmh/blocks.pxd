"""The C types of `blocks`."""

cimport cython
from camtool.kernels.types cimport Int

cdef bint _is_blank(Int sign) noexcept  # inline

@cython.locals(k=Int)
cdef Int _digits(const unsigned char[::1] data, Int at, Int count, Int number) noexcept  # inline

@cython.locals(longest=Int, signed=bint, negative=bint, number=Int)
cdef Int _coordinate(
    const unsigned char[::1] data, Int at, Int letter, bint annex, Int[::1] block, Int column
) noexcept

@cython.locals(size=Int, code=Int, deep=bint)
cdef Int _move(const unsigned char[::1] data, Int at, bint annex, Int[::1] block) noexcept

@cython.locals(rows=Int, size=Int, first=Int, last=Int, end=Int)
cpdef (Int, Int) moves_in_a_row(
    const unsigned char[::1] data, Int at, bint annex, Int[:, ::1] blocks
) noexcept
