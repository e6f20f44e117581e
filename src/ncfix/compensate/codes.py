"""The codes of the compensation floor: 40x and 41x poses and paths, 42x comparing programs."""

from __future__ import annotations

from ncfix.diagnostics import Code

CODES = {
    "NCF401": Code(
        "the machine has no three linear axes X, Y and Z",
        "Strategies move the tool tip with X, Y and Z. Without one of them (a lathe, say) the tip cannot be brought to "
        "every point, and nothing is corrected.",
        "Check the `topology` of the machine file.",
    ),
    "NCF402": Code(
        "the linear axes cannot reach the point",
        "With the rotary axes where they are, two of the linear axes move the tool along the same line in the "
        "workpiece, so some displacements of the tip are not possible.",
        "Such a pose exists on machines with a linear axis on each side of a rotary one. Change the pose.",
    ),
    "NCF403": Code(
        "no correction found",
        "The corrected command is sought until the tool tip of the erroneous machine is within 1 nm of where it should "
        "be. Here the search did not end. The error model probably has a jump there, larger than the tip can avoid.",
        "Look at the effects with basis `step` near that position.",
    ),
    "NCF404": Code(
        "the corrected motion leaves the range of an axis",
        "The motion as programmed is within the travel of the machine, the corrected one is not. Corrections are never "
        "cut short: the part would be wrong.",
        "Move the workpiece away from the end of the travel.",
    ),
    "NCF405": Code(
        "the pose is outside the calibrated range",
        "The errors are known within the `range` of each axis; beyond it the last value would be held, which is a "
        "guess. The program itself goes there, or comes back from there in blocks of which one ends there.",
        "Calibrate the machine over the range that is used, or correct the `range` in the machine file.",
    ),
    "NCF406": Code(
        "the correction is too large",
        "A correction above `max_correction` of the machine file is refused: more likely the machine file or the "
        "units are wrong than the machine is that bad. It is never cut short.",
        "Check the machine file; set `max_correction` if the machine really needs more.",
    ),
    "NCF407": Code(
        "the correction changes too fast",
        "From one motion to the next the correction changes by more than the way between them accounts for. The "
        "machine would jerk, and the surface would show it.",
        "Look for jumps in the error model: coarse tables, steps, a large play.",
    ),
    "NCF408": Code(
        "not a number",
        "A position or a correction is not a finite number: the start position is not known, or the error model gives "
        "NaN or infinity there.",
        "Give the start position (`initial` in the setup), or check the machine file.",
    ),
    "NCF409": Code(
        "the control's digits are too coarse for the tolerance",
        "Commands are rounded to what the control resolves. That comes on top of the tolerance, and alone may move the "
        "tool tip by more than half of it.",
        "Ask for a larger tolerance, or set `least_increment` in the machine file if the control resolves more.",
    ),
    "NCF410": Code(
        "the tool direction is not fully corrected",
        "Near a pose in which a rotary axis turns the tool about itself, a small tilt would need a large turn. The "
        "correction of the rotary axes is damped there, and limited in size and rate; the tool tip is held exactly.",
        "Nothing to do if the tool is a ball; else avoid the pose.",
    ),
    "NCF411": Code(
        "there is no such strategy",
        "The name given with `--strategy` is none of those that ncfix has.",
        "`ncfix fix --help` lists them.",
    ),
    "NCF412": Code(
        "the thesis' procedure does not fit the machine",
        "It is printed for linear axes on the tool side and rotary axes under the workpiece, and kept as it is.",
        "`--strategy rotary-then-linear` is the same idea for any machine.",
    ),
    "NCF413": Code(
        "the path cannot be kept within the tolerance without splitting",
        "The motion would have to be split, and must not be: cutter radius compensation is on, and the control works "
        "out the contour from the motions as they are.",
        "Let the CAM system compensate the cutter radius, or ask for a larger tolerance.",
    ),
    "NCF414": Code(
        "the length of the tool is not known",
        "Where the tool tip is depends on it, and so does the correction.",
        "Give it with `--tool NUMBER=LENGTH` or in the setup file.",
    ),
    "NCF415": Code(
        "an arc cannot stay an arc, and must not be split",
        "The corrected path is not round enough for an arc, or the control would refuse or misunderstand it, and "
        "straight pieces may not be put in its place here (cutter radius compensation).",
        "Let the CAM system compensate the cutter radius, or ask for a larger tolerance.",
    ),
    "NCF416": Code(
        "more is left than the tolerance",
        "The program was corrected, and the simulation of the result shows a place where the tool tip is farther off "
        "than `--tolerance-um` and the control's digits allow. Where motions are passed by rule or refused, those "
        "beside them begin or end on them; depths and retract planes of some cycles stay as they are. Motions at "
        "corners that the control rounds or breaks (RND, CHF) are not split, and get no axis that they do not move.",
        "`ncfix verify` looks along the whole path and says where; a larger tolerance makes the warning go away, not "
        "the error.",
    ),
    "NCF417": Code(
        "a motion is too long to be looked at",
        "The tip is followed along each motion, as closely as the errors of the machine may bend. A motion of "
        "thousands of turns, or of many times the travel, would take more looks at it than ncfix has; it is refused.",
        "Make several motions of it, or check its number of turns.",
    ),
    "NCF418": Code(
        "the errors grow",
        "The program was corrected, and the simulation says that its tool tip is farther off than before, at most and "
        "on average. That happens where the machine's errors are smaller than `--tolerance-um`, so that no block is "
        "split to follow them between its ends, or smaller than a step of the control's digits.",
        "Ask for a tolerance below the errors of the machine, or leave the program as it is. Set `least_increment` in "
        "the machine file if the control resolves more.",
    ),
    "NCF420": Code(
        "the corrected program does not follow the original",
        "The motions of the two programs cannot be put side by side: somewhere the second does not come to where the "
        "first wants to be.",
        "Check that both files belong together, and that the machine, its setup and the tool are those of the "
        "correction.",
    ),
    "NCF430": Code(
        "the program has been corrected already",
        "It carries the stamp that `ncfix fix` puts into what it writes. Correcting it again would correct the "
        "corrections: the error would be back, with the opposite sign.",
        "Fix the original program. `--force` corrects it all the same.",
    ),
    "NCF431": Code(
        "a tool length is needed and not given",
        "The machine has angular errors, and what they do at the tip depends on how long the tool is.",
        "`--tool 12=120.0`, [tools] in the setup file, `--tool-table FILE`, or `--assume-zero`.",
    ),
    "NCF432": Code(
        "a motion that is not corrected",
        "Its path or its end is not known from the program, or it is of a kind that a correction of its words would "
        "not put right (splines, threads, turning cycles, positions that are known only at run time). The block is "
        "left as it was.",
        "Have the CAM system write lines and arcs there, or accept it with `--allow-refused`. `--flatten` writes out "
        "what cycles with incremental words, patterns of holes and other repetitions make. Parameters that the program "
        "reads and does not set can stand in the setup file: `variables.R1 = 5`.",
    ),
    "NCF433": Code(
        "a block that cannot be written once for all",
        "The block is executed several times from different places and needs another correction each time, or it has "
        "to stay as it is because a refused arc, whose line is named, begins where it ends: only so does the arc "
        "close.",
        "`--flatten` writes loops and subprograms out, or accept it with `--allow-refused`.",
    ),
    "NCF437": Code(
        "a tool length was taken as zero",
        "`--assume-zero` was given, and the length of this tool is used and not known.",
        "`--tool 12=120.0` gives it.",
    ),
    "NCF438": Code(
        "the program seems to have been corrected already",
        "It carries no stamp, but its numbers are crooked, and many of them become round when the errors of this "
        "machine are put into them: as if they had been corrected for it. Correcting them again would put the errors "
        "back in.",
        "Fix the original program. `--force` corrects this one all the same.",
    ),
    "NCF439": Code(
        "an axis is left where it stands",
        "The correction needs an axis that the block does not name, and the program has not said where that axis "
        "stands: at the start, and after machine coordinates, a reference point, a tool change, another length offset "
        "or another work offset. A word for it would send it to where the setup says that it is; if that is wrong, "
        "into the part. So it gets none, and the next block that names it gets the whole correction. The same holds "
        "for X and Y (the axes of the plane) in blocks that only move across it under cutter radius compensation, and "
        "after it until the program names them: the control would offset even the smallest motion by the radius. And "
        "for rapids behind blocks with `/`, if the axis stands elsewhere where these are skipped.",
        "Let the program name X, Y and Z in the first blocks, and again after such a change. At the start `--initial` "
        "with `--offset` and `--tool`, without `--assume-zero`, says it as well.",
    ),
    "NCF445": Code(
        "program written out flat",
        "With --flatten every block is written as often as it is executed, for some need another correction each time. "
        "Loops, subprogram calls and expressions are gone from the program that is written.",
        "Keep the original: changes are better made there.",
    ),
    "NCF451": Code(
        "a block that needs another correction in each position of block delete",
        "Blocks with `/` before it may be executed or skipped, and the program is the same. Where this block begins, "
        "or what its words mean, depends on that, and so does its correction: increments, axes that it does not name, "
        "offsets and modes that a block with `/` sets.",
        "Name all axes in absolute words behind blocks with `/`; or `--block-skip on` or `off`, if the switch always "
        "stands so.",
    ),
    "NCF452": Code(
        "too many switches of block delete",
        "Each switch (`/2`, `/3`, ...) may be on or off while the program runs, and each position of all of them is "
        "followed, corrected and proven. There are too many.",
        "`--block-skip on`, `off`, or the numbers of the switches that are on, says how they stand.",
    ),
    "NCF453": Code(
        "no text is right in all positions of block delete",
        "The program was corrected for each position of its switches, and what was put together was read again: in one "
        "of them the control would make something else of it. So nothing is written.",
        "`--block-skip on` or `off`, if the switch always stands so; or fewer blocks with `/` that change modes, "
        "poles, frames or where arcs begin.",
    ),
    "NCF447": Code(
        "not written out flat",
        "A program with / lines has to be right with block delete on and off. Written out flat it would have the "
        "numbers of one of these positions in it, also in blocks that both execute.",
        "Say --block-skip on or off: the stamp says which one the program is for.",
    ),
    "NCF446": Code(
        "length offset that is no length",
        "The length offset in force is below zero: a distance by which the tool was touched off, or one that is taken "
        "off (G44). The errors of this machine depend on how long the tool is, and such a distance does not say that.",
        "Give the length from the gauge line to the tip (`--tool 1=120`), and make the work offset lower by the "
        "difference between that and the offset: with H1 = -300 and a tool of 120 mm, Z of the work offset is 420 mm "
        "lower. With G44 use G43 and such a length.",
    ),
    "NCF454": Code(
        "a contour that the control would make worse",
        "Cutter radius compensation is on, and the control takes the tool beside the contour. At a corner it goes "
        "where the lines beside two motions meet; these turn with the corrected ends, and a sharp corner makes much of "
        "it. The tool would be beyond the tolerance there, and farther off than without a correction, so the whole "
        "contour is left as it is.",
        "Let the CAM system compensate the cutter radius, or ask for a larger tolerance.",
    ),
    "NCF283": Code(
        "pieces under exact stop",
        "G60 or G61 is in force, with which the control comes to a stop at the end of every block. Where a motion is "
        "split to hold the tolerance it stops at the end of each piece, too, and the tool may leave a mark there.",
        "Program continuous path mode (G64) where no exact stop is needed, or ask for a larger tolerance.",
    ),
    "NCF285": Code(
        "a cut begins on a side of play that nobody knows",
        "On an axis with play the body stays behind on the side from which it was last pulled. The program has not "
        "moved this axis before the cut, or it comes from where nobody knows (the start of the program, a reference "
        "point, machine coordinates). The axis is taken to be in the middle until it moves, and on the side of its "
        "motion from there on: where it begins, the tip may be off by the play, or half of it where the axis rests. "
        "The figures of the report do not know of it.",
        "Move these axes farther than their play before the first cut, as an approach from a place that the program "
        "names does; `--initial X=0` says where an axis comes from at the start.",
    ),
    "NCF456": Code(
        "turns of rotary axes get inverse time",
        "F of a block that turns rotary axes alone is degrees per minute. Where its correction moves a linear axis, "
        "many controls take F as the speed of that axis, and would turn in no time. So such a block gets the time that "
        "it had, in inverse time (G93); G94 and the F that was in force follow it.",
        "Check that the control has G93. A post that writes rotary axes with tool-centre-point control needs none.",
    ),
    "NCF455": Code(
        "the radius of the tool is not known",
        "Cutter radius compensation is on. The contour is corrected, and the figures are those of the contour; where "
        "the control takes the tool beside it cannot be said without the radius.",
        "`--tool NUMBER=LENGTH,RADIUS`, or `radius` in the setup file.",
    ),
}
