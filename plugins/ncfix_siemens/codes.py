"""The codes of following a SINUMERIK program, beyond those that all controls have."""

from __future__ import annotations

from ncfix.diagnostics import Code

SINUMERIK_CODES: dict[str, Code] = {
    "NCF250": Code(
        "block not understood",
        "The block holds a name, and does not fit the grammar of the language: it may be a call of the machine's "
        "builder, and may move axes or change coordinates.",
        "Motions after it are refused. Correct the block, or take it out.",
    ),
    "NCF251": Code(
        "synchronized action",
        "The control may do this at any time while the blocks that follow are executed, and it may move axes.",
        "Motions after it are refused.",
    ),
    "NCF252": Code(
        "cycle not known",
        "A name stands alone in a block, and no subprogram of that name is here. It is taken as a cycle of the "
        "machine's builder that leaves frames, offsets and modal codes as they are; where the axes stand after it is "
        "not known until the program says so.",
        "Put the file of the subprogram beside the program.",
    ),
    "NCF253": Code(
        "way of the rotary axes",
        "Rotary axes turn until the tool stands along a direction, and there is more than one way. Which one a control "
        "takes depends on its machine data; here it is the one that the message says.",
        "State the rotary axes in the program if they are others.",
    ),
    "NCF254": Code(
        "impossible direction of the tool",
        "A3 B3 C3 have no length, or the rotary axes of the machine cannot point the tool that way.",
        "Check the vector, and that the machine file is that of the machine the program was written for.",
    ),
    "NCF255": Code(
        "work offset over a transformation",
        "TRAORI or TRAFOOF stands between the work offset (G54) and a motion. Whether the control keeps the offset "
        "depends on its machine data (MD10602: 0 takes it out, as G500 would); here it stays.",
        "Program the work offset anew after TRAORI and TRAFOOF.",
    ),
    "NCF259": Code(
        "work offset after measuring",
        "A measuring cycle (CYCLE977, CYCLE978, ...) may have set the work offset. Motions behind it are refused until "
        "the program calls a work offset; that is taken to be what the setup gives.",
        "Give the offset that the probe is about to find. A tenth of a millimetre beside it matters little: errors of "
        "machines change slowly with the position.",
    ),
    "NCF257": Code(
        "another transformation",
        "TRAORI(2) and further ones are what the machine's data say: another head, or other rotary axes. The tool is "
        "followed by the kinematics of the machine file, whichever is called.",
        "Correct with the machine file of that transformation, or check that both are the same.",
    ),
    "NCF256": Code(
        "blocks cannot be numbered anew",
        "Block numbers are targets of jumps, and here nobody can tell which block is meant: a number stands more than "
        "once, or a text that looks like one stands in the program.",
        "Leave out `--block-numbers renumber`, or jump to labels.",
    ),
    "NCF282": Code(
        "G500 with an offset",
        "The setup gives G500 an offset, and the program calls another work offset. If that of G500 is a basic offset, "
        "the control adds it to every other one, too; here each is taken to be all that acts.",
        "In the setup file give the work offset as the sum of both.",
    ),
}
