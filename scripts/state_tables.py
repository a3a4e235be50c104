"""Write the tables of docs/conventions.md that say what a state and a trace's table hold, from where rows are declared.

python scripts/state_tables.py            # rewrites them
python scripts/state_tables.py --check    # exit code 1 where they are not what the code declares
"""

import sys
from pathlib import Path

from driftwise.engine.layout import Layout
from driftwise.estimators.adaptive_gain.row import GAIN
from driftwise.estimators.algebraic_observer.row import ALGEBRAIC
from driftwise.estimators.arx.row import LAGS
from driftwise.estimators.arx_mimo.row import SEVERAL
from driftwise.estimators.common.columns import GAIN_SAMPLE, OBSERVER_SAMPLE, RECURSIVE_SAMPLE, SAMPLE
from driftwise.estimators.continuous.step import CONTINUOUS
from driftwise.estimators.grey_box.row import GREY_BOX, GREY_SAMPLE
from driftwise.estimators.joint.row import JOINT
from driftwise.estimators.joint_mimo.row import JOINT_MIMO
from driftwise.estimators.manoeuvre.row import MANOEUVRE
from driftwise.estimators.model_average.step import AVERAGE, AVERAGE_SAMPLE
from driftwise.estimators.state_space.row import STATE_SAMPLE, STATE_SPACE
from driftwise.estimators.track.bank import TRACK, TRACK_SAMPLE
from driftwise.estimators.window_observer.fir import FIR
from driftwise.estimators.window_observer.growing import GROWING
from driftwise.estimators.window_observer.queue import QUEUE
from driftwise.memory.additive import PAST
from driftwise.memory.auto_state import AUTO
from driftwise.memory.autocovariance_ls import DESIGN
from driftwise.memory.auxiliary_filter import FILTER
from driftwise.memory.bank import BANK
from driftwise.memory.bayesian_change_point import CHANGE_POINT, HYPOTHESIS
from driftwise.memory.likelihood_drift import LEARNER
from driftwise.memory.modes import MODE
from driftwise.memory.moments import MOMENT, ROW
from driftwise.memory.retrospect import FILTERS, RETROSPECT
from driftwise.memory.robust_start import ROWS
from driftwise.memory.second_start import SECOND
from driftwise.memory.suspicion import SUSPICION
from driftwise.memory.trial_state import TRIAL
from driftwise.memory.unknown_drift import DRIFT_STATE
from driftwise.memory.window import WINDOW

PAGE = Path(__file__).parent.parent / "docs" / "conventions.md"
BEGIN, END = "<!-- written by scripts/state_tables.py -->\n", "<!-- end -->\n"
RECURSIVE = "`ARX`, `AR`, `Regression`, `ARMAX`, `ARMA`, `OE`, `BJ`, `AdaptiveObserver`"
STATES = {
    "`Joint`": JOINT,
    "`Manoeuvre`": MANOEUVRE,
    "`JointMIMO`": JOINT_MIMO,
    "`ContinuousJoint`": CONTINUOUS,
    RECURSIVE: LAGS,
    "`ARXMIMO`": SEVERAL,
    "`AdaptiveGain`": GAIN,
    "`StateSpace`": STATE_SPACE,
    "`GreyBox`": GREY_BOX,
    "`WindowObserver` of regular samples": FIR,
    "`WindowObserver(window=math.inf)`": GROWING,
    "`WindowObserver(irregular=True)`": QUEUE,
    "`AlgebraicObserver`": ALGEBRAIC,
    '`ModelAverage`: `state["own"]`, behind the states of its members': AVERAGE,
    "`TrackEstimator`": TRACK,
}
MEMORIES = {
    "what learns the speed of drift (`own` is the policy's)": DRIFT_STATE,
    "`LikelihoodDrift`, its own": LEARNER,
    "`AuxiliaryFilter`, its own": FILTER,
    "`AutocovarianceLS`, its own": DESIGN,
    "`MultipleModel`, `IMM`, their own": BANK,
    "each mode of a bank": MODE,
    "`AutoMemory`, its own": AUTO,
    "`suspicion` of `AutoMemory`": SUSPICION,
    "`second` of `AutoMemory`": SECOND,
    "`rows` of `AutoMemory`": ROWS,
    "`past` of `AutoMemory`": PAST,
    "`moments` of `AutoMemory`": MOMENT,
    "a row of `kept` of `moments`": ROW,
    "`late` of `AutoMemory`": RETROSPECT,
    "each of `sets` of `late`": FILTERS,
    "`trial` of `AutoMemory`": TRIAL,
    "`Window`": WINDOW,
    "`BayesianChangePoint`": CHANGE_POINT,
    "each hypothesis": HYPOTHESIS,
}
SAMPLES = {
    "`Joint`, `Manoeuvre`, `JointMIMO`, `ContinuousJoint`": SAMPLE,
    "`AdaptiveGain`": GAIN_SAMPLE,
    f"{RECURSIVE}, `ARXMIMO`": RECURSIVE_SAMPLE,
    "`WindowObserver`, `AlgebraicObserver`": OBSERVER_SAMPLE,
    "`StateSpace`": STATE_SAMPLE,
    "`GreyBox`": GREY_SAMPLE,
    "`ModelAverage`": AVERAGE_SAMPLE,
    "`TrackEstimator`": TRACK_SAMPLE,
}


def table(title: str, layout: Layout, known: dict[str, Layout]) -> str:
    """Return a table of a layout's fields; those that an earlier one begins with are not told again."""
    like = max(known, key=lambda name: shared(layout, known[name]), default="")
    same = shared(layout, known[like]) if like else 0
    where = ", ".join(f"`{name}` = `{size}`" for name, size in layout.sizes.items())
    lines = [f"**{title}**" + (f", where {where}" if where else ""), "", "| field | size | meaning |", "|---|---|---|"]
    if same > 3:
        first, last = layout.fields[0].name, layout.fields[same - 1].name
        lines.append(f"| `{first}` .. `{last}` | | as of {like} |")
    for field in layout.fields[same if same > 3 else 0 :]:
        size = " x ".join(f"`{size}`" for size in field.shape)
        about = field.about + (f"; in a trace: {field.trace}" if field.trace else "")
        lines.append(f"| `{field.name}` | {size} | {about.replace('|', chr(92) + '|')} |")
    known[title] = layout
    return "\n".join(lines) + "\n"


def shared(one: Layout, other: Layout) -> int:
    """Return how many fields two layouts begin with alike."""
    count = 0
    for a, b in zip(one.fields, other.fields):
        if a != b:
            break
        count += 1
    return count


def page() -> str:
    """Return the page with its tables written anew."""
    text = PAGE.read_text(encoding="utf-8")
    for name, tables in (("samples", SAMPLES), ("states", STATES), ("memories", MEMORIES)):
        known: dict[str, Layout] = {}
        before, rest = text.split(f"{BEGIN}<!-- {name} -->\n")
        _, after = rest.split(END, 1)
        written = "\n".join(table(title, layout, known) for title, layout in tables.items())
        text = f"{before}{BEGIN}<!-- {name} -->\n\n{written}\n{END}{after}"
    return text


if __name__ == "__main__":
    if "--check" in sys.argv:
        sys.exit(page() != PAGE.read_text(encoding="utf-8"))
    PAGE.write_text(page(), encoding="utf-8")
