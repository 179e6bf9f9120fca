"""Which linkages and critical flow numbers give the four published times: a set; the shipped one is of it."""
