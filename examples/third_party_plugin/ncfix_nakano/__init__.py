"""Controls of Nakano, a relative of Fanuc: the dialect `nakano`, and its stored pitch errors.

Nakano is invented. What differs from Fanuc: G100 changes the tool and goes to the words of its block in rapid, G168
tilts the plane by A B C, G177 drills with E as the level from which it feeds, and MSG["..."] shows a text.
"""

from pathlib import Path

from ncfix.plugin import CycleTable, Rapid, SetTool, family, hookimpl, like, made_by

NAKANO = family("fanuc").derive(
    "nakano",
    title="Nakano N7",
    grammar=str(Path(__file__).with_name("nakano.lark")),
    suffixes=(".nak",),
    signature=(rb"(?im)^[^(;\n]*(?<![A-Z])G[ \t]*(?:100[ \t]*T|(?:168|177)(?![\d.]))",),
    line_limit=128,
    codes={
        "G100": [SetTool("T"), Rapid()],
        "G168": [like("G68.2", P=0, I="A", J="B", K="C")],
    },
    cycles={"G177": CycleTable(level="E", needs="Q")},
)


@hookimpl
def register_dialects(register):
    register(NAKANO)


@hookimpl
def register_controls(register):
    register(made_by("ncfix_nakano.tables:NakanoPitch"), name="nakano-pitch")
