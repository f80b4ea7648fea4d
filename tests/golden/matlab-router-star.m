% camtool: matlab-router, profile safe, 1 job
% xy, lxy and first point in 0.1 mm from home; velxy in counts of the encoder in 5 ms
% serial line: 9600 baud, 8 bits, no parity, 1 stop bit
%% job 1 of 1: 10 lines
xy = [
  152   400   630   576   816   502   400   294     6   220   154
   86   266    86   432   640   642  1000   646   666   428    86
];
lxy = [
  248   230    54   240   314   102   106   288   214    66
  180   180   346   208     2   358   354    20   238   342
];
velxy = [
  480   480   -75   480  -480  -137  -144  -480   432   -93
  348  -376   480   416     3   480  -480    33  -480  -480
];
size_of_array = 10;
first_pointx = 152;
first_pointy = 86;
