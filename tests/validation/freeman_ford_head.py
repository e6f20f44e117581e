"""The angle head of Freeman and Ford (2003) for the tests of this folder: its chain, derived, and its symbols."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import sympy as sp

from ncfix.machine.symbolic import Chain, Derivation, derive, load_chain
from ncfix.machine.symbolic.algebra import Algebra

ROOT = Path(__file__).resolve().parents[2]
DEGREE = np.pi / 180
ARCSEC = DEGREE / 3600
UM = 1e-3
ROUNDING = 1e-12
"""A dozen products of numbers of size 20 in double precision."""

NAMES = ["G", "e", "Yp", "Ap", "Cp", "ThetaAs", "OAs", "ThetaAv", "dYp", "OCx", "OCy", "ThetaCh", "ThetaCv"]
G, e, Yp, Ap, Cp, ThetaAs, OAs, ThetaAv, dYp, OCx, OCy, ThetaCh, ThetaCv = sp.symbols(NAMES, real=True)
SMALLS = NAMES[5:]
sY, cY, sA, cA, sC, cC = (f(angle) for angle in (Yp, Ap, Cp) for f in (sp.sin, sp.cos))
cot = 1 / sp.tan(Yp)


@cache
def head() -> Chain:
    """The chain that the examples ship."""
    return load_chain(ROOT / "examples/chains/angle_head.toml")


@cache
def first_order() -> Derivation:
    return derive(head())


def equal(a: sp.Expr, b: sp.Expr) -> bool:
    """Whether two expressions are the same function."""
    return not Algebra([sp.expand(a), sp.expand(b)]).poly(a - b)
