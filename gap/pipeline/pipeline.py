"""The stages of a diagnosis in their order. To add one: a function from state to state, and its line here."""

from __future__ import annotations

from . import analysis, forms, preparation, probabilities, remarks, run_subset, search
from .stage import Stage

PIPELINE = (
    Stage("numerical gap: the model at its step and at half of it", preparation.assess_steps),
    Stage("sensors that contradict each other", preparation.compare_sensors),
    Stage("what swings", preparation.describe_swings),
    Stage("held-out runs", preparation.build_held_out_runs, when=lambda s: s.holdout_campaign is not None),
    Stage("runs to begin with", run_subset.restrict_to_subset, when=run_subset.has_many_runs),
    Stage("finite differences", preparation.prepare_fits),
    Stage("refitting the base parameters", search.fit_baseline),
    Stage("what an earlier diagnosis has found", search.resume_search, when=lambda s: s.earlier is not None),
    Stage("a first look at sets of effects", search.look_at_sets, when=lambda s: s.earlier is None),
    Stage("comparing sets of effects", search.compare_sets_quickly, when=lambda s: s.earlier is None),
    Stage("fitting the best of them", search.fit_best_sets, when=lambda s: s.quick_round is not None),
    Stage("trying similar effects in place of those found", search.swap_relatives, when=search.has_relatives),
    Stage("trying other forms of the effects found", search.try_forms, when=search.has_forms),
    Stage("comparing sets around the best", search.compare_sets, when=search.can_continue),
    Stage("comparing sets from elsewhere", search.compare_sets, when=search.is_worth_continuing),
    Stage("comparing sets once more", search.compare_sets, when=search.has_moved),
    Stage("effects that need shorter steps", search.look_at_shorter_steps, when=search.has_long_steps),
    Stage("trying other forms of the effects found, again", search.try_forms, when=search.has_forms),
    Stage("trying free curves for the effects found", search.try_curves, when=search.has_curves),
    Stage("fitting the best sets to all runs", run_subset.fit_to_all, when=run_subset.is_on_subset),
    Stage("runs of which most is left", run_subset.restart_on_worst_runs, when=run_subset.fits_all_runs_worse),
    Stage("comparing sets on these", search.compare_sets, when=run_subset.is_on_subset),
    Stage("fitting the best of them to all runs", run_subset.fit_to_all, when=run_subset.is_on_subset),
    Stage("fitting the best to the end", search.fit_the_best),
    Stage("judging the hypotheses", search.rank_fitted),
    Stage("ranking what is there", search.rank_unfinished, when=lambda s: not s.ranked, always=True),
    Stage("weighing the hypotheses", probabilities.weigh_hypotheses, always=True),
    Stage("sharing out the gap", probabilities.share_gap, always=True),
    Stage("assessing forms", forms.assess_forms, when=forms.has_other_forms, always=True),
    Stage("looking at what is left", analysis.assess_structure),
    Stage("where the gap lies", analysis.locate, always=True),
    Stage("warnings about the fit", remarks.add_remarks, always=True),
    Stage("which component has it", analysis.replay),
    Stage("signals of what swings", analysis.draw_swings),
    Stage("what to measure next", analysis.design_experiment),
)
