"""Figures that are shown where they are returned."""

from __future__ import annotations

from io import BytesIO
from typing import Any


def in_notebooks(figure: Any) -> Any:
    """The matplotlib figure, made to show itself in a notebook, which it does else only once pyplot is imported."""

    def image() -> bytes:
        buffer = BytesIO()
        figure.savefig(buffer, format="png", dpi=100)
        return buffer.getvalue()

    figure._repr_png_ = image
    return figure
