"""The old place of `inner`."""

from camtool.kernels.compiled import inner

__all__ = ["inner"]
