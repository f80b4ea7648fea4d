"""Carving with a V bit along the medial axis."""
