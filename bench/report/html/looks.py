"""What each planner is drawn in."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.colors import to_hex, to_rgb

from bench.report.scene import colours

_DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot")
_SYMBOLS = ("circle", "square", "diamond", "circle-open", "square-open", "diamond-open")
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of sRGB, ITU-R BT.709
_DARK_MOST, _LIGHT_LEAST = 0.75, 0.35  # luminances on a light and on a dark page


def looks(planners: Sequence[str]) -> list[dict[str, Any]]:
    """For each planner its `name`; `light` and `dark`, its colour on such pages, which differ only
    where it could hardly be seen; and `dash` and `symbol` for those who cannot tell colours apart,
    by plotly's names."""
    return [
        {
            "name": name,
            "light": _within(colour, 0.0, _DARK_MOST),
            "dark": _within(colour, _LIGHT_LEAST, 1.0),
            "dash": _DASHES[number % len(_DASHES)],
            "symbol": _SYMBOLS[number % len(_SYMBOLS)],
        }
        for number, (name, colour) in enumerate(colours(planners).items())
    ]


def _within(colour: str, least: float, most: float) -> str:
    """A colour, mixed with white or black until its luminance is between two others."""
    rgb = np.array(to_rgb(colour))
    luminance = float(_LUMINANCE @ rgb)
    if luminance < least:
        rgb = 1 - (1 - rgb) * (1 - least) / (1 - luminance)
    if luminance > most:
        rgb = rgb * most / luminance
    return to_hex(tuple(rgb.clip(0, 1)))
