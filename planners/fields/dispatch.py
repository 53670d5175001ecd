"""What compiled code asks of clearances, whichever kind of robot they are of.

Numba chooses by the type of `field`: a `clearance_field.ClearanceField` in rooms, a
`robot_features.ArmClearanceField` for arms. Configurations x (d,) are in the networks' space,
clearances by d_max.
"""

from __future__ import annotations

from typing import Any

from numba import types
from numba.extending import overload

from planners.fields.clearance_field import ClearanceField, clearance_at, room_outward
from planners.fields.indoor_features import room_inputs
from planners.fields.robot_features import (
    ArmClearanceField,
    arm_clearance_at,
    arm_inputs,
    arm_outward,
)


def inputs_at(modes: Any, field: Any, x: Any, rows: Any) -> Any:
    """Writes the computed inputs of a network at (d,) and their derivatives, (1 + d, size)."""


def clearance_of(field: Any, x: Any) -> Any:
    """The clearance at (d,), by d_max."""


def outward(field: Any, x: Any, missing: Any, step: Any) -> Any:
    """Writes a step (d,) from (d,) uphill, along which the clearance grows by about `missing`."""


# Numba wants what it compiles to be annotated as what stands for it.


@overload(inputs_at)
def _inputs_at(modes: Any, field: Any, x: Any, rows: Any) -> Any:
    def of_arm(modes: Any, field: Any, x: Any, rows: Any) -> Any:
        arm_inputs(field, x, rows)

    def in_room(modes: Any, field: Any, x: Any, rows: Any) -> Any:
        room_inputs(modes, field, x, True, rows)

    return _chosen(field, of_arm, in_room)


@overload(clearance_of)
def _clearance_of(field: Any, x: Any) -> Any:
    def of_arm(field: Any, x: Any) -> Any:
        return arm_clearance_at(field, x)

    def in_room(field: Any, x: Any) -> Any:
        return clearance_at(field, x[0], x[1], x[2])

    return _chosen(field, of_arm, in_room)


@overload(outward)
def _outward(field: Any, x: Any, missing: Any, step: Any) -> Any:
    def of_arm(field: Any, x: Any, missing: Any, step: Any) -> Any:
        arm_outward(field, x, missing, step)

    def in_room(field: Any, x: Any, missing: Any, step: Any) -> Any:
        room_outward(field, x, missing, step)

    return _chosen(field, of_arm, in_room)


def _chosen(field: Any, of_arm: Any, in_room: Any) -> Any:
    """The one that is meant by the type of `field`, or None for a type that is neither."""
    if not isinstance(field, types.NamedTuple):
        return None
    return {ArmClearanceField: of_arm, ClearanceField: in_room}.get(field.instance_class)
