"""Settings that several of Fanuc's compensations share: the sign, and detection units."""

from __future__ import annotations

from collections.abc import Mapping

from ncfix.tables.control import Option, number, one_of
from ncfix.tables.table_files import DEGREE

SIGNS = ("correction", "error")
SIGNED = "correction: values are added to the command; error: they are taken off it"
UNITS: Mapping[str, Option] = {
    "detection_unit_um": Option("0.1", "detection unit of linear axes, um", number(1e-3, 10)),
    "detection_unit_deg": Option("0.0001", "detection unit of rotary axes and of angles, degree", number(1e-6, 10)),
}


def sign_option(settled: str) -> Option:
    """The option `sign`, with the assumption that it is about."""
    return Option(None, SIGNED, one_of(*SIGNS), settled)


def sense_of(sign: str) -> int:
    """1 if values are added, -1 if they are taken off."""
    return 1 if sign == SIGNS[0] else -1


def units_of(settings: Mapping[str, str]) -> tuple[float, float]:
    """Detection units, mm and rad."""
    length, angle = (float(settings[key]) for key in UNITS)
    return length / 1000, angle * DEGREE
