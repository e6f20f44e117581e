"""Machines with errors: kinematic chain, effects, machine files. Units mm and rad; frames in docs/conventions.md."""

from ncfix.machine.axes import Axis, Effect, GaugeLine
from ncfix.machine.file import load, loads
from ncfix.machine.linear import Jacobians
from ncfix.machine.machine import Machine, dumps
from ncfix.machine.state import State

__all__ = ["Axis", "Effect", "GaugeLine", "Jacobians", "Machine", "State", "dumps", "load", "loads"]
