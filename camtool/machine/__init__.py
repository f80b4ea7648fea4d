"""Machines as frozen records, their strict TOML loader, and the registry of targets."""
