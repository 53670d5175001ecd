"""What compiled code asks of what is about a robot, whichever kind of robot it is.

Numba chooses by the type of `about`: a `clearance_field.View` in rooms, a
`robot_features.ArmAbout` for arms. Configurations x (d,) are in the networks' space, clearances by
d_max.
"""

from __future__ import annotations

from typing import Any

from numba import types
from numba.extending import overload

from planners.fields.clearance_field import View, clearance_at, room_outward
from planners.fields.indoor_features import room_inputs
from planners.fields.robot_features import ArmAbout, arm_clearance_at, arm_inputs, arm_outward


def inputs_at(held: Any, about: Any, x: Any, rows: Any) -> Any:
    """Writes the computed inputs of a network at (d,) and their derivatives, (1 + d, size)."""


def clearance_of(about: Any, x: Any) -> Any:
    """The clearance at (d,), by d_max."""


def outward(about: Any, x: Any, missing: Any, step: Any) -> Any:
    """Writes a step (d,) from (d,) uphill, along which the clearance grows by about `missing`."""


# Numba wants what it compiles to be annotated as what stands for it.


@overload(inputs_at)
def _inputs_at(held: Any, about: Any, x: Any, rows: Any) -> Any:
    def of_arm(held: Any, about: Any, x: Any, rows: Any) -> Any:
        arm_inputs(about, x, rows)

    def in_room(held: Any, about: Any, x: Any, rows: Any) -> Any:
        room_inputs(held, about, x, True, rows)

    return _chosen(about, of_arm, in_room)


@overload(clearance_of)
def _clearance_of(about: Any, x: Any) -> Any:
    def of_arm(about: Any, x: Any) -> Any:
        return arm_clearance_at(about, x)

    def in_room(about: Any, x: Any) -> Any:
        return clearance_at(about, x[0], x[1], x[2])

    return _chosen(about, of_arm, in_room)


@overload(outward)
def _outward(about: Any, x: Any, missing: Any, step: Any) -> Any:
    def of_arm(about: Any, x: Any, missing: Any, step: Any) -> Any:
        arm_outward(about, x, missing, step)

    def in_room(about: Any, x: Any, missing: Any, step: Any) -> Any:
        room_outward(about, x, missing, step)

    return _chosen(about, of_arm, in_room)


def _chosen(about: Any, of_arm: Any, in_room: Any) -> Any:
    """The one that is meant by the type of `about`, or None for a type that is neither."""
    if not isinstance(about, types.NamedTuple):
        return None
    return {ArmAbout: of_arm, View: in_room}.get(about.instance_class)
