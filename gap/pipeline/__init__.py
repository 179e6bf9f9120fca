"""The diagnosis as a list of stages over an immutable state: see `pipeline.PIPELINE`."""
