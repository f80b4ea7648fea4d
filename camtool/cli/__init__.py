"""Commands: parse, call, print."""

COMPLETE = "_CAMTOOL_COMPLETE"
"""The environment's variable in which a shell says what it asks."""
