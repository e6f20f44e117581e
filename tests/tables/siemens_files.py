"""Small files of SINUMERIK compensation tables for the tests, and what they do."""

from __future__ import annotations

import numpy as np

from ncfix.tables.control import get_control

CONTROL = get_control("siemens")
HEAD = b"""%_N_NC_CEC_INI
CHANDATA(1)
; ncfix: value_sign=error product_terms=only X=AX1 Y=AX2 Z=AX3 most_tables=40 most_points=1000
"""
ONE = b"""$AN_CEC[0,0]=0.001
$AN_CEC[0,1]=0.003
$AN_CEC[0,2]=0.002
$AN_CEC_INPUT_AXIS[0]=(AX2)
$AN_CEC_OUTPUT_AXIS[0]=(AX1)
$AN_CEC_STEP[0]=50.0
$AN_CEC_MIN[0]=-100.0
$AN_CEC_MAX[0]=0.0
$AN_CEC_DIRECTION[0]=0
$AN_CEC_MULT_BY_TABLE[0]=0
$AN_CEC_IS_MODULO[0]=0
"""
MORE = b"""$AN_CEC[1,0]=0.1
$AN_CEC[1,1]=0.2
$AN_CEC_INPUT_AXIS[1]=(AX3)
$AN_CEC_OUTPUT_AXIS[1]=(AX1)
$AN_CEC_STEP[1]=100
$AN_CEC_MIN[1]=0
$AN_CEC_MAX[1]=100
$AN_CEC_DIRECTION[1]=0
$AN_CEC_MULT_BY_TABLE[1]=0
$AN_CEC_IS_MODULO[1]=0
"""
GOOD = HEAD + ONE + b"M17\n"
PAIR = HEAD + ONE.replace(b"TABLE[0]=0", b"TABLE[0]=2") + MORE + b"M17\n"
EEC = b"""%_N_AX1_EEC_INI
CHANDATA(1)
; ncfix: X=AX1
$AA_ENC_COMP[0,0,AX1]=0.003
$AA_ENC_COMP[0,1,AX1]=0.01
$AA_ENC_COMP[0,2,AX1]=0.012
$AA_ENC_COMP_STEP[0,AX1]=100.0
$AA_ENC_COMP_MIN[0,AX1]=-200.0
$AA_ENC_COMP_MAX[0,AX1]=0.0
$AA_ENC_COMP_IS_MODULO[0,AX1]=0
M17
"""


def at(files: dict[str, bytes], ways: tuple[int, int, int] = (0, 0, 0), **place: float) -> np.ndarray:
    """The correction of X, Y, Z at a place, mm."""
    q = np.array([[place.get(axis, 0.0) for axis in "XYZ"]])
    return CONTROL.read(files).at(("X", "Y", "Z"), q, np.array([ways], dtype=float))[0]
