"""results.html: a run, or several over each other, for a person at a browser: one file that needs nothing else."""
