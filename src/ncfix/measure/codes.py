"""What the message codes of measurements mean: files (NCF600 ... NCF619), calibration and plans (NCF630 ... NCF649)."""

from __future__ import annotations

from ncfix.diagnostics import Code

FORMATS = "docs/formats.md describes the measurement file."

CODES = {
    "NCF600": Code(
        "not a measurement file",
        "A measurement file begins with comment lines `# key: value`, one of which is `# ncfix-measurement: 1`. This "
        "file does not, and it is no file of an instrument that ncfix can read either.",
        f"docs/guide/calibrate.md shows how to make one from the table of an instrument. {FORMATS}",
    ),
    "NCF601": Code(
        "an unknown kind of measurement",
        "`# kind:` names the kind of measurement. There is no kind of this name.",
        FORMATS,
    ),
    "NCF602": Code(
        "an unknown header line",
        "ncfix does not know this header line, or it appears twice or below the line of columns. It would have no "
        "effect without a word. Free notes belong under instrument, date, origin, operator or note.",
        FORMATS,
    ),
    "NCF603": Code(
        "a header line that cannot be read", "The value does not have the form that the key needs.", FORMATS
    ),
    "NCF604": Code(
        "an unknown column",
        "Each column is an axis of the machine, a state (dir_X, time_s, temp_..., load_kg, tool_length, set) or a "
        "measured value of this kind.",
        FORMATS,
    ),
    "NCF605": Code("a column is missing", "This kind of measurement needs this column.", FORMATS),
    "NCF606": Code(
        "a wrong number of cells",
        "The row has more or fewer cells than there are columns. A decimal comma makes two cells of one number.",
        "Numbers have a decimal point; commas stand between cells.",
    ),
    "NCF607": Code(
        "an empty cell",
        "ncfix neither guesses a missing value nor leaves out its row. A quantity that was not measured at all has "
        "no column.",
        "Fill in the value, or remove the row or the column.",
    ),
    "NCF608": Code("a cell that is not a number", "The cell cannot be read as a finite number with a decimal point."),
    "NCF609": Code("no rows", "The file has a header but nothing was measured."),
    "NCF610": Code(
        "an axis that the machine does not have",
        "A column or a direction belongs to an axis that is not in the topology of the machine file.",
        "Check that it is the right machine file.",
    ),
    "NCF611": Code(
        "time goes backwards",
        "Within one set, a row is earlier than the row before it. Drift and time constants would be computed from "
        "wrong times.",
        "Give the rows after the clock was set back another `set`.",
    ),
    "NCF612": Code(
        "an invalid label, direction, distance or reading",
        "The axis, component, ball or target of a row does not exist, a direction is none of -1, 0 and 1, a distance "
        "is not above zero, or a deviation is 999 or 9999, with which programs mark a missing reading.",
    ),
    "NCF613": Code(
        "a pose was measured twice",
        "Two rows of one set have the same pose and inputs. They are taken as repeats, from which the noise is "
        "estimated. If their values are equal too, one row may have been copied by mistake.",
        "If the rows are repeats, add a column `repeat`.",
    ),
    "NCF614": Code(
        "positions look like radians, inches or metres",
        "All positions of a rotary axis lie within one turn in radians and none is a round number of degrees, "
        "although the axis can turn further. Or the positions of a linear axis cover a small part of its travel, but "
        "in inches or metres they would cover most of it. Positions are in mm and degrees.",
    ),
    "NCF615": Code(
        "a position outside the range of its axis",
        "The machine cannot have been there: columns are exchanged, it is another machine, or the range in the "
        "machine file is wrong.",
    ),
    "NCF616": Code(
        "measured errors look like another unit",
        "As mm, the values are larger than errors of machine tools, or smaller than a laser can measure, or repeats "
        "agree better than any machine tool repeats. Values must be in mm, rotations in rad.",
    ),
    "NCF617": Code(
        "a mistake in a measurement file",
        "The model explains the measurements far better if two columns are exchanged, the sign of a column, a set or "
        "an axis is changed, radians are taken for degrees, or the lengths of one set are scaled. Neither chance nor "
        "a missing effect explains that. No machine file is written (exit code 4); `--allow-misfit` writes it.",
        "Check units, signs, and the directions of the instrument's axes.",
    ),
    "NCF618": Code(
        "an instrument's file that cannot be read", "A line does not have the form that this file format needs here."
    ),
    "NCF619": Code(
        "a file that may have been cut off",
        "The file ends within a line, and its last number has fewer decimals than all above it. Digits of this "
        "number, and further rows, may be missing.",
        "If the file is complete, end the last row with a line end.",
    ),
    "NCF620": Code(
        "an error that these measurements hardly determine",
        "Its uncertainty would be larger than a large error of this kind on any machine, so that the estimate would "
        "be noise. It keeps the value of the machine file.",
        "`ncfix plan` finds poses that show it.",
    ),
    "NCF621": Code(
        "stated lengths that contradict each other",
        "Calibrated distances (`# distance:`) are never taken as outliers. One of them differs from the value that "
        "the others and the readings give, by more than its uncertainty, the noise and missing errors of usual size "
        "allow. No machine file is written (exit code 4); `--allow-misfit` writes it.",
        "Check the certificates. Leave out the wrong distance, or estimate more effects: `--effects`.",
    ),
    "NCF622": Code(
        "too many outliers",
        "More than a twentieth of the values, or most rows of a set, are far from the model that fits the others. "
        "Then it is not clear which of them are right. No machine file is written (exit code 4); `--allow-misfit` "
        "writes it.",
        "Check these rows; calibrate with each part alone.",
    ),
    "NCF623": Code(
        "measurements without readings",
        "All values are exactly equal. No instrument reads that: the file was not filled in, or the instrument was "
        "not running.",
    ),
    "NCF624": Code(
        "too many set-ups",
        "Each set adds unknowns, and with so many sets the equations need too much memory. Most often each row was "
        "given its own set by mistake; then errors could not be distinguished from set-ups.",
        "Give all rows that were measured in one set-up the same `set`.",
    ),
    "NCF625": Code(
        "a ball-bar whose poses are not on its circle",
        "The distance of the commanded tool tip from the stated centre is not the length of the bar. The direction "
        "of the bar is computed from both, so estimated errors would be too large or too small, although the fit is "
        "good.",
        "Give `tool_length`, and the centre in the workpiece frame: X Y Z of the tip, not of the axes.",
    ),
    "NCF626": Code(
        "positioning of an axis whose body moves against the base axis",
        "The body of a table axis moves towards minus as the number of the axis grows. Its positioning error (EXX of "
        "X) is that of the body along the base axis, so target minus actual position of the axis. A laser reports "
        "actual minus target. With the wrong sign a correction doubles the error.",
        "Write `# sense: axis` in the header if the deviations are actual minus target in the counting direction of "
        "the axis; then their sign is changed. Write `# sense: body` if their sign has already been changed.",
    ),
    "NCF630": Code(
        "too few rows for the unknowns",
        "There are at least as many unknowns (errors, and the set-up of the instrument) as measured values. Then "
        "noise and errors cannot be distinguished.",
        "Measure more poses, or estimate fewer effects: `--effects`.",
    ),
    "NCF631": Code(
        "errors that these measurements cannot distinguish",
        "Different values of these coefficients explain the measurements equally well. Some of them keep the value "
        "of the machine file; the message names the combination that was determined.",
        "`ncfix plan --separate` finds poses that distinguish two effects, if the hint of the message says so.",
    ),
    "NCF632": Code(
        "an error that these measurements do not determine",
        "It changes no measured value, or changes them in the same way as the unknown set-up. It keeps the value of "
        "the machine file.",
    ),
    "NCF633": Code(
        "an outlier",
        "The value differs from the model by more than noise can explain. It is named and gets no weight; the file "
        "is not changed. `--loss none` gives every value full weight.",
        "Check this row for a typing error, dirt, or a failed touch of the probe.",
    ),
    "NCF634": Code(
        "the residuals are larger than the noise",
        "The residuals exceed the noise that is stated or that repeats show: the model lacks an effect, or the noise "
        "is underestimated. The uncertainties are increased accordingly.",
        "`ncfix diagnose` looks for the missing effect.",
    ),
    "NCF635": Code(
        "an effect that cannot be estimated",
        "No effect of the machine has this name, and it is neither an ISO 230-1 component of one of its axes nor the "
        "name of a model.",
        "`ncfix effects` lists the names.",
    ),
    "NCF636": Code("a plan that cannot be made", "The options leave no poses to choose from, or not enough."),
    "NCF637": Code(
        "the estimation did not converge",
        "The exact model and its linearisation do not agree: the values are far larger than errors, or belong to "
        "another machine.",
    ),
    "NCF638": Code(
        "the estimates depend strongly on one another",
        "The condition number of the scaled problem is large: small errors of measurement become large errors of "
        "some coefficients, but not of the predicted error at the measured poses.",
    ),
    "NCF639": Code(
        "a time constant that cannot be determined",
        "An effect that follows its input with a delay needs the time of each row, and measurements over several "
        "time constants while the input changes.",
        "Measure while the machine warms up and while it cools down, with a column `time_s`.",
    ),
    "NCF640": Code(
        "an estimated time constant",
        "The time constant with which an effect follows its input, and its standard deviation. The standard "
        "deviations of the coefficients hold for this time constant.",
    ),
    "NCF641": Code(
        "a model that is a guess at some poses",
        "The coefficients fit the measured poses. But somewhere in the travels the standard deviation of the "
        "predicted tip error is larger than the residuals before the calibration: there the model follows the noise, "
        "and a correction may increase the error.",
        "Measure at the poses that `ncfix plan --existing FILE` proposes, estimate fewer effects (`--effects`), or "
        "set coefficients that are not significant to zero (`--prune 0.99`).",
    ),
    "NCF642": Code(
        "a calibration that does not describe the measurements",
        "The residuals of the calibrated model exceed 100 um and a thousand times the noise, or the largest "
        "correction that the machine file allows (`max_correction`). No missing effect is that large: a unit, a sign "
        "or a column is wrong, the file belongs to another machine, or the noise in its header is wrong. No machine "
        "file is written.",
        "Check the row in the message, and the other messages. `ncfix diagnose` tests for such mistakes; "
        "`--allow-misfit` writes the machine file.",
    ),
    "NCF643": Code(
        "targets whose position the readings do not determine",
        "If only linear axes move the body that carries the targets, the readings determine the positions of the "
        "targets relative to each other, but not on the body. Angles act on the targets through these positions as "
        "levers, so the estimated angles and displacements depend on the positions that were assumed: as near as the "
        "readings allow to the tip given by `tool_length` (`carried_by: spindle`) or to the base origin "
        "(`carried_by: workpiece`).",
        "Give the approximate position of one target in the header: `# target: NAME x y z`.",
    ),
    "NCF644": Code(
        "coefficients that were set to zero",
        "They are not significant at the level of `--prune`, so they are zero in the new machine file. Their true "
        "values are not known to be zero, so the standard deviations allow for the size that they may have: by the "
        "measurements, and by a third of a large error of this kind. If such a coefficient acts like one that was "
        "kept, as squareness errors and tilts of rotary axes may, the kept one contains both, and its standard "
        "deviation is large.",
        "If a standard deviation is too large, measure at poses where the two differ (`ncfix plan`), or leave errors "
        "that are known to be zero out of the model with `--effects`.",
    ),
}
