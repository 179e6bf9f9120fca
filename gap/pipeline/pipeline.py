"""The stages of a diagnosis in their order. To add one: a function from state to state, and its line here."""

from __future__ import annotations

from . import analysis, preparation, probabilities, search
from .stage import Stage

PIPELINE = (
    Stage("numerical gap: the model at its step and at half of it", preparation.assess_steps, always=True),
    Stage("held-out runs", preparation.pose_held_out_runs, when=lambda s: s.holdout_campaign is not None, always=True),
    Stage("finite differences", preparation.prepare_fits, always=True),
    Stage("refitting the base parameters", search.fit_baseline, always=True),
    Stage("screening the effects", search.screen, always=True),
    Stage("fitting single effects", search.fit_singles, always=True),
    Stage("looking for large effects", search.fit_large, when=search.may_be_large),
    Stage("macro step of the best single effects", search.refine_singles, always=True),
    Stage("fitting pairs of effects", search.fit_pairs, when=search.something_is_left),
    Stage("finishing the best", search.finish_best, always=True),
    Stage("trying what is alike", search.try_alike),
    Stage("trying the best without its effects", search.drop_each),
    Stage("weighing the hypotheses", probabilities.weigh_hypotheses, always=True),
    Stage("sharing out the gap", probabilities.share_gap, always=True),
    Stage("looking at what is left", analysis.look_at_rest, always=True),
    Stage("where the gap lies", analysis.locate, always=True),
    Stage("what to measure next", analysis.design_experiment),
)
