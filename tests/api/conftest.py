"""The native FMUs that the tests of the master use, too."""

from ..master.conftest import fmus

__all__ = ["fmus"]
