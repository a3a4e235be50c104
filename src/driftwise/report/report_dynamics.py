"""Details of the report: poles and zeros, what the record taught, memory, drift and order."""

from __future__ import annotations

from math import isfinite, log

from driftwise.report import report_page as html
from driftwise.report.report_roots import FAR
from driftwise.report.wording import fixed, number, plus_minus, probable, zeros_told

__all__ = [
    "UNLEARNED",
    "directions",
    "drift",
    "has_weight",
    "hindsight",
    "knowledge",
    "memory",
    "order_evidence",
    "roots",
]

UNLEARNED = 0.5  # a direction that keeps more than this share of its prior variance is not learned


def roots(summary, dt: float, figure: str) -> str:
    """Return the section about poles, zeros and steady-state gains; ``figure`` is trusted markup."""
    found = summary.moduli
    model = summary.model
    outside = sum(abs(p) >= 1 for p, _ in found)
    near = sum(abs(p) < 1 <= abs(p) + 2 * s for p, s in found)
    words, hint = "All poles lie inside the circle: stable.", "stable"
    if outside or near:
        hint = f"{outside + near} on, outside or near the circle"
        words = f"{outside} on or outside the circle, {near} within two standard errors of it: integrating or unstable."
    words += " Shaded: 95 % ellipses (a bar for a root that stays real); drag to zoom in."
    if "sampled" in model.method or any("sampled" in model.zeros_method(i) for i in range(model.form.inputs)):
        words += " Dots: draws from the posterior, where an ellipse would mislead."
    has_zeros = any(zeros_told(model, i) for i in range(model.form.inputs))
    rows = [[_complex(p), f"{abs(p):.4f}", _std(s), _time_constant(p, s, dt)] for p, s in found if p.imag >= -1e-12]
    body = [
        f'<div class="center">{figure}</div>',
        html.table(["pole", "size", "standard error", f"time constant ({summary.unit})"], rows),
        _zeros(model),
        _gains(model),
        *[html.say(f"{note}.") for note in summary.notes],
    ]
    return html.fold("poles", "Poles and zeros" if has_zeros else "Poles", hint, words, *body)


def _zeros(model) -> str:
    rows, far, k = [], 0, model.form.inputs
    for i in range(k):
        for z, std in zeros_told(model, i):
            if z.imag < -1e-12:
                continue
            name = "" if k == 1 else f" (u{i + 1})"
            far += int(abs(z) > FAR)
            size = f"{abs(z):.4f}" if abs(z) < 1e4 else number(abs(z), 2)
            rows.append([_complex(z) + name, size, _std(std)])
    if not rows:
        return ""
    left = html.say(f"{far} zero{'s lie' if far > 1 else ' lies'} outside the figure.") if far else ""
    return html.table(["zero", "size", "standard error"], rows) + left


def _gains(model) -> str:
    """Return the table of steady-state gains, one row per input, or nothing."""
    if not model.form.inputs or not model.is_stable:  # perhaps an integrator
        return ""
    rows = []
    for k, (gain, std, (low, high)) in enumerate(zip(model.dc_gain, model.dc_gain_std, model.dc_gain_interval())):
        shown = plus_minus(float(gain), float(std))
        if not isfinite(std):
            shown = f"{number(low, 3)} \u2026 {number(high, 3)} (95 %, Fieller)" if isfinite(low) else "no bound"
        rows.append(["u" if model.form.inputs == 1 else f"u{k + 1}", shown])
    return html.table(["input", "steady-state gain"], rows)


def _complex(pole: complex) -> str:
    return number(pole.real, 4) if abs(pole.imag) < 1e-12 else f"{number(pole.real, 4)} ± {number(abs(pole.imag), 4)} j"


def _std(std: float) -> str:
    return number(std, 2) if isfinite(std) else "no bound"


def _time_constant(pole: complex, std: float, dt: float) -> str:
    """Return the time constant, a dash where the pole cannot be told from one that never decays."""
    size = abs(pole)
    return number(-dt / log(size), 3) if 0 < size and size + 2 * std < 1 else "\u2013"


# --- what was learned ----------------------------------------------------------------------------------------


def directions(summary) -> list[tuple[str, float]]:
    """Return (direction, share of the prior variance that is left), the least learned first."""
    from driftwise.results.summary import combination

    est = summary.estimator
    return [
        (combination(vector, est.names).replace("-", "\u2212"), float(ratio))
        for ratio, vector in est.information_ratio(summary.state)
    ]


def knowledge(found, study, figure: str) -> str:
    """Return the section about what the data taught; ``found`` comes from `directions`."""
    lost = sum(ratio > UNLEARNED for _, ratio in found)
    words = (
        "The data taught every direction of the parameters. Right of the dashed line the first guess would still rule."
    )
    if lost:
        words = (
            f"{lost} direction{'s' if lost > 1 else ''} of the parameters stayed close to the first guess: the data "
            "did not excite them, and what is said about them is the prior's."
        )
    said = []
    if study is not None:
        said.append(html.say(study.words))
        if study.identifiability is not None:
            said.append(html.table(["identifiability of the record", ""], _numbers(study)))
        said += [html.say(study.trust)] if study.trust else []
    hint = f"{lost} direction{'s' if lost > 1 else ''} not excited" if lost else "every direction"
    return html.fold("excitation", "What was learned", hint, words, f'<div class="plot">{figure}</div>', *said)


def _numbers(study) -> list[list]:
    found = study.identifiability
    rows = [
        ["rows looked at", f"{study.rows:,}".replace(",", "\u2009")],
        ["rank of the Gramian", f"{found.rank} of {found.unknowns}"],
        ["weakest combination of parameters (0: unseen; white input: 0.1)", number(found.worst, 2)],
    ]
    if study.bound is not None:
        ratio = float(max(study.bound.ratio))
        rows.append(["error of a, noise colour unknown / known", number(ratio, 3) if isfinite(ratio) else "infinite"])
    return rows


# --- memory --------------------------------------------------------------------------------------------------


def has_weight(memory) -> bool:
    """Whether a memory counts samples: not where it adds a variance that was told at every one."""
    from driftwise.memory.drift import RandomWalk

    return not isinstance(memory, RandomWalk)


def memory(figures: list[str], estimator) -> str:
    """Return the section about gain and detector; ``figures`` is trusted markup."""
    if not figures:
        return ""
    kept, said = estimator.options.get("memory"), []
    if has_weight(kept):
        said.append("how many samples the estimate rests on (it grows until the past is forgotten)")
    if hasattr(kept, "detector"):
        said.append("how near the detector came to an alarm (1)")
    elif len(figures) > len(said):
        said.append("how near a jump came to being told (1)")
    words = f"{type(kept).__name__}: {', and '.join(said)}."
    if hasattr(kept, "detector"):
        words += f" {type(kept.detector).__name__} promises {getattr(kept.detector, 'words', 'nothing')}."
    return html.fold("adaptation", "Memory", type(kept).__name__, words, *figures)


# --- drift ---------------------------------------------------------------------------------------------------

MEANT = {
    "still": "nothing drifts", "fast": "everything drifts fast", "learnt": "drift at these speeds", "jump": "a jump",
}  # fmt: skip


def drift(found) -> str:
    """Return the table of how fast each parameter drifts (`Speeds`), or nothing."""
    if found is None:
        return ""
    head = ["", "NVR (variance of a step / noise)", "memory (samples)", ""]
    still = '<span class="tag good">stands still</span>'
    rows = [
        [name, number(nvr, 2), number(memory, 2), still if is_still else ""]
        for name, nvr, memory, is_still in zip(found.names, found.nvr, found.memory, found.is_still)
    ]
    table = html.table(head, rows)
    title, hint = "How fast each parameter drifts", found.words.partition(", or else")[0]
    if not found.weights:
        return html.fold("drift", title, hint, "", table)
    likely = ", ".join(f"{MEANT.get(name, f'NVR {name}')} {probable(weight)}" for name, weight in found.weights.items())
    return html.fold("drift", title, hint, "", table, html.say(f"Probabilities: {likely}."))


def hindsight(smoothed) -> str:
    """Return what a record of drifting parameters says in hindsight, in words."""
    is_told = smoothed is not None and not smoothed.estimator.model.n
    return html.say(smoothed.words) if is_told else ""


# --- order ---------------------------------------------------------------------------------------------------


def order_evidence(evidence, figure: str) -> str:
    """Return the section about the orders that were compared."""
    columns = evidence.columns()
    head = ["order", "log evidence", "probability", "one-step fit", "NIS"]
    rows = [
        [order, fixed(log_evidence, 1), probable(p), f"{fixed(fit, 1)} %", fixed(nis, 2)]
        for order, log_evidence, p, fit, _, nis in zip(*columns.values())
    ]
    text = (
        f"{evidence.words[0].upper()}{evidence.words[1:]}. Every order saw the same samples; all were equally probable."
    )
    best = f"{evidence.best}, probability {probable(max(evidence.probability))}"
    return html.fold(
        "orders", "Order", best, text,
        f'<div class="pair"><div>{html.table(head, rows)}</div><div class="plot">{figure}</div></div>',
    )  # fmt: skip
