"""Dialects: each is one module (write and read) and one TOML file (its machine)."""
