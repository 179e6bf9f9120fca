"""Which sets of effects the data prefer: the pipeline, the search, the evidence, the probabilities."""
