"""Pictures: SVG is the source, PNG is rendered from it (`camtool.pictures.draw`)."""
