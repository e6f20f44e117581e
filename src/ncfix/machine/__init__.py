"""The machine floor: kinematic chain, error effects, machine file. Units mm and rad; frames in docs/conventions.md."""

from ncfix.machine.axis import Axis, Tool
from ncfix.machine.effect import Effect
from ncfix.machine.file import load, loads
from ncfix.machine.jacobian import Jacobians
from ncfix.machine.machine import Machine
from ncfix.machine.state import State
from ncfix.machine.write import dumps

__all__ = ["Axis", "Effect", "Jacobians", "Machine", "State", "Tool", "dumps", "load", "loads"]
