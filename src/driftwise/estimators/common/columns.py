"""What the compiled loop writes of each sample, before estimates and their spread: declared as rows are."""

from ...engine.layout import Field, Layout, each

SAMPLE = Layout(
    *each(
        "outputs",
        prediction="y(t) given everything before t",
        innovation="y(t) less that; NaN where y is missing",
        variance="squared scale of the innovation: its variance where the noise is known",
        status="bits",
    ),
    given=("outputs",),
)
GAIN_SAMPLE = SAMPLE.replace(
    *each(
        "outputs",
        weight="samples behind the estimate: 1 over the gain",
        statistic="of the detector, over its threshold",
        since="at an alarm: samples since the change began",
        which="at an alarm: the parameter that the detector names, -1: it cannot say",
    )
)
RECURSIVE_SAMPLE = GAIN_SAMPLE.replace(
    *each("outputs", dof="degrees of freedom of the prediction; infinite where the noise is known"),
    Field("mixture", ("outputs * mixture",), "weight, mean less that of the whole, squared scale of each filter"),
    given=("outputs", "mixture"),
)
OBSERVER_SAMPLE = SAMPLE.replace(Field("statistic", ("1",), "of the detector, over its threshold"))
