"""Slow, obvious twins: what the fast code is compared with."""
