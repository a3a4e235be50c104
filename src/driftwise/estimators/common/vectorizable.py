"""Policies that eight series can take side by side in a register: their branches rarely depend on the data."""

from ...detect.gate import Always, InnovationGate
from ...detect.watch import Silent
from ...memory.constant import Constant
from ...models.noise import White
from ...models.scale import InverseGamma, KnownScale
from ..arx.methods import LeastSquares
from ..arx.row import Lags
from ..joint.row import Form

FIT = {Form, Lags, LeastSquares, White, Constant, Always, InnovationGate, KnownScale, InverseGamma, Silent}
