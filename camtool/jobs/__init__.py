"""Job files: TOML that says how a drawing is cut, read strictly, and begun from a drawing.

keys         every key: what it may be, the field that it fills, the flag that says the same
build        the tables of a file and of flags as a Job
drawing      the drawing that a job is for, as finely read as its part needs
description  what a job does with a drawing
template     a file to fill in, from the layers of a drawing"""
