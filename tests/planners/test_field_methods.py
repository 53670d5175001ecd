"""Which methods of time fields there are for an environment, by what it says of itself."""

from __future__ import annotations

import numpy as np
import pytest
from turning_cubes import Plane

import envs
import planners
from envs.environment import LinkGeometry
from envs.spaces import Coordinates, Space
from planners.fields import methods
from planners.fields.objectives import Regression
from planners.fields.robot_features import ArmInputs


class FourNumbers(Plane):
    """Says that its robot has four coordinates, in which nothing wraps."""

    lower = np.full(4, -1.0)
    upper = np.full(4, 1.0)
    space = Space([Coordinates(lower, upper)])


class SixNumbers(FourNumbers):
    lower = np.full(6, -1.0)
    upper = np.full(6, 1.0)
    space = Space([Coordinates(lower, upper)])


class WithLinks(FourNumbers):
    """Offers the geometry of links, without being an arm's world."""

    @property
    def link_geometry(self) -> LinkGeometry | None:
        return envs.make("arm4").link_geometry


class Inside(FourNumbers):
    """A body in a room."""

    is_interior = True


@pytest.mark.parametrize("name", methods.METHODS)
def test_no_field_is_for_what_moves_and_turns_in_parts(name: str) -> None:
    assert "in parts" in str(planners.make(name).unsupported(Plane()))


def test_a_robot_that_is_no_point_and_has_no_links_is_told_by_its_numbers() -> None:
    world = FourNumbers()
    assert methods.method("ntfields", world) is methods.METHODS["ntfields"]
    assert methods.unsupported("ntfields", world) is None
    assert "point" in str(methods.unsupported("ntfields-wenc", world))
    assert methods.unsupported("ief3d", world) is None
    labels = methods.method("ief3d", world).objective()
    assert isinstance(labels, Regression)
    assert labels.plan.resolution is None, "100 nodes a side would be 800 MB"
    assert "6 dimensions" in str(methods.unsupported("ief3d", SixNumbers()))


def test_links_that_are_offered_are_used() -> None:
    network = methods.method("ntfields", WithLinks()).network(WithLinks())
    assert isinstance(network.inputs, ArmInputs)
    with pytest.raises(ValueError, match="no link_geometry"):
        ArmInputs(FourNumbers())


def test_what_is_done_in_rooms_is_for_points() -> None:
    assert methods.method("ntfields", Inside()) is methods.METHODS["ntfields"]
