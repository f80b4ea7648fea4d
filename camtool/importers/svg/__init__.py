"""SVG drawings: `reader` is the door and walks the elements that `tree` gives; `style` says what
they look like, `shapes` and `text` what their outlines are."""
