"""Solid models by OpenCASCADE: `reader` is the door, `worker` a process of its own, in which
`bodies` reads the model and `outline` draws it."""
