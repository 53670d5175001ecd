"""The report as one HTML file that needs no network: `report.html`."""

from bench.report.html.page import write

__all__ = ["write"]
