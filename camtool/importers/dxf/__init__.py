"""DXF drawings: `reader` is the door, `load` gives the document, `walk` visits its entities,
`shapes` and `text` make paths of them."""
