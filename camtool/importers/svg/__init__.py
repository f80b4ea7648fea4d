"""SVG drawings: `reader` is the door, `data` and `tree` give elements, `walk` draws them."""
