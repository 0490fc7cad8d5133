"""Where a run starts: coordinates and velocities that meet the constraints."""

from __future__ import annotations

from ...common.arrays import Array
from ...common.errors import InputError
from ..joints.transmission import ElasticGear
from ..model.system import MechanismSystem
from .initial_guess import initial_guess, working_guess
from .position import solve_positions, with_rates
from .reach import unreachable
from .redundancy import check_redundancy, check_regular
from .state import State


def undeformed_state(assembly: MechanismSystem) -> State:
    """The state with p = ṗ = 0 that meets all constraints at t = 0, next to the guessed angles and rates.

    Raises `InputError` for constraints that repeat or contradict each other, a target out of reach, and a singular
    configuration, naming the trajectory or joints.
    """
    guess = initial_guess(assembly)
    check_redundancy(assembly, guess.q)
    q = solve_positions(assembly, 0.0, guess.q)
    if q is None:
        raise InputError(unreachable(assembly, 0.0, guess.q) + _suggestion(assembly))
    check_regular(assembly, q)
    return _with_relaxed_gears(assembly, with_rates(assembly, q, guess.v))


def _suggestion(assembly: MechanismSystem) -> str:
    """Which `initial.angles` would do; empty where none are found."""
    angles = working_guess(assembly)
    if angles is None:
        return ""
    table = ", ".join(f'{name} = "{degrees:g}*deg"' for name, degrees in angles.items())
    return f"; from [initial] angles = {{ {table} }}, for one, it goes"


def _with_relaxed_gears(assembly: MechanismSystem, state: State) -> State:
    """The state with rotors where their gears are not strained."""
    q, v = state.q.copy(), state.v.copy()
    for gear in assembly.model.gears:
        rotor = assembly.first[assembly.index[gear.rotor]] + 2
        q[rotor], v[rotor] = output_angle(assembly, gear, q), output_angle(assembly, gear, v)
    return State(q, v)


def output_angle(assembly: MechanismSystem, gear: ElasticGear, x: Array) -> float:
    """γ + α_a/N (rad), which is a rotor's angle over N where its gear is not strained; of x = q, or its rate of v."""
    a, b = (float(assembly.section_angle(marker, x)) for marker in (gear.coordinate.a, gear.coordinate.b))
    return b - (1 - 1 / gear.ratio) * a
