"""Which dialects there are, and which of them a text is written in."""

from __future__ import annotations

import re
from pathlib import PurePath

from ncfix.diagnostics import UsageError
from ncfix.plugins import nearest, registry, working
from ncfix.text.content import beginning_without_comments
from ncfix.text.dialect import Dialect

DEFAULT = "iso"
"""What a text is read as if neither its name nor its content says more."""


def names() -> tuple[str, ...]:
    """The names of all dialects, sorted."""
    return tuple(sorted(registry("dialects")))


def get(name: str) -> Dialect:
    """The dialect of that name; raises UsageError NCF104."""
    known: dict[str, Dialect] = registry("dialects")
    if name not in known:
        raise UsageError.of("NCF104", f"no dialect {name!r}", hint=nearest(name, known))
    return known[name]


def detect(source: bytes, path: str, control: str = "") -> Dialect:
    """The dialect of a text: by its content, else that of the machine's control, else by its file suffix, else ISO."""
    known: dict[str, Dialect] = registry("dialects")
    head = beginning_without_comments(source)
    ranks = {name: rank for name, dialect in known.items() if (rank := signature_rank(dialect, head)) is not None}
    if ranks:
        shown = min(ranks, key=lambda name: (ranks[name], name))
        return known[control if control in known and known[control].variant_of == shown else shown]
    if control in known:
        return known[control]
    suffix = PurePath(path).suffix.lower()
    by_suffix = [name for name, dialect in sorted(known.items()) if suffix in dialect.suffixes]
    return known[by_suffix[0]] if by_suffix else get(DEFAULT)


def signature_rank(dialect: Dialect, head: bytes) -> int | None:
    """Which of the dialect's signatures is found first in `head`, in the order of their strength; None for none."""
    with working("dialects", dialect.name):
        found = (rank for rank, pattern in enumerate(dialect.signature) if re.search(pattern, head))
        return next(found, None)
