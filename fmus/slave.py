"""The base class of the FMUs, of the FMI version they are built for; an FMU's own copy of `version.py` tells which."""

from __future__ import annotations

from .version import FMI

if FMI == 3:
    from .fmi3 import Slave
else:
    from .fmi2 import Slave

__all__ = ["Slave"]
