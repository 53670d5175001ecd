"""Which links and objects may touch each other, as MoveIt's scenes say."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from functools import partial
from itertools import combinations


@dataclass(frozen=True)
class AllowedCollisionMatrix:
    """What `moveit_msgs/AllowedCollisionMatrix` is about. Names may be of links or of objects, or
    of what is not there.

    Attributes:
        entries: whether the two of a pair may touch, by their names.
        defaults: by a name, whether it may touch that with which it has no entry.
    """

    entries: Mapping[frozenset[str], bool] = field(default_factory=dict)
    defaults: Mapping[str, bool] = field(default_factory=dict)

    def allows(self, one: str, other: str) -> bool:
        """Whether two may touch: by their entry; where they have none, by the default of the one
        that has a default, and if both have, only if both say so."""
        pair = frozenset((one, other))
        if pair in self.entries:
            return self.entries[pair]
        told = [self.defaults[name] for name in pair if name in self.defaults]
        return bool(told) and all(told)

    def pairs(self, names: Collection[str]) -> frozenset[frozenset[str]]:
        """The pairs of some names that may touch."""
        return frozenset(frozenset(pair) for pair in combinations(names, 2) if self.allows(*pair))

    def touching(
        self, links: Collection[str], objects: Collection[str]
    ) -> Callable[[str, str], bool]:
        """Whether a link may touch an object, by their names. A name that is a link's stands for
        that alone."""
        among = frozenset(objects) - frozenset(links)
        return partial(self._allows_among, among)  # which, unlike a lambda, can be pickled

    def _allows_among(self, among: Collection[str], link: str, name: str) -> bool:
        return name in among and self.allows(link, name)
