"""Sending programs to machines by the machine's own protocol, and virtual machines to test it.

This package knows no machine: a target supplies both ends of its wire (`camtool.target.twin` is
the contract of the virtual one), and the two ends share no code."""
