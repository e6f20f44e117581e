G21 G90
G0 X1
G1 X2 (outer (inner) text)
M30
