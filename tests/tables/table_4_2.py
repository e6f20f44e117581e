"""The 84 coefficients of Esmaeili Marzdashti (2021), Table 4-2, as a machine: wCBXFZYSt, mm and rad.

Degrees 0 to 3 in turn, b for the part that changes sign with the direction of motion. E_XB3, which is printed as E_YB3
in the thesis, is taken for what it must be. Location errors and frames are in the terms of degree 0 and 1, so that the
raw error is large; grids do not mind, since they hold what is linear exactly.
"""

from __future__ import annotations

from ncfix.machine import Machine, loads

AXES = """
ncfix = 1
name = "Table 4-2"
topology = "w C B X F Z Y t"
max_correction = { linear = 20.0, rotary = 5.0 }
axis.X = { type = "linear", direction = [-1, 0, 0], range = [-305, 305] }
axis.Y = { type = "linear", direction = [0, 1, 0], range = [-280, 280] }
axis.Z = { type = "linear", direction = [0, 0, 1], range = [0, 560] }
axis.B = { type = "rotary", direction = [0, -1, 0], range = [-90, 90] }
axis.C = { type = "rotary", direction = [0, 0, -1], range = [-360, 360] }
"""
LENGTH = 275.86
"""mm, of the probe."""
TABLE = """
XX1 -3.13E-04, XX2 7.53E-08, XX3 1.35E-10, YX2 -2.74E-09, YX3 1.22E-10, ZX2 -1.57E-08, ZX3 -1.32E-11, AX0 -5.99E-04,
AX1 2.86E-08, AX2 2.97E-10, AX3 -1.82E-13, BX1 -7.27E-08, BX2 -1.10E-10, BX3 3.61E-13, CX0 -3.62E-03, CX1 6.46E-08,
CX2 -2.59E-11, CX3 -1.82E-12,
XY0 -2.41E-02, XY2 3.43E-08, XY3 -5.12E-10, YY0 6.10E-02, YY1 -1.09E-04, YY2 -2.46E-08, YY3 3.64E-11, ZY2 3.30E-08,
ZY3 -1.19E-10,
XZ1 2.29E-04, XZ2 -6.27E-07, XZ3 5.55E-10, YZ2 5.12E-07, YZ3 -3.06E-10, ZZ1 1.04E-04, ZZ2 -3.76E-07, ZZ3 3.26E-10,
AZ0 -2.60E-04, AZ1 -1.15E-07, AZ2 4.06E-10, AZ3 -5.07E-13, CZ0 -4.28E-04, CZ1 3.47E-06, CZ2 -8.99E-09, CZ3 7.56E-12,
XB0 -1.08E-01, XB1 -1.21E-02, XB2 4.19E-02, XB3 1.53E-02, YB1 -1.58E-03, YB2 -4.16E-04, YB3 -4.16E-04, ZB1 -1.08E-02,
ZB2 -4.89E-02, ZB3 1.05E-02, AB0 3.00E-04, AB1 -3.62E-04, AB2 -1.30E-04, AB3 5.03E-05, BB0 1.95E-05, BB1 -2.39E-05,
BB2 3.92E-06, BB3 1.51E-05, BBb 7.12E-06, CB1 3.13E-04, CB2 -1.55E-04, CB3 -4.66E-05,
XC1 -5.06E-04, XC2 2.81E-05, XC3 3.39E-05, YC1 2.08E-04, YC2 -7.80E-05, YC3 -2.51E-05, ZC1 -2.74E-04, ZC2 -4.94E-05,
ZC3 1.40E-05, AC1 5.41E-07, AC2 -1.35E-08, AC3 -5.51E-08, BC1 1.89E-06, BC2 -5.42E-08, BC3 -1.58E-07, CC1 1.64E-06,
CC2 9.84E-08, CC3 -9.73E-08, CCb 5.76E-06
"""
RADIAN = 57.29577951308232


def coefficients() -> dict[str, float]:
    """Component, axis and degree -> value."""
    pairs = (each.split() for each in TABLE.replace("\n", " ").split(","))
    return {name: float(value) for name, value in pairs}


def machine() -> Machine:
    """The machine; polynomials over rotary axes are in radians."""
    text = AXES
    for name, value in coefficients().items():
        kind = "backlash" if name[2] == "b" else "polynomial"
        degree = 0 if name[2] == "b" else int(name[2])
        text += f'[[effect]]\nname = "E{name[:2]}"\nbasis = "{kind}"\ndegree = [{degree}]\n'
        size = 2 * value if kind == "backlash" else value
        text += f"scale = {RADIAN if name[1] in 'BC' else 1.0}\ncoefficients = [{size}]\n"
    return loads(text)
