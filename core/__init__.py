"""What every part of deepsea-cosim shares: errors, units, variable records. Imports nothing of ours."""
