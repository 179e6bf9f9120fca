"""An arm of the user's own from an MJCF model: any number of joints, tendons as cylinders, Morison loads on geoms."""
