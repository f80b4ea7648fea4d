(camtool 0.1.0 for grbl: any machine on grbl 1.1)
(test.dxf)
(settings 90115384)
(mm and mm/min - part zero at X0 Y0 Z0)
(X -1.588 to 41.588)
(Y -1.588 to 60.000)
(Z -4.000 to 30.000)
G17 G21 G90 G94
G54
G0 Z5.000
(operation 1 of 3: holes)
(tool 2 pilot: drill 3 mm 118 deg - 8000 rev/min)
(4 mm deep by 1.5 mm - plunge 200 mm/min - takes 26 s)
M3 S8000
G4 P3
(0/PATH 1)
X8.000 Y8.000
G1 Z-1.333 F200
G0 Z0.500
Z-1.133
G1 Z-2.667
G0 Z0.500
Z-2.467
G1 Z-4.000
G0 Z5.000
M5
Z30.000
X0.000 Y60.000
(operation 2 of 3: window)
(tool 1 end mill 3.175 mm - 12000 rev/min)
(3.2 mm deep in 3 passes - feed 300 plunge 90 mm/min)
(takes 39 s)
(stop: mount tool 1 end mill 3.175 mm)
(zero Z on top of the stock at X0 Y0 - not cut yet)
(or set its tip to Z 30 mm here - then start)
T1 M0
G0 Z30.000
M3 S12000
G4 P3
X31.143 Y10.000
(0/PATH 2)
Z5.000
G1 Z-1.067 F90
G3 X31.143 Y10.000 I-1.143 J0.000 F300
G1 X32.413
G3 X32.413 Y10.000 I-2.413 J0.000
G1 X31.143
Z-2.133 F90
G3 X31.143 Y10.000 I-1.143 J0.000 F300
G1 X32.413
G3 X32.413 Y10.000 I-2.413 J0.000
G1 X31.143
Z-3.200 F90
G3 X31.143 Y10.000 I-1.143 J0.000 F300
G1 X32.413
G3 X32.413 Y10.000 I-2.413 J0.000
G0 Z5.000
(operation 3 of 3: profile)
(tool 1 end mill 3.175 mm - 12000 rev/min)
(4 mm deep in 3 passes - feed 300 plunge 90 mm/min)
(takes 1 min 33 s)
(0/PATH 0)
X0.000 Y-1.588
G1 Z-1.333 F90
X40.000 F300
G3 X41.588 Y0.000 I0.000 J1.588
G1 Y20.000
G3 X40.000 Y21.588 I-1.588 J0.000
G1 X0.000
G3 X-1.588 Y20.000 I0.000 J-1.588
G1 Y0.000
G3 X0.000 Y-1.588 I1.588 J0.000
G1 Z-2.667 F90
X40.000 F300
G3 X41.588 Y0.000 I0.000 J1.588
G1 Y20.000
G3 X40.000 Y21.588 I-1.588 J0.000
G1 X0.000
G3 X-1.588 Y20.000 I0.000 J-1.588
G1 Y0.000
G3 X0.000 Y-1.588 I1.588 J0.000
G1 Z-4.000 F90
X40.000 F300
G3 X41.588 Y0.000 I0.000 J1.588
G1 Y20.000
G3 X40.000 Y21.588 I-1.588 J0.000
G1 X0.000
G3 X-1.588 Y20.000 I0.000 J-1.588
G1 Y0.000
G3 X0.000 Y-1.588 I1.588 J0.000
G0 Z5.000
M5
Y0.000
M2
