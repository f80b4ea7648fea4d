"""The lines of a controller over time: their levels, from the pulses of its motors; dumps, tables
and pictures of them."""
