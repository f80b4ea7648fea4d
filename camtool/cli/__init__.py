"""Commands: parse, call, print."""

COMPLETE = "_CAMTOOL_COMPLETE"
"""The environment variable in which a shell asks for completions."""
