"""The codes of the compensation floor: 40x and 41x poses and paths, 42x comparing programs."""

from __future__ import annotations

from ncfix.diagnostics import Code

CODES = {
    "NCF401": Code(
        "the machine does not have the three linear axes X, Y and Z",
        "All strategies move the tool tip with X, Y and Z. Without one of them (as on many lathes) the tip cannot "
        "reach every point, so ncfix corrects nothing.",
        "Check the `topology` of the machine file.",
    ),
    "NCF402": Code(
        "the linear axes cannot reach the point",
        "At these angles of the rotary axes two linear axes move the tool along the same line in the workpiece, so "
        "some displacements of the tip are not possible.",
        "Such a pose exists on machines with linear axes both before and after a rotary axis. Change the pose.",
    ),
    "NCF403": Code(
        "no correction found",
        "ncfix searches for the command with which the tool tip of the real machine is within 1 nm of the intended "
        "point. Here the search did not converge. The error model probably has a large jump there.",
        "Look at the effects with basis `step` near that position.",
    ),
    "NCF404": Code(
        "the corrected motion leaves the range of an axis",
        "The motion as programmed is within the travel of the machine, the corrected one is not. ncfix never limits a "
        "correction, because the part would be wrong.",
        "Move the workpiece away from the end of the travel.",
    ),
    "NCF405": Code(
        "the pose is outside the calibrated range",
        "The errors are known only within the `range` of each axis. The program moves an axis beyond it, or the start "
        "or end of a block is there.",
        "Calibrate the machine over the range that the program uses, or correct the `range` in the machine file.",
    ),
    "NCF406": Code(
        "the correction is too large",
        "A correction above `max_correction` of the machine file is refused: an error in the machine file or its "
        "units is more likely than such a large error of the machine. ncfix never limits a correction.",
        "Check the machine file; set `max_correction` if the machine really needs more.",
    ),
    "NCF407": Code(
        "the correction changes too fast",
        "From one motion to the next the correction changes more than the distance between them explains. The machine "
        "would jerk and leave a mark on the surface.",
        "Look for jumps in the error model: coarse tables, steps, large backlash.",
    ),
    "NCF408": Code(
        "not a number",
        "A position or a correction is not a finite number: the start position is not known, or the error model gives "
        "NaN or infinity there.",
        "Give the start position (`initial` in the setup), or check the machine file.",
    ),
    "NCF409": Code(
        "the control's digits are too coarse for the tolerance",
        "Commands are rounded to the least increment of the control. This error is added to the tolerance, and it "
        "alone may move the tool tip by more than half of the tolerance.",
        "Use a larger tolerance, or set a smaller `least_increment` in the machine file if the control has more "
        "digits.",
    ),
    "NCF410": Code(
        "the tool direction is not fully corrected",
        "Near a pose in which a rotary axis turns the tool about its own axis, a small correction of the tool "
        "direction needs a large turn of that axis. There ncfix reduces the correction of the rotary axes and limits "
        "its size and rate. The tool tip position is corrected fully.",
        "With a ball-end tool no action is necessary; otherwise avoid the pose.",
    ),
    "NCF411": Code(
        "there is no such strategy",
        "ncfix has no strategy with the name given by `--strategy`.",
        "`ncfix fix --help` lists them.",
    ),
    "NCF412": Code(
        "the thesis' procedure does not fit the machine",
        "The thesis gives it for linear axes on the tool side and rotary axes under the workpiece, and ncfix uses it "
        "without change.",
        "Use `--strategy rotary-then-linear`, the same principle for any machine.",
    ),
    "NCF413": Code(
        "the path cannot be kept within the tolerance without splitting",
        "The motion needs to be split to keep the tolerance, but it must not be split. Usually cutter radius "
        "compensation is on, and the control calculates the contour from the motions. Other reasons: a corner that "
        "the control rounds, a subprogram call in the block, a rotary axis that may turn in the other direction, an "
        "arc with an axis that gets no word (NCF439).",
        "Let the CAM system compensate the cutter radius, or use a larger tolerance.",
    ),
    "NCF414": Code(
        "the length of the tool is not known",
        "The position of the tool tip depends on it, and so does the correction.",
        "Give it with `--tool NUMBER=LENGTH` or in the setup file.",
    ),
    "NCF415": Code(
        "an arc cannot stay an arc, and must not be split",
        "The corrected path differs too much from an arc, or the control would refuse or misread the arc. Straight "
        "pieces cannot replace it here, because the motion must not be split (see NCF413).",
        "Let the CAM system compensate the cutter radius, or use a larger tolerance.",
    ),
    "NCF416": Code(
        "more is left than the tolerance",
        "The simulation of the corrected program has a tip error that is larger than `--tolerance-um` plus the "
        "rounding to the control's digits. Possible reasons: the motion is next to one that is passed by rule or "
        "refused; the depth or retract plane of a cycle stays unchanged; the motion is at a corner that the control "
        "rounds or chamfers (RND, CHF), so it is not split and gets no word for a further axis.",
        "`ncfix verify` shows the error along the whole path and its place. A larger tolerance removes the warning, "
        "but not the error.",
    ),
    "NCF417": Code(
        "a motion is too long to be checked",
        "ncfix checks the tip error along each motion, in steps that depend on the error model. A motion of thousands "
        "of turns, or of many times the travel, needs too many steps; ncfix refuses it.",
        "Divide it into several motions, or check its number of turns.",
    ),
    "NCF418": Code(
        "the correction makes the tip error larger",
        "In the simulation both the largest and the rms tip error of the corrected program are larger than before. "
        "That happens if the errors of the machine are smaller than `--tolerance-um`, so that no block is split, or "
        "smaller than the least increment of the control.",
        "Use a tolerance below the errors of the machine, or use the original program. If the control has more "
        "digits, set a smaller `least_increment` in the machine file.",
    ),
    "NCF420": Code(
        "the corrected program does not follow the original",
        "The motions of the two programs do not match: at some point the second program does not reach the position "
        "of the first.",
        "Check that the two files belong together, and that machine, setup and tool are those of the correction.",
    ),
    "NCF430": Code(
        "the program has been corrected already",
        "It has the stamp that `ncfix fix` writes into corrected programs. A second correction is added to the first "
        "one, so the part would be wrong.",
        "Fix the original program. `--force` corrects it nevertheless.",
    ),
    "NCF431": Code(
        "a tool length is needed and not given",
        "The machine has angular errors, and their effect at the tip depends on the tool length.",
        "`--tool 12=120.0`, [tools] in the setup file, `--tool-table FILE`, or `--assume-zero`.",
    ),
    "NCF432": Code(
        "a motion that is not corrected",
        "The program does not give its path or its end, or the motion is of a kind that ncfix cannot correct "
        "(splines, threads, turning cycles, positions that are known only at run time). The block stays unchanged.",
        "Let the CAM system write lines and arcs there, or accept the uncorrected motion with `--allow-refused`. "
        "`--flatten` writes out cycles with incremental words, patterns of holes and other repetitions. For "
        "parameters that the program reads but does not set, give values in the setup file: `variables.R1 = 5`.",
    ),
    "NCF433": Code(
        "a block that would need several texts",
        "The block is executed several times and needs another correction each time. Or it must stay unchanged "
        "because a refused arc or increment after it starts from its end; the message names that line.",
        "`--flatten` writes loops and subprograms out; or accept the uncorrected motion with `--allow-refused`.",
    ),
    "NCF437": Code(
        "a tool length was taken as zero",
        "The program uses the length of this tool, which is not given. Because of `--assume-zero` ncfix uses zero.",
        "Give it with `--tool 12=120.0`.",
    ),
    "NCF438": Code(
        "the program seems to have been corrected already",
        "It has no stamp, but many of its numbers become round when the errors of this machine are added to them, as "
        "in a program that was corrected for this machine. A second correction would make the part wrong.",
        "Fix the original program. `--force` corrects this one nevertheless.",
    ),
    "NCF439": Code(
        "an axis gets no word",
        "The correction needs a word for an axis that the block does not name, but the program has not yet given the "
        "position of that axis. This is so at the start, and after machine coordinates, a reference point, a tool "
        "change, a change of the length offset or of the work offset. A word would move the axis to the position in "
        "the setup, and if that is wrong, into the part. So ncfix adds no word; the next block that names the axis "
        "gets the whole correction. The same applies to the axes of the plane (X and Y) in blocks that move only "
        "normal to it under cutter radius compensation, and after it until the program names them, because the "
        "control would offset even the smallest motion by the radius. It also applies to rapids after blocks with "
        "`/`, if the axis has another position when these are skipped.",
        "Program X, Y and Z in the first blocks, and again after such a change. For the start you can give "
        "`--initial` with `--offset` and `--tool`, without `--assume-zero`.",
    ),
    "NCF445": Code(
        "program written out flat",
        "With --flatten every block is written as often as it is executed, because some blocks need another "
        "correction each time. The corrected program has no loops, subprogram calls or expressions.",
        "Keep the original and make changes there.",
    ),
    "NCF451": Code(
        "a block that needs another correction in each position of block delete",
        "Blocks with `/` before it may be executed or skipped. The start of this block or the meaning of its words "
        "depends on that (increments, axes that it does not name, offsets and modes that a block with `/` sets), and "
        "so does its correction. One text cannot be right for both.",
        "After blocks with `/` program all axes with absolute words; or use `--block-skip on` or `off` if the switch "
        "is always in that position.",
    ),
    "NCF452": Code(
        "too many switches of block delete",
        "Each switch (`/2`, `/3`, ...) may be on or off while the program runs. ncfix corrects and proves the program "
        "for each combination of positions, and here there are too many.",
        "Give the positions with `--block-skip on`, `off`, or the numbers of the switches that are on.",
    ),
    "NCF453": Code(
        "no corrected text is right in all positions of block delete",
        "ncfix corrected the program for each position of its switches and read the combined text again. In one "
        "position the control would execute it differently, so nothing is written.",
        "Use `--block-skip on` or `off` if the switch is always in that position; or use fewer blocks with `/` that "
        "change modes, poles, frames or starts of arcs.",
    ),
    "NCF447": Code(
        "not written out flat",
        "A program with / blocks must be right with block delete on and off. A flat program would have the numbers of "
        "one of these positions, also in blocks that are executed in both.",
        "Give --block-skip on or off; the stamp then says for which position the program is.",
    ),
    "NCF446": Code(
        "length offset that is not the tool length",
        "The length offset in force is negative: the tool was set by touching off, or the offset is subtracted (G44). "
        "The errors of this machine depend on the real tool length, which such an offset does not give.",
        "Give the length from the gauge line to the tip (`--tool 1=120`), and make the work offset lower by the "
        "difference between that and the offset: with H1 = -300 and a tool of 120 mm, Z of the work offset is 420 mm "
        "lower. With G44 use G43 and such a length.",
    ),
    "NCF454": Code(
        "a contour that the control would make worse",
        "Cutter radius compensation is on, so the control calculates the path of the tool from the corrected contour. "
        "At a corner this path is the intersection of the offset lines, and at a sharp corner small corrections move "
        "it far. There the tool would be beyond the tolerance and farther off than without a correction, so the whole "
        "contour stays uncorrected.",
        "Let the CAM system compensate the cutter radius, or use a larger tolerance.",
    ),
    "NCF283": Code(
        "split motions under exact stop",
        "G60 or G61 is in force, so the control stops at the end of every block. If ncfix splits a motion to keep the "
        "tolerance, the control stops at the end of each piece, too, and the tool may leave marks.",
        "Program continuous path mode (G64) where no exact stop is needed, or use a larger tolerance.",
    ),
    "NCF285": Code(
        "a cut begins with an unknown side of backlash",
        "The position of an axis with backlash depends on the direction of its last motion. Here this direction is "
        "not known: the program has not moved the axis before the cut, or has moved it from an unknown position (the "
        "start of the program, a reference point, machine coordinates). ncfix assumes the middle of the backlash "
        "until the axis moves, and then the side of its motion. At the start of the cut the tip may be off by the "
        "backlash, or by half of it if the axis does not move. The figures of the report do not include this.",
        "Before the first cut move these axes farther than their backlash, for example with an approach from a "
        "programmed position. `--initial X=0` gives the position of an axis at the start.",
    ),
    "NCF456": Code(
        "turns of rotary axes get inverse time",
        "F of a block that moves only rotary axes is in degrees per minute. If its correction also moves a linear "
        "axis, many controls use F as the speed of that axis, and would turn much too fast. So ncfix gives such a "
        "block its original duration in inverse time (G93), and programs G94 and the previous F after it.",
        "Check that the control has G93. It is not necessary if the post-processor uses tool-centre-point control for "
        "rotary motions.",
    ),
    "NCF455": Code(
        "the radius of the tool is not known",
        "Cutter radius compensation is on. ncfix corrects the contour, and the figures are those of the contour. "
        "Without the radius it cannot calculate the path of the tool that the control makes from it.",
        "Give the radius with `--tool NUMBER=LENGTH,RADIUS`, or as `radius` in the setup file.",
    ),
}
