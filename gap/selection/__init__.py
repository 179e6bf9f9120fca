"""Which sets of effects the data prefer: hypotheses, their evidence, and the probabilities calibrated from it."""
