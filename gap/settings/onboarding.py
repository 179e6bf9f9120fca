"""What the first look at a user's files goes by: from run files to a campaign, and what looks wrong in one."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class OnboardingSettings:
    """When a guess is made, and when it is left as a question. Chosen on the toy oscillator, the pool test and the
    servo cylinder, Silverbox and cascaded tanks."""

    same_name: float = 0.9
    """Likeness of names from which a column is that connector whatever its readings are like; 1 is the same name."""
    least_score: float = 0.5
    """Score of name and shape together below which nothing is guessed."""
    margin: float = 0.08
    """By how much the score of the second best connector has to be less."""
    shape_alone: float = 0.9
    """Correlation with the model from which the shape alone says which output a column is."""
    margin_of_shape: float = 0.2
    """By how much that of the second best output has to be less."""
    share_of_name: float = 0.55
    """Weight of the name in the score; the rest is that of the shape."""
    like_input: float = 0.45
    """Likeness of names from which a column drives an input of the package."""
    most_trials: int = 24
    """Simulations that are tried to find out which column drives which input."""
    shown_runs: int = 3
    """Runs that the nominal model is simulated for while guessing."""
    most_steps: float = 4e4
    """Macro steps of such a run; a longer one is simulated over its first part."""
    share_of_names_in_trial: float = 0.3
    """Weight of the names where it is tried which column drives which input."""
    shifted_counts: float = 0.8
    """Weight of a correlation that shows only once clocks are shifted."""
    proposed_from: float = 0.2
    """Score from which a connector is proposed for a column that is none yet."""
    near_level: float = 0.25
    """Share within which a number in a file's name is the level of a channel, and no condition."""
    usual_within: float = 2.0
    """Factor beyond the usual values of a condition within which a number in a file's name can be it."""
    rising_share: float = 0.99
    """Share of steps of a clock that do not go back."""
    sensor_delay: float = 1.5
    """Usual delay of a sensor, in sample intervals."""
    most_sensor_delay: float = 20.0
    """The most that is fitted, likewise."""
    points: int = 2000
    """Points at which readings and model are compared."""
    longest_shift: float = 0.3
    """Share of a run by which clocks may be apart to be found."""
    constant: float = 1e-9
    """Share of its level within which a column does not change."""
    unit_within: float = 2.0
    """Factor within which a unit has to make the readings as large as the model's to be guessed."""
    time_within: float = 1.5
    """Factor within which a run has to be as long as the scenario for another unit of time to be guessed."""
    reads_per_step: float = 100.0
    """Macro steps between readings, or readings in one, from which another unit of time is guessed."""
    sensor_follows: float = 0.9
    """Correlation from which a column in volts or amperes is taken for the sensor of what the model moves like."""
    even_clock: float = 0.05
    """Share of an interval by which a column without a name for time may be uneven and still be a clock."""
    preamble: int = 60
    """Lines of remarks above the names of the columns that are passed over."""
    asked_base: int = 12
    """Parameters of which it is asked how well they are known."""
    usual_tolerance: float = 0.05
    """Tolerance that is proposed for a base parameter."""
    usual_interval: float = 0.01
    """Sample interval that a sensor's delay is thought of by where no run says it [s]."""
    holdout_from: int = 4
    """Runs from which it is asked which are held out."""


@dataclass(frozen=True, kw_only=True)
class NameSettings:
    """How alike the name of a column and that of a connector are, 0 to 1; 1 is the same name."""

    end: float = 0.9
    """The column is called as the last word of the connector."""
    letters: float = 0.85
    """Weight of the share of letters that both names have in the same order."""
    words: float = 0.8
    """Weight of the share of the column's words that the connector or its description has."""
    meaning: float = 0.5
    """Words that mean the same quantity."""
    word_beside: float = 0.2
    """More where they share a word, too; and where nothing but the quantity's unit speaks for it."""
    same_mark: float = 0.15
    """More where a number or letter that tells quantities of a kind apart is the same."""
    other_mark: float = 0.35
    """Less where it is another: P1 is not P2."""
    same_unit: float = 0.1
    """More where the heading has a unit of the connector's quantity."""
    most: float = 0.89
    """Of anything but the same name."""


@dataclass(frozen=True, kw_only=True)
class CheckSettings:
    """What looks wrong in a campaign, before it is diagnosed. Chosen so that the pool test and the campaigns of
    benchmarks/real say nothing but what is so, while the slips in tests/gap/onboarding are told."""

    simulated_runs: int = 12
    """Runs of a campaign that are simulated; of more, so many from the first to the last."""
    drawn_runs: int = 6
    """Runs in the picture."""
    drawn_channels: int = 8
    """Channels in the picture."""
    drawn_points: int = 1500
    """Readings of a curve."""
    against: float = -0.6
    """Correlation of readings and model from which the sign is asked about."""
    follows: float = 0.9
    """Correlation from which a shifted, exchanged or turned signal follows the model."""
    follows_not: float = 0.7
    """Correlation below which it does not as it stands."""
    shift_gain: float = 0.35
    """Share of what was missed that a shift in time may leave to be told."""
    least_shift: float = 3.0
    """Sample intervals that a shift has to be."""
    shift_of_run: float = 0.004
    """Share of the run that it has to be: a machine may be late by less."""
    shift_missed: float = 5.0
    """Noise standard deviations that the shift has to move the readings by."""
    quiet: float = 20.0
    """Times the noise that a signal moves by, from which it moves."""
    within_noise: float = 3.0
    """Times the noise within which a signal rests."""
    tails: tuple[float, float] = (98.0, 2.0)
    """Percentiles between which a signal's size is taken."""
    hole: float = 1.5
    """Usual intervals that readings are apart where one is missing."""
    unlike_rest: float = 0.02
    """Share of the model's span within which a channel does not move."""
    off_level: float = 1.5
    """Times what readings and model move by, from which they stand too far apart."""
    held_rows: float = 3.0
    """Rows that repeat a reading from which it is told."""
    held_values: int = 20
    """Different readings in a row from which that is judged."""
    held_share: float = 0.8
    """Share of them that are repeated as often as is usual, within one row."""
    jump_of_span: float = 0.1
    """Share of its span that a channel jumps by at least to be told."""
    jump_over_steps: float = 8.0
    """Times that this is more than the model moves by between two readings anywhere, or than nearly all readings do."""
    jump_stays: int = 10
    """Readings after it that are far from where it was: else it is a pulse."""
    compared_runs: int = 40
    """Runs that are compared with each other."""
    exchanged: float = 0.35
    """Share of a run's gap that it has in the conditions of another run, below which it is taken for that one."""
    channels_of_rate: int = 2
    """Channels that move from which a clock's rate is judged."""
    rate_gain: float = 0.25
    """Share of what each channel misses that another rate of the clock may leave to be told."""
    quiet_rate: float = 5.0
    """Noises that each of them misses at least."""
    farthest_rate: float = 2.2
    """Times that a clock may be too fast or too slow to be found."""
    tried_rates: int = 241
    """Rates that are tried from the slowest to the fastest, before the best is drawn nearer."""
    rate_within: float = 1e-4
    """Share to which the rate is found."""
    off_share: float = 0.25
    """Share of the model's own level that it is away then, too: a supply that is a little low is no slip."""
    off_size: float = 10.0
    """Times that a channel moves more or less than the model from which it is told."""
    lost_by_averaging: float = 0.05
    """Share of its span that a channel may move within the readings that the diagnosis averages."""
    clipped_share: float = 0.02
    """Share of a channel's readings at its highest or lowest value from which it is asked whether it is clipped."""
    clipped_samples: int = 10
    """Readings in a row at that value."""
    clipped_beyond: float = 0.05
    """Share of the span by which the model goes on where the readings are clipped."""
    slow_share: float = 0.05
    """Share of the model's span that it may move away, between two readings, from the straight line that joins them."""
    slow_readings: float = 0.01
    """Share of the intervals in which it does so from which sampling is too slow."""
    noisier_than_stated: float = 3.0
    """Times a stated noise that readings scatter by, from which it is told."""
    gap_begins: float = 0.05
    """Share of a run's squared gap after which it is said to begin."""
    below_noise: float = 1.1
    """Normalised RMS up to which a gap is within the noise."""
    longest_notes: int = 4
    """Notes below the table."""
    longest_texts: int = 14
    """Lines of the table; more are counted."""


NAMES = NameSettings()
ONBOARDING = OnboardingSettings()
CHECKS = CheckSettings()
