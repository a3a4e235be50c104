"""The targets, as verdicts: numbered rows that were fixed before, each with what came out and whether it is met.

A row is left out where its record was not asked for. Rows 12 to 18 are tasks of their own (``run.TASKS``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from ..papers.verdict import Verdict, numbers
from . import labels
from .board import CONSTANT, OURS, UNTUNED
from .records import ROWS
from .run import Measured
from .second import SECOND

PAGE = "docs/score.md"
STEADY = {"hair_dryer": 95.5, "robot_arm": 99.5, "heating_system": 98.7, "soldering_station": 98.0}
HUNGRY = {"canning_flow": 83.0, "leaf_hppc_25C": 99.7}  # little excitation: fixed forgetting breaks
CHANGING = {"gas_furnace": 88.0, "heat_exchanger": 76.5, "mur_groundwater": 79.0}
INVARIANT = ("hair_dryer", "robot_arm", "heating_system")
ADAPTIVE = ("mur_groundwater", "gas_furnace", "heat_exchanger", "air_quality_NO2")
MOST = 13  # records, of all 17, on which a row of the table has to hold
GAIN, LEVEL = (0.98, 0.49), (329.95, 330.80)  # of the river and the head, before and after the dam
YEAR, DAM = 52, 621  # weeks
SHORT = 200  # samples, of a record that may lose


def verdicts(found: Measured) -> list[Verdict]:
    """Return every verdict that what was measured allows, in the order of the rows."""
    told = [v for part in PARTS for v in part(found)]
    told += [v for task in found.tasks.values() for v in task]
    told += [_broken(failure.job.title, failure.words) for failure in found.failures]
    return sorted(told, key=lambda v: _number(v.source))


def _number(source: str) -> float:
    """Return the row that a source names; what names none comes last."""
    last = source.rsplit(" ", 1)[-1]
    return float(last) if last.replace(".", "").isdigit() else np.inf


def _row(name: str, value: str, expected: str, confirmed, row: float) -> Verdict:
    return Verdict(name, value, expected, bool(confirmed), f"{PAGE}, row {row:g}")


def _broken(title: str, words: str) -> Verdict:
    return Verdict(title, words, "runs to its end", False, PAGE)


# --- forecasts ---------------------------------------------------------------------------------------------


def fits(found: Measured) -> Iterator[Verdict]:
    """Rows 1, 4 and 5: the fit, with the defaults."""
    for row, targets in ((1, STEADY), (4, HUNGRY), (5, CHANGING)):
        for name, least in targets.items():
            if name in found.rows:
                fit = found.rows[name].scores[OURS].fit
                yield _row(f"{name}: one-step fit", f"{fit:.1f} %", f">= {least} %", round(fit, 1) >= least, row)
    for name in HUNGRY:
        if name in found.rows:
            wide = found.rows[name].widest
            yield _row(
                f"{name}: no wind-up",
                f"largest standard deviation claimed: {wide:.2g} times the range of y",
                "< 1",
                wide < 1,
                4,
            )


def bars(found: Measured) -> Iterator[Verdict]:
    """Rows 2 and 3: error bars and densities on all records."""
    if not found.is_whole or not found.rows:
        return
    scores = {name: row.scores[OURS] for name, row in found.rows.items() if name in ROWS}
    least, count = MOST, len(ROWS)  # a record that failed counts as one that is not good
    nis = {name: s.nis for name, s in scores.items()}
    good = [name for name, v in nis.items() if 0.8 <= v <= 1.25]
    yield _row("NIS in .8 to 1.25", f"{len(good)} of {count} records", f">= {least}", len(good) >= least, 2)
    worst = max(nis, key=lambda name: np.nan_to_num(nis[name], nan=np.inf))
    yield _row("the largest NIS", f"{nis[worst]:.2f} ({worst})", "<= 1.6", nis[worst] <= 1.6, 2)
    inside = sum(92 <= round(s.share) <= 97 for s in scores.values())
    yield _row("92 to 97 % in 95 % bands", f"{inside} of {count} records", f">= {least}", inside >= least, 2)
    dense = sum(s.log_score >= found.rows[name].density - 0.05 for name, s in scores.items())
    yield _row(
        "log score at least the better of Kalman and RLS .995, minus .05",
        f"{dense} of {count} records",
        f">= {least}",
        dense >= least,
        3,
    )


def both_sets(found: Measured) -> Iterator[Verdict]:
    """Row 29: all records of both sets, what misses by name."""
    if not found.rows.keys() >= ROWS.keys() | SECOND.keys():
        return
    rows = found.rows

    def share(what: str, misses: dict[str, float], least: float) -> Verdict:
        part = 1 - len(misses) / len(rows)
        named = "; ".join(f"{name} {value:.3g}" for name, value in sorted(misses.items(), key=lambda pair: pair[1]))
        text = f"{len(rows) - len(misses)} of {len(rows)}" + (f" (not: {named})" if named else "")
        return _row(f"both sets: {what}", text, f">= {100 * least:.0f} %", part >= least, 29)

    behind = {name: row.lead for name, row in rows.items() if row.lead < -0.3}
    yield share("fit within .3 points of the best opponent", behind, 0.9)
    far = {name: lead for name, lead in behind.items() if lead < -1 and rows[name].samples >= SHORT}
    yield share(f"never more than 1 point behind, {SHORT} samples or more", far, 1.0)
    score = {name: row.scores[OURS].log_score - row.density for name, row in rows.items()}
    yield share(
        "log score at least the better of Kalman and RLS .995, minus .02",
        {name: gap for name, gap in score.items() if not gap >= -0.02},
        0.95,
    )
    nis = {name: row.scores[OURS].nis for name, row in rows.items()}
    yield share(
        "NIS in .8 to 1.25, or what chance allows",
        {name: value for name, value in nis.items() if not _within(value, 0.8, 1.25, 1.0, 2.0, rows[name].samples)},
        0.9,
    )
    held = {name: row.scores[OURS].share / 100 for name, row in rows.items()}
    yield share(
        "92 to 97 % in 95 % bands, or what chance allows",
        {n: value for n, value in held.items() if not _within(value, 0.92, 0.97, 0.95, 0.05 * 0.95, rows[n].samples)},
        0.9,
    )


def _within(value: float, low: float, high: float, right: float, variance: float, samples: int) -> bool:
    """Say whether a mean over the second half lies in an interval, or in that of 99 % about what is ``right``."""
    half = 2.576 * float(np.sqrt(variance / max(samples // 2, 1)))
    return min(low, right - half) <= value <= max(high, right + half)


def opponents(found: Measured) -> Iterator[Verdict]:
    """Rows 20 and 21: not worse than the best constant opponent where nothing changes, better where something does."""
    for name in INVARIANT:
        if name in found.rows:
            lead = found.rows[name].lead
            best, fit = found.rows[name].best
            yield _row(f"{name}: never lose", f"{lead:+.2f} points on {best} ({fit:.1f})", ">= -.5", lead >= -0.5, 20)
    for name in ADAPTIVE:
        if name in found.rows:
            lead = found.rows[name].lead
            best, fit = found.rows[name].best
            yield _row(
                f"{name}: above all {len(CONSTANT)} opponents",
                f"{lead:+.2f} points on {best} ({fit:.1f})",
                "> 0",
                lead > 0,
                21,
            )


# --- labelled changes --------------------------------------------------------------------------------------


def groundwater(found: Measured) -> Iterator[Verdict]:
    """Row 6: the dam."""
    if "river_only" not in found.labelled:
        return
    one = found.labelled["river_only"]
    seen = one.found[OURS][0]
    yield _row("groundwater: alarms in the ten years before the dam", str(seen.before), "<= 1", seen.before <= 1, 6)
    yield _row(
        "groundwater: the dam is told",
        _after(seen.delay, "weeks"),
        "<= 3 weeks",
        seen.delay is not None and seen.delay <= 3,
        6,
    )
    if not one.truths:
        yield _row("groundwater: gain and level", "the model has none", f"a gain of {GAIN[1]}", False, 6)
        return
    later, before = slice(DAM + YEAR, None), DAM - 1
    gain, gain_std, level, level_std = (one.truths[k] for k in ("gain", "gain_std", "level", "level_std"))
    off = np.abs(gain[later] - GAIN[1])
    yield _row(
        "groundwater: gain from 52 weeks on",
        f"{gain[later].min():.2f} to {gain[later].max():.2f}",
        f"{GAIN[1]} +- .06 throughout",
        off.max() <= 0.06,
        6,
    )
    yield _row(
        f"groundwater: level at a stage of {labels.STAGE} m from 52 weeks on",
        f"{level[later].min():.2f} to {level[later].max():.2f} m",
        "330.8 +- .1 m throughout",
        np.abs(level[later] - 330.8).max() <= 0.1,
        6,
    )
    for what, value, std, truth in (("gain", gain, gain_std, GAIN), ("level", level, level_std, LEVEL)):
        z = [(value[k] - t) / std[k] for k, t in zip((before, -1), truth)]
        yield _row(
            f"groundwater: the 95 % band of the {what} covers the truth before the dam and at the end",
            f"{numbers(z, 1)} standard deviations off",
            "within +- 1.96",
            np.all(np.abs(z) <= 1.96),
            6,
        )


def _after(delay: int | None, unit: str) -> str:
    return "missed" if delay is None else f"after {delay} {unit}"


def exchanger(found: Measured) -> Iterator[Verdict]:
    """Row 7: the heat exchanger's two changes, one setting."""
    for seen, at in zip(_found(found, "heat_exchanger"), (800, 2000)):
        yield _row(f"heat exchanger: alarms before k = {at}", f"{seen.before} in {seen.clean}", "0", not seen.before, 7)
        yield _row(
            f"heat exchanger: the change at k = {at}",
            _after(seen.delay, "samples"),
            "<= 15 samples",
            seen.delay is not None and seen.delay <= 15,
            7,
        )


def drive(found: Measured) -> Iterator[Verdict]:
    """Row 8: the motor that turns round."""
    for seen in _found(found, "dc_motor_hoop"):
        yield _row(
            "motor drive: false alarms per 1000",
            f"{seen.per_thousand:.2f} ({seen.before} in {seen.clean})",
            "<= 1",
            seen.per_thousand <= 1,
            8,
        )
        yield _row(
            "motor drive: the reversal",
            _after(seen.delay, "samples"),
            "<= 20 samples",
            seen.delay is not None and seen.delay <= 20,
            8,
        )
        truths = found.labelled["dc_motor_hoop"].truths
        if truths:
            spans = slice(2000, 4100), slice(5000, None)
            offset, gain = ([float(np.median(truths[k][s])) for s in spans] for k in ("level", "gain"))
            yield _row(
                "motor drive: the offset changes sign, the gain does not move",
                f"offset {numbers(offset, 2)}, gain {numbers(gain, 2)}",
                "signs differ, gain within 5 %",
                offset[0] * offset[1] < 0 and abs(gain[1] / gain[0] - 1) < 0.05,
                8,
            )


def nile(found: Measured) -> Iterator[Verdict]:
    """Row 9: the dam, or the climate, of 1899."""
    for seen in _found(found, "nile"):
        told = [1871 + k for k in found.labelled["nile"].alarms]
        words = ", ".join(map(str, told)) or "no alarm"
        yield _row("the Nile: told by 1902", words, "1899 to 1902", seen.delay is not None and seen.delay <= 3, 9)
        yield _row("the Nile: nothing before 1899, nothing else after", words, "one alarm", len(told) == 1, 9)


def pump(found: Measured) -> Iterator[Verdict]:
    """Row 10: the pump rig, flow alone."""
    if not found.is_whole or not found.pump:
        return
    seen = [one.found[OURS][0] for one in found.pump.values()]
    delays = [s.delay for s in seen if s.delay is not None]
    rate = 1000 * sum(s.before for s in seen) / sum(s.clean for s in seen)
    yield _row("pump rig: files found", f"{len(delays)} of {len(seen)}", ">= 16", len(delays) >= 16, 10)
    middle = float(np.median(delays)) if delays else np.inf
    yield _row("pump rig: median delay", f"{middle:.0f} s", "<= 25 s", middle <= 25, 10)
    yield _row("pump rig: false alarms per 1000", f"{rate:.2f}", "<= 1", rate <= 1, 10)


def air_handler(found: Measured) -> Iterator[Verdict]:
    """Row 11: five faults, and four days on which nothing is to be seen."""
    for name, most in labels.FAULTS.items():
        if name in found.day:
            alarms = found.day[name].alarms
            first = alarms[0] if alarms else None
            met = first is not None and first <= labels.START + most
            words = f"<= {most} minutes after it starts ({labels.START})"
            yield _row(f"air handler, fault of {name}", _after(first, "minutes of the day"), words, met, 11)
    for name in labels.NO_FAULT:
        if name in found.day:
            count = len(found.day[name].alarms)
            yield _row(f"air handler, {name}: nothing to see", f"{count} alarms", "<= 1", count <= 1, 11)


def _found(found: Measured, name: str) -> list[labels.Found]:
    return found.labelled[name].found[OURS] if name in found.labelled else []


# --- tracks ------------------------------------------------------------------------------------------------


def tracks(found: Measured) -> Iterator[Verdict]:
    """Rows 22 to 28: tracks, against the fixed filter that is best in hindsight."""
    kinds = found.tracks
    marine, long_range = "marine radar 1.68 s", "12 s long-range radar, C-130"
    if marine in kinds:
        ratio = kinds[marine].ratio[OURS]
        close = int(np.sum(ratio <= 1.10))
        yield _row(
            "marine radar: RMSE over that of the best fixed filter",
            f"median {np.median(ratio):.2f}, {close} of {len(ratio)} series <= 1.10",
            "median <= 1.02, <= 1.10 on >= 16",
            np.median(ratio) <= 1.02 and close >= 16,
            22,
        )
    if long_range in kinds:
        ratio = kinds[long_range].ratio[OURS]
        yield _row("12 s radar: both coordinates", numbers(ratio, 2), "<= .92", np.all(ratio <= 0.92), 23)
    if not found.is_whole or not kinds:
        return
    ratio = np.concatenate([t.ratio[OURS] for t in kinds.values()])
    beaten, close = int(np.sum(ratio <= 1.0)), int(np.sum(ratio <= 1.1))
    yield _row(
        f"all {len(ratio)} series",
        f"median {np.median(ratio):.2f}; <= 1.00 on {beaten}, <= 1.10 on {close}",
        "median <= .97; 60; 79",
        np.median(ratio) <= 0.97 and beaten >= 60 and close >= 79,
        24,
    )
    yield _row(
        "divergence: the worst series",
        f"{np.max(ratio):.2f}",
        "<= 2, and a number everywhere",
        np.all(np.isfinite(ratio)) and np.max(ratio) <= 2,
        25,
    )
    good = [
        name
        for name, t in kinds.items()
        if 0.8 <= np.median(t.nis[OURS]) <= 1.5 and 92 <= np.median(t.share[OURS]) <= 97
    ]
    yield _row(
        "sets whose median NIS is in .8 to 1.5 and coverage in 92 to 97 %",
        f"{len(good)} of {len(kinds)}",
        "all",
        len(good) == len(kinds),
        26,
    )
    dense = np.concatenate([t.density[OURS] for t in kinds.values()]) >= 0
    yield _row(
        "log density no worse than that of the best fixed filter",
        f"{100 * np.mean(dense):.0f} % of the series",
        ">= 55 %",
        np.mean(dense) >= 0.55,
        27,
    )
    for words, names in (("radar", (marine, long_range)), ("all series", tuple(kinds))):
        mine, bank = (
            float(np.exp(np.mean(np.log(np.concatenate([kinds[n].ratio[m] for n in names if n in kinds])))))
            for m in (OURS, UNTUNED)
        )
        yield _row(
            f"geometric mean of the ratios beside that of six untuned filters, {words}",
            f"{mine:.3f} against {bank:.3f}",
            "no larger",
            mine <= bank,
            28,
        )


# --- a task ------------------------------------------------------------------------------------------------


def newcomer(where: Path) -> list[Verdict]:
    """Row 19: a file as a newcomer has it (wrong header, drop-outs, uneven stamps), nothing said about it."""
    import driftwise as dw

    names = ("the newcomer's file: one-step fit on valid samples", "the newcomer's file: drop-outs are reported")
    if not hasattr(dw, "identify"):
        return [Verdict(name, "no identify", "runs", None, f"{PAGE}, row 19") for name in names]
    said = dw.identify(str(where / "soldering_station.csv"))
    y, prediction = said.forecast.y, said.forecast.prediction
    used = (np.arange(len(y)) >= len(y) // 2) & (y > 60)
    fit = 100 * (1 - np.linalg.norm((y - prediction)[used]) / np.linalg.norm(y[used] - y[used].mean()))
    told = [line for line in str(said.table).splitlines() if "drop-out" in line]
    return [
        _row(names[0], f"{fit:.1f} %", ">= 97.5 %", fit >= 97.5, 19),
        _row(names[1], told[0] if told else "not a word", "says so", told, 19),
    ]


PARTS: tuple[Callable[[Measured], Iterator[Verdict]], ...] = (
    fits, bars, opponents, groundwater, exchanger, drive, nile, pump, air_handler, tracks, both_sets,
)  # fmt: skip
