"""Which form of the step each method of `ARX` has."""

from typing import Any

from .gradient import LagsAlone
from .instruments import InstrumentalLags
from .row import Lags

METHODS: dict[str, Any] = {"ls": Lags, "iv": InstrumentalLags, "nlms": LagsAlone, "lms": LagsAlone}
