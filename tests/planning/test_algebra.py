"""Elimination, roots and sizes: against NumPy's linear algebra, its roots of polynomials, and mpmath."""

from __future__ import annotations

import math
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest

from movimentum.expressions import ONE, ZERO, add, call, const, div, mul, neg, sub, symbol
from movimentum.planning.blocks.reduction import (
    back_substitute,
    branch_sign_symbol,
    divisors_of,
    eliminate_linear,
    line_and_conic,
    line_conic_roots,
    quadratic_roots,
    size_in_rounding,
    size_of_terms,
)
from movimentum.planning.codegen.elimination import newton_steps, pivot_order
from movimentum.planning.lowering.equations import Equation, System
from movimentum.planning.lowering.polynomial import to_expression
from movimentum.planning.lowering.unknowns import PoseCos, PoseX
from movimentum.planning.structure.linear_rows import code_of, reduced_rows, sparse_rows
from movimentum.planning.structure.turns import turns_in, without_repetitions
from movimentum.records import replace
from tests.planning.exact import form_value, valued

SCALES = (1e-3, 1.0, 1e6)


def system_of(payloads, equations=()):
    unknowns = tuple(SimpleNamespace(payload=payload, number=k) for k, payload in enumerate(payloads))
    return System(None, None, unknowns, tuple(equations), (), (), {}, {})  # type: ignore[arg-type]


def equation(number, form, **more):
    unknowns = frozenset(n for m in form for n in m)
    return Equation(number, to_expression(form), unknowns, tuple(sorted(unknowns)), polynomial=form, **more)


# --- unrolled elimination


@pytest.mark.parametrize("seed", range(6))
def test_newtons_steps_are_those_of_numpy(seed):
    """Sparse matrices, some with pivots that are zero or tiny, in any order of rows and columns."""
    random = np.random.default_rng(seed)
    size = int(random.integers(2, 8))
    while True:
        shape = (random.random((size, size)) < 0.45) | np.eye(size, dtype=bool)[random.permutation(size)]
        matrix = np.where(shape, random.normal(size=(size, size)) * 10.0 ** random.integers(-3, 3, size=(size, 1)), 0.0)
        if np.linalg.matrix_rank(matrix) == size and np.linalg.cond(matrix) < 1e8:
            break
    samples = np.stack([matrix * random.uniform(0.9, 1.1, matrix.shape) for _ in range(3)])
    present = [(int(i), int(j)) for i, j in np.argwhere(shape)]
    order = pivot_order(samples, present)
    assert sorted(i for i, _ in order) == sorted(j for _, j in order) == list(range(size))
    right = random.normal(size=size)
    entries = {(i, j): symbol(i * size + j) for i, j in present}
    steps = newton_steps(size, entries, [symbol(size * size + i) for i in range(size)], order)
    for sample in samples:
        values = {i * size + j: sample[i, j] for i, j in present} | {size * size + i: right[i] for i in range(size)}
        truth = np.linalg.solve(sample, right)
        found = np.array([valued(step, values) for step in steps])
        assert found == pytest.approx(truth, rel=1e-7, abs=1e-9 * float(np.abs(truth).max()))


def test_pivots_are_never_small_and_fill_is_least():
    # an entry that is tiny at one of the samples must wait
    samples = np.array([[[1e-6, 1.0], [1.0, 1.0]], [[1.0, 1.0], [1.0, 1.0 + 1e-3]]])
    assert pivot_order(samples, [(0, 0), (0, 1), (1, 0), (1, 1)])[0] != (0, 0)
    # an arrow: the diagonal first, its tip last, so that nothing fills in (Duff, Erisman & Reid)
    size = 6
    arrow = np.eye(size) * 4.0
    arrow[0], arrow[:, 0] = 1.0, 1.0
    present = [(int(i), int(j)) for i, j in np.argwhere(arrow)]
    order = pivot_order(arrow[None], present)
    assert {i for i, _ in order[: size - 2]} <= set(range(1, size))
    assert 0 in order[-1] or 0 in order[-2]
    # singular by its structure
    assert pivot_order(np.array([[[1.0, 1.0], [0.0, 0.0]]]), [(0, 0), (0, 1)]) == []


# --- what is linear


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("seed", range(4))
def test_what_is_eliminated_satisfies_its_rows(seed, scale):
    random = np.random.default_rng(seed)
    count, rows = 6, 4  # unknowns 0..5; inputs 6 and 7
    payloads = [PoseCos(0) if n % 2 else PoseX(0) for n in range(count)]
    forms = []
    for _ in range(rows):
        some = random.choice(count, size=3, replace=False)
        form = {(int(n),): const(float(c)) for n, c in zip(some, random.normal(size=3), strict=True)}
        form[()] = add(mul(const(float(random.normal() * scale)), symbol(6)), symbol(7))
        forms.append(form)
    forms.append({(0, 1): ONE, (2, 3): const(2.0), (4,): const(-1.0), (): symbol(6)})
    eliminated, left = eliminate_linear(system_of(payloads), forms, set(range(count)), scale)
    gone = [n for n, _ in eliminated]
    assert (
        len(set(gone))
        == len(gone)
        == np.linalg.matrix_rank(
            np.array([[form[n,].value if (n,) in form else 0.0 for n in range(count)] for form in forms[:rows]])
        )
    )
    assert all(n not in m for _, form in left for m in form for n in gone)
    core = [n for n in range(count) if n not in gone]
    values = {n: scale * random.normal() for n in (*core, 6, 7)}
    explicit = back_substitute(eliminated)
    assert sorted(n for n, _ in explicit) == sorted(gone)
    values |= {n: valued(expr, values) for n, expr in explicit}
    size = max(abs(v) for v in values.values())
    linear = [k for k in range(rows) if k not in {place for place, _ in left}]
    for k in linear:
        assert form_value(forms[k], values) == pytest.approx(0.0, abs=1e-10 * size * max(1.0, scale))
    for place, form in left:  # what is left is what it was
        assert form_value(form, values) == pytest.approx(form_value(forms[place], values), rel=1e-8, abs=1e-9 * size**2)


def test_the_pivot_is_large_by_the_size_of_its_unknown():
    """A place counts by the scene's size, a cosine by 1."""
    for size, first in ((1e6, 0), (1e-6, 1)):
        form = {(0,): const(1.0), (1,): const(10.0), (): symbol(2)}
        ((gone, _),), _ = eliminate_linear(system_of([PoseX(0), PoseCos(0)]), [form], {0, 1}, size)
        assert gone == first


@pytest.mark.parametrize("seed", range(5))
def test_large_blocks_lose_what_is_linear_and_keep_the_rest(seed):
    random = np.random.default_rng(seed)
    count, rows, inputs = 9, 5, (9, 10)
    payloads = [PoseCos(0) if n % 3 else PoseX(0) for n in range(count)]
    equations = []
    for e in range(rows):
        some = random.choice(count, size=int(random.integers(2, 5)), replace=False)
        form = {(int(n),): const(float(c)) for n, c in zip(some, random.normal(size=len(some)), strict=True)}
        form[()] = symbol(9) if e % 2 else const(float(random.normal()))
        equations.append(equation(e, form))
    # one that follows from two others, but for its rest; and two that are not linear
    first, second = (equations[k].polynomial for k in (0, 1))
    total = {m: add(first.get(m, ZERO), second.get(m, ZERO)) for m in {**first, **second}}
    total[()] = symbol(10)
    equations.append(equation(rows, total))
    equations.append(equation(rows + 1, {(0, 1): ONE, (2,): const(3.0)}))
    equations.append(equation(rows + 2, {(3, 3): ONE, (4,): symbol(9), (): const(-1.0)}))
    system = system_of([*payloads, None, None], equations)
    core, linear, residuals, owners = reduced_rows(system, range(len(equations)), range(count), 1.0)
    assert sorted((*core, *linear.targets)) == list(range(count))
    assert len(linear.targets) == np.linalg.matrix_rank(
        np.array(
            [[equations[e].polynomial.get((n,), ZERO).value or 0.0 for n in range(count)] for e in range(rows + 1)]
        )
    )
    values = {n: float(random.normal()) for n in (*core, *inputs)}
    explicit = {n: valued(expr, values) for n, expr in linear.explicit}
    # the compiled code says the same, for one and for many
    u = [np.array([values.get(n, np.nan)] * 3) for n in range(count + 2)]
    coded = code_of(linear, core, [])(u, [])
    for n, slopes, rest, value in zip(linear.targets, linear.slopes, linear.rests, coded, strict=True):
        stated = sum(c * values[core[j]] for j, c in slopes) + valued(rest, values)
        assert explicit[n] == pytest.approx(stated, rel=1e-12, abs=1e-12)
        assert np.array(value) == pytest.approx(np.full(3, explicit[n]), rel=1e-12, abs=1e-12)
        assert (n in linear.driven) == (rest.value is None)
    everything = values | explicit
    for residual, e in zip(residuals, owners, strict=True):
        if e <= rows:  # a row that says nothing of unknowns: what its rest has to be
            assert not set(range(count)) & set(_symbols(residual))
        else:
            assert valued(residual, values) == pytest.approx(form_value(equations[e].polynomial, everything), rel=1e-9)
    spent = {e for e in owners if e <= rows}
    for e in set(range(rows + 1)) - spent:
        assert form_value(equations[e].polynomial, everything) == pytest.approx(0.0, abs=1e-9)


def _symbols(root):
    stack, found = [root], []
    while stack:
        node = stack.pop()
        stack += node.args
        if node.op == "symbol":
            found.append(node.payload)
    return found


@pytest.mark.parametrize("seed", range(4))
def test_sparse_rows_are_the_polynomials_and_their_slopes(seed):
    random = np.random.default_rng(seed)
    core, count = (4, 7, 1, 3), 8
    roots = []
    for _ in range(5):
        total = mul(symbol(5), symbol(core[0])) if random.random() < 0.5 else const(float(random.normal()))
        for _ in range(int(random.integers(1, 5))):
            term = const(float(random.normal()))
            for n in random.choice(core, size=int(random.integers(0, 4))):
                term = mul(term, symbol(int(n)))
            total = add(total, term)
        roots.append(total)
    rows = sparse_rows(roots, core, [])
    assert rows is not None
    values = {n: float(random.normal()) for n in range(count)}
    constants = rows.constants.copy()
    if rows.coefficients is not None:
        u = [np.array([values[n]]) for n in range(count)]
        constants[rows.varying] = [float(np.ravel(c)[0]) for c in rows.coefficients(u, [])]
    x = np.append([values[n] for n in core], 1.0)
    products = constants * np.prod(x[rows.factors], axis=1)
    found = np.bincount(rows.row, products, minlength=rows.rows)
    assert found == pytest.approx([valued(root, values) for root in roots], rel=1e-12, abs=1e-12)
    # the Jacobian, laid out as compressed rows, by the product rule
    data = np.zeros(len(rows.indices) + 1)
    for t in range(len(rows.row)):
        for d in range(rows.factors.shape[1]):
            others = np.delete(rows.factors[t], d)
            data[rows.slots[t, d]] += constants[t] * np.prod(x[others])
    jacobian = np.zeros((rows.rows, len(core)))
    for i in range(rows.rows):
        for k in range(rows.indptr[i], rows.indptr[i + 1]):
            jacobian[i, rows.indices[k]] = data[k]
    for j, n in enumerate(core):
        for i, root in enumerate(roots):
            ahead, back = (valued(root, values | {n: values[n] + h}) for h in (1e-5, -1e-5))
            assert jacobian[i, j] == pytest.approx((ahead - back) / 2e-5, rel=1e-6, abs=1e-7)
    assert sparse_rows([call("sqrt", symbol(1))], core, []) is None


# --- turns


@pytest.mark.parametrize("seed", range(6))
def test_as_many_turns_are_determined_as_the_rank_says(seed):
    """Rows of gears, of which some follow from others; what is no gear comes first."""
    random = np.random.default_rng(seed)
    count, rows = 6, 9
    matrix = np.zeros((rows, count))
    for i in range(rows):
        if i > 3 and random.random() < 0.5:  # a sum of some before
            matrix[i] = random.integers(-3, 4, size=i) @ matrix[:i] / 7.0
        else:
            matrix[i, random.choice(count, size=2, replace=False)] = random.integers(1, 9, size=2) / 3.0
    equations = [
        equation(
            i, {(n,): const(float(c)) for n, c in enumerate(row) if abs(c) > 1e-12} | {(): const(1.0)}, constraint=i
        )
        for i, row in enumerate(matrix)
    ]
    paired = {int(i) for i in random.choice(rows, size=6, replace=False)}
    active = [SimpleNamespace(number=i, paired=i in paired) for i in range(rows)]

    system = replace(system_of([str(n) for n in range(count)], equations), segment=SimpleNamespace(active=active))
    after = without_repetitions(system)
    order = sorted(range(rows), key=lambda i: (i in paired, i))
    rank, gone = 0, set()
    for k, i in enumerate(order):
        now = int(np.linalg.matrix_rank(matrix[order[: k + 1]], tol=1e-9))
        if now == rank and i in paired and matrix[i].any():
            gone.add(i)
        rank = now
    assert {i for i in range(rows) if not after.equations[i].targets and equations[i].targets} == gone


def test_a_row_of_turns_is_linear_and_of_nothing_that_has_a_place():
    system = system_of(["turn", "turn", "variable", PoseX(0)])
    row = equation(0, {(0,): const(2.0), (1,): const(-3.0), (): symbol(9)})
    assert turns_in(system, row, ()) == {0: 2.0, 1: -3.0}
    assert turns_in(system, row, {1}) == {0: 2.0}
    assert turns_in(system, row, {0, 1}) == {}
    assert turns_in(system, replace(row, targets=()), ()) is None
    assert turns_in(system, replace(row, polynomial=None), ()) is None
    assert turns_in(system, equation(0, {(0, 1): ONE, (): ONE}), ()) is None
    assert turns_in(system, equation(0, {(0,): ONE, (3,): ONE}), ()) is None
    assert turns_in(system, equation(0, {(0,): symbol(7)}), ()) is None


# --- roots


@pytest.mark.parametrize("scale", SCALES)
def test_a_line_meets_a_conic_where_numpys_roots_say(scale):
    random = np.random.default_rng(7)
    for k in range(60):
        l1, l2 = random.normal(size=2)
        l0 = scale * random.normal()
        a, b, c = random.normal(size=3)
        if k % 3 == 0:
            a, b, c = 1.3, 0.0, 1.3  # a circle
        d, e, f = scale * random.normal(), scale * random.normal(), scale**2 * random.normal()
        given = (l1, l2, l0, a, b, c, d, e, f)
        names = [const(0.0) if k == 4 and b == 0.0 else symbol(3 if k == 5 and a == c else k) for k in range(9)]
        roots = line_conic_roots(branch_sign_symbol("s"), names[:3], names[3:])
        values = dict(enumerate(given))
        # by a parameter along the line, from its foot
        n = np.hypot(l1, l2)
        p0, q0, u, v = l0 * l1 / n**2, l0 * l2 / n**2, -l2 / n, l1 / n
        square = [
            a * u * u + b * u * v + c * v * v,
            2 * a * p0 * u + b * (p0 * v + q0 * u) + 2 * c * q0 * v + d * u + e * v,
            a * p0 * p0 + b * p0 * q0 + c * q0 * q0 + d * p0 + e * q0 + f,
        ]
        truth = np.roots(square)
        margin = valued(roots.margin, values)
        real = abs(truth[0].imag) < 1e-12 * scale
        assert (margin >= 0.0) == real
        assert -1.0 <= abs(margin) <= 1.0 or a == c
        if not real:
            continue
        ahead = np.array([[valued(each, values | {"s": sign}) for each in roots.values] for sign in (1.0, -1.0)])
        there = np.array([[p0 + t.real * u, q0 + t.real * v] for t in truth])
        if np.linalg.norm(ahead - there) > np.linalg.norm(ahead - there[::-1]):
            there = there[::-1]
        size = max(scale, float(np.abs(there).max()))
        assert ahead == pytest.approx(there, rel=1e-7, abs=1e-8 * size)
        for p, q in ahead:
            assert l1 * p + l2 * q == pytest.approx(l0, abs=1e-9 * size)


@pytest.mark.parametrize("scale", SCALES)
def test_a_quadratic_has_both_roots_to_all_digits(scale):
    """Also where the sum of b and the root cancels: against 50 digits of mpmath."""
    random = np.random.default_rng(3)
    with mpmath.workdps(50):
        for _ in range(60):
            a, b = random.normal(), random.normal() * 10.0 ** random.integers(-1, 6) * scale
            c = random.normal() * scale**2
            roots = quadratic_roots(branch_sign_symbol("s"), *(symbol(n) for n in "abc"), call("abs", symbol("c")))
            values = {"a": a, "b": b, "c": c}
            delta = mpmath.mpf(b) ** 2 - 4 * mpmath.mpf(a) * mpmath.mpf(c)
            assert (valued(roots.margin, values) >= 0.0) == (delta >= 0)
            assert abs(valued(roots.margin, values)) <= 1.0 + 1e-12
            if delta < 0:
                continue
            truth = sorted((-b + sign * mpmath.sqrt(delta)) / (2 * mpmath.mpf(a)) for sign in (1, -1))
            (value,) = roots.values
            found = sorted(valued(value, values | {"s": sign}) for sign in (1.0, -1.0))
            assert found == pytest.approx([float(each) for each in truth], rel=1e-9)
    a, c = 2.0, -8.0 * scale**2
    roots = quadratic_roots(branch_sign_symbol("s"), symbol("a"), ZERO, symbol("c"), call("abs", symbol("c")))
    for sign in (1.0, -1.0):
        values = {"a": a, "c": c, "s": sign}
        assert valued(roots.values[0], values) == pytest.approx(sign * 2.0 * scale)
        assert valued(roots.margin, values) == pytest.approx(1.0)
        assert valued(roots.margin, values | {"c": -c}) == pytest.approx(-1.0)


@pytest.mark.parametrize("scale", SCALES)
def test_two_circles_are_a_circle_and_their_radical_axis(scale):
    random = np.random.default_rng(5)
    core = (3, 5)
    for _ in range(10):
        point = scale * random.normal(size=2)
        forms = []
        for _ in range(2):
            middle, k = scale * random.normal(size=2), random.uniform(0.5, 2.0)
            rest = float(middle @ middle - (point - middle) @ (point - middle))
            linear = {(n,): const(-2.0 * k * float(m)) for n, m in zip(core, middle, strict=True)}
            forms.append({(3, 3): const(k), (5, 5): const(k), **linear, (): const(k * rest)})
        found = line_and_conic(forms, core)
        assert found is not None
        l1, l2, l0, a, b, c, d, e, f = (each.value for each in found)
        p, q = point
        assert l1 * p + l2 * q == pytest.approx(l0, abs=1e-9 * scale**2)
        assert a * p * p + b * p * q + c * q * q + d * p + e * q + f == pytest.approx(0.0, abs=1e-9 * scale**2)
        assert a == c
        assert b == 0.0
        roots = line_conic_roots(branch_sign_symbol("s"), found[:3], found[3:])
        near = [math.hypot(*(valued(each, {"s": sign}) - x for each, x in zip(roots.values, point, strict=True)))
                for sign in (1.0, -1.0)]  # fmt: skip
        assert min(near) <= 1e-6 * scale
    ellipse = {(3, 3): ONE, (5, 5): const(2.0), (): const(-1.0)}
    assert line_and_conic([ellipse, forms[0]], core) is None
    assert line_and_conic([{(3,): ONE, (): ONE}, {(): ONE}], core) is None
    straight = {(3,): const(2.0), (5,): const(-1.0), (): const(4.0)}
    for pair in ([straight, ellipse], [ellipse, straight]):
        found = line_and_conic(pair, core)
        assert found is not None
        assert [each.value for each in found] == [2.0, -1.0, -4.0, 1.0, 0.0, 2.0, 0.0, 0.0, -1.0]
    cubic = {(3, 3, 5): ONE, (): ONE}
    assert line_and_conic([straight, cubic], core) is None
    # concentric ones: no line is left
    twice = {(3, 3): const(2.0), (5, 5): const(2.0), (): const(-5.0)}
    assert line_and_conic([{(3, 3): ONE, (5, 5): ONE, (): const(-1.0)}, twice], core) is None


# --- sizes


def test_the_size_of_terms_is_the_sum_of_their_absolute_values():
    random = np.random.default_rng(1)
    for _ in range(20):
        terms = [mul(const(float(c)), symbol(k)) for k, c in enumerate(random.normal(size=5))]
        total = terms[0]
        for k, term in enumerate(terms[1:]):
            total = add(total, term) if k % 2 else sub(term, total)
        values = dict(enumerate(random.normal(size=5)))
        truth = sum(abs(valued(term, values)) for term in terms)
        assert valued(size_of_terms(total), values) == pytest.approx(truth, rel=1e-12)


def test_rounding_is_never_more_than_the_size_that_it_is_measured_by():
    random = np.random.default_rng(2)
    least = 1e-3
    for _ in range(40):
        leaves = [symbol(k) for k in range(4)] + [const(float(random.normal() * 100.0))]
        for _ in range(8):
            a, b = (leaves[int(k)] for k in random.integers(0, len(leaves), 2))
            leaves.append([add, sub, mul, mul][int(random.integers(0, 4))](a, b))
        root = leaves[-1]
        values = {k: float(random.normal() * 10.0 ** random.integers(-6, 4)) for k in range(4)}
        size = valued(size_in_rounding(root, lambda _: const(least)), values)
        with mpmath.workdps(60):
            exact = valued(root, {k: mpmath.mpf(v) for k, v in values.items()}, mpmath.mpf)
            error = abs(float(exact - mpmath.mpf(valued(root, values))))
        assert error <= 16 * 2.3e-16 * size
        assert size >= abs(valued(root, values)) * (1.0 - 1e-12)
        raised = valued(size_in_rounding(root, lambda _: const(1e9)), values)
        assert raised >= size * (1.0 - 1e-12)
    half = div(call("sind", symbol(0)), const(-4.0))
    assert valued(size_in_rounding(half, lambda _: const(1e9)), {0: 3.0}) == 0.25


def test_what_is_divided_by_varies_and_is_not_sought():
    x, y, t = symbol(0), symbol(1), symbol(2)
    assert divisors_of([div(x, add(t, ONE)), div(ONE, mul(y, t))], {0, 1}) == [add(t, ONE)]
    assert divisors_of([div(x, const(3.0))], {0}) == []
    assert divisors_of([call("tand", t)], {0}) == [call("cosd", t)]
    powers = [call("pow", symbol(k), payload=p) for k, p in ((2, -2.0), (3, 0.5), (4, 2.0))]
    assert divisors_of(powers, {0}) == [t]
    assert divisors_of([neg(div(y, t)), div(x, t)], {0, 1}) == [t]
