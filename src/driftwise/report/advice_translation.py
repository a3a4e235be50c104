"""Advice is written in Python; on the command line it is said in options."""

from __future__ import annotations

import re
from typing import Any

# what the estimators' words become behind --memory and --noise
WORDS = {
    "AutoMemory()": "auto", "Constant()": "constant", "RestartOnChange()": "restart", "RandomWalk(q)": "random-walk:Q",
    "UnknownPolynomial()": "unknown",
    "OutputError()": "output-error", "EquationError()": "equation-error",
}  # fmt: skip
# advice that no option follows
PHRASES = {
    "estimate it (offset=True)": "estimate it: --offset estimated",
    "take another operating point off y and u": "try another --offset",
    " Is the variance known? Then say variance=...": "",
    "Name them: columns={'latitude': ..., 'longitude': ...}": "Call them so in the header of the table",
    "Give columns={'east': ..., 'north': ...} for metres": "Call them east and north in the header, if they are metres",
    "resume=True": "--resume",
    "replace=True": "--replace",
}
_WORD = "|".join(map(re.escape, WORDS))
_MODEL = re.compile(rf"\b([A-Z]+)\(([\d, ]+), memory=({_WORD})\)")
_OPTION = re.compile(rf"\b(memory|noise)=({_WORD})")
_MORE = re.compile(rf"(?<=or )({_WORD})")
_CHOICE = re.compile(r"say which: columns=\{'(\w+)': .*?\}")


def spoken(text: str) -> str:
    """Return the text in the words of the command line.

    >>> spoken("try memory=RestartOnChange() or AutoMemory()"), spoken("try ARX(2, 2, memory=AutoMemory())")
    ('try --memory restart or auto', 'try --model arx:2,2 --memory auto')
    """
    for said, instead in PHRASES.items():
        text = text.replace(said, instead)
    text = _MODEL.sub(lambda m: f"--model {m[1].lower()}:{m[2].replace(' ', '')} --memory {WORDS[m[3]]}", text)
    text = _OPTION.sub(lambda m: f"--{m[1]} {WORDS[m[2]]}", text)
    text = _CHOICE.sub(lambda m: f"call one of them {m[1]} in the header, and leave the other out", text)
    return _MORE.sub(lambda m: WORDS[m[0]], text)


def spoken_verdicts(diagnosis: Any) -> Any:
    """Return verdicts whose advice is in the words of the command line."""
    return type(diagnosis)(verdict._replace(advice=spoken(verdict.advice)) for verdict in diagnosis)
