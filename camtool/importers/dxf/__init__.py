"""DXF drawings: `reader` reads them, `load` gives the document, `walk` visits its entities,
`shapes` and `text` make paths of them."""
