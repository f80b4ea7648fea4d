"""Compiled inner loops: arrays in, arrays out.

Each module is plain Python; a .pxd beside it says the C types with which Cython compiles it when
the package is installed (`build_backend`).
"""
