"""SVG drawings: `reader` walks the elements that `tree` gives; `style` has their looks,
`shapes` and `text` their outlines."""
