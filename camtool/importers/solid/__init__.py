"""Solid models by OpenCASCADE, in a process of its own: `reader` is the door."""
