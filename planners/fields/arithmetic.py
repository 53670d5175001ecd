"""How compiled code of time fields may compute."""

from __future__ import annotations

QUICK = {"reassoc", "contract", "arcp", "nsz", "afn"}
"""What LLVM may do with sums, products and functions of floating-point numbers. All that Numba's
`fastmath=True` allows but `nnan` and `ninf`: with these LLVM may do anything where a number is
infinite or none, and distances from nothing and times through a wall are infinite here."""
