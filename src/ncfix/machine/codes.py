"""The meanings of the message codes of machine files (NCF300 to NCF324) and of states (NCF340)."""

from __future__ import annotations

from ncfix.diagnostics import Code

FORMATS = "docs/formats.md describes the machine file; examples/machines has examples."

CODES = {
    "NCF300": Code("the machine file cannot be read", "It does not exist, or may not be read.", "Check the path."),
    "NCF301": Code(
        "the machine file is not TOML",
        "The text breaks the rules of TOML at the place shown, or is not UTF-8. Nothing else of the file was checked.",
        "Repair that line first. Then the other faults are reported.",
    ),
    "NCF302": Code(
        "an unknown key in the machine file",
        "ncfix does not know this key. If it were ignored, an error of the machine might be missing without a word. "
        "Often the key is misspelled, or belongs to another basis.",
        FORMATS,
    ),
    "NCF303": Code(
        "a key is missing in the machine file", "This key has no default, so its value must be given.", FORMATS
    ),
    "NCF304": Code(
        "a value of the wrong type in the machine file",
        'A number is written without quotes: 5.0, not "5.0". A list must have the length that the message names.',
        FORMATS,
    ),
    "NCF305": Code(
        "an invalid number in the machine file",
        "The value is not a finite number, or it is zero or negative where only a positive value is possible.",
        "Omit `range` for an axis without ends.",
    ),
    "NCF306": Code(
        "the topology cannot be read",
        "The topology lists the axes from the workpiece w through the foundation F to the tool t, each axis once. "
        "The spindle S, if any, is the last before t.",
        'For example "w C B F X Y Z t".',
    ),
    "NCF307": Code(
        "topology and axes do not agree",
        "Each axis of the topology has a table [axis.LETTER], and each such table is in the topology.",
        FORMATS,
    ),
    "NCF308": Code(
        "an empty range",
        "The first end of an axis range must be below the second.",
        "Omit `range` for an endless axis.",
    ),
    "NCF309": Code(
        "an unknown effect",
        "Names follow ISO 230-1: E, component X Y Z A B C, axis (EYX); with 0 for the location of the axis line "
        "(EC0Y); S for the spindle.",
        "`ncfix effects` lists them.",
    ),
    "NCF310": Code(
        "an unknown basis", "No built-in basis and none of a plugin has this name.", "`ncfix effects --bases`"
    ),
    "NCF311": Code(
        "a wrong number of coefficients",
        "Each function of the basis needs one coefficient: one per degree, two per order, one per position, one per "
        "B-spline.",
        "`ncfix effects --bases` says how many a basis has.",
    ),
    "NCF312": Code(
        "an invalid covariance",
        "A covariance is a symmetric matrix with one row per coefficient and no negative eigenvalue.",
        "Leave out `covariance` if it is not known.",
    ),
    "NCF313": Code(
        "an invalid direction",
        "A direction must not be zero. `error_axes` are three perpendicular unit vectors as rows, right-handed.",
        FORMATS,
    ),
    "NCF314": Code(
        "an unknown signal",
        "`input` and `times` name an axis of the machine, or an input in lower-case letters such as temp_spindle.",
        FORMATS,
    ),
    "NCF315": Code(
        "a basis or an option that does not fit the effect",
        "A location error and an error of the spindle have no axis position to depend on. `fourier` needs an angle, "
        "`backlash` a direction of motion, `carried` a location error.",
        FORMATS,
    ),
    "NCF316": Code(
        "an invalid parameter of a basis",
        "Positions and knots must ascend, powers and orders must be distinct and not negative, a period must be "
        "positive.",
        "`ncfix effects --bases` describes them.",
    ),
    "NCF317": Code(
        "another schema of machine files",
        "The key `ncfix` of the file names another version of the machine file than this ncfix reads.",
        FORMATS,
    ),
    "NCF318": Code(
        "a control that is not known",
        "`control` is the default of `--dialect`. No installed dialect and no control with tables has this name.",
        "`ncfix dialects` lists the dialects, `ncfix plugins` the controls with tables.",
    ),
    "NCF319": Code(
        "play with the sign of too much compensation",
        "An error is actual minus nominal position of the body, along the base axes. With lost motion the body stays "
        "behind: while it moves towards plus, it is too far towards minus. So the coefficient is negative where the "
        "body moves towards plus as the number of the axis grows, and positive for a table axis X', whose body moves "
        "towards minus. With the opposite sign the body is ahead, as on a control that compensates more backlash "
        "than there is. If that is not the case, every correction of this backlash doubles it.",
        "Measure one point from both sides: `ncfix calibrate` finds size and sign.",
    ),
    "NCF320": Code(
        "an error larger than machines have",
        "Over the travel this error exceeds what is large for a machine tool in use. `ncfix effects` lists that size "
        "for a machine of one metre; it grows with travel and reach, and is ten times as large for arms of rotary "
        "joints. No machine has more than ten times that size: then the number is in another unit (translations are "
        "in mm, rotations in rad), or a polynomial is used far outside the range where it was fitted (`center`, "
        "`scale`, `range`).",
        "Correct the number. `ncfix fix --force` and `ncfix export --force` use it as it is.",
    ),
    "NCF321": Code(
        "axes that do not span space",
        "Two of X, Y and Z are parallel, or all three lie in one plane, or two rotary axes in sequence turn about "
        "the same line. Then one axis only repeats the motion of others, and no machine is built like that. Further "
        "linear axes (U V W) may be parallel to X Y Z.",
        "Check `direction` and `point` of these axes.",
    ),
    "NCF322": Code(
        "a size that no machine has",
        "A travel, a pitch, a point, a step or a limit is far outside what machines have. Most often it is in "
        "another unit: lengths are in mm, ranges and steps of rotary axes in degrees.",
        FORMATS,
    ),
    "NCF323": Code(
        "positions of an error that its axis does not have",
        "The positions of a table or the knots of a curve are outside the range of the axis, cover almost nothing of "
        "it, or look like radians or inches. They are in mm or degrees, after `center` and `scale` are applied.",
        FORMATS,
    ),
    "NCF325": Code(
        "left-handed axes",
        "Seen from the workpiece, the tool moves in the directions of the thumb, forefinger and middle finger of the "
        "left hand as X, Y and Z grow. ISO 841 and all controls have them right-handed: planes, the sense of arcs "
        "and tilted planes rely on it. One of the axes has the wrong sign, and its errors would be corrected in the "
        "wrong direction. Most often it is an axis that moves the workpiece: `direction` is the motion of its body "
        "as the number grows, which is opposite to the motion of the tool relative to the workpiece.",
        "Change the sign of the wrong `direction`.",
    ),
    "NCF324": Code(
        "an impossible machine",
        "The machine file has values that no machine can have; the messages before this one name them. Programs and "
        "tables made with it would be wrong by the same amount.",
        "`ncfix machine check` lists all of them.",
    ),
    "NCF340": Code(
        "an input of the error model is not given",
        "An effect depends on a temperature, a time or another input. Without its value the error is not known, and "
        "zero would be a guess.",
        "`--input temp_spindle=24.5`, or [inputs] in the setup file; a column of that name in measurements.",
    ),
    "NCF390": Code(
        "symbolic formulas need sympy",
        "The error equations are derived with sympy, which is an optional package.",
        'pip install "ncfix[symbolic]"',
    ),
    "NCF391": Code(
        "a chain file that is wrong",
        "A variable or a step of the chain is invalid, or an angle is not linear in the small variables.",
        "The message names the key; examples/chains shows such a file.",
    ),
    "NCF392": Code(
        "an order that is not supported",
        "Error equations can be expanded to the orders 1 to 4.",
        "Ask for 1 or 2.",
    ),
    "NCF393": Code(
        "an unknown error of the chain",
        "A name or a pattern matches no error of the machine, or the effects of that name differ, so that one symbol "
        "cannot represent them.",
        "Use the name in the machine file, or a pattern such as E?C.",
    ),
}
