"""A contour, its start chosen, as runs: passes, ramps, leads, tabs, starts, reliefs."""
