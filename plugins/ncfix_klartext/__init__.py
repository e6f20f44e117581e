"""Heidenhain Klartext: the dialect `heidenhain`."""

from __future__ import annotations

from ncfix.hookspecs import Register, hookimpl
from ncfix.program.dialect import Dialect

BEGIN_PGM = rb"(?im)^[ \t]*(?:/?[ \t]*\d+[ \t]*)?BEGIN[ \t]+PGM\b"
"""The first block of every Klartext program."""

HEIDENHAIN = Dialect(
    name="heidenhain",
    title="Heidenhain Klartext",
    grammar="klartext.lark",
    suffixes=(".h",),
    signature=(BEGIN_PGM,),
    foreign=(("a text without BEGIN PGM", rb"(?is)\A(?!.*\bBEGIN[ \t]+PGM\b)"),),
    comment="; {}",
    closure_mm=0.016,
    closure_relative=0.0,
    feed_of="all",
    language="ncfix.program.klartext.language:KLARTEXT",
)


@hookimpl
def register_dialects(register: Register[Dialect]) -> None:
    """Bring the dialect `heidenhain`."""
    register(HEIDENHAIN)
