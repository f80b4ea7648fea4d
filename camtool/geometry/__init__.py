"""Polylines with bulges and pure functions on them."""
