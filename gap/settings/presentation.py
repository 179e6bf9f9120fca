"""What is said of the gap, on the terminal and in the report."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class AnalysisSettings:
    """Where the gap lies and what it follows."""

    max_listed_hypotheses: int = 20
    """Hypotheses that are listed, the most probable first."""
    max_with_parameters: int = 8
    """Of these, those whose parameters are told."""
    bands: tuple[float, ...] = (0.0, 0.5, 5.0, 25.0, float("inf"))
    """Edges of the frequency bands [Hz]."""
    change_point_bins: int = 200
    """Stretches of a run among which change points are looked for."""
    change_points: int = 4
    """Most change points of a channel in a run."""
    nested_regions: int = 3
    """Most regions that are nested to describe where a gap is densest."""
    least_bins: int = 20
    """Stretches from which change points are looked for."""
    change_point_rms: float = 1.3
    """Normalised RMS of a channel in a run from which they are."""
    least_region: float = 0.02
    """Share of all readings that a region holds, and that lies outside it, at least."""
    least_nested: float = 0.03
    """Share of a channel's readings that nested regions hold at least."""
    region_share: float = 0.6
    region_density: float = 1.15
    """Share of a gap, and density of it beside that of the whole, from which a region describes where it is."""
    replay_kernel: float = 0.05
    """Standard deviation of the kernel that smooths a measured signal before it drives a component [s]."""
    replay_copies: int = 3
    """Disturbed copies from which the noise that a component passes on is estimated."""
    frequency_share: float = 0.7
    """Share of a residual's energy that the range of frequencies holds which is told."""
    min_predictable_share: float = 0.1
    """Predictable share of a channel's residual from which is told what it varies with."""
    nearest: int = 3
    """Effects that are told as nearest to what is left."""
    structure_stretches: int = 300
    """Stretches of time of a run that are left out in turn when what is left is predicted from the signals."""
    structure_samples: int = 4000
    """Readings of a channel that are looked at."""
    structure_least: int = 100
    """Readings of a channel below which nothing is said."""
    question: float = 0.05
    """Probability beside the best one's from which a hypothesis about something else is what the next measurement is to
    tell it from; of less, one with other effects is."""
    designs: int = 3
    """Changes of conditions whose separation is worked out; in three cases the best of all was among the two under
    which the fits differ most as they stand."""
    design_rows: int = 400
    """Times of a run at which a next measurement is foretold."""
    structure_bins: int = 40
    """Bins of a signal in which the residual's mean is taken."""


@dataclass(frozen=True, kw_only=True)
class TerminalSettings:
    """What the terminal prints."""

    width: int = 100
    """Characters of a line at most."""
    lines: int = 25
    """Lines at most."""
    headline: int = 7
    """Lines of the headline at most."""
    bar: int = 60
    """Characters of the budget's bar."""
    parts: int = 4
    channels: int = 4
    moments: int = 3
    """Effects, channels and measured moments that are shown, the largest first."""
    probable: float = 0.5
    """Inclusion probability from which an effect's parameters are shown, and the effect however small its share."""


@dataclass(frozen=True, kw_only=True)
class ReportSettings:
    """What the report shows; no part of a diagnosis."""

    trace: float = 0.02
    """Inclusion probability and share up to which an effect is only counted: less cannot be told from nothing."""
    channels: int = 12
    regions: int = 14
    hypotheses: int = 8
    swings: int = 10
    """Rows of a table, those that matter most first; the rest is in diagnosis.json."""
    probable: float = 0.5
    """Inclusion probability from which an effect is named in sentences."""
    clear_dependence: float = 0.05
    """Share of a residual's energy that a signal predicts from which it is said to vary with it."""
    apart: float = 3.0
    """Distance of two hypotheses [multiples of the noise, RMS] from which they are called clearly apart."""
    component_misses: float = 1.3
    """Deviation of a component driven with what was measured [multiples of the noise] from which it is set in bold."""
    little: float = 1.1
    """Deviation [multiples of the noise] below which what is left is called hardly more than noise."""
    mean_intervals: int = 48
    """Intervals of a signal in which the mean of what is left is drawn."""
    trace_points: int = 4000
    """Points of a channel in a run at most: twice what a screen has."""
    fewest_points: int = 600
    """Points of a channel that are kept however many channels there are."""
    all_points: int = 120_000
    """Points of all channels together: the page stays below about 6 MB."""
    scatter_points: int = 1500
    """Points of a residual against a signal."""
    hole: float = 5.0
    """A hole in a measurement is this many times as long as its usual interval; no line crosses it."""
