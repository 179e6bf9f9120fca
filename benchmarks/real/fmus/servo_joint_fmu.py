"""A servo that moves a weight at the end of a rod, as an FMU: plain pythonfmu, no other file.

Its target is measured and drives it. Every effect is exactly absent at its start value.
"""

from collections import deque
from math import ceil, exp, sin

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

GRAVITY = 9.80665
TORQUE = 4.9
"""Most that the motor gives [N m]."""
LONGEST = 1e-3
"""Longest internal step [s]; a much shorter one changes a run's angles by 0.04 times the sensor's step (RMS), by 0.14
where dry friction ends a swing."""

PARAMETERS = {
    # base: mass and length as recorded, stiffness and damping near the authors' fit (67.3, 2.35)
    "stiffness": (69.4, "torque per angle between target and joint [N m/rad]"),
    "damping": (2.67, "torque per speed while the motor is on [N m s/rad]"),
    "armature": (0.0085, "inertia of motor and gear at the joint [kg m2]"),
    "mass": (1.13, "weight [kg]"),
    "length": (0.12, "rod [m]"),
    # effects
    "T_coulomb": (0.0, "dry friction [N m]"),
    "T_stribeck": (0.0, "friction that fades with speed [N m]"),
    "w_stribeck": (0.1, "speed at which it has faded to 1/e [rad/s]"),
    "k_load": (0.0, "friction per torque that the gear carries"),
    "b": (0.0, "viscous friction, also with the motor off [N m s/rad]"),
    "backlash": (0.0, "play of the gear [rad]"),
    "delay": (0.0, "time after which a target counts [s]"),
    "slowness": (0.0, "share of the motor's greatest torque that it loses per speed [s/rad]"),
    "rod_mass": (0.0, "mass of the rod [kg]"),
}


class ServoJoint(Fmi2Slave):
    """Inputs goal [rad], on (0 or 1); output q [rad], 0 where the weight hangs."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.goal, self.on, self.q = 0.0, 1.0, 0.0
        self.register_variable(Real("goal", causality=Fmi2Causality.input, description="target [rad]"))
        self.register_variable(Real("on", causality=Fmi2Causality.input, description="1: the motor is on"))
        self.register_variable(Real("q", causality=Fmi2Causality.output, description="angle [rad]"))
        for name, (value, text) in PARAMETERS.items():
            setattr(self, name, value)
            fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
            self.register_variable(Real(name, description=text, **fixed))

    def exit_initialization_mode(self):
        self.q, self.w = self.goal, 0.0
        self.inertia = (self.mass + self.rod_mass / 3.0) * self.length**2 + self.armature
        self.weight = (self.mass + 0.5 * self.rod_mass) * GRAVITY * self.length
        self.targets = deque([(0.0, self.goal)])

    def do_step(self, current_time, step_size):
        n = ceil(step_size / LONGEST - 1e-6)
        h = step_size / n
        self.targets.append((current_time, self.goal))
        for k in range(n):
            self.advance(self.target(current_time + k * h, h), h)
        return True

    def target(self, t, h):
        """What counts from t to t + h, on average; targets are held until the next one."""
        if self.delay <= 0.0:
            return self.goal
        late = t - self.delay
        while len(self.targets) > 1 and self.targets[1][0] <= late:
            self.targets.popleft()
        if len(self.targets) == 1:
            return self.targets[0][1]
        (_, old), (since, new) = self.targets[0], self.targets[1]
        return old + (new - old) * max(late + h - since, 0.0) / h

    def motor(self, away, w):
        """Its torque [N m] at an angle `away` from the target and a speed w."""
        if self.on <= 0.5:
            return 0.0
        away -= min(max(away, -0.5 * self.backlash), 0.5 * self.backlash)
        most = TORQUE * min(max(1.0 - self.slowness * w, 0.0), 1.0)
        least = -TORQUE * min(max(1.0 + self.slowness * w, 0.0), 1.0)  # driven on by the weight, it brakes in full
        return min(max(self.stiffness * away - self.damping * w, least), most)

    def advance(self, target, h):
        """One time step h [s] of second order: torques in its middle, friction as a set-valued torque (Moreau)."""
        middle = self.q + 0.5 * h * self.w
        load = -self.weight * sin(middle)
        speed = self.w
        for _ in range(2):  # the second time with the mean speed that the first has found
            motor = self.motor(target - middle, speed)
            dry = self.T_coulomb + self.k_load * abs(motor - load)
            if self.T_stribeck > 0.0:
                dry += self.T_stribeck * exp(-abs(speed) / self.w_stribeck)
            free = self.w + h / self.inertia * (motor + load)
            held = h / self.inertia * (dry + self.b * abs(speed))
            after = free - min(max(free, -held), held)  # it stops where friction can hold it
            speed = 0.5 * (self.w + after)
        self.q, self.w = middle + 0.5 * h * after, after
