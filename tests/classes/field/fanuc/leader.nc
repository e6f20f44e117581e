($Message("a simulator's line, with brackets in it"))
%
O0041
G21 G90 G54 G17
G0 X1. Y2. Z5. (@ X1 Y2 Z5)
M30
%
G0 X9.
