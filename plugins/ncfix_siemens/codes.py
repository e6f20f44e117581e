"""The codes of following a SINUMERIK program, beyond those that all controls have."""

from __future__ import annotations

from ncfix.diagnostics import Code

SINUMERIK_CODES: dict[str, Code] = {
    "NCF250": Code(
        "unknown block",
        "The block has a name and is not in the form that ncfix reads. It may be a call of the machine builder, and "
        "may move axes or change coordinates.",
        "Motions after it are refused. Remove the action if the program runs without it. Correct the block or remove "
        "it.",
    ),
    "NCF251": Code(
        "synchronized action",
        "The control may execute this action at any time during the blocks after it, and the action may move axes.",
        "Motions after it are refused. Remove the action if the program runs without it.",
    ),
    "NCF252": Code(
        "unknown cycle",
        "The block calls a name, and ncfix finds no subprogram of that name. ncfix assumes a cycle of the machine "
        "builder that does not change frames, offsets or modal codes. Positions after it are not known until the "
        "program gives them.",
        "Copy the file of the subprogram to the folder of the program.",
    ),
    "NCF253": Code(
        "position of the rotary axes not unique",
        "The rotary axes turn the tool to a direction, and more than one position of them does that. Which one the "
        "control uses depends on its machine data. The message gives the one that ncfix assumes.",
        "If the control uses other positions, program the rotary axes themselves.",
    ),
    "NCF254": Code(
        "impossible tool direction",
        "A3 B3 C3 are a vector of length zero, or the rotary axes of the machine cannot turn the tool to this "
        "direction.",
        "Check the vector, and that the machine file belongs to the machine of the program.",
    ),
    "NCF255": Code(
        "work offset before a transformation",
        "TRAORI or TRAFOOF is between the work offset (G54) and a motion. Machine data decide whether the control "
        "keeps the offset (MD10602: with 0 it is cancelled, as by G500). ncfix assumes that it stays in force.",
        "Program the work offset again after TRAORI and TRAFOOF.",
    ),
    "NCF259": Code(
        "work offset after measuring",
        "A measuring cycle (CYCLE977, CYCLE978, ...) may have set the work offset. Motions after it are refused until "
        "the program selects a work offset. ncfix then uses the offset of the setup.",
        "Give approximately the offset that the probe will find. A difference of a tenth of a millimetre has little "
        "effect, because the errors of a machine change slowly with the position.",
    ),
    "NCF257": Code(
        "another transformation",
        "Machine data define TRAORI(2) and further transformations: another head, or other rotary axes. ncfix uses "
        "the kinematics of the machine file for all of them.",
        "Use the machine file of that transformation, or check that both are the same.",
    ),
    "NCF256": Code(
        "blocks cannot be renumbered",
        "Block numbers are jump targets, and here the target is not clear: a number appears more than once, or the "
        "program has a text that looks like a block number.",
        "Omit `--block-numbers renumber`, or use labels as jump targets.",
    ),
    "NCF282": Code(
        "G500 with an offset",
        "The setup gives an offset for G500, and the program selects another work offset. If the offset of G500 is a "
        "basic offset, the control adds it to each other work offset. ncfix assumes that each offset of the setup is "
        "the whole offset.",
        "If G500 is a basic offset, give the sum of both as the work offset in the setup file.",
    ),
}
