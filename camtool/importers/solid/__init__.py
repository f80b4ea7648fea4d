"""Solid models by OpenCASCADE: `reader` reads them, `worker` a process of its own, in which
`bodies` reads the model and `outline` draws it."""
