"""Flights, boats and walkers that nobody chose: drawn from a seed, declared as data, simulated with their truth.

An object moves straight, turns, hurries, slows and rests, as its class does; sensors see it at their own times with
errors. *Deviation* of a plot: the standard deviation of its error in a coordinate.

| trouble | what is drawn |
|---|---|
| rests | stretches in which the object stands still |
| lattice | positions rounded to .5 .. 20 deviations |
| wild | 1 .. 8 % of the plots are off by 8 .. 100 deviations, in half of the scenes along the track only |
| gaps | 5 .. 40 % of the plots missing, and pauses of 3 .. 6 scans |
| precise start | the first 5 .. 30 plots are 100 .. 10 000 times as precise |
| uneven | times of plots off their grid by up to 40 % of a scan, or by whole reports of three sizes |
| heavy | errors of Student's t with 3 degrees of freedom |
| second sensor | another one with scan, deviation, constant offset and clock of its own |
| stated | the sensor says how large its errors are, by a factor of .5 .. 2 wrong |
| company | three objects that say not who they are |

Every third scene has one trouble alone (or none, in turn), the others several together. Nothing here knows a recording.
"""

from .drawing import draw
from .scene import ALONE, KINDS, Kind, Scene
from .simulation import Seen, simulate

__all__ = ["ALONE", "KINDS", "Kind", "Scene", "Seen", "draw", "simulate"]
