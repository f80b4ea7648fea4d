from camtool.arrays import Floats, Ints

def arc_angles(
    turn: Ints, begin: Floats, ends: Floats, offset: Floats, computed: bool, out: Floats
) -> int: ...
