"""The classes of blocks in SINUMERIK: right, passed or refused; never silently wrong."""

from __future__ import annotations

import pytest

from classes.judging import Case, judged

HEAD = "G710 G90 G94 G17 G40 G54\nG0 X1 Y2 Z50\n"
"""Two lines; the second is the motion to the start."""

R, P, N = "right", "passed", "refused"


def case(name: str, body: str, **lines: str) -> Case:
    """A case after the head; lines of the body are counted from 3, as `L3`."""
    return Case(name, HEAD + body + "\nM30\n", {2: R} | {int(key[1:]): what for key, what in lines.items()})


WORDS = [
    case("G0 and G1 with all words", "G1 X5 Y6 Z7 F100", L3=R),
    case("omitted words", "G1 X5 F100\nZ3\nG0 Y9", L3=R, L4=R, L5=R),
    case("packed words", "G1X5Y6Z7F100\nG0X-.5", L3=R, L4=R),
    case("words with =", "G1 X=5 Y=-6.5 F100\nZ = 7", L3=R, L4=R),
    case("AC and IC", "G1 X=IC(5) Y=AC(3) F100\nG91 X1 Y=AC(7)", L3=R, L4=R),
    case("G91", "G91\nG1 X5 F100\nX5 Y1\nG90 X0", L4=R, L5=R, L6=R),
    case("an increment from nobody knows where", "HEAD_CLEAN\nG91 G0 X5\nG90 X7 Y7 Z7", L4=N, L5=R),
    case("inches", "G700\nG1 X1 Y.5 F10\nG91 X.25", L4=R, L5=R),
    case("diameters", "DIAMON\nG1 X5 F100\nDIAMOF\nX7", L4=R, L6=R),
    case("no X beside diameters", "DIAM90\nG1 X6 F100\nG91 Y1\nG3 I-4 J1\nG90 G1 X7", L4=R, L5=N, L6=N, L7=R),
    case("radii beside diameters", "DIAM90\nG1 X6 F100\nG91 X1", L4=R, L5=N),
    case("expressions of constants", "R1=5\nDEF REAL DEEP=-2\nG1 X=R1*2 Z=DEEP F100", L5=R),
    case("a frame variable", "$P_UIFR[1,X,TR]=5\nG54 G1 X5 F100", L4=N),
    case("tool data", "$TC_DP3[1,1]=100\nG1 X5 F100", L4=N),
    case("a value of the machine", "G1 X=$AA_IW[X]+1 F100\nG1 X5", L3=N, L4=N),
    case("block skip", "/G0 X5\nG0 Y5", L3=R, L4=R),
    case("dwell", "G4 F1\nG1 X5 F100", L4=R),
    case("rounding at the corner", "G1 X5 RND=2 F100\nY20", L3=R, L4=R),
    case("a contour by an angle", "G1 X5 ANG=45 F100", L3=N),
    case("a positioning axis", "POS[X]=5\nG0 X7", L3=N, L4=R),
    case(
        "a soft approach to where the next block says", "G147 DISR=5\nG1 X5 Y5 F100\nG0 X7 Y7 Z7\nX8", L4=N, L5=R, L6=R
    ),
    case("a curve table", "CTABDEF(Y,X,1,0)\nX5 Y5\nCTABEND\nG0 X7\nG0 X5 Y5 Z5", L4=N, L6=P, L7=R),
    case("where a polynomial ends", "POLY PO[X]=(35,1,0.5) PO[Y]=(9) F100\nG1 X5\nX6 Y5", L3=N, L4=R, L5=R),
    case("a polynomial to nobody knows where", "POLY PO[X]=($AA_IW[Y],1) F100\nG1 Y5\nX6 Y5", L3=N, L4=N, L5=N),
    case("an axis named by a variable", "DEF AXIS WAY=X\nAX[WAY]=5\nG0 X7", L4=N, L5=R),
    case("a computed G code", "G=R1 X5", L3=N),
    case("a G code named by its group", "G[8]=3\nG1 X5 F100", L4=N),
    case("a fixed stop", "FXS[X]=1 G1 X5 F100\nG0 X7", L3=N, L4=N),
    case("a variable that its block sets", "R1=5\nR1=7 G1 X=R1 F100\nG0 X9", L4=N, L5=R),
    case("an array", "DEF REAL ROW[3]=(5,6,7)\nROW[0]=SET(1,2)\nG1 X=ROW[1] Y=ROW[2] F100", L5=R),
    case("an array of one value", "DEF REAL ROW[2,2]=REP(4)\nROW[0,0]=$AA_IW[X]\nG1 X=ROW[1,1] F100", L5=R),
    case("texts", 'DEF STRING[9] NAME="M10"\nIF SUBSTR(NAME,1,2)=="10"\nG1 X=STRLEN(NAME) F100\nENDIF', L5=R),
    case("a workpiece for the screen", 'WORKPIECE(,,,"BOX",0,0,-9,-9,0,0,9,9)\nNORM SETPIECE(1)\nG1 X5 F100', L5=R),
]
ARCS = [
    case("arc with a centre", "G2 X11 Y12 I10 J0 F100", L3=R),
    case("arc with an absolute centre", "G2 X11 Y12 I=AC(11) J=AC(2) F100", L3=R),
    case("arc with a radius", "G2 X11 Y12 CR=10 F100", L3=R),
    case("arc with an opening angle and an end", "G3 X11 Y12 AR=90 F100", L3=R),
    case("arc with an opening angle and a centre", "G3 I0 J10 AR=90 F100", L3=R),
    case("arc with an opening angle, centre across the plane", "G3 X11 Y12 K1 AR=90 F100\nG0 X5 Y5 Z5", L3=N, L4=R),
    case("arc with the angle of a contour", "G2 X11 Y12 I10 J0 ANG=45 F100\nG0 X5 Y5 Z5", L3=N, L4=R),
    case("full circle", "G3 I10 J0 F100", L3=R),
    case("several turns", "G3 I10 J0 Z40 TURN=2 F100", L3=R),
    case("arc through a point", "CIP X21 Y2 I1=11 J1=12 F100\nG1 X5", L3=R, L4=R),
    case("arc through a point, and more turns", "CIP X21 Y2 I1=11 J1=12 TURN=1 F100", L3=R),
    case("absolute centre in diameters", "DIAMON\nG1 X2 F100\nG2 X22 Y2 I=AC(12) J=AC(2)", L2=N, L4=N, L5=N),
    case("helix", "G2 X11 Y12 Z40 I10 J0 F100", L3=R),
    case("tangential arc", "G1 X5 F100\nCT X10 Y5\nX15 Y2\nG1 X20", L3=R, L4=R, L5=R, L6=R),
    case("tangential arc that is a line", "G1 X5 F100\nCT X10\nY5\nG1 X20", L3=R, L4=R, L5=R, L6=R),
    case("tangential helix", "G1 X5 F100\nCT X10 Y5 Z40 TURN=1\nG1 X20", L3=R, L4=R, L5=R),
    case("tangential arc after nobody knows what", "SUPA G1 Z1 F100\nCT X10 Y5 Z5\nG1 X20", L2=N, L3=P, L4=N, L5=R),
    case("splines", "BSPLINE X5 Y5 F100\nX10\nG1 X20", L3=N, L4=N, L5=R),
    case("polynomials", "POLY PO[X]=(5,1) F100\nG1 X20 Y5 Z5", L3=N, L4=R),
    case("an arc of the tip", "TRAORI\nG2 X11 Y12 I10 J0 F100\nTRAFOOF\nG0 X1 Y1 Z50", L4=R, L6=R),
    case("cutter compensation", "G41 D1 G1 X5 F100\nX20\nY20\nG40 X30", L3=R, L4=R, L5=R, L6=R),
    case("soft approach", "G147 G41 DISR=5 X5 Y5 F100\nG0 X1 Y1 Z1", L3=N, L4=R),
]
FRAMES = [
    case("another work offset", "G55\nG1 X5 F100", L4=R),
    case("no work offset", "G500\nG1 X5 F100", L4=R),
    case("TRANS and ATRANS", "TRANS X3\nATRANS Y2\nG1 X5 F100\nTRANS\nX7", L5=R, L7=R),
    case("ROT", "ROT RPL=30\nG1 X5 Y6 Z7 F100\nROT\nX1", L4=R, L6=R),
    case("ROT in space", "ROT X10 Y20 Z30\nG1 X5 Y6 Z7 F100", L4=R),
    case("MIRROR", "MIRROR X0\nG1 X5 F100\nG2 X15 Y2 CR=5", L4=R, L5=R),
    case("SCALE alike", "SCALE X2 Y2 Z2\nG1 X5 Y6 Z7 F100", L4=R),
    case("SCALE of one axis", "SCALE X2\nG1 X5 F100\nSCALE\nX7 Y7 Z7", L4=N, L6=N),
    case("a frame that only the control knows", "TRANS X=$AA_IW[X]\nG1 X5 F100\nTRANS\nG0 X1 Y1 Z50", L4=N, L6=R),
    case("limits of the working area", "G25 X-100 Y-100\nG26 X100 Y100 S900\nG1 X5 F100", L5=R),
    case("SUPA", "SUPA G0 Z0\nG0 X5 Y5 Z20", L3=P, L4=R),
    case("G53 and G153", "G53 G0 Z0\nG153 Z1\nG0 X5 Y5 Z20", L3=P, L4=P, L5=R),
    case("reference and fixed points", "G74 Z1=0\nG75 X1=0\nG0 X5 Y5 Z20", L3=P, L4=P, L5=R),
    case("measuring", "MEAS=1 G1 Z0 F100\nG0 X5 Y5 Z20", L3=P, L4=R),
    case("measuring by axis", "MEASA[Z]=(1,1) G1 Z0 F100\nG0 X5 Y5 Z20", L3=P, L4=R),
    case("tool length", "T3 M6\nG1 Z5 F100\nD0 Z80", L4=R, L5=R),
    case("polar", "G111 X5 Y5\nG1 AP=30 RP=10 F100\nAP=60 RP=10", L4=R, L5=R),
    case("polar with words left out", "G111 X5 Y5\nG1 AP=30 RP=10 F100\nAP=60\nRP=12", L4=R, L5=R, L6=R),
    case("polar with words left out and a probe", "G111 X5 Y5\nG1 AP=30 RP=10 F100\nMEAS=1 AP=60", L4=N, L5=P),
    case("arcs about the pole", "G111 X1 Y2\nG1 X11 F100\nG3 AP=90 RP=10\nG2 AP=0", L2=R, L4=R, L5=R, L6=R),
    case("an arc about the pole with a radius", "G111 X1 Y12\nG3 AP=90 RP=10 CR=9 F100\nG1 X5 Y5", L2=N, L4=N, L5=R),
    case("polar and an axis of the plane", "G111 X5 Y5\nG1 AP=30 RP=10 X9 F100\nG0 X9 Y9 Z60", L4=N, L5=R),
    case("polar in diameters", "DIAMON\nG111 X5 Y5\nG1 AP=30 RP=10 F100\nX9 Y9", L5=N, L6=R),
    case("TRAORI", "TRAORI\nG1 X5 Y6 Z7 F100\nTRAFOOF\nG0 X1 Y1 Z50", L4=R, L6=R),
    case("turning, X not said", "G96 S100 M4\nG1 X6 F0.1\nDIAMOF\nX7\nG961\nX8", L4=N, L6=N, L8=R),
    case("turning at any feed, X not said", "F100\nG962 S100 M4\nG1 X6\nDIAMOF\nX7", L5=N, L7=N),
    case("diameters by axis", "DIAMONA[X]\nG1 X5 F100", L4=N),
    case("a tool carrier", "TCARR=1\nG1 X5 F100", L4=N),
    case("a program from elsewhere", 'EXTCALL("PART")\nG1 X5 F100', L4=N),
    case("point to point", "PTP\nG1 X5 F100\nCP\nG0 X1 Y1 Z50", L4=N, L6=R),
    case("a preset position", "PRESETON(X,5)\nTRAFOOF\nG1 X5 F100\nG0 X1 Y1 Z50", L5=N, L6=N),
    case("a frame along the tool", "TOROT\nTRAFOOF\nG1 X5 F100\nTOROTOF\nG0 X1 Y1 Z50", L5=N, L7=R),
    case("TRAORI with a direction", "TRAORI(1,0,0,1)\nG1 X5 F100", L4=N),
    case("TRANSMIT", "TRANSMIT\nG1 X5 F100\nTRAFOOF\nG0 X1 Y1 Z50", L4=N, L6=R),
    case("CYCLE800 over a programmed frame", "TRANS X5\nCYCLE800()\nG1 X5 F100\nTRANS\nX7", L5=N, L7=N),
    case("CYCLE800 deselected", 'CYCLE800(1,"0",0,57,0,0,0,0,0,0,0,0,0,-1)\nG0 X5\nG0 X5 Y5 Z60', L4=P, L5=R),
    case("CYCLE800 that aligns the tool", 'CYCLE800(0,"T",100,57,0,0,0,9,0,0,0,0,0,-1)\nG0 X1 Y1 Z60', L4=N),
    case(
        "CYCLE800 at zero that turns nothing",
        'CYCLE800(0,"T",0,57,1,2,0,0,0,0,0,0,0,0)\nG0 X1 Y1 Z60\nG1 X5',
        L4=R,
        L5=R,
    ),
    case("CYCLE800 that turns nothing", 'CYCLE800(0,"T",0,57,0,0,0,9,0,0,0,0,0,0)\nG0 X1 Y1 Z60', L4=N),
    case("CYCLE800 without rotary axes", "CYCLE800()\nG1 X5 F100", L4=R),
]
FLOW = [
    case("a branch that is decided", "R1=1\nIF R1==1\nG1 X5 F100\nELSE\nG1 X6 F100\nENDIF\nY7", L5=R, L9=R),
    case("a branch decided at run time", "IF $A_IN[1]==1\nG1 X5 F100\nENDIF\nG1 X7", L4=N, L6=N),
    case("a loop", "FOR R1=1 TO 2\nG1 X=R1 F100\nENDFOR\nX7", L4=N, L6=R),
    case("a jump", "GOTOF DOWN\nG0 X99\nDOWN: G0 X5", L5=R),
    case(
        "a subprogram from two places",
        "SUB1\nG0 X9\nSUB1\nM30\n%_N_SUB1_SPF\nG1 X5 Y5 Z5 F100\nM17",
        L4=R,
        L8=R,
    ),
    case("a subprogram by a text", 'CALL "_N_SUB1_SPF"\nM30\n%_N_SUB1_SPF\nG1 X5 F100\nM17', L6=R),
    case("a subprogram in the text", "SUB1\nM30\n%_N_SUB1_SPF\nG1 X5 F100\nM17", L6=R),
    case("a cycle nobody knows", "HEAD_CLEAN\nG1 X5 F100\nG0 X1 Y1 Z1\nX3", L4=N, L5=R, L6=R),
    case("a block nobody understands", 'OTHER "x" 5\nG1 X5 F100', L4=N),
    case("drilling cycle", "CYCLE81(50,0,2,-20)\nG0 X5", L3=R, L4=R),
    case(
        "a modal subprogram",
        "MCALL SUB1\nX5\nMCALL\nX7\nG0 X1 Y1 Z1\nM30\n%_N_SUB1_SPF\nG91 G1 Z-5 F100\nM17",
        L4=N,
        L6=N,
        L7=R,
    ),
    case(
        "a modal subprogram by its number",
        "MCALL L7\nX5\nMCALL\nG0 X1 Y1 Z1\nM30\n%_N_L7_SPF\nG91 G1 Z-5 F100\nM17",
        L4=N,
        L6=R,
    ),
    case("a subprogram that only the control knows", "L=R5\nG0 X1 Y1 Z1", L4=N),
    case("a modal pocket", "MCALL POCKET3(50,0,2,-20)\nX5 Y5\nMCALL\nG1 X7 F100\nG0 X1 Y1 Z1", L4=R, L6=N, L7=R),
    case("a macro of the program", "DEFINE MILL AS G1 F100\nMILL X5\nG0 X1 Y1 Z1", L4=N, L5=N),
    case("a cycle of the control", "CYCLE830(50,0,2,-20)\nG0 X5 Y5 Z5", L3=N, L4=R),
    case("a subprogram that is called like a cycle", "POCKET7\nM30\n%_N_POCKET7_SPF\nG1 X5 F100\nM17", L6=R),
    case("a call of a contour", 'CYCLE62("SHAPE",1,,)\nG1 X5 F100', L4=R),
    case("measuring that sets nothing", "CYCLE978(100,0,,1,0,5,10,1,1)\nG0 X5 Y5 Z20\nG1 X7", L3=P, L4=R, L5=R),
    case("measuring, as before", "_KNUM=0\nCYCLE978\nG0 X5 Y5 Z20", L4=P, L5=R),
    case("measuring a tool", "CYCLE971(1,0,1,1)\nG0 X5 Y5 Z20", L3=P, L4=R),
    case("measuring a work offset", "CYCLE978(100,10001,,1,0,5,10)\nG0 X5 Y5 Z20\nG54 X1\nX7", L3=P, L4=N, L5=R, L6=R),
    case("a place to return to", 'SUB1\nG0 X5\nM30\n%_N_SUB1_SPF\nG0 X3\nRET("DOWN")', L4=N, L7=R),
    case("a row of holes", "HOLES1(0,0,0,10,10,5)\nG0 X5 Y5 Z5", L3=N, L4=R),
    case("holes on a circle", "MCALL CYCLE81(50,0,2,-5)\nHOLES2(0,0,9,0,0,5)\nMCALL\nG0 X5 Y5 Z5", L4=N, L6=R),
    case("a synchronized action", "WHEN TRUE DO $A_OUT[1]=1\nG1 X5 F100\nID=1 DO POS[X]=5\nX7", L4=R, L6=N),
]


FLAT = [
    Case("modal drilling cycle", f"{HEAD}MCALL CYCLE81(50,0,2,-20)\nX5 Y5\nX9\nMCALL\nG0 X1\nM30\n", {0: R}, flat=True),
    Case("a loop", f"{HEAD}FOR R1=1 TO 3\nG1 X=R1*2 Y=IC(R1) F100\nENDFOR\nX9\nM30\n", {0: R}, flat=True),
    Case("a section repeated", f"{HEAD}G91\nMARK: G1 X1 F100\nREPEATB MARK P=3\nG90 X9\nM30\n", {0: R}, flat=True),
    Case(
        "a subprogram from two places",
        f"{HEAD}SUB1(5)\nSUB1(7)\nM30\n%_N_SUB1_SPF\nPROC SUB1(REAL WIDE)\nG91 G1 X=WIDE F100\nG90\nM17\n",
        {0: R},
        flat=True,
    ),
]
"""What is executed several times, with --flatten, and what gets lines of its own: judged motion by motion."""


@pytest.mark.parametrize("each", FLAT, ids=lambda each: each.name)
def test_flat_programs(each: Case) -> None:
    assert judged(each, "siemens") == each.expected


@pytest.mark.parametrize("each", [*WORDS, *ARCS, *FRAMES, *FLOW], ids=lambda each: each.name)
def test_classes_of_siemens(each: Case) -> None:
    assert judged(each, "siemens") == each.expected
