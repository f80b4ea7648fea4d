from camtool.kernels.types cimport Int

cdef struct SawSums:
    # Of j = 0 … n − 1: how many; sums of j and j², of u and u², and of their product.
    double count, j, jj, u, uu, ju

cdef void saw_sums(Int count, Int size, Int phase, Int events, SawSums* sums) noexcept nogil
cdef double square_sum(
    long double along, long double tooth, long double level, SawSums* sums
) noexcept nogil
cdef Int find_most(
    Int count, long double along, long double across, Int slope, Int offset, Int modulus,
    long double* most
) noexcept nogil
cdef Int count_up_to(
    Int count, Int size, Int phase, Int events, long double along, long double across,
    long double level, long double limit
) noexcept nogil
cdef double negative_sum(
    Int count, Int size, Int phase, Int events, long double along, long double across,
    long double level
) noexcept nogil
cdef Int most_events() noexcept nogil
