% camtool: matlab-router, profile safe, 3 jobs
% xy, lxy and first point in 0.1 mm from home; velxy in counts of the encoder in 5 ms
% serial line: 9600 baud, 8 bits, no parity, 1 stop bit
% run one section, send it, reset the master, then run the next one
%% job 1 of 3: 23 lines
xy = [
  200   198   192   184   174   160   146   134   122   112   104   100   100   104   112   122   134   146   160   174   184   192   198   200
  100   114   126   136   144   148   150   148   140   132   120   106    94    80    68    60    52    50    52    56    64    74    86   100
];
lxy = [
    2     6     8    10    14    14    12    12    10     8     4     0     4     8    10    12    12    14    14    10     8     6     2
   14    12    10     8     4     2     2     8     8    12    14    12    14    12     8     8     2     2     4     8    10    12    14
];
velxy = [
  -69  -240  -384  -480  -480  -480  -480  -480  -480  -320  -137     0   137   320   480   480   480   480   480   480   384   240    69
  480   480   480   384   137    69   -80  -320  -384  -480  -480  -480  -480  -480  -384  -320   -80    69   137   384   480   480   480
];
size_of_array = 23;
first_pointx = 200;
first_pointy = 100;
jobs{1} = {xy, lxy, velxy, size_of_array, first_pointx, first_pointy};
%% job 2 of 3: 6 lines
xy = [
  100   358   742  1000  1258  1642  1900
  400   400   402   402   402   404   404
];
lxy = [
  258   384   258   258   384   258
    0     2     0     0     2     0
];
velxy = [
  192   192   192   192   192   192
    0     1     0     0     1     0
];
size_of_array = 6;
first_pointx = 100;
first_pointy = 400;
jobs{2} = {xy, lxy, velxy, size_of_array, first_pointx, first_pointy};
%% job 3 of 3: 2 lines
xy = [
    2   100     0
    2     0   100
];
lxy = [
   98   100
    2   100
];
velxy = [
  480  -480
  -10   480
];
size_of_array = 2;
first_pointx = 2;
first_pointy = 2;
jobs{3} = {xy, lxy, velxy, size_of_array, first_pointx, first_pointy};
