"""Forward kinematics of chains in PyTorch, whose import takes seconds that other users of chains
need not pay."""

from __future__ import annotations

import torch
from torch import Tensor

from envs.robots.chain import Chain, Joint


def forward(chain: Chain, q: Tensor) -> Tensor:
    """Poses (n, links, 4, 4) of a chain's links at configurations (n, d), as `Chain.forward`, of
    any type and on any device, with gradients.

    Raises:
        ValueError: the configurations have another shape.
    """
    if q.ndim != 2 or q.shape[1] != chain.dimension:
        raise ValueError(f"configurations must be (n, {chain.dimension}), not {tuple(q.shape)}")
    body = torch.eye(4, dtype=q.dtype, device=q.device).expand(len(q), 4, 4)
    bodies = [body]
    for joint, value in zip(chain.joints, q.T, strict=True):
        origin = torch.tensor(joint.origin).to(q)
        body = body @ origin @ _joint(joint, value)
        bodies.append(body)
    offsets = [torch.tensor(link.offset).to(q) for link in chain.links]
    return torch.stack(
        [bodies[link.body] @ at for link, at in zip(chain.links, offsets, strict=True)], dim=1
    )


def _joint(joint: Joint, value: Tensor) -> Tensor:
    """Poses (n, 4, 4) of a joint's body in the joint's frame, for values (n,)."""
    axis = torch.tensor(joint.axis).to(value)
    pose = torch.eye(4, dtype=value.dtype, device=value.device).repeat(len(value), 1, 1)
    if joint.prismatic:
        pose[:, :3, 3] = value[:, None] * axis
        return pose
    x, y, z = joint.axis.tolist()
    cross = torch.tensor([[0, -z, y], [z, 0, -x], [-y, x, 0]], dtype=value.dtype).to(value.device)
    c, s = value.cos()[:, None, None], value.sin()[:, None, None]
    turned = c * torch.eye(3).to(value) + s * cross + (1 - c) * torch.outer(axis, axis)
    return torch.cat([torch.cat([turned, pose[:, :3, 3:]], dim=2), pose[:, 3:]], dim=1)
