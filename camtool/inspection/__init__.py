"""Dimensions of a part with their limits, as they will be cut, and whether they hold."""
