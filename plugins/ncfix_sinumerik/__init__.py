"""SINUMERIK 840D: the dialect `siemens`."""

from __future__ import annotations

from ncfix.hookspecs import Register, hookimpl
from ncfix.program.dialect import FOREIGN, Dialect

SIEMENS = Dialect(
    name="siemens",
    title="Siemens SINUMERIK 840D",
    grammar="siemens.lark",
    suffixes=(".mpf", ".spf", ".arc"),
    signature=(
        *(pattern for family, pattern in FOREIGN if family.startswith("Siemens")),
        rb"(?im)^[ \t]*(?:N\d+[ \t]*)?(?:(?:TRAORI|TRAFOOF|SUPA|STOPRE|MCALL|FFWON|ORI[WM]KS)\b|GOTO[FB][ \t]+[A-Z_])",
        rb"(?im)^[^(;\n]*(?:\b[XYZABC]=(?:AC|IC|DC|ACP|ACN)[ \t]*\(|\b(?:CR|AR|[ABC]3)=[-+.\d])",
    ),
    foreign=tuple((family, pattern) for family, pattern in FOREIGN if not family.startswith("Siemens")),
    comment="; {}",
    closure_mm=0.01,
    closure_relative=0.0,
    language="ncfix.program.sinumerik.language:SINUMERIK",
)


@hookimpl
def register_dialects(register: Register[Dialect]) -> None:
    """Bring the dialect `siemens`."""
    register(SIEMENS)
