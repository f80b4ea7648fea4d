"""The command line, for the tests of this machine's programs by commands."""

from tests.cli.conftest import camtool, samples

__all__ = ["camtool", "samples"]
