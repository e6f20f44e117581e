from ncfix.plugin import family, hookimpl

GRBL = family("iso").derive(
    "grbl",
    title="Grbl 1.1",
    suffixes=(".grbl",),
    line_limit=80,
)


@hookimpl
def register_dialects(register):
    register(GRBL)
