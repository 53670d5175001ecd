"""The shape of time fields' networks: plain numbers and names."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class FieldShape:
    """What a network is made of.

    Attributes:
        dimension: d.
        frequencies: number of random Fourier features.
        bandwidth: standard deviation of their frequencies, in periods per side of the space.
        width: of all hidden layers, and half of the number of features of a configuration.
        speed_ratio: the highest speed by the lowest, which bounds the stretch.
        below: how far the bounds of the stretch reach below 0.
        opening: where between the bounds an untrained network's stretch is, as log odds.
        operator: how two configurations' features are combined, see `OPERATORS`.
        bounded: whether the stretch is bounded.
        workspace: whether there is a w-space encoder.
        computed: how many inputs are computed from the environment, see `networks.ComputedInputs`.
        modes: how many of them, the last ones, are modes of free space; 0 but in rooms.
    """

    dimension: int
    frequencies: int = 32
    bandwidth: float = 0.7
    width: int = 128
    encoder_blocks: int = 2
    generator_blocks: int = 2
    speed_ratio: float = 10.0
    below: float = 0.08
    opening: float = -1.0
    operator: str = "smooth"
    bounded: bool = True
    workspace: bool = False
    computed: int = 0
    modes: int = 0

    @property
    def features(self) -> int:
        """Of one configuration."""
        return (4 if self.workspace else 2) * self.width
