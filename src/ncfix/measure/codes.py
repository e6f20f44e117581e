"""What the message codes of measurements mean: files (NCF600 ... NCF619), calibration and plans (NCF630 ... NCF649)."""

from __future__ import annotations

from ncfix.diagnostics import Code

FORMATS = "docs/formats.md describes the measurement file."

CODES = {
    "NCF600": Code(
        "not a measurement file",
        "The file begins with comment lines `# key: value`, one of them `# ncfix-measurement: 1`; or it is the file of "
        "an instrument that ncfix can read, which this is not.",
        f"docs/guide/calibrate.md says how the table of an instrument becomes one. {FORMATS}",
    ),
    "NCF601": Code("an unknown kind of measurement", "`# kind:` says what was measured; this kind is none.", FORMATS),
    "NCF602": Code(
        "an unknown header line",
        "A header line that ncfix does not know, or that is there twice or below the columns, would be ignored in "
        "silence. Free notes go under instrument, date, origin, operator or note.",
        FORMATS,
    ),
    "NCF603": Code("a header line that cannot be read", "Its value is not of the form that the key asks for.", FORMATS),
    "NCF604": Code(
        "an unknown column",
        "Each column is an axis of the machine, a state (dir_X, time_s, temp_..., load_kg, tool_length, set) or a "
        "measured value of this kind.",
        FORMATS,
    ),
    "NCF605": Code("a column is missing", "This kind of measurement cannot be used without it.", FORMATS),
    "NCF606": Code(
        "a wrong number of cells",
        "The row has more or fewer cells than there are columns. A decimal comma makes two cells of one number.",
        "Numbers have a decimal point; commas stand between cells.",
    ),
    "NCF607": Code(
        "an empty cell",
        "A gap would have to be guessed or its row left out, and ncfix does neither. What was not measured at all has "
        "no column.",
        "Fill the gap, or remove the row or the column yourself.",
    ),
    "NCF608": Code("a cell that is no number", "The cell cannot be read as a finite number with a decimal point."),
    "NCF609": Code("no rows", "The file has a header but nothing was measured."),
    "NCF610": Code(
        "an axis that the machine does not have",
        "A column, or a direction, is of an axis that is not in the machine file's topology.",
        "Is it the right machine file?",
    ),
    "NCF611": Code(
        "time goes backwards",
        "Within one set a row is earlier than the one before it. Drift and lags would be worked out from a clock that "
        "cannot have run so.",
        "Give a set of its own to what was measured after the clock was set back.",
    ),
    "NCF612": Code(
        "a label, direction, distance or reading that is none",
        "Axis, component, ball or target of a row does not exist, a direction is none of -1, 0 and 1, a distance is "
        "not above zero, or a deviation is 999 or 9999, by which programs mark what was not read.",
    ),
    "NCF613": Code(
        "a pose was measured twice",
        "Two rows of one set have the same state. That is fine for repeats, which tell the noise; with the very same "
        "values it looks like a row copied by mistake.",
        "A column `repeat` says that it is meant.",
    ),
    "NCF614": Code(
        "positions look like radians, inches or metres",
        "All positions of a rotary axis lie within one turn in radians and not on any round degree, while the axis can "
        "do more; or those of a linear axis are a corner of its travel, which they would cover in inches or metres. "
        "Positions are in mm and degrees.",
    ),
    "NCF615": Code(
        "a position outside the range of its axis",
        "The machine cannot have been there: swapped columns, another machine, or a range that is wrong.",
    ),
    "NCF616": Code(
        "measured errors look like another unit",
        "The values are larger than a machine tool's errors in mm can be, or smaller than a laser tells, or repeats "
        "agree better than a machine tool comes back. They are given in mm (rotations in rad).",
    ),
    "NCF617": Code(
        "a mistake in a measurement file",
        "With two columns exchanged, the sign of a column, of a set or of an axis changed, radians taken for degrees, "
        "or one set's lengths of another scale, the model explains the measurements far better, more than chance or a "
        "missing effect can. No machine file is written (exit code 4); `--allow-misfit` writes it all the same.",
        "Check units and signs, and which way the instrument's axes point.",
    ),
    "NCF618": Code("an instrument's file that cannot be read", "A line is not what that format has at this place."),
    "NCF619": Code(
        "a file that may have been cut off",
        "The file ends within a line, and its last number has fewer decimals than all above it: it may lack digits, "
        "and the file rows.",
        "A line end behind the last row says that it is whole.",
    ),
    "NCF620": Code(
        "an error that these measurements hardly see",
        "Its uncertainty would be more than what is much for such an error on any machine, so that the number found "
        "would be noise. It is held at what the machine file says.",
        "`ncfix plan` finds poses that show it.",
    ),
    "NCF621": Code(
        "stated lengths that contradict each other",
        "Calibrated distances (`# distance:`) are never outliers: what they say holds. One of these is further from "
        "what the others and the readings say than its uncertainty, the noise and errors of a usual size that the "
        "model lacks allow. No machine file is written (exit code 4); `--allow-misfit` writes it all the same.",
        "Look at the certificates; leave the wrong one out, or estimate more effects: `--effects`.",
    ),
    "NCF622": Code(
        "too many outliers",
        "More than a twentieth of the values, or most rows of a set, are far from the model that the others make: it "
        "is not said which of them are right. No machine file is written (exit code 4); `--allow-misfit` writes it "
        "all the same.",
        "Look at these rows; calibrate with either part alone.",
    ),
    "NCF623": Code(
        "measurements in which nothing was measured",
        "All values are the very same. No instrument reads that: the file was not filled in, or the instrument did not "
        "run.",
    ),
    "NCF624": Code(
        "too many set-ups",
        "Each set has unknowns of its own, and with so many of them the equations would fill all memory. Mostly each "
        "row was given a set of its own by mistake, which would leave nothing to tell errors from set-ups.",
        "Rows that were measured in one set-up have one and the same `set`.",
    ),
    "NCF625": Code(
        "a ball-bar whose poses are elsewhere",
        "The commanded tool tip is not at the length of the bar from the stated centre. The direction of the bar is "
        "worked out from both, so errors would come out too large or too small, though the fit is as good as ever.",
        "Give `tool_length`, and the centre where it is in the workpiece frame: X Y Z of the tip, not of the axes.",
    ),
    "NCF626": Code(
        "positioning of an axis that goes against its base axis",
        "The body of a table axis goes towards minus as its number grows. Its positioning error (EXX of X) is that of "
        "the body, along the base axis: target minus actual. A laser says actual minus target. With the wrong sign a "
        "correction doubles the error.",
        "Write `# sense: axis` above deviations that are actual minus target, as the number of the axis counts: they "
        "are turned then. `# sense: body` says that they are turned already.",
    ),
    "NCF630": Code(
        "too few rows for the unknowns",
        "There are more unknowns (errors, and the set-up of the instrument) than measured values, or just as many: "
        "nothing would be left to tell noise from error.",
        "Measure more poses, or estimate fewer effects: `--effects`.",
    ),
    "NCF631": Code(
        "errors that these measurements cannot tell apart",
        "Different values of these coefficients explain the measurements equally well. Some of them are held at what "
        "the machine file says; the message says which combination was found.",
        "`ncfix plan --separate` finds poses that tell two effects apart, where there are any: the hint says so.",
    ),
    "NCF632": Code(
        "an error that these measurements do not see",
        "It changes nothing that was measured, or only what the unknown set-up changes as well. It is held at what the "
        "machine file says.",
    ),
    "NCF633": Code(
        "an outlier",
        "The value is further from the model than noise can explain. It is named and given no weight; the file is as "
        "it was. `--loss none` gives every value its full weight.",
        "Look at that row: a typing error, dirt, a missed touch?",
    ),
    "NCF634": Code(
        "the residuals are larger than the noise",
        "What the model leaves is more than the noise that was given or that repeats show: an effect is missing, or "
        "the noise is underestimated. Uncertainties are widened accordingly.",
        "`ncfix diagnose` looks for what is missing.",
    ),
    "NCF635": Code(
        "an effect that cannot be estimated",
        "No effect of the machine has this name, and it is neither an ISO 230-1 component of one of its axes nor the "
        "name of a model.",
        "`ncfix effects` lists the names.",
    ),
    "NCF636": Code("a plan that cannot be made", "The numbers asked for leave no poses to choose from."),
    "NCF637": Code(
        "the estimation did not converge",
        "The exact model and its linearisation do not agree: values far larger than errors, or a wrong machine.",
    ),
    "NCF638": Code(
        "several values depend on nearly the same combination",
        "The condition number of the scaled problem is large: small errors of measurement become large errors of some "
        "coefficients, though not of the predicted error where it was measured.",
    ),
    "NCF639": Code(
        "a time constant that cannot be told",
        "An effect that follows its input after a time needs a clock, and measurements over several time constants in "
        "which the input changes.",
        "Measure while it warms up and while it cools down, with a column time_s.",
    ),
    "NCF640": Code(
        "an estimated time constant",
        "How long after its input an effect follows, with its standard deviation. That of the coefficients holds for "
        "this constant.",
    ),
    "NCF641": Code(
        "a model that is a guess in places",
        "The coefficients fit the measured poses, but somewhere in the travels the tip error that they predict is more "
        "uncertain than the error was large: the model follows the noise there. Corrections by it may do harm.",
        "Measure more poses, and where `ncfix plan --existing FILE` says; or estimate fewer effects (`--effects`), or "
        "drop what is not significant (`--prune 0.99`).",
    ),
    "NCF642": Code(
        "a calibration that does not describe the measurements",
        "What the calibrated model leaves is more than 100 um and a thousand times the noise, or more than the machine "
        "file allows to be corrected (`max_correction`). No missing effect is that large: a unit, a sign or a column "
        "is wrong, the file is of another machine, or the noise in its head is. No machine file is written.",
        "Look at the row that is named, and at what else is remarked. `ncfix diagnose` tests for such mistakes; "
        "`--allow-misfit` writes the machine file all the same.",
    ),
    "NCF643": Code(
        "targets whose place the readings leave open",
        "Where only linear axes move what carries the targets, readings show how targets lie to each other, not where "
        "they are. Angles act on them by levers, so that estimated angles and displacements go with the place that was "
        "taken: as near the tip of the row's `tool_length`, or the base origin (`carried_by: spindle` or `workpiece`), "
        "as the readings allow.",
        "A line `# target: NAME x y z` in the header says where one of them nearly is.",
    ),
    "NCF644": Code(
        "coefficients that were left out",
        "With `--prune` they are not significant at the level that was asked for, so they are zero in the new machine "
        "file. Nobody knows that they are zero, so standard deviations count in what they may be: by the measurements, "
        "and by a third of what is much of such an error. Where a coefficient that was left out acts like one that "
        "stays, as squareness errors and tilts of rotary axes may, the one that stays carries the other, and its "
        "standard deviation is large.",
        "Where a standard deviation grew too large, measure where the two act otherwise (`ncfix plan`), or name what "
        "is known to be zero out of the model with `--effects`.",
    ),
}
