"""What a hostile day tries: a little of it at every change, all of it in the slow part; see README.md."""

import os
import shutil

import numpy as np
import pytest

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="a command is tried in a forked process")
SEED = 0xD81F7


def _refuse(tried) -> None:
    """Fail with all that broke a promise."""
    found = [
        f"{kind} {number} ({case.told}): driftwise {' '.join(case.args)[:300]}\n    {'; '.join(wrong)[:600]}"
        for kind, number, case, wrong, _ in tried
        if wrong
    ]
    assert not found, "\n".join(found)


@pytest.mark.parametrize("count", [16, pytest.param(150, marks=pytest.mark.slow)])
def test_drawn_files_and_options_are_answered(count):
    from hostile import day

    _refuse(day.files(SEED, range(count)))


@pytest.mark.parametrize("count", [10, pytest.param(60, marks=pytest.mark.slow)])
def test_whatever_happens_to_a_command_its_files_stay_whole(count):
    from hostile import day

    _refuse(day.troubles(SEED, range(count)))


@pytest.mark.slow
def test_a_disk_that_is_full_leaves_what_was_there():
    from hostile import day, troubles

    day.load()
    for size in (100_000, 300_000):
        with troubles.small_disk(size) as disk:
            if disk is None:
                pytest.skip("no disk may be made here: A FULL DISK WAS NOT TRIED (a limit on files is)")
            for number in range(6):
                case = troubles.a_command(np.random.default_rng([SEED, number]), 100)
                case.folder = disk
                wrong, _ = day.try_case(case)
                assert not wrong


@pytest.mark.slow
def test_a_damaged_cache_is_made_again(tmp_path):
    from hostile import day, tables, troubles
    from hostile.cases import Case

    day.load()
    rng, cache = np.random.default_rng(SEED), tmp_path / "cache"
    case = Case(
        {"t.csv": tables.plain(rng, 40).to_bytes()}, ["run", "t.csv", "-o", "y", "-i", "u", "--json", "-"], "run"
    )
    case.seconds, case.codes = 120.0, {0}
    case.options = {"prepare": lambda: os.environ.update(DRIFTWISE_CACHE=str(cache))}
    wrong, first = day.try_case(case)
    assert not wrong and any(cache.iterdir())
    for _ in range(4):
        how = troubles.spoil(cache, rng)
        wrong, again = day.try_case(case)
        assert not [line for line in wrong if "RuntimeWarning" not in line], how
        assert again.out == first.out, how
    shutil.rmtree(cache, ignore_errors=True)
