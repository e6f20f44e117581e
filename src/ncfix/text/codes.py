"""Message codes of reading programs: 1xx."""

from __future__ import annotations

from ncfix.diagnostics import Code

CODES: dict[str, Code] = {
    "NCF101": Code(
        "not a text file",
        "The file has zero bytes or is UTF-16 text, which an NC program never is. A text that is given to a Python "
        "function may have characters of Latin-1 only.",
        "Save it as plain text (ASCII, Latin-1 or UTF-8).",
    ),
    "NCF102": Code(
        "empty program",
        "The file is empty, or has only blank lines.",
        "Check that it was transferred completely.",
    ),
    "NCF103": Code(
        "another control's language",
        "The text is written for another family of controls than the dialect with which ncfix reads it. Or it is "
        "another file of ncfix (a machine, setup or measurement file), not a program.",
        "Select the dialect with --dialect; `ncfix dialects` lists what ncfix can read.",
    ),
    "NCF104": Code(
        "no such dialect",
        "Neither ncfix nor a plugin has a dialect of this name.",
        "`ncfix dialects` lists the names.",
    ),
    "NCF105": Code(
        "line too long",
        "The line has more characters than the control accepts.",
        "Break the line, or shorten its comment.",
    ),
    "NCF106": Code(
        "a program for another control",
        "The text is in the language of another family of controls than the control in the machine file. ncfix reads "
        "it in that language, and corrects it with the errors of this machine file.",
        "Check that the machine file belongs to the machine that runs the program. If it does, confirm the language "
        "with --dialect.",
    ),
    "NCF110": Code(
        "unexpected text",
        "The language does not allow this character or word at this place.",
        "Correct the line, or select the dialect with --dialect.",
    ),
    "NCF111": Code(
        "comment not closed",
        "A comment has `(` without `)` on its line, or `)` without `(`.",
        "Write both brackets of the comment on one line.",
    ),
    "NCF112": Code(
        "nested comment",
        "There is a `(` inside a comment. The control ends the comment there, or refuses the block.",
        "Use other brackets inside comments.",
    ),
    "NCF113": Code(
        "bracket not closed",
        "An expression has `[` without the matching `]`, or `]` without `[`.",
        "Add the missing bracket.",
    ),
    "NCF114": Code(
        "word without a value",
        "An address, an operator or a pair of brackets has no number, parameter or expression.",
        "Write the value, or remove the letter.",
    ),
    "NCF115": Code(
        "malformed number",
        "A number has two points, two signs, a decimal comma or no digit, or is too large.",
        "Write it with digits, one point and at most one sign.",
    ),
    "NCF116": Code(
        "number with an exponent",
        "A number is written like `1e-05`. A control reads E as the address of another word.",
        "Write the number out, as 0.00001; put a blank before E if E is a word.",
    ),
    "NCF117": Code(
        "word programmed twice",
        "An address appears twice in the block. Some controls refuse such a block; others use one of the two values.",
        "Remove one of them.",
    ),
    "NCF118": Code(
        "expression too long",
        "An expression is nested too deep, or has too many terms, for ncfix.",
        "Divide it into several assignments.",
    ),
    "NCF119": Code(
        "flow control not understood",
        "The O-word is followed by no keyword that the control knows, or by more than the keyword allows.",
        "Use one of sub, endsub, call, return, if, elseif, else, endif, while, do, repeat, break, continue.",
    ),
}
