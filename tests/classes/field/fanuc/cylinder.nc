O0020
G21 G90 G54 G17
G0 X20. C0 Y0 Z5. A0 (@ X20)
G07.1 C20. (@ refused)
G1 Z0 C30. F100. (@ refused)
G07.1 C0 (@ refused)
G0 X0 Y0 Z5. C0 A0 (@ refused)
M30
