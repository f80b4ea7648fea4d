"""Code shared by the dialects of G-code.

dialect   options that writer and reader must agree on
blocks    reading: bytes to lines, blocks of words, and runs of plain blocks
          plain_moves: a run of plain blocks to moves, column by column
          part_moves: moves in any frame and plane; faults: what stops a reader, by place
format    writing: numbers and comments; checks: what every writer refuses
write     writing grbl and linuxcnc, modal; arcs: by the controller's own rule for arcs
plain     writing flashcut and valcnc, whose blocks say everything anew"""
