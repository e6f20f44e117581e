"""What the message codes of diagnosis mean: NCF650 ... NCF659."""

from __future__ import annotations

from ncfix.diagnostics import Code

CODES = {
    "NCF650": Code(
        "too few values for a diagnosis",
        "The set-up and the constants of the machine file have almost as many unknowns as there are measured values. "
        "The residuals then cannot distinguish an effect from noise.",
        "Measure more poses, or several balls in one set-up.",
    ),
    "NCF651": Code(
        "all poses are equal",
        "No axis was moved, or all rows are repeats of one pose. An error that depends on the pose cannot be seen.",
        "`ncfix plan` proposes poses. A test of drift at one pose needs a column `time_s`, or temperatures.",
    ),
    "NCF652": Code(
        "the noise is not known",
        "There are neither repeats nor a line `# noise_um:`, and too few poses to estimate the noise from "
        "neighbouring ones. Without the noise, every variation could be an effect.",
        "Repeat ten poses a few times, one after another, or state the noise of the instrument.",
    ),
    "NCF653": Code(
        "an axis was approached from one side only",
        "The files state the same direction of approach for all its positions. Its backlash cannot be seen, and "
        "would be taken for another effect.",
        "Approach half of the poses from the other side.",
    ),
    "NCF654": Code(
        "the measurements do not fit the machine file",
        "After the set-up is fitted, the residuals are far larger than errors of machine tools, and no mistake of "
        "unit, sign or axis that ncfix knows explains them. Or two units would explain them, and it is not clear "
        "which one is right.",
        "Check whether it is a measurement of another machine, whether columns are exchanged, and the unit of the "
        "values.",
    ),
    "NCF656": Code(
        "the files contradict each other",
        "Two files have values for the same pose that differ by far more than the noise.",
        "Diagnose them one by one; something changed between them, or one belongs to another machine.",
    ),
    "NCF657": Code(
        "a name that is not in the catalogue",
        "`--without` names an effect that is not in the catalogue of this machine. The name has no effect.",
    ),
    "NCF658": Code(
        "a file without the direction of approach of an axis",
        "Some files state the direction of approach of an axis, another file that moves it does not. Errors that "
        "depend on this direction would be wrong for the rows of that file, so ncfix does not look for them.",
        "Add the column `dir_` of the axis to that file, or diagnose the other files without it.",
    ),
    "NCF659": Code(
        "repeats contradict the stated noise",
        "Repeats at one pose scatter by more than twice the noise in the header, or by less than half of it. The "
        "header or a unit is wrong. If there are enough repeats, the noise is taken from them.",
        "Correct the line `# noise_um:`, or the unit of the values.",
    ),
    "NCF660": Code(
        "not all rows were used",
        "All values are evaluated together, and the memory grows with the square of their number. From files with "
        "very many rows, some rows are drawn at random, the repeats of a pose together. Small files are used "
        "completely.",
        "Nothing needs to be done: the rows used are more than enough. The other rows can be diagnosed as a separate "
        "file.",
    ),
}
