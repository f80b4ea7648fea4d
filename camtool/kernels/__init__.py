"""Compiled inner loops: arrays in, arrays out.

Each .pyx file is Cython, compiled when the package is installed (setup.py). A .pyi beside it holds
the types of what Python code imports from it, a .pxd what other kernels import."""

from importlib.machinery import PathFinder

from camtool.errors import CamtoolError

if PathFinder.find_spec("camtool.kernels._memoryviews", __path__) is None:
    # Python was started in a checkout, whose camtool/ comes before the installed one.
    raise CamtoolError(
        "the kernels of this checkout are not compiled",
        file=__path__[0],
        mend="type `python -P -m camtool` for the installed camtool, or compile them by "
        "`pip install --editable .`",
    )
