"""Job files: TOML that says how a drawing is cut, read strictly, and begun from a drawing.

file       the tables of a file                                    Said
given      a value with the place where it was given               Given, Key, Table
keys       every key: the field that it fills, and how it is read
values     texts such as "0.2mm" or "ramp:3deg" as numbers and records
tools      the tool of an operation: by name, by number, or key by key
build      the tables of a file and of flags as a Job
layers     whether a drawing has what the operations take
template   a file to fill in, from the layers of a drawing
"""
