"""What the message codes of compensation tables mean."""

from __future__ import annotations

from ncfix.diagnostics import Code

CODES = {
    "NCF480": Code(
        "no tables for that control",
        "No plugin brings compensation tables for a control of that name.",
        "`ncfix plugins` lists the controls with tables; `ncfix fix` corrects programs for any control.",
    ),
    "NCF481": Code(
        "a machine for which no tables can be made",
        "Tables move the tool tip with three linear axes: X, Y and Z if the machine has more, such as W of a boring "
        "mill. This machine has fewer, or its axes have other names.",
        "`ncfix fix` corrects programs for any machine with X, Y and Z.",
    ),
    "NCF482": Code(
        "no correction found at a point of a table",
        "Newton's method on the exact model of the machine finds no command that brings the tip to its nominal "
        "position.",
        "Look for jumps and very large coefficients in the machine file.",
    ),
    "NCF483": Code(
        "a range that tables cannot cover",
        "The range of an axis is empty, exceeds its travel or is not given, or the machine has no such axis.",
        "Give ranges in the machine file, or `--range X=LOW,HIGH` (mm or degree).",
    ),
    "NCF484": Code(
        "more than the table format can hold",
        "A value, a number of points or an axis exceeds what the files of the control can hold.",
        "The message names the limit. Try a smaller range or a larger `--target-um`, or use `ncfix fix`.",
    ),
    "NCF485": Code(
        "a setting of a control is unknown, missing or wrong",
        "`--set NAME=VALUE` gives a setting of the control. A setting has no default if a wrong value would double "
        "the error.",
        "The message lists the possible settings; docs/controllers.md explains them.",
    ),
    "NCF486": Code(
        "not a folder of exported tables",
        "`ncfix emulate` reads the folder that `ncfix export` wrote, with its side file `ncfix-tables.json`.",
        "Export again into an empty folder.",
    ),
    "NCF487": Code(
        "tables of another machine",
        "According to the side file, the tables were made for another control or machine, or before the errors were "
        "calibrated again.",
        "Export them again. `--other-machine` runs them anyway, to see the remaining error of old tables.",
    ),
    "NCF488": Code(
        "a table was changed since it was exported",
        "A file differs from what `ncfix export` wrote. It is used as it is now.",
        "Export again, unless the change was intended.",
    ),
    "NCF489": Code(
        "corrections beyond what the machine allows",
        "A table would move an axis by more than `max_correction` of the machine file, or an error is not a number.",
        "Check units and signs of the errors. If the correction is right, raise `max_correction`.",
    ),
    "NCF490": Code(
        "tables that increase the error",
        "When the tables are run as the control would, the error is larger than without them. They are not written.",
        "The tables of this control cannot correct the errors of this machine; use `ncfix fix`.",
    ),
    "NCF491": Code(
        "a table file that the control would not load or would misread",
        "A line is invalid, positions do not ascend, the number of values is wrong, or points of a grid are missing.",
        "The message names the place. Export the file again rather than editing it by hand.",
    ),
    "NCF492": Code(
        "a doubtful table",
        "The control would load the file, but something in it is rarely intended: a jump, a range smaller than the "
        "travel, values lost to rounding, or a setting that compensates twice.",
        "The message names the place and the reason.",
    ),
    "NCF493": Code(
        "tables for a program that has already been corrected",
        "The program carries the stamp of `ncfix fix`. With tables of the same errors it would be corrected twice: "
        "its error would be as large as without correction, with the opposite sign.",
        "Give the original program, or run the corrected program with the tables switched off.",
    ),
}
