"""The parts of the reproduction of Abid and Kamoun (2008); `systems` are the test systems policies are ranked on."""
