"""Every loop that the configurations of `scripts/fingerprint.py` run: what it is given, and what plain Python makes.

python recorded.py FOLDER        # writes NAME.c, NAME.given and NAME.made; checked C, called by `MAIN`
"""

import os
import sys
from pathlib import Path

import numpy as np

MAIN = """
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
long long driftwise_run(void *const *, const long long *);
static long long word(FILE *file)
{
    long long found;
    if (fread(&found, 8, 1, file) != 1)
        exit(3);
    return found;
}
int main(int count, char **names)
{
    FILE *given = fopen(names[count - 2], "rb"), *made = fopen(names[count - 1], "wb");
    for (long long calls = word(given); calls > 0; calls--) {
        void *places[32];
        long long sizes[32], numbers[64], arrays = word(given), many = word(given);
        for (long long i = 0; i < many; i++)
            numbers[i] = word(given);
        for (long long i = 0; i < arrays; i++) {
            sizes[i] = word(given);
            places[i] = malloc((size_t)(8 * sizes[i])); /* no larger, so that whatever reads beyond it is seen */
            if (fread(places[i], 8, (size_t)sizes[i], given) != (size_t)sizes[i])
                return 3;
        }
        driftwise_run(places, numbers);
        for (long long i = 0; i < arrays; i++) {
            fwrite(places[i], 8, (size_t)sizes[i], made);
            free(places[i]);
        }
    }
    fclose(made);
    fclose(given);
    return 0;
}
"""
CALLS = 3  # of each loop


def packed(args, dimensions) -> bytes:
    """Return arguments as `MAIN` reads them."""
    numbers, arrays = [], []
    for one, kind in zip(args, dimensions):
        numbers += [int(one)] if kind is int else [] if kind is float else list(np.shape(one))
        arrays.append(np.zeros(0) if kind is int else np.ravel(one))
    words = [np.array([len(arrays), len(numbers), *numbers])]
    for array in arrays:
        words += [np.array([array.size]), array.view(np.int64) if array.dtype == float else array]
    return b"".join(word.astype(np.int64).tobytes() for word in words)


def made(args, dimensions) -> bytes:
    """Return what arrays hold, as `MAIN` writes it."""
    return b"".join(np.ravel(one).tobytes() for one, kind in zip(args, dimensions) if kind is not int)


def record(folder: Path) -> None:
    """Run all configurations as plain Python; keep the first calls of each loop."""
    from driftwise.engine import compile

    known = {}

    def load(make, sizes, kinds, dimensions, loop=None):
        key = make, sizes, dimensions, loop
        run = compile._quiet(loop or make(*sizes, 0))
        calls = known.setdefault(key, [])

        def note(*args):
            args = [np.array([one], float) if kind is float else one for one, kind in zip(args, dimensions)]
            given = packed(args, dimensions)
            result = run(*(one[0] if kind is float else one for one, kind in zip(args, dimensions)))
            if len(calls) < CALLS:
                calls.append((given, made(args, dimensions)))
            return result

        return note

    compile._load = load
    import fingerprint

    for name in fingerprint.NUMBERS:
        fingerprint.take(name)
    used = {key: calls for key, calls in known.items() if calls}
    for i, ((make, sizes, dimensions, loop), calls) in enumerate(used.items()):
        name = f"{(loop or make).__name__.removeprefix('make_')}_{i}"
        text = compile.translated(loop or make(*sizes, 0), dimensions, checked=True)
        (folder / f"{name}.c").write_text(text + MAIN)
        (folder / f"{name}.given").write_bytes(np.int64(len(calls)).tobytes() + b"".join(given for given, _ in calls))
        (folder / f"{name}.made").write_bytes(b"".join(after for _, after in calls))


if __name__ == "__main__":
    os.environ["DRIFTWISE_ENGINE"] = "python"
    sys.path.insert(0, str(Path(__file__).parents[3] / "scripts"))
    record(Path(sys.argv[1]))
