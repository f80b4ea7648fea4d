"""Targets: each machine is one folder, with its dialect and its machine file."""
