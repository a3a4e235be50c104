"""The section of the report that says what is wrong, and what to do about it."""

from __future__ import annotations

from driftwise.report import report_page as html

__all__ = ["section"]


def section(trace, summary, study=None) -> str:
    """Return the verdicts on a run, those that ask for something first.

    They are those of the whole run where they come with the trace (``trace.diagnosis``), which may be thinned out.
    """
    from driftwise.analysis.diagnose import diagnose

    found = getattr(trace, "diagnosis", None)
    if found is None:
        identifiable = None if study is None else study.identifiability
        found = diagnose(trace, summary, record=(trace.y, trace.u), identifiable=identifiable)
    asked = len(found.not_fine)
    words = "Nothing asks for attention." if not asked else f"{asked} of {len(found)} ask for attention."
    rows = [(v.name, v.shown, v.limits, v.is_fine, v.advice) for v in sorted(found, key=lambda one: one.is_fine)]
    return html.section("verdicts", "Can this run be trusted?", words, html.verdict_list(rows))
