from camtool.kernels.types cimport Int

cpdef enum:
    # Direction of a block of positions.
    RISING = 1, FALLING = -1, STILL = 0, TURNING = 2

cpdef Int way_of(Int before, Int[::1] positions) noexcept
cpdef Int play_block(
    Int trend, double[::1] positions, double[::1] axis, double[::1] state, double[::1] out
) noexcept
