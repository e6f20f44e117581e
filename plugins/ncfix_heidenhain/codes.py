"""The codes of the messages that appear while a Klartext program is followed."""

from __future__ import annotations

from ncfix.diagnostics import Code

KLARTEXT_CODES: dict[str, Code] = {
    "NCF271": Code(
        "no pole",
        "An arc or a polar coordinate counts from the pole, and no CC has set one that is known.",
        "Put CC with both coordinates before it.",
    ),
    "NCF272": Code(
        "no cycle",
        "CYCL CALL, M99 or M89 executes the cycle that was defined last, and none was.",
        "Put its CYCL DEF before it.",
    ),
    "NCF273": Code(
        "no plane",
        "The vectors or points of a PLANE block lie in one line, or its angles give no plane.",
        "Check its words.",
    ),
    "NCF275": Code(
        "no beginning",
        "A Klartext program begins with BEGIN PGM, its name, and MM or INCH.",
        "Check that it is Klartext, and that it was transferred completely.",
    ),
    "NCF276": Code(
        "no such label",
        "A call or a jump names a label that is not in the program.",
        "Check its LBL.",
    ),
    "NCF277": Code(
        "decided at run time",
        "Where the program goes on depends on a Q parameter that it does not set itself: a result of the control, or "
        "what an earlier program left.",
        'Give its value: variables."Q1" in the setup file.',
    ),
    "NCF278": Code(
        "stopped by the program",
        "The program checks its parameters, and stops with an error of its own (FN 14).",
        "Check the parameters with which it is called.",
    ),
    "NCF279": Code(
        "several ways to turn to a tilted plane",
        "PLANE turns the rotary axes until the tool stands square to the plane, and there is more than one way. The "
        "control takes one by its travels and parameters; here it is the nearest.",
        "Say SEQ+ or SEQ- in the program, or state the rotary axes.",
    ),
    "NCF281": Code(
        "the program measures the tool",
        "TCH PROBE 31, 33, 481, 483 and their like write the length that they find into the tool table. Where the axes "
        "stand follows from that length, and ncfix goes by the one that it is given. A tenth of a millimetre between "
        "the two changes a correction by some nanometres.",
        "Give the length that the tool has when it cuts, not that before it is measured.",
    ),
    "NCF284": Code(
        "cycle 19: spatial angles, or positions of axes",
        "A machine parameter decides whether the angles of cycle 19 are spatial angles or positions of the rotary "
        "axes. Here the axes had not been turned before, which would have shown it, and the two are different planes. "
        "They are taken as spatial angles.",
        "Turn the axes by numbers before the cycle, or use PLANE SPATIAL or PLANE AXIAL, which say what they are.",
    ),
}
