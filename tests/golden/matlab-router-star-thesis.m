% camtool: matlab-router, profile safe, 1 job
% xy, lxy and first point in 0.1 mm from home; velxy in counts of the encoder in 5 ms
% serial line: 9600 baud, 8 bits, no parity, 1 stop bit
%% job 1 of 1: 10 lines
xy = [
  151   400   630   575   815   501   400   294     6   220   153
   86   265    86   431   639   642   999   645   665   428    86
];
lxy = [
  249   230    55   240   314   101   106   288   214    67
  179   179   345   208     3   357   354    20   237   342
];
velxy = [
  480   480   -77   480  -480  -136  -144  -480   433   -94
  345  -374   480   416     5   480  -480    33  -480  -480
];
size_of_array = 10;
first_pointx = 151;
first_pointy = 86;
