"""What the last L samples of a plant say about [x; q], for any L without going through the samples one by one."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.linalg import block_diag, expm

from ...models.plant import Augmented
from .gains import WORST, Coordinates, smallest

GROWS = 3e-3  # real part, relative to the fastest mode, from which a mode grows: a sixfold root is found to 2e-3


class Horizon:
    """Least squares on a window, by its length: standard deviations and condition from R of QR = the window's rows.

    The unknowns are those of `gains.Design`: growing modes at the window's end, all others at its start, so that no
    power of Phi grows. A window of a + b samples is one of a and one of b:

        R(a+b) = qr [R(a) diag(I, Phi_u^-b); R(b) diag(Phi_s^a, I)]

    Parameters
    ----------
    augmented : the plant with its disturbances; their prior is what is known at the window's start
    dt : seconds between samples
    noise_std : of each output

    Examples
    --------
    >>> from driftwise import Plant
    >>> chain = Augmented(Plant([[0, 1], [0, 0]]))                # position and velocity
    >>> Horizon(chain, 0.1, 1.0).std(5).round(3).tolist()
    [0.775, 3.162]
    """

    def __init__(self, augmented: Augmented, dt: float, noise_std):
        self.augmented, self.dt = augmented, dt
        self.noise_std = np.broadcast_to(noise_std, augmented.outputs)
        fastest = max(float(np.abs(augmented.modes).max(initial=0.0)), 1e-100)
        self.frame = frame = Coordinates(augmented, 1 / (GROWS * fastest))
        self._T = np.hstack([frame.Ta, frame.Tb])
        self._forwards, self._backwards = expm(frame.Aa * dt), expm(-frame.Ab * dt)
        self._H = augmented.H @ self._T / self.noise_std[:, None]
        self._free = block_diag(frame.Z, np.eye(frame.Tb.shape[1]))
        self._prior = np.hstack([frame.prior, np.zeros((len(frame.prior), frame.Tb.shape[1]))])
        self.least = max(1, -(-frame.free // augmented.outputs))  # samples, to begin with

    def _shift(self, before: int, after: int) -> np.ndarray:
        """Return what takes the unknowns of a part of a window from those of the whole."""
        power = np.linalg.matrix_power
        return block_diag(power(self._forwards, before), power(self._backwards, after))

    def _triangle(self, samples: int) -> np.ndarray:
        """Return R of a window's rows, put together from windows of 1, 2, 4, .. samples."""
        whole, size, piece, length = np.zeros((0, self.augmented.m)), 0, self._H, 1
        while size < samples:
            if samples & length:
                whole = _qr(whole @ self._shift(0, length), piece @ self._shift(size, 0))
                size += length
            if size < samples:
                piece = _qr(piece @ self._shift(0, length), piece @ self._shift(length, 0))
                length *= 2
        return whole

    def _solvable(self, samples: int):
        """Return R of data and prior in the unknowns that are free, columns of norm 1, and what their norms were."""
        R = np.vstack([self._triangle(samples) @ self._free, self._prior])
        norms = np.linalg.norm(R, axis=0)
        norms[norms == 0] = 1.0
        return R / norms, norms

    def condition(self, samples: int) -> float:
        """Return the condition of the unknowns of a window, each in its own units."""
        values = np.linalg.svd(self._solvable(samples)[0], compute_uv=False)
        few = len(values) < self._free.shape[1] or values[-1] == 0
        return np.inf if few else float(values[0] / values[-1])

    def errors(self, samples: int) -> tuple[np.ndarray, np.ndarray]:
        """Return N and K of the error N v - K w of the estimate of z at a window's end.

        v is white noise, w the disturbances at the window's start over their prior deviations, both of variance 1.
        """
        R, norms = self._solvable(samples)
        U, values, V = np.linalg.svd(R, full_matrices=False)
        root = self._T @ self._shift(samples - 1, 0) @ self._free @ (V.T / values / norms[:, None]) @ U.T
        data = len(R) - len(self._prior)
        return root[:, :data], root[:, data:]

    def std(self, samples: int) -> np.ndarray:
        """Return the standard deviations (m,) at the end of a window, infinite where it does not determine them."""
        if samples < self.least or self.condition(samples) > WORST:
            return np.full(self.augmented.m, np.inf)
        return np.linalg.norm(np.hstack(self.errors(samples)), axis=1)

    @cached_property
    def smallest(self) -> int:
        """Number of samples of the smallest window that determines all unknowns; 0 if none does."""
        return self.shortest(lambda samples: self.condition(samples) <= WORST)

    def shortest(self, suits) -> int:
        """Return the smallest number of samples that suits, where all longer windows suit as well; 0 if none does."""
        return smallest(suits, self.least) or 0


def _qr(above, below):
    return np.linalg.qr(np.vstack([above, below]), mode="r")
