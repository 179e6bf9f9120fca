"""What is asked of the simulations: observations, noise, sensors, estimated parameters, step sizes."""
