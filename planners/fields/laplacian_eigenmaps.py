"""Coordinates of free space that know its walls: the slow modes of diffusion in it.

Places on either side of a thin wall are close together, but far from each other in travel time.
A smooth function of position alone cannot tell them apart. The eigenvectors of the smallest
eigenvalues of the graph Laplacian of free space (Belkin and Niyogi, "Laplacian Eigenmaps", 2003)
can: they change within rooms slowly, through doors faster, and across walls not continuously.
Each divided by the root of its eigenvalue, their squared distance is the effective resistance
between two places (Klein and Randic, "Resistance distance", 1993), which grows with the way round.

They are a w-space encoding of the obstacles that is computed instead of learned: it depends on
speeds alone, and no path and no travel time goes into it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from envs.compiled import njit_cached_quick
from envs.grid import node_axes, node_counts, node_positions
from envs.problem import Array
from envs.seeding import stream
from planners.fields.clearance_field import ClearanceField, ClearanceMap, clearance_at

if TYPE_CHECKING:  # SciPy's parts take half a second, which planners outside of rooms can save
    from scipy import sparse

_SPACING = 0.35
"""Between the nodes of the graph, by d_max, unless there would be too many."""

_MOST_NODES = 40_000
"""That are free: more take too long to solve, and too much room in files of weights."""

_LEAST_CLEARANCE = 0.02
"""Of a free node, by d_max."""


class Modes(nn.Module):
    """The first modes on a grid, and in files of weights.

    Half the distance between two places' modes, squared, is a length in the networks' space: the
    effective resistance between them, scaled so that its median over pairs of places is that of
    their distance.

    Args:
        clearances: of the environment.
        count: of modes.
    """

    def __init__(self, clearances: ClearanceMap, count: int) -> None:
        super().__init__()
        self.count = count
        self._clearances = clearances
        self.shape: Tensor
        self.free: Tensor
        self.table: Tensor
        self.unit: Tensor
        self.register_buffer("shape", torch.full((3,), 3, dtype=torch.int32))
        self.register_buffer("free", torch.zeros(4, dtype=torch.uint8))
        self.register_buffer("table", torch.zeros((0, count), dtype=torch.int16))
        self.register_buffer("unit", torch.ones(count))
        self._arrays: ModeArrays | None = None

    def solve(self, seed: int) -> None:
        """Computes the modes of the largest component of free space."""
        graph = _FreeGraph(self._clearances)
        values, eigenvalues = graph.modes(self.count, seed)
        values /= np.sqrt(eigenvalues)
        self._keep(graph.free, values)
        self._keep(graph.free, 2 * values * np.sqrt(self._lengths_by_resistance(seed)))

    @property
    def arrays(self) -> ModeArrays:
        """What compiled code is given."""
        if self._arrays is None:
            shape = tuple(int(n) for n in self.shape)
            bits = np.unpackbits(self.free.cpu().numpy())[: int(np.prod(shape))]
            free = bits.reshape(shape).astype(np.bool_)
            table = self.table.cpu().numpy() * self.unit.cpu().numpy()
            # In rows, as when they were read from a file: for columns, which the solver of
            # eigenproblems gives, all that plans would be compiled a second time.
            values = table.astype(np.float32, order="C")
            self._arrays = ModeArrays.of(free, values, self._clearances)
        return self._arrays

    def _keep(self, free: NDArray[np.bool_], values: Array) -> None:
        """Takes values (nodes, m) at free nodes, in sixteen bits each."""
        unit = np.abs(values).max(axis=0) / np.iinfo(np.int16).max
        self.shape = torch.tensor(free.shape, dtype=torch.int32)
        self.free = torch.from_numpy(np.packbits(free))
        self.table = torch.from_numpy(np.rint(values / unit).astype(np.int16))
        self.unit = torch.from_numpy(unit.astype(np.float32))
        self._arrays = None

    def _lengths_by_resistance(self, seed: int) -> float:
        clearances, field = self._clearances, self._clearances.field
        rng = stream("pairs for modes", seed)
        x = rng.uniform(clearances.lower, clearances.upper, (20_000, 3))
        x = x[clearances.clearance(x) > _LEAST_CLEARANCE]
        a, b = x[: len(x) // 2], x[len(x) // 2 : 2 * (len(x) // 2)]
        resistance = ((modes_of(self.arrays, field, a) - modes_of(self.arrays, field, b)) ** 2).sum(
            axis=1
        )
        return float(np.median(np.linalg.norm(a - b, axis=1)) / np.median(resistance))

    def _load_from_state_dict(self, state: Any, prefix: str, *rest: Any) -> None:
        for name in ("shape", "free", "table", "unit"):  # their sizes are the environment's
            if prefix + name in state:
                setattr(self, name, torch.empty_like(state[prefix + name]))
        if self.table.ndim != 2 or self.table.shape[1] != self.count:
            raise ValueError(f"there should be {self.count} modes")
        self._arrays = None
        super()._load_from_state_dict(state, prefix, *rest)


class _FreeGraph:
    """Nodes of a regular grid that are free, in one component, and the conductances between them.

    Attributes:
        free: (nx, ny, nz) which nodes these are.
    """

    def __init__(self, clearances: ClearanceMap) -> None:
        spacing = _SPACING * clearances.field.reach
        while True:
            shape = node_counts(clearances.lower, clearances.upper, spacing)
            shape = np.maximum(shape, 3)  # for quadratic splines
            nodes = node_positions(node_axes(clearances.lower, clearances.upper, shape))
            clear = clearances.clearance(nodes.reshape(-1, 3)) > _LEAST_CLEARANCE
            if clear.sum() <= _MOST_NODES:
                break
            spacing *= 1.1
        self._clearances = clearances
        laplacian, members = self._connected(nodes, clear.reshape(nodes.shape[:3]))
        self._laplacian = laplacian
        self.free = np.zeros(clear.shape, dtype=np.bool_)
        self.free[np.flatnonzero(clear)[members]] = True
        self.free = self.free.reshape(nodes.shape[:3])

    def modes(self, count: int, seed: int) -> tuple[Array, Array]:
        """The slowest modes (nodes, count) but for the constant one, each of mean square 1, and
        their eigenvalues (count,)."""
        from scipy.sparse.linalg import eigsh

        n = len(self._laplacian.indptr) - 1
        begin = stream("modes", seed).normal(size=n)
        least = 1e-6 * float(self._laplacian.diagonal().mean())
        found, vectors = eigsh(self._laplacian, k=count + 1, sigma=-least, v0=begin)
        order = np.argsort(found)[1:]
        modes: Array = vectors[:, order] * np.sqrt(n)
        return modes, found[order]

    def _connected(
        self, nodes: Array, clear: NDArray[np.bool_]
    ) -> tuple[sparse.csc_matrix, NDArray[np.int64]]:
        """The Laplacian of the largest component of the free nodes, and its members among them.

        The conductance between neighbours is the mean speed on the way, and 0 through walls.
        """
        from scipy import sparse
        from scipy.sparse.csgraph import connected_components

        number = np.cumsum(clear).reshape(clear.shape) - 1
        ends, conductances = [], []
        for axis in range(3):
            this = tuple(slice(0, -1) if a == axis else slice(None) for a in range(3))
            next = tuple(slice(1, None) if a == axis else slice(None) for a in range(3))
            both = clear[this] & clear[next]
            a, b = nodes[this][both], nodes[next][both]
            length = np.linalg.norm(b - a, axis=1)
            ends.append(np.stack([number[this][both], number[next][both]]))
            speed = length / self._clearances.straight_times(a, b)
            conductances.append(speed * (self._clearances.field.reach / length) ** 2)
        pair, weight = np.concatenate(ends, axis=1), np.concatenate(conductances)
        n = int(clear.sum())
        half = sparse.coo_matrix((weight[weight > 0], pair[:, weight > 0]), (n, n))
        whole = (half + half.T).tocsr()
        # Each other component would have a constant mode of its own, of eigenvalue 0.
        _, component = connected_components(whole, directed=False)
        members = np.flatnonzero(component == np.bincount(component).argmax())
        whole = whole[members][:, members]
        laplacian = sparse.diags(np.asarray(whole.sum(axis=1)).ravel()) - whole
        return laplacian.tocsc(), members


class ModeArrays(NamedTuple):
    """Modes on a grid as compiled code sees them.

    Attributes:
        row: (nx, ny, nz) that of `values` of a node, or of the nearest free one.
        free: (nx, ny, nz) whether it is free.
        values: (rows, m).
        lower, spacing: (3,) the first node, and the distance to the next along each axis.
    """

    row: NDArray[np.int32]
    free: NDArray[np.bool_]
    values: NDArray[np.float32]
    lower: Array
    spacing: Array

    @staticmethod
    def of(
        free: NDArray[np.bool_], values: NDArray[np.float32], clearances: ClearanceMap
    ) -> ModeArrays:
        """Modes (nodes, m) of the free nodes, in their order."""
        from scipy import ndimage

        row = np.cumsum(free).reshape(free.shape) - 1
        nearest = ndimage.distance_transform_edt(~free, return_distances=False, return_indices=True)
        spacing = (clearances.upper - clearances.lower) / (np.array(free.shape) - 1)
        rows = row[tuple(nearest)].astype(np.int32)
        return ModeArrays(rows, free, values, clearances.lower, spacing)

    @staticmethod
    def none() -> ModeArrays:
        """No modes."""
        row, free = np.zeros((3, 3, 3), dtype=np.int32), np.zeros((3, 3, 3), dtype=np.bool_)
        values = np.zeros((1, 0), dtype=np.float32)
        return ModeArrays(row, free, values, np.zeros(3), np.ones(3))


_HARDLY = 1e-6
"""The weight of a node that is not free; one that cannot be seen has ten times that."""


@njit_cached_quick
def modes_at(modes: Any, field: Any, x: Any, values: Any) -> None:
    """Writes the modes (m,) at (3,): quadratic splines, weighted by how well nodes are seen."""
    base = np.empty(3, dtype=np.int64)
    spline = np.empty((3, 3))
    # Quadratic B-splines about the nearest node: smooth once, with a sum of 1. Within half a
    # spacing of the grid's ends they stay as they are there.
    for axis in range(3):
        last = modes.row.shape[axis] - 1
        u = min(max((x[axis] - modes.lower[axis]) / modes.spacing[axis], 0.0), float(last))
        base[axis] = min(max(round(u), 1), last - 1)
        t = min(max(u - base[axis], -0.5), 0.5)
        spline[axis, 0] = 0.5 * (0.5 - t) ** 2
        spline[axis, 1] = 0.75 - t * t
        spline[axis, 2] = 0.5 * (0.5 + t) ** 2
    values[:] = 0
    total = 0.0
    for a in range(3):
        for b in range(3):
            for c in range(3):
                i, j, k = base[0] + a - 1, base[1] + b - 1, base[2] + c - 1
                weight = spline[0, a] * spline[1, b] * spline[2, c]
                if weight < 1e-9:
                    continue
                # Never 0, so that a place which no node sees has a value, too.
                if modes.free[i, j, k]:
                    weight *= _seen(modes, field, x, i, j, k) + 10 * _HARDLY
                else:
                    weight *= _HARDLY
                total += weight
                row = modes.row[i, j, k]
                for m in range(len(values)):
                    values[m] += weight * modes.values[row, m]
    for m in range(len(values)):
        values[m] /= total


@njit_cached_quick
def _seen(modes: Any, field: Any, x: Any, i: int, j: int, k: int) -> float:
    """From 0, where a wall is between (3,) and a node, to 1."""
    dx = modes.lower[0] + i * modes.spacing[0] - x[0]
    dy = modes.lower[1] + j * modes.spacing[1] - x[1]
    dz = modes.lower[2] + k * modes.spacing[2] - x[2]
    least = 1.0
    for s in range(1, 5):
        t = 0.2 * s
        least = min(least, clearance_at(field, x[0] + t * dx, x[1] + t * dy, x[2] + t * dz))
    t = min(max((least + 0.03) / 0.06, 0.0), 1.0)
    return t * t * (3 - 2 * t)


def modes_of(modes: ModeArrays, field: ClearanceField, x: Array) -> Array:
    """Modes (n, m) at (n, 3), see `modes_at`."""
    values = np.empty((len(x), modes.values.shape[1]))
    _all_modes(modes, field, np.ascontiguousarray(x, dtype=np.float64), values)
    return values


@njit_cached_quick
def _all_modes(modes: Any, field: Any, x: Any, values: Any) -> None:
    for n in range(len(x)):
        modes_at(modes, field, x[n], values[n])
