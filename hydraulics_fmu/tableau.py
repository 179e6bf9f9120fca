"""Coefficients of the Rosenbrock-W method ROS34PW2 (Rang and Angermann 2005, BIT 45, 761-787).

Order 3 with any approximation of the Jacobian, L-stable and stiffly accurate with the exact one; order 2 embedded.
Kept in the transformed form that needs no product with the Jacobian (Hairer and Wanner, Solving ODEs II, IV.7):

    (1/(h gamma) I - J) u_i = f(t + alpha_i h, y + sum_j A[i,j] u_j) + sum_j C[i,j]/h u_j,    y' = y + sum_i M[i] u_i
"""

from __future__ import annotations

import numpy as np

STAGES = 4
GAMMA = 4.3586652150845900e-01

_ALPHA = np.array(
    [
        [0.0, 0.0, 0.0, 0.0],
        [8.7173304301691801e-01, 0.0, 0.0, 0.0],
        [8.4457060015369423e-01, -1.1299064236484185e-01, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
    ]
)
_GAMMAS = np.array(
    [
        [GAMMA, 0.0, 0.0, 0.0],
        [-8.7173304301691801e-01, GAMMA, 0.0, 0.0],
        [-9.0338057013044082e-01, 5.4180672388095326e-02, GAMMA, 0.0],
        [2.4212380706095346e-01, -1.2232505839045147e00, 5.4526025533510214e-01, GAMMA],
    ]
)
_B = np.array([2.4212380706095346e-01, -1.2232505839045147e00, 1.5452602553351020e00, 4.3586652150845900e-01])
_B_HAT = np.array([3.7810903145819369e-01, -9.6042292212423178e-02, 5.0000000000000000e-01, 2.1793326075422950e-01])

_INVERSE = np.linalg.inv(_GAMMAS)

NODES = _ALPHA.sum(axis=1)
"""Stage times as fractions of the step."""
A = np.ascontiguousarray(_ALPHA @ _INVERSE)
C = np.ascontiguousarray(np.diag(np.full(4, 1.0 / GAMMA)) - _INVERSE)
M = _B @ _INVERSE
"""Weights of the step."""
E = (_B - _B_HAT) @ _INVERSE
"""Weights of the error estimate."""
