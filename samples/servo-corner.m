%% job 1
xy = [
    100 114 114
    100 100 114
];
lxy = [
    14 0
    0 14
];
velxy = [
    480 0
    0 480
];
size_of_array = 2;
first_pointx = 100;
first_pointy = 100;
