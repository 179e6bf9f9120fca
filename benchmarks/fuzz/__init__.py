"""Mutants of everything that a user can hand to a command: each is refused in one line, or does what it should.

    python -m benchmarks.fuzz [--seed N] [--mutants N] [--hours H] [--only ssd,csv] [--out DIR]

Targets (`targets.py`) are files that are right, and what reads them; `mutants.py` changes them by their structure:
attributes, elements, keys, cells, bytes. Mutants are tried in a process of their own, which is watched: a traceback,
no word, a crash or a hang is a failure, and the mutant is kept in DIR with what was said.
"""
