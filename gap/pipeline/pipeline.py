"""The stages of a diagnosis in their order. To add one: a function from state to state, and its line here."""

from __future__ import annotations

from . import analysis, forms, preparation, probabilities, search, some_runs
from .stage import Stage

PIPELINE = (
    Stage("numerical gap: the model at its step and at half of it", preparation.assess_steps),
    Stage("what swings", preparation.describe_swings),
    Stage("held-out runs", preparation.build_held_out_runs, when=lambda s: s.holdout_campaign is not None),
    Stage("runs to begin with", some_runs.start_with_some, when=some_runs.has_many_runs),
    Stage("finite differences", preparation.prepare_fits),
    Stage("refitting the base parameters", search.fit_baseline),
    Stage("what an earlier diagnosis has found", search.resume_search, when=lambda s: s.earlier is not None),
    Stage("comparing sets of effects", search.compare_sets_quickly, when=lambda s: s.earlier is None),
    Stage("fitting the best of them", search.fit_best_sets, when=lambda s: s.quick_round is not None),
    Stage("what acts alike, in its place", search.swap_relatives, when=search.has_relatives),
    Stage("other forms of what is in", search.try_forms, when=search.has_forms),
    Stage("comparing sets around the best", search.compare_sets, when=search.can_continue),
    Stage("comparing sets from elsewhere", search.compare_sets, when=search.is_worth_continuing),
    Stage("comparing sets once more", search.compare_sets, when=search.is_worth_continuing),
    Stage("what long steps spoil", search.look_at_shorter_steps, when=search.has_long_steps),
    Stage("other forms of what is in now", search.try_forms, when=search.has_forms),
    Stage("what is in, as free curves", search.try_curves, when=search.has_curves),
    Stage("fitting the best sets to all runs", some_runs.fit_to_all, when=some_runs.is_confined),
    Stage("runs of which most is left", some_runs.restart_on_worst_runs, when=some_runs.leaves_more_than_some),
    Stage("comparing sets on these", search.compare_sets, when=some_runs.is_confined),
    Stage("fitting the best of them to all runs", some_runs.fit_to_all, when=some_runs.is_confined),
    Stage("fitting the best to the end", search.fit_the_best),
    Stage("judging the hypotheses", search.rank_fitted),
    Stage("ranking what is there", search.rank_unfinished, when=lambda s: not s.ranked, always=True),
    Stage("weighing the hypotheses", probabilities.weigh_hypotheses, always=True),
    Stage("sharing out the gap", probabilities.share_gap, always=True),
    Stage("what forms are worth", forms.assess_forms, when=forms.has_other_forms, always=True),
    Stage("looking at what is left", analysis.assess_structure),
    Stage("where the gap lies", analysis.locate, always=True),
    Stage("which component has it", analysis.replay),
    Stage("signals of what swings", analysis.draw_swings),
    Stage("what to measure next", analysis.design_experiment),
)
