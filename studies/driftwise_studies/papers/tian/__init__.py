"""The parts of the reproduction of Tian (2009): a DC motor, its disturbances and noise, and who else can watch it."""
