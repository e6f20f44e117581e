O0018
(@ dialect mitsubishi)
G21 G90 G54 G17
G0 X0 Y0 Z5. (@ X0)
G1 Z-1. F100. (@ Z-1)
G12 I10. D1 F200. (@ refused)
G0 X0 Y0 Z5. (@ X0 Y0 Z5)
G13 I10. D1 F200. (@ refused)
G0 X0 Y0 Z5. (@ X0 Y0 Z5)
M30
