"""Message codes of reading programs: 1xx."""

from __future__ import annotations

from ncfix.diagnostics import Code

CODES: dict[str, Code] = {
    "NCF101": Code(
        "not a text file",
        "It holds what no NC program has: zero bytes, or UTF-16 text; a text that is given to a function may have "
        "characters of Latin-1 only.",
        "Save it as plain text (ASCII, Latin-1 or UTF-8).",
    ),
    "NCF102": Code(
        "nothing in the program",
        "The file is empty, or holds nothing but blank lines.",
        "Check that it was transferred completely.",
    ),
    "NCF103": Code(
        "another control's language",
        "The text is written for another family of controls than the dialect with which it was read, or is no program "
        "but another file of ncfix.",
        "`ncfix dialects` lists what can be read.",
    ),
    "NCF104": Code(
        "no such dialect",
        "The name given for the dialect is not one that ncfix or a plugin has.",
        "`ncfix dialects` lists the names.",
    ),
    "NCF105": Code(
        "line too long",
        "The control refuses lines of more characters than its buffer holds; so would it refuse this one.",
        "Break the line, or shorten its comment.",
    ),
    "NCF106": Code(
        "a program for another control",
        "The text shows another family's language than that of the control which the machine file names. It is read as "
        "what it shows; the corrections are those of the machine file.",
        "Check that the machine file is that of the machine which the program is for; --dialect says that it is.",
    ),
    "NCF110": Code(
        "unexpected text",
        "At this place the language allows no such character or word.",
        "Correct the line, or name the dialect with --dialect.",
    ),
    "NCF111": Code(
        "comment not closed",
        "A comment starts with `(` and has no `)` on its line.",
        "Close the comment.",
    ),
    "NCF112": Code(
        "comment in a comment",
        "There is a `(` inside a comment; the control ends or refuses the comment there.",
        "Use other brackets inside comments.",
    ),
    "NCF113": Code(
        "bracket not closed",
        "An expression starts with `[` and has no `]` that belongs to it.",
        "Close the bracket.",
    ),
    "NCF114": Code(
        "word without a value",
        "An address stands without a number, parameter or expression.",
        "Write its value, or take the letter out.",
    ),
    "NCF115": Code(
        "malformed number",
        "A number has two points, two signs, a decimal comma, or no digit.",
        "Write it with digits, one point and at most one sign.",
    ),
    "NCF116": Code(
        "number with an exponent",
        "A number looks like `1e-05`, as some programs write small values; a control reads E as another word.",
        "Write the number out, as 0.00001; put a blank before E if a word is meant.",
    ),
    "NCF117": Code(
        "word twice",
        "An address stands twice in the block; controls refuse it, or take one of the two values.",
        "Take one of them out.",
    ),
    "NCF118": Code(
        "expression too deep",
        "An expression is nested deeper, or has more terms, than ncfix follows.",
        "Spread it over several assignments.",
    ),
    "NCF119": Code(
        "flow control not understood",
        "After an O-word stands no keyword that the control knows, or more than belongs to it.",
        "One of sub, endsub, call, return, if, elseif, else, endif, while, do, repeat, break, continue.",
    ),
}
