"""The hand-written product and transposition equal NumPy's, for every shape at the edges of the tiles."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pbcs_ompl.agents.kernels.matrix import product, transpose

SIDE = st.integers(1, 70)


@given(m=SIDE, n=SIDE, k=SIDE, turned=st.booleans(), seed=st.integers(0, 2**16))
@settings(max_examples=150, deadline=None)
def test_product_equals_numpy_and_writes_nothing_else(m: int, n: int, k: int, turned: bool,
                                                      seed: int) -> None:
    rng = np.random.default_rng(seed)
    left = rng.standard_normal((m, k), dtype=np.float32)
    right = rng.standard_normal((k, n), dtype=np.float32)
    a = np.concatenate([np.full(3, np.nan, np.float32), (left.T if turned else left).ravel()])
    b = np.concatenate([np.full(5, np.nan, np.float32), right.ravel()])
    out = np.full(m * n + 9, 7.0, np.float32)
    strides = (1, m) if turned else (k, 1)
    product(a, 3, *strides, b, 5, out, 4, (m, n, k))
    np.testing.assert_allclose(out[4 : 4 + m * n].reshape(m, n), left @ right, rtol=1e-4, atol=1e-4)
    assert (np.r_[out[:4], out[4 + m * n :]] == 7.0).all()


@given(rows=SIDE, columns=SIDE)
@settings(max_examples=100, deadline=None)
def test_transpose_equals_numpy_and_writes_nothing_else(rows: int, columns: int) -> None:
    a = np.arange(rows * columns + 2, dtype=np.float32)
    out = np.full(rows * columns + 5, -1.0, np.float32)
    transpose(a, 2, out, 3, rows, columns)
    assert (out[3:-2].reshape(columns, rows) == a[2:].reshape(rows, columns).T).all()
    assert (np.r_[out[:3], out[-2:]] == -1.0).all()


@pytest.mark.parametrize("shape", [(100, 64, 64), (64, 1, 100), (4, 64, 100), (100, 300, 400)])
def test_a_nan_is_never_lost(shape: tuple[int, int, int]) -> None:
    m, n, k = shape
    a, b, out = np.ones(m * k, np.float32), np.ones(k * n, np.float32), np.empty(m * n, np.float32)
    a[k * (m - 1)] = np.nan
    product(a, 0, k, 1, b, 0, out, 0, shape)
    assert np.isnan(out.reshape(m, n)[-1]).all()
    assert np.isfinite(out.reshape(m, n)[:-1]).all()
