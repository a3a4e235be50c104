"""The parts of the reproduction of Perriot-Mathonna (1981); `engine` is the paper's own recursion, in plain NumPy."""
