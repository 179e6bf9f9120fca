"""What a diagnosis knows at some stage; every stage returns a new one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...master.parallel.pool import Pool
from ..analysis.budget import Alternative, Budget
from ..analysis.character import Character
from ..analysis.component_replay import Replay
from ..analysis.experiment_design import NextMeasurement
from ..analysis.localisation import GapLocation
from ..analysis.residual_structure import Structure
from ..analysis.verdict import verdict
from ..campaign.campaign import NOTHING_TO_FIT, Campaign, CampaignError
from ..campaign.catalogue import Catalogue
from ..problem.build import build_problem
from ..problem.parameters import EffectCandidate
from ..problem.problem import Problem
from ..problem.stop import StopToken
from ..search.earlier import EarlierDiagnosis, transferable_sets
from ..search.rounds import FirstLook, Round
from ..selection.evidence import RankedHypothesis
from ..selection.hypothesis import Hypothesis, is_adequate
from ..settings import DEFAULT, Settings
from .holdout import HoldoutRuns, split_runs


def _empty() -> np.ndarray:
    return np.zeros(0)


@dataclass(frozen=True)
class Inclusion:
    """Calibrated probability that an effect, or any effect of a group, is in the machine."""

    effects: Mapping[str, float]
    groups: Mapping[str, float]
    group_of: Mapping[str, str]


@dataclass(frozen=True, eq=False)
class EffectInForm:
    """An effect in another form than the plain one."""

    effect: EffectCandidate
    hypothesis: RankedHypothesis
    """The most probable one that has the effect."""
    probability: float
    """Of the form among the hypotheses that have the effect."""
    share: float
    """What the plain form leaves more, of what calibration leaves."""


@dataclass(frozen=True, eq=False)
class AllRuns:
    """What the search comes back to from some of the runs; as in `State`."""

    problem: Problem
    nominal: np.ndarray
    step_change: np.ndarray


@dataclass(frozen=True, eq=False)
class State:
    """What is known so far, grouped by the module of `pipeline` that fills it first; later stages replace what they
    know better, such as the problem with its steps, and what rests on it."""

    problem: Problem
    """Of the runs that are learned from."""
    holdout_campaign: Campaign | None
    """The runs that are held out, before they are simulated."""
    package_step: float
    """Macro step that the package asks for [s]."""

    # preparation
    nominal: np.ndarray = field(default_factory=_empty)
    """The model as delivered (n,)."""
    step_change: np.ndarray = field(default_factory=_empty)
    """How far halving the package's step moves each entry (n,)."""
    nominal_macro_step: float = 0.0
    """Macro step of exact runs that the delivered model needs [s]."""
    noise_widened: str = ""
    """What is to be said where the noise was widened beyond what is stated or estimated."""
    run_mistakes: tuple[str, ...] = ()
    """What betrays runs as a whole, such as the file of another run."""
    holdout: HoldoutRuns | None = None
    nuisance_jacobian: np.ndarray = field(default_factory=_empty)
    """(n, m)."""

    # run_subset
    all_runs: AllRuns | None = None
    """All of them, while the problem is that of some."""
    rms_on_subset: float = 0.0
    """Normalised RMS that the best set left of some runs when the search came back from them; 0 before."""

    # search
    earlier: EarlierDiagnosis | None = None
    """What an earlier diagnosis had fitted, to go on from; only sets that the problem can have."""
    baseline: Hypothesis | None = None
    """The refit of the base parameters."""
    start: Hypothesis | None = None
    """Where the next bank of responses is made; None once nothing is left to go on from."""
    other_start: Hypothesis | None = None
    """The model as delivered, or its refit: the one of the two at which there has been no bank."""
    bank_sets: tuple[frozenset[str], ...] = ()
    """Sets at which there has been one, by their effects' labels."""
    first_look: FirstLook | None = None
    """What a first look at sets of effects has found, until all are compared."""
    quick_round: Round | None = None
    """What the first comparison of sets has found, until the best of it is fitted to the end."""
    fitted_sets: tuple[Hypothesis, ...] = ()
    """Fits of sets of effects, of each set the best."""
    shares_alone: Mapping[str, float] = field(default_factory=dict)
    """Share of the first bank's residual that each effect alone could explain, by its label."""
    ranked: tuple[RankedHypothesis, ...] = ()
    """All hypotheses, the best first."""

    # probabilities
    probabilities: tuple[float, ...] = ()
    not_held_out: tuple[RankedHypothesis, ...] = ()
    """Those with which the held-out runs cannot be simulated."""
    """Of the ranked hypotheses, which are then in their order; they add up to 1."""
    inclusion: Inclusion = field(default_factory=lambda: Inclusion({}, {}, {}))
    alternatives: tuple[Alternative, ...] = ()
    """Plausible hypotheses with what every subset of their effects leaves on the scoring data."""
    budget: Budget | None = None

    # forms
    effects_in_form: tuple[EffectInForm, ...] = ()
    """Effects in other forms than the plain one."""

    # analysis
    structure: Structure | None = None
    masks: Mapping[str, np.ndarray] = field(default_factory=dict)
    """Regions of the scoring data, by name."""
    places: tuple[GapLocation, ...] = ()
    replays: tuple[Replay, ...] = ()
    reduction_ci: tuple[float, float] = (0.0, 0.0)
    all_samples: tuple[np.ndarray, ...] = ()
    """Residuals of all samples as delivered, calibrated, with the effects (n,); empty where nothing swings."""
    held_samples: tuple[np.ndarray, ...] = ()
    """The same of the held-out runs."""
    character: Character | None = None
    """Of what is unexplained."""
    next_measurements: tuple[NextMeasurement, ...] = ()
    """Changes of conditions and channels to add, the best first."""

    # any stage
    warnings: tuple[str, ...] = ()
    sections: Mapping[str, Any] = field(default_factory=dict)
    """What a stage adds to diagnosis.json, by its key there; JSON values."""
    progress: str = ""
    """What the search knows, for whoever waits."""

    # run_pipeline
    unfinished: str = ""
    """The stage in which the diagnosis was asked to stop."""
    seconds: Mapping[str, float] = field(default_factory=dict)
    """Wall time of each stage [s]."""
    first_answer: float = 0.0
    """Time until it first knew anything of effects [s]; 0 before."""

    @property
    def subset_text(self) -> str:
        """To be said of what was found on some of the runs; else nothing."""
        return f" on {len(self.problem.runs)} of {len(self.all_runs.problem.runs)} runs" if self.all_runs else ""

    @property
    def scoring(self) -> Problem:
        """The problem on whose data gaps are stated: the held-out runs, or all data with folds left out in turn."""
        return self.holdout.problem if self.holdout else self.problem

    @property
    def held_out_how(self) -> str:
        """What held-out means here."""
        return "runs that the campaign holds out" if self.holdout else "stretches of time predicted from the rest"

    @property
    def nominal_residual(self) -> np.ndarray:
        """Normalised residual of the model as delivered, on the scoring data."""
        return self.holdout.nominal_residual if self.holdout else self.problem.observations.whiten(self.nominal)

    @property
    def required_baseline(self) -> Hypothesis:
        """The baseline; a stage that comes before its fit has no use of it."""
        if self.baseline is None:
            raise ValueError("the base parameters have not been fitted yet")
        return self.baseline

    @property
    def start_or_baseline(self) -> Hypothesis:
        """Where the next bank is made; a stage that comes before the baseline has no use of it."""
        return self.start or self.required_baseline

    @property
    def required_quick_round(self) -> Round:
        """The first comparison; a stage that comes before it has no use of it."""
        if self.quick_round is None:
            raise ValueError("no sets have been looked at yet")
        return self.quick_round

    @property
    def hypotheses(self) -> list[Hypothesis]:
        """All that were fitted by the search."""
        return [self.required_baseline, *self.fitted_sets]

    @property
    def ranked_baseline(self) -> RankedHypothesis:
        """The refit of the base parameters among the ranked."""
        return next(r for r in self.ranked if not r.hypothesis.candidates)

    def is_named(self, id: str) -> bool:
        """Whether an effect is probable enough to be named, itself or as a member of a group of which no other is."""
        least, inclusion = self.problem.settings.posterior.named, self.inclusion
        group = inclusion.group_of[id]
        other_members = (inclusion.effects[x] for x, g in inclusion.group_of.items() if g == group and x != id)
        if inclusion.effects[id] >= least:
            return True
        return inclusion.groups[group] >= least and max(other_members, default=0.0) < least

    @property
    def reported(self) -> RankedHypothesis:
        """The most probable hypothesis of named effects only that the held-out runs can be simulated with, else the
        baseline: its parameters are reported."""
        named = (r for r in self.ranked if all(self.is_named(id) for id in r.hypothesis.ids))
        return next((r for r in named if r not in self.not_held_out), self.ranked_baseline)

    @property
    def verdict(self) -> str:
        """explained, explained_in_part, no_significant_gap or unexplained."""
        settings, inclusion = self.problem.settings, self.inclusion
        adequate = is_adequate(self.problem, self.ranked_baseline.hypothesis.fit)
        scatter = self.scoring.stated_scatter
        return verdict(
            self.required_budget, inclusion.effects, inclusion.groups, adequate, scatter, settings.posterior,
            settings.budget,
        )  # fmt: skip

    @property
    def required_budget(self) -> Budget:
        """The budget; a stage that comes before it has no use of it."""
        if self.budget is None:
            raise ValueError("the gap has not been shared out yet")
        return self.budget

    def residual_of(self, ranked: RankedHypothesis) -> np.ndarray:
        """Normalised residual of a hypothesis on the scoring data."""
        if not self.holdout:
            return ranked.cv_residual
        return self.holdout.residual_of(ranked.hypothesis.fit, self.problem)

    @property
    def left_by_calibration(self) -> np.ndarray:
        """Normalised residual that the refit of the base parameters leaves, as the most probable hypothesis sees it."""
        return self.alternatives[0].residuals[frozenset()]

    def with_section(self, key: str, value: Any) -> State:
        """With a section of diagnosis.json."""
        return replace(self, sections={**self.sections, key: value})


def initial_state(
    campaign: Campaign, catalogue: Catalogue, pool: Pool, stop: StopToken, settings: Settings = DEFAULT,
    earlier: EarlierDiagnosis | None = None,
) -> State:  # fmt: skip
    """The state in which a diagnosis begins: the campaign posed for its package."""
    if campaign.lacks_training:
        raise CampaignError(f"{campaign.file}: {NOTHING_TO_FIT}")
    training, *held = split_runs(campaign)
    problem = build_problem(training, catalogue, pool, stop, settings)
    transferable = earlier and replace(earlier, sets=tuple(transferable_sets(problem, earlier)))
    return State(
        problem, held[0] if held else None, problem.macro_step, warnings=problem.warnings, earlier=transferable
    )
