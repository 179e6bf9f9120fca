"""The deep-sea valve-controlled hydraulic cylinder: one component of the circuit a module, equations as pure functions.

`variables` is the table of its parameters, inputs and outputs, `constants` makes of them the numbers that the kernels
read by name (`c.valve.k_q`, `c.effect.entrained_air.fraction`), `circuit` puts the components together, `integrator`,
`march` and `stepping` advance them. `fmus/hydraulics.py` makes the FMU DeepseaHydraulics of it.

Sign convention. Flow is positive from the pump towards the piston side (port a, line a-1, port 1) and from
the rod side back to the tank (port 2, line b-2, port b), as in the paper; so both valve flows Q_a and Q_b are
positive while the cylinder extends. Force is positive when it extends the cylinder. All pressures are absolute.

The equation numbers in the docstrings are those of Wu et al. (2022), J. Mar. Sci. Eng. 10(3), 362.
"""
