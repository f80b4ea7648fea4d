(A circle of 30 mm both ways round, as a ball-bar test goes)
G21 G90 G17
G0 Z5
G0 X30 Y0
G1 Z-1 F100
G3 X30 Y0 I-30 J0 F500
G2 X30 Y0 I-30 J0
G0 Z5
M2
