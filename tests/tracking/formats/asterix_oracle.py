"""Random ASTERIX records that libasterix encodes and decodes: the oracle of our reader."""

import random

import asterix.generated as generated
from asterix.base import Bits

SPECS = {
    (category, ".".join(map(str, spec.cv_edition))): spec
    for category in (1, 2, 21, 34, 48, 62, 65)
    for spec in generated.manifest["CATS"][category]
}


def _kind(v):
    return v.__mro__[1].__name__


def _variation(rule):
    return getattr(rule, "cv_default_variation", None) or rule.cv_variation


def _value(rng, v):
    """Return a random argument for a variation's ``create``."""
    match _kind(v):
        case "Element" | "Group":
            return rng.getrandbits(v.cv_bit_size)
        case "Extended":
            groups = v.cv_items_list[: rng.randint(1, len(v.cv_items_list))]
            return tuple(rng.getrandbits(sum(i[1] for i in group if i)) for group in groups)
        case "Repetitive":
            return [_value(rng, v.cv_variation) for _ in range(rng.randint(v.cv_rep_bytes is None, 3))]
        case "Explicit":
            return rng.randbytes(rng.randint(0, 5))
    names = [i for i in v.cv_items_list if i is not None and rng.random() < 0.4]
    return {i.cv_name: _value(rng, _variation(i.cv_rule)) for i in names}


def lists(spec):
    """Return name -> record class."""
    return getattr(spec.cv_uap, "cv_uaps", None) or {"-": spec.cv_record}


def random_record(rng, category, edition, share=0.5, fixed=None):
    """Return (name of the list, libasterix's record) with random items of random content, I010 always."""
    spec = SPECS[category, edition]
    name = rng.choice(list(lists(spec)))
    record = lists(spec)[name]
    items = {"010": rng.getrandbits(16)}
    for item, non_spare in record.cv_items_dict.items():
        if item != "010" and rng.random() < share:
            items[item] = _value(rng, _variation(non_spare.cv_rule))
    if name in ("plot", "track"):
        items["020"] = (rng.getrandbits(6) | (name == "track") << 6,)
    return name, record.create(items | (fixed or {}))


def block(category, records):
    """Return the bytes of a block of records (or their bytes)."""
    body = b"".join(r if isinstance(r, bytes) else r.unparse().to_bytes() for r in records)
    return bytes([category]) + (len(body) + 3).to_bytes(2, "big") + body


def decode(category, edition, body):
    """Return libasterix's records of the body of a block, None where it refuses them; category 1 by its I020."""
    spec, out, rest = SPECS[category, edition], [], Bits.from_bytes(body)
    known = lists(spec)
    while len(rest):
        found = None
        for name, record in known.items():
            try:
                result = record._parse(generated.ParsingMode.StrictParsing, rest)
            except TypeError:  # libasterix 0.36.3, where a bit is set beyond the last item it knows
                continue
            if isinstance(result, ValueError):
                continue
            if name == "-" or ("020" in result[0].items_regular and _track(result[0]) == (name == "track")):
                found = result
        if found is None:
            return None
        out.append(found[0])
        rest = found[1]
    return out


def _track(record):
    return bool(record.items_regular["020"].unparse().to_bytes()[0] & 0x80)


def items(record):
    """Return item -> bytes, in order."""
    return {name: item.unparse().to_bytes() for name, item in record.items_regular.items()}


def quantity(record, *path):
    """Return the physical value of an item, part by part; None where it is absent."""
    item = record.items_regular.get(path[0])
    for part in path[1:]:
        if item is None:
            return None
        item = item.variation.get_item(part)
    return None if item is None else item.variation.content._as_quantity()


def generator(seed):
    return random.Random(seed)
