"""The numbers by which a faulty reading is told from a real one."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class FaultSettings:
    """When a reading is a fault of the sensor and not of the machine.

    Chosen so that nothing is left out of the clean signals of the examples, of the four real data sets and of the blind
    benchmark, while faults as large as a tenth of a channel's span are found.
    """

    longest_glitch: int = 3
    """Samples of a glitch; a pressure spike that lasts longer has been sampled and is taken as real."""
    longest_dropout: float = 1.0
    """Length of a drop-out [s]; a cable that is loose for longer cannot be told from a machine that stands still."""
    longest_dropout_samples: int = 10
    """Samples of a drop-out that may last longer than that, of slow loggers."""
    shortest_stuck: float = 0.5
    """Length of a constant stretch of a stuck sensor [s]; shorter ones do no harm to a fit."""
    shortest_stuck_samples: int = 10
    """Samples of it at least; fewer equal readings happen by chance."""
    share_of_span: float = 0.05
    """A fault is at least this share of the channel's span [-]; what is smaller does not dominate a fit."""
    above_noise: float = 20.0
    """Noise standard deviations that a fault is away; the farthest of 1e6 readings with white noise is at 5."""
    above_steps: float = 10.0
    """Times the usual change from sample to sample nearby that a fault is away: a fast motion's edge is about once."""
    above_resolution: float = 10.0
    """Steps of the converter that a fault is away: a switch or a coarse channel jumps by one or a few of them."""
    neighbours_agree: float = 0.1
    """Share of the fault by which the readings before and after may differ: an edge changes the level."""
    neighbours_agree_in_motion: float = 0.25
    """The same, where the channel moves so fast that the readings before and after differ by that."""
    nearby: int = 10
    """Samples before and after that tell the usual change."""
    event: float = 5.0
    """Times the usual kink of a channel from which its course changes: then the machine itself has done something."""
    event_window: int = 8
    """Samples of the two straight lines whose difference is a kink."""
    most: float = 0.1
    """Share of a channel's readings that may be faulty, or jump so far; more is a signal and all are kept."""
