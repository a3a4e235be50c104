"""test_NAME.c: recorded samples, and the bits that must come out; prints OK, or the first difference."""

from __future__ import annotations

from typing import Any

from .record import words

TEST = """\
/* Recorded samples, and the bits that driftwise says after each. Prints OK, or the first difference.
 *
 *   cc -std=c99 -O2 test_{name}.c {name}.c -lm && ./a.out
 */
#include "{name}.h"

#include <stdio.h>
#include <string.h>

#define SAMPLES {samples}
#define GIVEN {given}
#define COLUMNS {columns}

static const {word} given[SAMPLES][GIVEN] = {{
{sample_words}
}};

static const {word} expected[SAMPLES][COLUMNS] = {{
{expected_words}
}};

static struct {name}_state state;

int main(void)
{{
    int t, i;
    {name}_init(&state);
    for (t = 0; t < SAMPLES; t++) {{
        {number} s[GIVEN];
        memcpy(s, given[t], sizeof s);
        (void){name}_update(&state, {arguments});
        for (i = 0; i < COLUMNS; i++) {{
            {number} wanted;
            memcpy(&wanted, &expected[t][i], sizeof wanted);
            if (memcmp(&wanted, &state.out[i], sizeof wanted) != 0 &&
                !(wanted != wanted && state.out[i] != state.out[i])) {{
                printf("sample %d, number %d: %.17g, expected %.17g\\n", t, i, (double)state.out[i], (double)wanted);
                return 1;
            }}
        }}
    }}
    printf("OK\\n");
    return 0;
}}
"""


def test(source: Any, samples, expected) -> str:
    """Return the test of an exported estimator."""
    p, k, many = source.outputs, source.inputs, samples.shape[1]
    arguments = ["&s[0]" if source.est.outputs else "s[0]"] + [f"&s[{p}]" if k > 1 else f"s[{p}]"] * (k > 0)
    arguments += [f"s[{i}]" for i in range(p + k, many)]
    suffix = "UL" if source.is_single else "ULL"
    digits = 8 if source.is_single else 16

    def table(numbers) -> str:
        many = (words(row, source.is_single) for row in numbers)
        rows = (", ".join(f"0x{word:0{digits}x}{suffix}" for word in row) for row in many)
        return ",\n".join(f"    {{{row}}}" for row in rows)

    return TEST.format(
        name=source.name, samples=len(samples), given=many, columns=expected.shape[1], number=source.number,
        word="uint32_t" if source.is_single else "uint64_t", arguments=", ".join(arguments),
        sample_words=table(samples), expected_words=table(expected),
    )  # fmt: skip
