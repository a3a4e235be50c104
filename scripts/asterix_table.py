"""Write the structure of the ASTERIX categories that are read, as libasterix (MIT) has it.

    python scripts/asterix_table.py > src/driftwise/data/asterix.txt

libasterix takes it from the public specification. A line is a category, an edition, which of its lists of items (`-`
where there is one), the longest field specification in bytes, and the items in order; `-` is a spare place, `RFS` the
place of items in random order (a count, then the number of a place and its item, so many times). What follows the
colon says how long an item is: `3` bytes; `x1,2` extended: groups of 1 and 2 bytes, each ended by a bit that says
whether the next one follows (`.` after the last group: it has no such bit); `f1` repeated while the last bit of the
byte says so; `r1*8` a count of 1 byte and so many times 8; `e` its own length in the first byte; `c2(...)` compound:
a field specification of at most 2 bytes, then these parts.
"""

import asterix.generated as gen

CATEGORIES = (1, 2, 21, 34, 48, 62, 65)


def variation(rule):
    return rule.cv_default_variation if hasattr(rule, "cv_default_variation") else rule.cv_variation


def kind(v):
    return v.__mro__[1].__name__


def octets(bits):
    assert bits % 8 == 0, bits
    return bits // 8


def shape(v):
    """Return how long a variation is, in the notation above."""
    match kind(v):
        case "Element" | "Group":
            return str(octets(v.cv_bit_size))
        case "Extended":
            groups = [sum(1 if i is None else i[1] for i in group) for group in v.cv_items_list]
            return "x" + ",".join(str(octets(g)) for g in groups) + ("" if v.cv_items_list[-1][-1] is None else ".")
        case "Repetitive" if v.cv_rep_bytes is None:
            return f"f{octets(v.cv_variation.cv_bit_size + 1)}"
        case "Repetitive":
            return f"r{v.cv_rep_bytes}*{octets(v.cv_variation.cv_bit_size)}"
        case "Explicit":
            return "e"
        case "Compound":
            parts = " ".join("-" if i is None else item(i) for i in v.cv_items_list)
            return f"c{v.cv_fspec_max_bytes}({parts})"
    raise ValueError(kind(v))


def item(non_spare):
    return f"{non_spare.cv_name}:{shape(variation(non_spare.cv_rule))}"


def place(i):
    match kind(i):
        case "UapItem":
            return item(i.cv_non_spare)
        case "UapItemSpare":
            return "-"
        case "UapItemRFS":
            return "RFS"
    raise ValueError(kind(i))


def table():
    for category in CATEGORIES:
        for spec in gen.manifest["CATS"][category]:
            uap = spec.cv_uap
            lists = uap.cv_uaps if kind(uap) == "UapMultiple" else {"-": uap.cv_record}
            for name, record in lists.items():
                edition = ".".join(map(str, spec.cv_edition))
                yield " ".join([
                    str(category), edition, name, str(record.cv_fspec_max_bytes), *map(place, record.cv_items_list)
                ])  # fmt: skip


if __name__ == "__main__":
    print("\n".join(table()))
