"""Leave out what nobody reads, and copies of copies: what unfolding leaves behind."""

from __future__ import annotations

from typing import Any

from .st_statements import WORD, Comment, Count, Ever, Plain, Set, Test, blocks, texts, with_blocks, with_texts

Block = list[Any]


def tidy(block: Block, kept: set[str]) -> Block:
    """Return a block that does the same with fewer statements; ``kept`` are variables that are read outside."""
    while True:
        before = count(block)
        block = copies_passed_on(block)
        block, _ = without_dead(block, kept, kept, kept)
        if count(block) == before:
            return block


def count(block: Block) -> int:
    """Return the number of statements."""
    return sum(1 + sum(map(count, blocks(one))) for one in block if not isinstance(one, Comment))


def words(*some: str) -> set[str]:
    """Return the words of texts."""
    return {word for text in some for word in WORD.findall(text)}


def reads(block: Block) -> set[str]:
    """Return all that is read in a block."""
    return {w for one in block for w in words(texts(one)).union(*(reads(inner) for inner in blocks(one)))}


def writes(block: Block) -> set[str]:
    """Return the variables and arrays that a block writes."""
    found: set[str] = set()
    for one in block:
        if isinstance(one, Set):
            found.add(WORD.match(one.target)[0])  # type: ignore[index]  # a target begins with a word
        elif isinstance(one, Count):
            found.add(one.variable)
        found.update(*(writes(inner) for inner in blocks(one)))
    return found


def without_dead(block: Block, live: set[str], at_exit: set[str], kept: set[str]) -> tuple[Block, set[str]]:
    """Return a block without values that are never read, and what is read behind its begin; ``live``: behind its end.

    A result that is only copied goes where the copy would.
    """
    left: Block = []
    todo = list(block)
    while todo:
        one = todo.pop()
        if isinstance(one, Set):
            if one.variable and (one.variable not in live or one.value == one.variable):
                continue
            last = next((k for k in range(len(todo) - 1, -1, -1) if not isinstance(todo[k], Comment)), -1)
            is_free = last >= 0 and one.value not in live and not words(one.target) & writes(todo[last:])
            if is_free and is_result(todo[last], one.value):
                todo[last] = moved(todo[last], one.value, one)
                continue
            live = (live - {one.variable}) | words(texts(one))
        elif isinstance(one, Plain):
            live = at_exit if one.text == "EXIT" else kept if one.text == "RETURN" else live
        elif isinstance(one, Test):
            ways = [without_dead(way, live, at_exit, kept) for way in (one.then, one.other)]
            if not ways[0][0] and not ways[1][0]:
                continue
            one = Test(one.test, ways[0][0], ways[1][0])
            if not one.then:
                one = Test(f"NOT ({one.test})", one.other)
            live = ways[0][1] | ways[1][1] | words(one.test)
        elif isinstance(one, Count | Ever):
            behind = round_ = live
            while True:
                body, begin = without_dead(one.body, round_, behind, kept)
                if begin <= round_:
                    break
                round_ = round_ | begin
            if not body and isinstance(one, Count):
                continue
            one = with_blocks(one, [body])
            live = behind | (begin - {getattr(one, "variable", "")}) | words(texts(one))
        left.append(one)
    return left[::-1], live


def copies_passed_on(block: Block) -> Block:
    """Return a block that reads a variable itself, not the copy of it, as long as neither changes."""
    block = [with_blocks(one, [copies_passed_on(inner) for inner in blocks(one)]) for one in block]
    for k, one in enumerate(block):
        if not isinstance(one, Set) or not one.variable or not one.value.isidentifier() or one.value == one.variable:
            continue
        for j in range(k + 1, len(block)):
            changed = writes([block[j]]) & {one.variable, one.value}
            if not changed or isinstance(block[j], Set):
                block[j] = with_texts(block[j], one.variable, one.value)
            if changed:
                break
    return block


def is_result(one, name: str) -> bool:
    """Say whether a variable is written last on each way through a statement, and not used in it otherwise."""
    if isinstance(one, Set):
        return one.variable == name and name not in words(one.value)
    if not isinstance(one, Test) or not one.then or not one.other or name in words(one.test):
        return False
    return all(
        is_result(way[-1], name) and name not in reads(way[:-1]) | writes(way[:-1]) for way in (one.then, one.other)
    )


def moved(one, name: str, to: Set):
    """Return a statement whose result goes elsewhere."""
    if isinstance(one, Set):
        return Set(to.target, one.value, to.variable)
    return Test(one.test, *([*way[:-1], moved(way[-1], name, to)] for way in (one.then, one.other)))
