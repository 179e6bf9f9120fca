"""`cosim-master replay`: the machine in motion, drawn from the results of a run.

What is drawn comes from the FMUs (resources/replay: a scene of MuJoCo, and which joint follows which output) and from
an annotation of the package (colours and labels). The master knows no machine: it fills formulas in and moves joints.
"""
