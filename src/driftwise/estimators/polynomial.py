"""ARMA, ARMAX, output error and Box-Jenkins: recursive prediction error, or pseudolinear regression."""

from __future__ import annotations

import inspect

import numpy as np

from ..errors import InputError
from ..models.family import Family
from . import door
from .polynomials import RADIUS, Polynomials, sizes
from .recursive import ARX

METHODS = ("rpem", "plr")
COMMON = {k: p.default for k, p in inspect.signature(ARX).parameters.items() if p.kind is p.KEYWORD_ONLY}


class _Member(ARX):
    """What the members of the family share; the orders make the difference."""

    def _set(self, orders, method, options):
        unknown = [name for name in options if name not in COMMON]
        if unknown:
            raise TypeError(f"{type(self).__name__} has no option {unknown[0]!r}; it has {', '.join(COMMON)}")
        if method not in METHODS:
            raise InputError(f"method must be one of {', '.join(METHODS)}, got {method!r}")
        self.options = {**orders, "method": method, **COMMON, **options}
        na, nc, nd = (door.count(name, orders.get(name, 0)) for name in ("na", "nc", "nd"))
        nb, nk, nf = (door.counts(name, orders.get(name, ())) for name in ("nb", "nk", "nf"))
        self.model = form = Family(na, nb, _each("nk", nk, nb), bool(self.options["offset"]), (), nc, nd, _each("nf", nf, nb))
        if not form.N:
            raise InputError("the model has no parameter: its orders are all zero")
        registers, own = sizes(form.N, form.kept, method == "rpem")
        self._prepare(
            Polynomials(
                N=0.0, na=form.na, inputs=form.inputs, deep=form.deep, registers=registers, cells=0.0, marks=0.0,
                missing=0.0, settle=0.0, offset=float(form.has_offset), nb=np.array(nb, float),
                nk=np.array(form.nk, float), R=0.0, exact=float(method == "rpem"), kept=form.kept, nc=form.nc,
                nd=form.nd, nf=np.array(form.nf, float), 
                start=2.0 * form.N if self.options["P0"] is None else np.inf, cap=(),
            ), own,
        )  # fmt: skip


    def _set_prior(self, theta0, P0):
        super()._set_prior(theta0, P0)
        if P0 is None:
            i = self.model.plain
            self._D0[i : i + self.model.kept] = 1.0


def _each(name, values, nb):
    """Return one order for each input."""
    values = values * len(nb) if len(values) == 1 else values
    if values and len(values) != len(nb):
        raise InputError(f"{name} must be one number, or one for each of the {len(nb)} inputs, got {values!r}")
    return values or (0,) * len(nb)


class ARMA(_Member):
    def __init__(self, na: int = 2, nc: int = 1, *, method: str = "rpem", **options):
        self._set(dict(na=na, nc=nc), method, options)


class ARMAX(_Member):
    def __init__(self, na: int = 2, nb=1, nc: int = 1, nk=1, *, method: str = "rpem", **options):
        self._set(dict(na=na, nb=nb, nc=nc, nk=nk), method, options)


class OE(_Member):
    def __init__(self, nb=1, nf=2, nk=1, *, method: str = "rpem", **options):
        self._set(dict(nb=nb, nf=nf, nk=nk), method, options)


class BJ(_Member):
    def __init__(self, nb=1, nc: int = 1, nd: int = 1, nf=2, nk=1, *, method: str = "rpem", **options):
        self._set(dict(nb=nb, nc=nc, nd=nd, nf=nf, nk=nk), method, options)
