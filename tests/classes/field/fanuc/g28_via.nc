O0034
G21 G90 G54 G17
G0 X5. Y5. Z10. (@ X5)
G91 G28 Z0 (@ passed)
G28 X0 Y0 (@ passed)
G90
G0 X1. Y1. Z10. (@ X1 Y1)
G30 P2 Z50. (@ passed)
G29 X5. Y5. Z10. (@ refused)
G0 X1. Y1. Z10. (@ X1)
M30
