"""The module that plugins import: everything that a maker's language and tables need.

    from ncfix.plugin import CycleTable, Rapid, SetTool, family, hookimpl

    BROTHER = family("fanuc").derive("brother", title="Brother", codes={"G100": [SetTool("T"), Rapid()]})

    @hookimpl
    def register_dialects(register):
        register(BROTHER)

Names are imported on first use. Dialects, operations and hooks import quickly; tables and machines import numpy. So a
plugin's first module should use only the former, and have its tables in a module of its own. docs/plugins.md explains
it step by step; `ncfix.testing` tests the result.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from ncfix.entry_points import entry_points
from ncfix.hookspecs import GROUP
from ncfix.hookspecs import Register as Register
from ncfix.hookspecs import hookimpl as hookimpl
from ncfix.plugins import nearest
from ncfix.text.dialect import FOREIGN as FOREIGN
from ncfix.text.dialect import TURNING as TURNING
from ncfix.text.dialect import CycleTable as CycleTable
from ncfix.text.dialect import Dialect as Dialect
from ncfix.values import frozen as frozen

if TYPE_CHECKING:
    from ncfix.arrays import Array as Array
    from ncfix.control.operations import ALL_AXES as ALL_AXES
    from ncfix.control.operations import Like as Like
    from ncfix.control.operations import Lose as Lose
    from ncfix.control.operations import MakeUp as MakeUp
    from ncfix.control.operations import Operation as Operation
    from ncfix.control.operations import Rapid as Rapid
    from ncfix.control.operations import Refuse as Refuse
    from ncfix.control.operations import Resume as Resume
    from ncfix.control.operations import SetLength as SetLength
    from ncfix.control.operations import SetTool as SetTool
    from ncfix.control.operations import Suspend as Suspend
    from ncfix.control.operations import like as like
    from ncfix.diagnostics import Code as Code
    from ncfix.diagnostics import ConfigError as ConfigError
    from ncfix.diagnostics import Message as Message
    from ncfix.diagnostics import NcfixError as NcfixError
    from ncfix.diagnostics import Place as Place
    from ncfix.diagnostics import RefusedError as RefusedError
    from ncfix.diagnostics import SourceError as SourceError
    from ncfix.diagnostics import UsageError as UsageError
    from ncfix.machine import Effect as Effect
    from ncfix.machine import Machine as Machine
    from ncfix.machine import State as State
    from ncfix.machine.basis import Basis as Basis
    from ncfix.machine.basis import key as key
    from ncfix.measure.measurement import Measurement as Measurement
    from ncfix.reports.document import Document as Document
    from ncfix.tables.axis_tables import Reversal as Reversal
    from ncfix.tables.axis_tables import positioning as positioning
    from ncfix.tables.axis_tables import reversal_note as reversal_note
    from ncfix.tables.axis_tables import reversals as reversals
    from ncfix.tables.compensation import Compensation as Compensation
    from ncfix.tables.compensation import Tables as Tables
    from ncfix.tables.compensation import Term as Term
    from ncfix.tables.compensation import own_terms as own_terms
    from ncfix.tables.control import Assumption as Assumption
    from ncfix.tables.control import Control as Control
    from ncfix.tables.control import FileControl as FileControl
    from ncfix.tables.control import Files as Files
    from ncfix.tables.control import Option as Option
    from ncfix.tables.control import Properties as Properties
    from ncfix.tables.control import Request as Request
    from ncfix.tables.control import Written as Written
    from ncfix.tables.control import number as number
    from ncfix.tables.control import one_of as one_of
    from ncfix.tables.control import whole as whole
    from ncfix.tables.control import wrong_setting as wrong_setting
    from ncfix.tables.correction import exact_correction as exact_correction
    from ncfix.tables.forms import FileForm as FileForm
    from ncfix.tables.forms import TableFile as TableFile
    from ncfix.tables.forms import form_named as form_named
    from ncfix.tables.forms import read_form as read_form
    from ncfix.tables.grid import Grid as Grid
    from ncfix.tables.grid import full_grid as full_grid
    from ncfix.tables.lower_bounds import least_of_own_axis as least_of_own_axis
    from ncfix.tables.table_files import Remarks as Remarks
    from ncfix.tables.table_files import as_number as as_number
    from ncfix.tables.table_files import check_all as check_all
    from ncfix.tables.table_files import in_order as in_order
    from ncfix.tables.table_files import messages_of as messages_of
    from ncfix.tables.table_files import unit_of as unit_of

HERE = ("FOREIGN", "TURNING", "CycleTable", "Dialect", "Register", "family", "frozen", "hookimpl", "made_by")
ELSEWHERE = {
    "ncfix.arrays": ("Array",),
    "ncfix.control.operations": (
        *("ALL_AXES", "Like", "Lose", "MakeUp", "Operation", "Rapid", "Refuse", "Resume", "SetLength", "SetTool"),
        "Suspend",
        "like",
    ),
    "ncfix.diagnostics": (
        *("Code", "ConfigError", "Message", "NcfixError", "Place", "RefusedError", "SourceError", "UsageError"),
    ),
    "ncfix.machine": ("Effect", "Machine", "State"),
    "ncfix.machine.basis": ("Basis", "key"),
    "ncfix.measure.measurement": ("Measurement",),
    "ncfix.reports.document": ("Document",),
    "ncfix.tables.axis_tables": ("Reversal", "positioning", "reversal_note", "reversals"),
    "ncfix.tables.compensation": ("Compensation", "Tables", "Term", "own_terms"),
    "ncfix.tables.control": (
        *("Assumption", "Control", "FileControl", "Files", "Option", "Properties", "Request", "Written"),
        *("number", "one_of", "whole", "wrong_setting"),
    ),
    "ncfix.tables.correction": ("exact_correction",),
    "ncfix.tables.forms": ("FileForm", "TableFile", "form_named", "read_form"),
    "ncfix.tables.grid": ("Grid", "full_grid"),
    "ncfix.tables.lower_bounds": ("least_of_own_axis",),
    "ncfix.tables.table_files": ("Remarks", "as_number", "check_all", "in_order", "messages_of", "unit_of"),
}
"""Module -> names that are imported from it on first use."""

MODULES = {name: module for module, names in ELSEWHERE.items() for name in names}

__all__ = sorted((*HERE, *MODULES))


def made_by(name: str) -> Callable[[], Any]:
    """A function that calls the function or class `module:name`, whose module is imported only then."""

    def made() -> Any:
        from pkgutil import resolve_name

        return resolve_name(name)()

    return made


def __dir__() -> list[str]:
    return __all__


def __getattr__(name: str) -> Any:
    """Import a name on first use."""
    if name not in MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = globals()[name] = getattr(import_module(MODULES[name]), name)
    return found


@cache
def family(name: str) -> Dialect:
    """The dialect `name` of an installed plugin, from which another can be derived.

    Raises LookupError if there is none.
    """
    found: dict[str, Dialect] = {}

    def register(dialect: Dialect, name: str | None = None) -> None:
        found.setdefault(name or dialect.name, dialect)

    for point in sorted(entry_points(GROUP), key=lambda point: point.name != name):
        own = point.dist is not None and point.dist.metadata["Name"] == "ncfix"
        if own or point.name == name:
            hook = getattr(point.load(), "register_dialects", None)
            if hook is not None:
                hook(register)
        if name in found:
            return found[name]
    raise LookupError(f"no dialect {name!r} to derive from: {nearest(name, found)}")
