"""DXF drawings: `reader` is the door, `walk` visits entities, `kinds` says what comes of each."""
