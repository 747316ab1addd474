"""Products of small float32 matrices on a CPU, called from other kernels without any overhead.

A library call costs as much as the product itself when matrices are 64 wide, and the libraries that come with
torch and NumPy leave half of an AVX-512 machine idle. Matrices are blocks of flat arrays, given by offset and
strides. The inner tile is written as vectors for LLVM, which compiles them to the vector instructions of the machine.
"""

from typing import Any

import llvmlite.binding
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from pbcs_ompl.core.compiled import njit

WIDE = bool(llvmlite.binding.get_host_cpu_features().get("avx512f", False))
LANES = 16 if WIDE else 8
ROWS = 6
"""Rows of a tile: 6 times 2 vectors fill the registers of AVX2, and keep the multipliers of AVX-512 busy."""
EDGE = 8
"""Edge of the blocks of a transposition."""

Flat = types.Array(types.float32, 1, "C")
_int = types.int64
_INDEX, _FLOAT = ir.IntType(64), ir.FloatType()


class _Matrix:
    """Addresses of the elements of one flat array, in LLVM's types."""

    def __init__(self, context: Any, builder: Any, array: Any, start: Any):
        self._builder = builder
        data = cgutils.create_struct_proxy(Flat)(context, builder, array).data
        self._base = builder.gep(data, [start])

    def at(self, offset: Any) -> Any:
        return self._builder.gep(self._base, [offset])

    def vector(self, offset: Any, lanes: int) -> Any:
        return self._builder.bitcast(self.at(offset), ir.VectorType(_FLOAT, lanes).as_pointer())


def _make_tile(rows: int, vectors: int) -> Any:
    """Build a kernel for C[rows, vectors * LANES] = A B, with all sums in registers."""

    def emit(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
        a, a0, a_row, a_column, b, b0, b_row, c, c0, c_row, depth = arguments
        left, right, out = (_Matrix(context, builder, *pair) for pair in ((a, a0), (b, b0), (c, c0)))
        kind = ir.VectorType(_FLOAT, LANES)
        everywhere = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
        fma = cgutils.get_or_insert_function(builder.module, ir.FunctionType(kind, [kind] * 3),
                                             f"llvm.fma.v{LANES}f32")
        sums = [[cgutils.alloca_once_value(builder, ir.Constant(kind, [0.0] * LANES)) for _ in range(vectors)]
                for _ in range(rows)]
        for row in sums:
            for slot in row:
                builder.store(ir.Constant(kind, [0.0] * LANES), slot)
        with cgutils.for_range(builder, depth) as loop:
            line = builder.mul(loop.index, b_row)
            values = [builder.load(right.vector(builder.add(line, _INDEX(v * LANES)), LANES), align=4)
                      for v in range(vectors)]
            for r in range(rows):
                place = builder.add(builder.mul(_INDEX(r), a_row), builder.mul(loop.index, a_column))
                one = builder.insert_element(ir.Constant(kind, ir.Undefined), builder.load(left.at(place)),
                                             ir.IntType(32)(0))
                factor = builder.shuffle_vector(one, ir.Constant(kind, ir.Undefined), everywhere)
                for v in range(vectors):
                    total = builder.call(fma, [factor, values[v], builder.load(sums[r][v])])
                    builder.store(total, sums[r][v])
        for r in range(rows):
            for v in range(vectors):
                place = builder.add(builder.mul(_INDEX(r), c_row), _INDEX(v * LANES))
                builder.store(builder.load(sums[r][v]), out.vector(place, LANES), align=4)
        return context.get_dummy_value()

    index = types.int64
    signature = types.void(Flat, index, index, index, Flat, index, index, Flat, index, index, index)

    @intrinsic
    def tile(typing: Any, a: Any, a0: Any, a_row: Any, a_column: Any, b: Any, b0: Any, b_row: Any, c: Any,
             c0: Any, c_row: Any, depth: Any) -> Any:
        return signature, emit

    return tile


_tile_2 = _make_tile(ROWS, 2)
_tile_1 = _make_tile(ROWS, 1)
_line_1 = _make_tile(1, 1)


@intrinsic
def _transpose_block(typing: Any, a: Any, a0: Any, a_row: Any, b: Any, b0: Any, b_row: Any) -> Any:
    """B = A^T for one block of EDGE x EDGE, by exchanging halves of pairs of rows in log2(EDGE) rounds."""
    signature = types.void(Flat, types.int64, types.int64, Flat, types.int64, types.int64)

    def emit(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
        a, a0, a_row, b, b0, b_row = arguments
        source, target = _Matrix(context, builder, a, a0), _Matrix(context, builder, b, b0)
        picks = ir.VectorType(ir.IntType(32), EDGE)
        places = [source.vector(builder.mul(_INDEX(r), a_row), EDGE) for r in range(EDGE)]
        rows = [builder.load(place, align=4) for place in places]
        half = 1
        while half < EDGE:
            upper = [lane if not lane & half else EDGE + lane - half for lane in range(EDGE)]
            lower = [lane + half if not lane & half else EDGE + lane for lane in range(EDGE)]
            for r in range(EDGE):
                if not r & half:
                    pair = rows[r], rows[r + half]
                    rows[r] = builder.shuffle_vector(*pair, ir.Constant(picks, upper))
                    rows[r + half] = builder.shuffle_vector(*pair, ir.Constant(picks, lower))
            half *= 2
        for r in range(EDGE):
            builder.store(rows[r], target.vector(builder.mul(_INDEX(r), b_row), EDGE), align=4)
        return context.get_dummy_value()

    return signature, emit


@njit(types.void(Flat, _int, Flat, _int, _int, _int))
def transpose(a: np.ndarray, a0: int, b: np.ndarray, b0: int, rows: int, columns: int) -> None:
    """B [columns, rows] = A^T for A [rows, columns], both contiguous. The last blocks overlap others."""
    if rows < EDGE or columns < EDGE:
        for i in range(rows):
            for j in range(columns):
                b[b0 + j * rows + i] = a[a0 + i * columns + j]
        return
    for i in range(0, rows, EDGE):
        i = min(i, rows - EDGE)
        for j in range(0, columns, EDGE):
            j = min(j, columns - EDGE)
            _transpose_block(a, a0 + i * columns + j, columns, b, b0 + j * rows + i, rows)


@njit(types.void(Flat, _int, _int, _int, Flat, _int, Flat, _int, _int, _int, _int))
def _wide_product(a: np.ndarray, a0: int, a_row: int, a_column: int, b: np.ndarray, b0: int, c: np.ndarray,
                  c0: int, m: int, n: int, k: int) -> None:
    if m < ROWS:
        for i in range(m):
            for j in range(0, n, LANES):
                j = min(j, n - LANES)
                _line_1(a, a0 + i * a_row, a_row, a_column, b, b0 + j, n, c, c0 + i * n + j, n, k)
        return
    double = n // (2 * LANES) * 2 * LANES
    for i in range(0, m, ROWS):
        i = min(i, m - ROWS)
        left, out = a0 + i * a_row, c0 + i * n
        for j in range(0, double, 2 * LANES):
            _tile_2(a, left, a_row, a_column, b, b0 + j, n, c, out + j, n, k)
        for j in range(double, n, LANES):
            j = min(j, n - LANES)
            _tile_1(a, left, a_row, a_column, b, b0 + j, n, c, out + j, n, k)


@njit(types.void(Flat, _int, _int, _int, Flat, _int, Flat, _int, types.UniTuple(_int, 3)))
def product(a: np.ndarray, a0: int, a_row: int, a_column: int, b: np.ndarray, b0: int, c: np.ndarray, c0: int,
            shape: tuple[int, int, int]) -> None:
    """C [m, n] = A B for shape (m, n, k); A has any strides, B [k, n] and C are contiguous.

    Tiles at the right and lower edge overlap their neighbours and write the same values again. A result that
    is narrower than a vector is computed with columns of zeros beside it.
    """
    m, n, k = shape
    if n >= LANES:
        _wide_product(a, a0, a_row, a_column, b, b0, c, c0, m, n, k)
        return
    padded, wide = np.zeros(k * LANES, dtype=np.float32), np.empty(m * LANES, dtype=np.float32)
    for i in range(k):
        for j in range(n):
            padded[i * LANES + j] = b[b0 + i * n + j]
    _wide_product(a, a0, a_row, a_column, padded, 0, wide, 0, m, LANES, k)
    for i in range(m):
        for j in range(n):
            c[c0 + i * n + j] = wide[i * LANES + j]
