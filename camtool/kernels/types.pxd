"""The C types of the kernels' numbers."""

# 64 bits on every platform, as the int64 of numpy.
ctypedef long long Int
