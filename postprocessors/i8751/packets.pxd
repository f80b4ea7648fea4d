"""The C types of `packets`."""

cimport cython
from camtool.kernels.types cimport Int

@cython.locals(high_steps=Int, lost=Int, sense=Int, count=Int)
cdef Int _motor(
    const unsigned char[::1] data, Int at, Int number, (Int, Int) pulses, Int[::1] record,
    Int column
) noexcept

cdef Int _wait(
    const unsigned char[::1] data, Int at, Int mark, Int[::1] record, Int column
) noexcept

@cython.locals(
    at=Int, inside=Int, most=Int, high_steps=Int, lost=Int, mark=Int, keys=bint, rows=Int,
    size=Int, behind=Int, end=Int
)
cpdef (Int, Int, Int) records_in_a_row(
    const unsigned char[::1] data, (Int, Int) place, (Int, Int, Int, Int, bint) rules,
    Int[:, ::1] records
) noexcept
