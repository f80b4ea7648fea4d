"""The stock after a program: its exact height at a point, proved bounds of gouge and leftover,
volumes, and height maps for pictures."""
