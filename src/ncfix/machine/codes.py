"""The meanings of the message codes of machine files (NCF300 to NCF324) and of states (NCF340)."""

from __future__ import annotations

from ncfix.diagnostics import Code

FORMATS = "docs/formats.md describes the machine file; examples/machines has some."

CODES = {
    "NCF300": Code("the machine file cannot be read", "It does not exist, or may not be read.", "Check the path."),
    "NCF301": Code(
        "the machine file is not TOML",
        "The text breaks the rules of TOML at the place shown, or is not UTF-8. Nothing of it could be looked at.",
        "Repair that line first; the other faults show then.",
    ),
    "NCF302": Code(
        "an unknown key in the machine file",
        "A key that ncfix does not know would be ignored in silence, and an error of the machine with it. Often it is "
        "misspelled, or belongs to another basis.",
        FORMATS,
    ),
    "NCF303": Code("a key is missing in the machine file", "The key has no default: its value must be given.", FORMATS),
    "NCF304": Code(
        "a value of the wrong type in the machine file",
        'A number is not a text: 5.0, not "5.0". Lists have the length that is asked for.',
        FORMATS,
    ),
    "NCF305": Code(
        "a number that cannot be, in the machine file",
        "Not a number, infinite, or zero or negative where that makes no sense.",
        "Omit `range` for an axis without ends.",
    ),
    "NCF306": Code(
        "the topology cannot be read",
        "It names the joints from the workpiece w through the foundation F to the tool t, each axis once; the spindle "
        "S may stand last, before t.",
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
        "an effect that this machine cannot have",
        "Names follow ISO 230-1: E, component X Y Z A B C, axis (EYX); with 0 for the location of the axis line "
        "(EC0Y); S for the spindle.",
        "`ncfix effects` lists them.",
    ),
    "NCF310": Code(
        "an unknown basis", "No built-in basis and none of a plugin has this name.", "`ncfix effects --bases`"
    ),
    "NCF311": Code(
        "a wrong number of coefficients",
        "Every function of the basis has one coefficient: one per degree, two per order, one per position, one per "
        "B-spline.",
        "`ncfix effects --bases` says how many a basis has.",
    ),
    "NCF312": Code(
        "a covariance that is none",
        "It is a symmetric matrix with one row per coefficient, and no combination has a negative variance.",
        "Omit it if it is not known.",
    ),
    "NCF313": Code(
        "an invalid direction",
        "A direction is not zero; `error_axes` are three perpendicular unit vectors, right-handed, as rows.",
        FORMATS,
    ),
    "NCF314": Code(
        "an unknown signal",
        "`input` and `times` name an axis of the machine or an input in small letters, like temp_spindle.",
        FORMATS,
    ),
    "NCF315": Code(
        "a basis or an option that does not fit the effect",
        "A location error and the spindle have no position to depend on, `fourier` wants an angle, `backlash` a "
        "direction of motion, `carried` a location error.",
        FORMATS,
    ),
    "NCF316": Code(
        "a parameter of a basis that cannot be",
        "Positions and knots ascend, powers and orders are distinct and not negative, a period is positive.",
        "`ncfix effects --bases` describes them.",
    ),
    "NCF317": Code("another schema of machine files", "The file says that it is of another version.", FORMATS),
    "NCF318": Code(
        "a control that is not known",
        "`control` is the default of `--dialect`; nothing that is installed has this name.",
        "`ncfix dialects` lists the dialects, `ncfix plugins` what else there is.",
    ),
    "NCF319": Code(
        "play with the sign of too much compensation",
        "An error is where the body really is, along the base axes: one that lags behind its axis, as lost motion has "
        "it, is too far towards minus while it moves towards plus. So the coefficient is negative where the body goes "
        "towards plus as the number grows, and positive of a table axis X', whose body goes towards minus. With the "
        "other sign the body is ahead, as a control makes it that takes out more play than there is; if that is not "
        "meant, every correction of this play doubles it.",
        "Measure one point from both sides: `ncfix calibrate` finds size and sign.",
    ),
    "NCF320": Code(
        "an error larger than machines have",
        "Over the travel this error is more than is much for a machine tool in use, which `ncfix effects` lists for a "
        "machine of a metre; it grows with travel and reach, and is ten times as much for arms of rotary joints. "
        "Beyond ten times that no machine runs: the number is in another unit (rotations are in rad, translations in "
        "mm), or a polynomial is used far outside where it was fitted (`center`, `scale`, `range`).",
        "Correct the number. `fix --force` and `export --force` take it as it is.",
    ),
    "NCF321": Code(
        "axes that do not span",
        "Two of X, Y and Z are parallel, or all three lie in a plane, or two rotary axes that follow one another turn "
        "about the same line: one axis does what others do, and no machine is built so. Further linear axes (U V W) "
        "may be parallel to X Y Z.",
        "See `direction` and `point` of these axes.",
    ),
    "NCF322": Code(
        "a size that no machine has",
        "A travel, a pitch, a point, a step or a limit is far from what machines have: it is in another unit. Lengths "
        "are in mm, rotary ranges and steps in degrees.",
        FORMATS,
    ),
    "NCF323": Code(
        "positions of an error that its axis does not have",
        "The positions of a table, or the knots of a curve, are outside the range of the axis, cover next to nothing "
        "of it, or look like radians or inches. They are in mm or degrees, after `center` and `scale`.",
        FORMATS,
    ),
    "NCF325": Code(
        "left-handed axes",
        "Where X, Y and Z grow the tool goes, seen from the workpiece, as thumb, forefinger and middle finger of the "
        "left hand point. ISO 841 and all controls have them right-handed: planes, the sense of arcs and tilted planes "
        "rely on it. One of the axes has the wrong sign, and its errors would be corrected the wrong way round. Mostly "
        "it is an axis below the workpiece: `direction` is how its body moves as the number grows, which is against "
        "the way of the tool.",
        "Turn the sign of the `direction` that is wrong.",
    ),
    "NCF324": Code(
        "a machine like no other",
        "Something about this machine file cannot be, see the messages before this one. Programs and tables for it "
        "would be wrong by as much.",
        "`ncfix machine check` lists all of it.",
    ),
    "NCF340": Code(
        "an input of the error model is not given",
        "An effect depends on a temperature, a time or the like. Without its value the error is not known, and zero "
        "would be a guess.",
        "`--input temp_spindle=24.5`, or [inputs] in the setup file; a column of that name in measurements.",
    ),
    "NCF390": Code(
        "symbolic formulas need sympy",
        "The error equations are worked out with sympy, which is not among what ncfix always needs.",
        'pip install "ncfix[symbolic]"',
    ),
    "NCF391": Code(
        "a chain file that is wrong",
        "A variable or a step of the chain cannot be understood, or an angle is not linear in the small variables.",
        "The message names the key; examples/chains shows such a file.",
    ),
    "NCF392": Code(
        "an order that there is not",
        "Error equations are expanded to first order, second order and so on.",
        "Ask for 1 or 2.",
    ),
    "NCF393": Code(
        "an error that is not in the chain",
        "A name or a pattern fits no error of the machine, or one symbol cannot stand for all effects of that name.",
        "Name it as the machine file does, or with a pattern such as E?C.",
    ),
}
