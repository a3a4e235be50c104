"""Which policies eight series can share a processor register with: those whose branches rarely depend on the data."""

from ...detect.gate import Always, Gate
from ...detect.watch import Silent
from ...memory.drift import Never
from ...models.noise import White
from ...models.scale import KnownScale, UnknownScale
from ..arx.methods import LeastSquares
from ..arx.row import Lags
from ..joint.row import Form

FIT = {Form, Lags, LeastSquares, White, Never, Always, Gate, KnownScale, UnknownScale, Silent}
