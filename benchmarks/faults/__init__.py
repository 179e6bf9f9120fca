"""What becomes of every command that is struck at a random time.

    python -m benchmarks.faults [--only run,sweep] [--faults kill,term] [--trials 40] [--seed N]

Each trial has an earlier result in place, starts the command, and strikes it between its start and its usual end:
kill -9 of the process that was started or of one of its children, SIGTERM, Ctrl-C, files that can grow no further, or a
clock that jumps. What is there afterwards has to be the old result whole, the new one whole, or the new one up to a
time that its summary states; the command has to have ended by itself, with its exit code and no traceback; nothing may
still run; and the same command has to do its work once more, as if nothing had been, and leave no temporary files.
"""
