"""What dialects of G-code share.

dialect   options that writer and reader must agree on
blocks    reading: bytes to blocks of words; read: blocks to moves, with the modes of RS274
format    writing: numbers and comments; checks: what every writer refuses
write     writing grbl and linuxcnc, modal; arcs: by the controller's own rule for arcs
plain     writing flashcut and valcnc, whose blocks say everything anew
"""
