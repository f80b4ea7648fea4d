"""Slow, obvious oracles: what the fast code is compared with."""
