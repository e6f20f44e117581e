"""The codes of the messages that appear while a Klartext program is followed."""

from __future__ import annotations

from ncfix.diagnostics import Code

KLARTEXT_CODES: dict[str, Code] = {
    "NCF271": Code(
        "no pole",
        "An arc or a polar coordinate needs the pole, but no CC has set one, or its position is not known.",
        "Program CC with both coordinates before it.",
    ),
    "NCF272": Code(
        "no cycle",
        "CYCL CALL, M99 or M89 executes the cycle that was defined last, but the program has defined none.",
        "Program its CYCL DEF before it.",
    ),
    "NCF273": Code(
        "no plane",
        "The vectors or points of a PLANE block are in one line, or its angles do not define a plane.",
        "Check the words of the block.",
    ),
    "NCF275": Code(
        "no BEGIN PGM",
        "A Klartext program begins with BEGIN PGM, its name, and MM or INCH.",
        "Check that the file is Klartext, and that it was transferred completely.",
    ),
    "NCF276": Code(
        "no such label",
        "A call or a jump goes to a label that is not in the program.",
        "Add the LBL, or correct the call or jump.",
    ),
    "NCF277": Code(
        "decided at run time",
        "A jump depends on a Q parameter that the program does not set: a result of the control, or a value from an "
        "earlier program.",
        'Give its value: variables."Q1" in the setup file.',
    ),
    "NCF278": Code(
        "stopped by the program",
        "The program checks its parameters, and stops with an error of its own (FN 14).",
        "Check the values of its parameters.",
    ),
    "NCF279": Code(
        "several ways to turn to a tilted plane",
        "PLANE turns the rotary axes until the tool is normal to the plane, and more than one position of them does "
        "that. Which one the control uses depends on its travels and parameters. ncfix assumes the nearest.",
        "Program SEQ+ or SEQ-, or the rotary axes themselves.",
    ),
    "NCF281": Code(
        "the program measures the tool",
        "TCH PROBE 31, 33, 481, 483 and similar cycles write the measured length into the tool table. The positions "
        "of the axes depend on that length; ncfix uses the length of the setup. A difference of a tenth of a "
        "millimetre changes a correction by some nanometres.",
        "Give the length of the tool when it cuts, not the length before the measurement.",
    ),
    "NCF284": Code(
        "cycle 19: spatial angles, or positions of axes",
        "A machine parameter decides whether the angles of cycle 19 are spatial angles or positions of the rotary "
        "axes. Here the two give different planes, and the positions of the rotary axes before the cycle do not show "
        "which one is meant. ncfix assumes spatial angles.",
        "Position the rotary axes before the cycle with plain numbers, or use PLANE SPATIAL or PLANE AXIAL.",
    ),
}
