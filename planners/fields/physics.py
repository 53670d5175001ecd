"""The physics of time fields: what a network's output means, and when it is right.

Equation numbers are those of Ni and Qureshi, "NTFields: Neural Time Fields for Physics-Informed
Robot Motion Planning", ICLR 2023. Configurations are in the normalised space of the networks;
leading axes are free, the last one of vectors is d.
"""

from __future__ import annotations

import torch
from torch import Tensor


def travel_time(distance: Tensor, tau: Tensor) -> Tensor:
    """T = |qs - qg| / tau  (equation 1)."""
    return distance / tau


def predicted_speed(tau: Tensor, offset: Tensor, gradient: Tensor) -> Tensor:
    """The speed at one end that a factorised time field implies  (equation 2).

    Args:
        tau: (...).
        offset: (..., d), this end minus the other.
        gradient: (..., d), of tau with respect to this end.
    """
    squared = (
        tau**2 + (offset**2).sum(-1) * (gradient**2).sum(-1) - 2 * tau * (offset * gradient).sum(-1)
    )
    return tau**2 / squared.clamp_min(torch.finfo(tau.dtype).tiny).sqrt()


def eikonal_loss(speed: Tensor, predicted: Tensor) -> Tensor:
    """|1 - sqrt(S* / S)| + |1 - sqrt(S / S*)| at one end  (equation 4)."""
    ratio = (speed / predicted).sqrt()
    return (1 - ratio).abs() + (1 - 1 / ratio).abs()


def log_slowness_error(log_speed: Tensor, stretch: Tensor, offset: Tensor, slope: Tensor) -> Tensor:
    """r = log(S* |grad T|) at one end, for T = |qs - qg| exp(stretch).

    0 where the Eikonal equation holds, positive where T rises too steeply (T would be above the
    true time) and negative where it is slack. In these terms equation 4 is 2 sinh(|r| / 2).

    Args:
        log_speed: (...), log S* at this end.
        stretch: (...), -log tau.
        offset: (..., d), this end minus the other; not zero.
        slope: (..., d), gradient of stretch with respect to this end.
    """
    distance = offset.norm(dim=-1, keepdim=True)
    steepness: Tensor = (offset / distance + distance * slope).norm(dim=-1)
    return log_speed + stretch + steepness.clamp_min(1e-12).log()


def steepness_along(rise: Tensor, time: Tensor) -> Tensor:
    """The mean cost of rises of T that are steeper than the speeds on the way allow.

    For a subsolution |T(a, g) - T(b, g)| is at most the integral of 1 / S* along any way from a to
    b. The cost is 2 sinh(r / 2), r = log(|rise| / time), as in `log_slowness_error`; what rises
    less costs nothing.

    Args:
        rise: (...), T at one place minus T at another.
        time: (...), of going from one to the other straight; infinite, and left out, if something
            is in the way. Places so close that it is hardly above 0 are left out as well.
    """
    rise = rise.abs()
    time = time.expand_as(rise)
    counts = time.isfinite() & (time > 1e-4)
    # log(1) where it does not count, as the gradient of what is masked must be finite
    ratio = torch.where(counts, rise, 1.0) / torch.where(counts, time, 1.0)
    excess = ratio.clamp_min(1.0).log().clamp_max(6.0)
    return 2 * torch.sinh(excess / 2).sum() / counts.sum().clamp_min(1)


def subsolution_loss(
    error: Tensor,
    stretch: Tensor,
    distance: Tensor,
    *,
    pull: float,
    pull_distance: float,
    slack_weight: float,
) -> Tensor:
    """The loss that has the *largest* subsolution of the Eikonal equation as its minimum.

    Many fields satisfy |grad T| S* = 1 almost everywhere; every one of them is at most the true
    travel time, which is the largest field with |grad T| S* <= 1 (the viscosity solution). So
    steepness above 1 costs as in equation 4, slack costs `slack_weight` times that, and
    `stretch` = log(T / |qs - qg|) is pulled up.

    Near pairs are pulled in proportion to their distance. Else a jump of T close to the goal would
    pay: it costs in a small ball only, but raises the stretch of all near pairs a lot.

    Args:
        error: (..., n), `log_slowness_error` at any ends.
        stretch: (n) of the same pairs.
        distance: (n) |qs - qg|.
        pull: weight of the mean stretch.
        pull_distance: beyond which pairs are pulled with their full weight.
        slack_weight: in 0..1.
    """
    weight = torch.where(error > 0, 1.0, slack_weight)
    pulled = (distance / pull_distance).clamp(max=1) * stretch
    return (weight * 2 * torch.sinh(error.abs() / 2)).mean() - pull * pulled.mean()
