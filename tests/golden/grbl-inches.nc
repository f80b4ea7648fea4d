(camtool 0.1.0 for grbl: any machine on grbl 1.1)
(test.dxf)
(settings 830ba976)
(inch and inch/min - part zero at X0 Y0 Z0)
(X -0.06250 to 1.63730)
(Y -0.06250 to 0.84990)
(Z -0.15748 to 0.19685)
G17 G20 G90 G94
G54
G0 Z0.19685
(operation 1 of 3: holes)
(tool 2 pilot: drill 0.1181 inch 118 deg - 8000 rev/min)
(0.1575 inch deep by 0.05906 inch - plunge 7.874 inch/min)
(cuts 3 s at these feeds)
M3 S8000
(0/PATH 1)
X0.31496 Y0.31496
G1 Z-0.05249 F7.874
G0 Z0.01969
Z-0.04462
G1 Z-0.10499
G0 Z0.01969
Z-0.09711
G1 Z-0.15748
G0 Z0.19685
M5
(operation 2 of 3: window)
(tool 1 end mill 0.125 inch - 12000 rev/min)
(0.126 inch deep in 3 passes)
(feed 11.811 plunge 3.5433 inch/min)
(cuts 20 s at these feeds)
(stop: mount tool 1 end mill 0.125 inch)
(set its tip to Z 0.1969 inch or zero Z again - then start)
T1 M0
G0 Z0.19685
M3 S12000
(0/PATH 2)
X1.22608 Y0.3937
G1 Z-0.04199 F3.543
G3 X1.22608 Y0.3937 I-0.04498 J0 F11.811
G1 X1.27608
G3 X1.27608 Y0.3937 I-0.09498 J0
G1 X1.22608
Z-0.08399 F3.543
G3 X1.22608 Y0.3937 I-0.04498 J0 F11.811
G1 X1.27608
G3 X1.27608 Y0.3937 I-0.09498 J0
G1 X1.22608
Z-0.12598 F3.543
G3 X1.22608 Y0.3937 I-0.04498 J0 F11.811
G1 X1.27608
G3 X1.27608 Y0.3937 I-0.09498 J0
G0 Z0.19685
(operation 3 of 3: profile)
(tool 1 end mill 0.125 inch - 12000 rev/min)
(0.1575 inch deep in 3 passes)
(feed 11.811 plunge 3.5433 inch/min)
(cuts 1 min 24 s at these feeds)
(0/PATH 0)
X0 Y-0.0625
G1 Z-0.05249 F3.543
X1.5748 F11.811
G3 X1.6373 Y0 I0 J0.0625
G1 Y0.7874
G3 X1.5748 Y0.8499 I-0.0625 J0
G1 X0
G3 X-0.0625 Y0.7874 I0 J-0.0625
G1 Y0
G3 X0 Y-0.0625 I0.0625 J0
G1 Z-0.10499 F3.543
X1.5748 F11.811
G3 X1.6373 Y0 I0 J0.0625
G1 Y0.7874
G3 X1.5748 Y0.8499 I-0.0625 J0
G1 X0
G3 X-0.0625 Y0.7874 I0 J-0.0625
G1 Y0
G3 X0 Y-0.0625 I0.0625 J0
G1 Z-0.15748 F3.543
X1.5748 F11.811
G3 X1.6373 Y0 I0 J0.0625
G1 Y0.7874
G3 X1.5748 Y0.8499 I-0.0625 J0
G1 X0
G3 X-0.0625 Y0.7874 I0 J-0.0625
G1 Y0
G3 X0 Y-0.0625 I0.0625 J0
G0 Z0.19685
M5
Y0
M2
