"""Plants with known truth, written as files, answered by the front door, and each claim of the answers checked.

| file | is about |
|---|---|
| `plant.py`, `drawing.py` | a plant and its troubles as data; drawing them from a seed |
| `simulation.py` | its record |
| `tables.py`, `table_names.py`, `table_stamps.py` | tables as loggers and packages write them |
| `columns.py` | how many of their columns are recognised |
| `oracle.py` | what somebody could know who is told columns, delays, structure and the times of changes |
| `checking.py` | one claim against the truth: true, false, vacuous, unchecked |
| `wander.py`, `passing.py`, `close.py` | levels and gains that wander; levels that come back; changes close together |
| `shapes.py` | plants that integrate, stick, overshoot or ring |
| `audit.py`, `judge.py` | all files, one table; `make claims` |
"""
