"""What the message codes of compensation tables mean."""

from __future__ import annotations

from ncfix.diagnostics import Code

CODES = {
    "NCF480": Code(
        "no tables for that control",
        "No plugin brings compensation tables for a control of that name.",
        "`ncfix plugins` lists what there is; `ncfix fix` corrects programs for any control.",
    ),
    "NCF481": Code(
        "a machine that tables are not made for",
        "Tables move the tool tip with three linear axes: with X, Y and Z where a machine has more, as a boring mill "
        "has W. This one has fewer, or its axes have other names.",
        "`ncfix fix` corrects programs for any machine with X, Y and Z.",
    ),
    "NCF482": Code(
        "no correction found at a node",
        "Newton's method on the exact model of the machine does not come to a command that brings the tip where it "
        "should be.",
        "Look for jumps and for very large coefficients in the machine file.",
    ),
    "NCF483": Code(
        "a range that tables cannot cover",
        "The range of an axis is empty, beyond its travel, of an axis that is not there, or nowhere given.",
        "Give ranges in the machine file, or `--range X=LOW,HIGH` (mm or degree).",
    ),
    "NCF484": Code(
        "more than the format can hold",
        "A value, a number of points or an axis is beyond what the control's files can say.",
        "The message names the limit. A smaller range, a larger `--target-um`, or `ncfix fix` may do.",
    ),
    "NCF485": Code(
        "a setting of a control is unknown, missing or wrong",
        "`--set NAME=VALUE` sets what a control's plugin leaves open. Settings without a default are those with which "
        "a wrong guess would double the error.",
        "The message names the settings that there are; docs/controllers.md explains them.",
    ),
    "NCF486": Code(
        "not a folder of exported tables",
        "`ncfix emulate` reads the folder that `ncfix export` wrote, with its side file `ncfix-tables.json`.",
        "Export again into an empty folder.",
    ),
    "NCF487": Code(
        "tables of another machine",
        "The side file says that the tables were made for another control, another machine, or for errors that have "
        "been calibrated anew since.",
        "Export them again. `--other-machine` runs them all the same, to see what old tables leave.",
    ),
    "NCF488": Code(
        "a table was changed since it was exported",
        "The content of a file is not what `ncfix export` wrote. It is read as it is.",
        "Export again if nobody meant to change it.",
    ),
    "NCF489": Code(
        "corrections beyond what the machine allows",
        "A table would move an axis by more than `max_correction` of the machine file, or an error is not a number.",
        "Check units and signs of the errors; raise `max_correction` if it is right.",
    ),
    "NCF490": Code(
        "tables that do harm",
        "Run as the control would, the tables leave more error than there is without them. They are not written.",
        "The errors of this machine are not of a kind that this control's tables can correct; `ncfix fix` can.",
    ),
    "NCF491": Code(
        "a table file that the control would not load, or read otherwise than it looks",
        "A line that is not understood, positions that do not ascend, a number of values that does not fit, a grid "
        "with holes.",
        "The message has the place. Export again rather than edit by hand.",
    ),
    "NCF492": Code(
        "a doubtful table",
        "The control would load the file, but it holds something that is rarely meant: a jump, a range smaller than "
        "the travel, values lost to rounding, a setting that compensates twice.",
        "The message has the place and says why.",
    ),
    "NCF493": Code(
        "tables on top of a program that has been corrected already",
        "The program carries the stamp of `ncfix fix`. Run with tables of the same errors it would be corrected twice, "
        "which is as wrong as not at all, the other way round.",
        "Give the original program, or run the corrected one with the tables switched off.",
    ),
}
