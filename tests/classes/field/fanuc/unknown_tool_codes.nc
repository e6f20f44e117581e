O0030
G21 G90 G54 G17
G0 X0 Y0 Z5. (@ X0)
M6 T5
M206
G100 A5. (@ refused)
G0 X5. Y5. Z5. (@ refused)
M30
