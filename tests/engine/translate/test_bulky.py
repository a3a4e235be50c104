"""A large kernel that not every sample reaches is a call where sizes are data, inlined in a loop that has its own."""

import driftwise as dw
from driftwise.engine import compile, loops


def test_a_trial_is_called_by_the_loop_of_all_sizes_and_inlined_in_that_of_a_fleet():
    est = dw.ARX(1, 1, memory=dw.AutoMemory())
    kinds, crew = tuple(map(type, est.policies)), dw.Fleet(est, range(2)).crew
    general = compile.translated(loops.make_driver(kinds, 0), compile.DRIVER, is_sized=False)
    sized = compile.translated(loops.make_crew(crew.kinds, crew.sizes, crew.shapes(4), 0), compile.CREW)
    for name in ("try_out", "time_update_copies"):
        assert f"_{name}_apart(" in general
        assert f"_{name}(" in sized and f"_{name}_apart(" not in sized
    assert "_begin_trial_apart(" in sized  # what is rare is a call in either
