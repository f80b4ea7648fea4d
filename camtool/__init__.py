"""camtool: drawings in, the exact program of your machine out, its error known beforehand."""

__version__ = "0.1.0"
