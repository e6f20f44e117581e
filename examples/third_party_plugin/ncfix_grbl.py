from ncfix.hookspecs import hookimpl
from ncfix.text.dialect import Dialect

GRBL = Dialect(
    name="grbl",
    title="Grbl 1.1",
    grammar="iso.lark",
    suffixes=(".grbl",),
    line_limit=80,
)


@hookimpl
def register_dialects(register):
    register(GRBL)
