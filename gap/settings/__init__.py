"""Every number that the diagnosis was tuned with, in one place: unit, meaning and why that value.

A `Settings` is made once by the command, passed down inside the problem, and written into diagnosis.json.

Unless said otherwise, values were chosen on the development seeds 20261123 to 20261125 of the blind benchmark
(benchmarks/blind) and on the real campaigns (benchmarks/real). "Normalised" means divided by the noise of a reading.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

from .measurements import FILE_LIMITS, FaultSettings, FileLimits, SanitySettings
from .onboarding import CHECKS, NAMES, ONBOARDING, CheckSettings, NameSettings, OnboardingSettings
from .presentation import AnalysisSettings, ReportSettings, TerminalSettings
from .problem import CurveSettings, NoiseSettings, NumericsSettings, ParameterSettings, SwingSettings
from .search import FitSettings, SearchSettings
from .selection import (
    SCORING,
    BootstrapSettings,
    BudgetSettings,
    EvidenceSettings,
    PosteriorSettings,
    UncertaintySettings,
    ValidationSettings,
)

__all__ = [
    "CHECKS",
    "DEFAULT",
    "FILE_LIMITS",
    "NAMES",
    "ONBOARDING",
    "SCORING",
    "AnalysisSettings",
    "BootstrapSettings",
    "BudgetSettings",
    "CheckSettings",
    "CurveSettings",
    "EvidenceSettings",
    "FaultSettings",
    "FileLimits",
    "FitSettings",
    "NameSettings",
    "NoiseSettings",
    "NumericsSettings",
    "OnboardingSettings",
    "ParameterSettings",
    "PosteriorSettings",
    "ReportSettings",
    "SanitySettings",
    "SearchSettings",
    "Settings",
    "SwingSettings",
    "SyntheticSettings",
    "TerminalSettings",
    "UncertaintySettings",
    "ValidationSettings",
]  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Settings:
    """All settings of a diagnosis."""

    noise: NoiseSettings = field(default_factory=NoiseSettings)
    faults: FaultSettings = field(default_factory=FaultSettings)
    swings: SwingSettings = field(default_factory=SwingSettings)
    numerics: NumericsSettings = field(default_factory=NumericsSettings)
    parameters: ParameterSettings = field(default_factory=ParameterSettings)
    curves: CurveSettings = field(default_factory=CurveSettings)
    fit: FitSettings = field(default_factory=FitSettings)
    search: SearchSettings = field(default_factory=SearchSettings)
    validation: ValidationSettings = field(default_factory=ValidationSettings)
    evidence: EvidenceSettings = field(default_factory=EvidenceSettings)
    posterior: PosteriorSettings = field(default_factory=PosteriorSettings)
    budget: BudgetSettings = field(default_factory=BudgetSettings)
    bootstrap: BootstrapSettings = field(default_factory=BootstrapSettings)
    uncertainty: UncertaintySettings = field(default_factory=UncertaintySettings)
    sanity: SanitySettings = field(default_factory=SanitySettings)
    analysis: AnalysisSettings = field(default_factory=AnalysisSettings)

    def as_dict(self) -> dict[str, Any]:
        """All values by name, for a result; JSON has no infinity."""
        sections = {**asdict(self), "scoring": asdict(SCORING)}
        return {name: {key: _finite(value) for key, value in values.items()} for name, values in sections.items()}


@dataclass(frozen=True, kw_only=True)
class SyntheticSettings:
    """Synthetic campaigns; no part of a diagnosis."""

    rate: float = 100.0
    """Samples a second unless a run says otherwise [1/s]."""
    step: float = 0.25e-3
    """Macro step of the finer of the two runs from which that of no macro step is extrapolated [s]."""
    max_samples: float = 1e7
    """Samples of a run above which a rate or a time is taken for a mistake."""


def _finite(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_finite(v) for v in value]
    return "inf" if value == float("inf") else value


DEFAULT = Settings()
