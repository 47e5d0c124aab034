"""Numbers in tables: every one reads back to the same bits, whatever stands beside it."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from multibody_sym.text.tables import Table, csv_lines, growing_csv, read_table, write_table


def _doubles(count: int) -> np.ndarray:
    """Return doubles of all sizes: random bits, with those at the ends and those that are no numbers."""
    bits = np.random.default_rng(5).integers(0, 2**64, count, dtype=np.uint64)
    special = [0.0, -0.0, 5e-324, 2.2250738585072014e-308, 1.7976931348623157e308, np.inf, -np.inf, np.nan, 1.0, 1e16]
    return np.concatenate([special, bits.view(np.float64), np.arange(-200.0, 200.0) / 8])


def _bits(values: np.ndarray) -> list[bytes]:
    return [struct.pack("<d", x) if x == x else b"nan" for x in values.tolist()]


def test_every_number_reads_back_to_the_same_bits_and_none_has_more_digits_than_repr():
    values = _doubles(200_000)
    written = b"".join(csv_lines(values.reshape(-1, 1))).decode().split()
    assert _bits(np.array(list(map(float, written)))) == _bits(values)
    digits = [sum(c.isdigit() for c in text.split("e")[0].strip("-0.").replace(".", "")) for text in written]
    shortest = [sum(c.isdigit() for c in repr(x).split("e")[0].strip("-0.").replace(".", "")) for x in values.tolist()]
    assert digits == shortest


@pytest.mark.parametrize("shape", [(0, 3), (1, 1), (70_000, 3), (3, 70_000)])
def test_lines_are_rows_however_many(shape):
    rows = np.random.default_rng(1).normal(size=shape)
    rows[::7, ::5] = np.nan
    text = b"".join(csv_lines(rows)).decode()
    assert text.count("\n") == len(rows)
    found = np.array([list(map(float, line.split(","))) for line in text.splitlines()]).reshape(shape)
    assert np.array_equal(found, rows, equal_nan=True)


def test_a_table_that_grows_has_the_bytes_of_one_that_is_written_at_once(tmp_path):
    values = _doubles(30_000)
    table = Table({"t": np.arange(float(len(values))), "=x": values})
    write_table(table, tmp_path / "whole.csv")
    with growing_csv(tmp_path / "grown.csv", ["t", "=x"]) as grow:
        for part in np.array_split(np.vstack([*table.blocks()]), 13):
            grow(part)
    assert (tmp_path / "grown.csv").read_bytes() == (tmp_path / "whole.csv").read_bytes()
    found = read_table(tmp_path / "whole.csv")
    assert list(found.columns) == ["t", "=x"]
    assert _bits(found.columns["=x"]) == _bits(values)
