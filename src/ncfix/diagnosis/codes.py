"""What the message codes of diagnosis mean: NCF650 ... NCF659."""

from __future__ import annotations

from ncfix.diagnostics import Code

CODES = {
    "NCF650": Code(
        "too few values for a diagnosis",
        "The set-up and the constants of the machine file already take as many numbers as were measured, or nearly: "
        "what is left cannot tell an effect from noise.",
        "Measure more poses, or several balls in one set-up.",
    ),
    "NCF651": Code(
        "all poses are alike",
        "No axis was moved, or all rows are repeats of one pose: an error that depends on the pose cannot show.",
        "`ncfix plan` proposes poses. A test of drift at one pose needs a column `time_s`, or temperatures.",
    ),
    "NCF652": Code(
        "the noise is not known",
        "There are neither repeats nor a `# noise_um:` line, and too few poses for their neighbours to tell the noise. "
        "Without it every wiggle could be an effect.",
        "Repeat ten poses a few times, one after another, or state the noise of the instrument.",
    ),
    "NCF653": Code(
        "an axis came from one side only",
        "All directions of approach that the files state for it are the same: its backlash and play cannot show, "
        "and what they do would be taken for something else.",
        "Approach half of the poses from the other side.",
    ),
    "NCF654": Code(
        "this does not look like that machine",
        "What is left after the set-up was fitted is far larger than errors of machine tools are, and no mistake of "
        "unit, sign or axis that ncfix knows explains it; or two units would, and it is not sure which.",
        "Is it the measurement of another machine, are columns exchanged, or are the values in another unit?",
    ),
    "NCF656": Code(
        "the files contradict each other",
        "What one file says of a pose differs from what another says by far more than the noise.",
        "Diagnose them one by one; something changed between them, or one belongs to another machine.",
    ),
    "NCF657": Code(
        "a name that the catalogue does not have",
        "`--without` names an effect that is not in the catalogue of this machine; nothing was left out for it.",
    ),
    "NCF658": Code(
        "a file does not say from where an axis came",
        "Some of the files have the direction of approach of an axis, another one that moved it has not. What depends "
        "on the direction would be wrong for that file's rows, so it is not looked for.",
        "Give that file the column `dir_` of the axis, or diagnose the others without it.",
    ),
    "NCF659": Code(
        "repeats deny the noise that is stated",
        "Values taken at one state one after another scatter by more than twice the noise in the header, or by less "
        "than half of it. The repeats are believed where there are enough; the header is wrong, or a unit is.",
        "Correct the line `# noise_um:`, or the unit of the values.",
    ),
    "NCF660": Code(
        "not all rows were weighed",
        "Names are weighed over all values at once, and memory grows with the square of their number. Of files with "
        "very many rows some are drawn at random, repeats of a pose together; small files stay whole.",
        "Nothing need be done: so many rows tell more than enough. Other rows can be diagnosed as a file of their own.",
    ),
}
