"""The technical words of the report, each in one sentence."""

from __future__ import annotations

GLOSSARY = {
    "noise": "What the sensor alone would scatter: its noise, the converter's step, the timing of the samples and the "
    "simulation's own error; no model can honestly come closer.",
    "RMS": "Root mean square: the usual size of a deviation, in the unit of the signal.",
    "as delivered": "The model with the parameters that were stated for it.",
    "calibrated": "The model after its base parameters were refitted within the tolerances that are stated for them; "
    "no effect is added.",
    "effect": "Something that a machine may have and the model as delivered lacks, such as friction; the catalogue "
    "lists them.",
    "group": "Effects that look much alike in measurements like these.",
    "share": "The part of the squared deviation that is left after calibration and that comes back when this effect is "
    "taken out, averaged over the orders in which the effects can be added (Shapley value).",
    "inclusion probability": "How probable it is that the machine has this effect: from the share of the remaining gap "
    "that it is expected to explain and from what the best set leaves, calibrated on cases whose truth was known.",
    "95 % interval": "Where the true value lies in 95 of 100 such campaigns.",
    "alone": "The size that this part would have by itself; such sizes add up as squares, so their sum is more than "
    "the "
    "whole.",
    "form": "The same effect in another shape than the catalogue's plain one, for instance unequal in two directions.",
    "unexplained": "What is left with the best set of effects and is more than noise.",
    "held out": "Not used for fitting: the model has to foretell it.",
    "residual": "Measured minus modelled.",
    "at bound": "The fitted value stands at the end of its allowed range, so it may not be the true one.",
    "swing": "A stretch of time in which the machine moves to and fro by itself. Two machines that swing alike do not "
    "stay in step, so it is compared by its course, amplitude and frequency instead of sample by sample.",
    "tolerance": "How far a base parameter may be from its stated value.",
}
