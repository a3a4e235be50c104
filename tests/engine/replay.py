"""Loops with what they were given, to be run again elsewhere: ``replay.py FOLDER`` writes NAME.c, .given and .made."""

import os
import sys
from pathlib import Path

import numpy as np

MAIN = r"""
#include <stdio.h>
#include <stdlib.h>
static I word(FILE *file)
{
    I found;
    if (fread(&found, 8, 1, file) != 1)
        exit(3);
    return found;
}
int main(int count, char **names)
{
    FILE *given = fopen(names[1], "rb"), *made = fopen(names[2], "wb");
    I calls, i;
    if (count != 3 || !given || !made)
        return 4;
    for (calls = word(given); calls > 0; calls--) {
        void *places[16];
        I sizes[16], numbers[64], arrays = word(given), many = word(given);
        for (i = 0; i < many; i++)
            numbers[i] = word(given);
        for (i = 0; i < arrays; i++) {
            sizes[i] = word(given);
            places[i] = malloc(8 * (size_t)sizes[i] + 8);
            if (fread(places[i], 8, (size_t)sizes[i], given) != (size_t)sizes[i])
                return 3;
        }
        driftwise_run(places, numbers);
        for (i = 0; i < arrays; i++)
            fwrite(places[i], 8, (size_t)sizes[i], made);
    }
    return fclose(made);
}
"""


def packed(args, dimensions) -> bytes:
    """Return arguments as the program reads them: arrays, what they and the integers tell, then every array."""
    numbers: list[int] = []
    for one, kind in zip(args, dimensions):
        numbers += [one] if kind is int else [] if kind is float else list(np.shape(one))
    words = [len(args), len(numbers), *numbers]
    return np.array(words, np.int64).tobytes() + b"".join(
        np.int64(array.size).tobytes() + array.tobytes() for array in arrays(args, dimensions)
    )


def arrays(args, dimensions) -> list[np.ndarray]:
    """Return what a loop may read and write; an integer has no place in memory."""
    return [np.zeros(0) if kind is int else np.atleast_1d(one) for one, kind in zip(args, dimensions)]


def record(folder: Path, most: int = 3) -> None:
    """Run estimators with compiled loops; keep of each loop its C, and what its first calls were given and made."""
    from driftwise.engine import objects

    load = objects.load

    def noted(key, text, dimensions, *more):
        run = load(key, text, dimensions, *more)
        place = folder / f"{key.rsplit('-', 1)[0]}_{len(list(folder.glob('*.c')))}"
        place.with_suffix(".c").write_text(text() + MAIN)
        given, made = [], []

        def note(*args):
            before = packed(args, dimensions)
            result = run(*args)
            if len(given) < most:
                given.append(before)
                made.extend(array.tobytes() for array in arrays(args, dimensions))
                place.with_suffix(".given").write_bytes(np.int64(len(given)).tobytes() + b"".join(given))
                place.with_suffix(".made").write_bytes(b"".join(made))
            return result

        return note

    objects.load = noted
    use()


def use() -> None:
    """Run what people run, over gaps, outliers and a change."""
    import driftwise as dw

    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=600, noise_std=0.3, missing=0.1, seed=1)
    y[300:] += 2.0 * u[300:]
    y[100] += 50.0
    for memory in (dw.Constant(), dw.RandomWalk(1e-5), dw.RestartOnChange(), dw.AutoMemory()):
        dw.ARX(2, 2, memory=memory).scan(y, u)
    dw.Joint(2, inputs=1, memory=dw.RestartOnChange()).scan(y, u)
    dw.Joint(2, inputs=1).smooth(y[:100], u[:100])
    dw.ARMAX(1, 1, 1).scan(y, u)
    dw.JointMIMO((1, 1)).scan(np.column_stack([y, np.roll(y, 1)]))
    dw.ContinuousJoint(2).scan(y)
    dw.TrackEstimator("aircraft").scan(4.0 * np.arange(300), np.cumsum(np.nan_to_num(y[:600]).reshape(300, 2), axis=0))
    fleet = dw.Fleet(dw.ARX(2, 2))
    fleet.scan(np.arange(600) % 7, y, u)


if __name__ == "__main__":
    os.environ["DRIFTWISE_ENGINE"] = "c"
    record(Path(sys.argv[1]))
