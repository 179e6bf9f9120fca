"""Which sets of effects explain the runs: a bank of responses, all small sets on it, fits of the best of them."""
