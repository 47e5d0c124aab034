"""Explicit Runge-Kutta methods as data that checks itself; `EXPLICIT` makes each of them by name."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import cache, cached_property
from math import prod
from types import MappingProxyType
from typing import Any, Final, TypeVar

import numpy as np

from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

# ----------------------------------------------------------------------------------------------------------------------
# Explicit Runge-Kutta methods as data that checks itself.
#
# Every method is kept with its end point as last stage: the last row of `A` is b, so the last slope is f(t + h, x_new).
# It costs nothing, because it is the first slope of the next step, and it lets one loop serve all methods: error
# estimates and continuous extensions are weights over the same stages, with or without "first same as last". An
# extension may need stages beyond the end point; they are evaluated only in steps that are interpolated.


# ----------------------------------------------------------------------------------------------------------------------
# Order conditions of Runge-Kutta methods over all rooted trees, exactly for coefficients that are Fractions.
#
# A rooted tree is the sorted tuple of its branches, each a tree; `()` is the single node. A method with coefficients
# A, weights b and nodes c = A 1 has order p when every tree t of at most p nodes satisfies
#
#     sum_i b_i Phi_i(t) = 1 / gamma(t)
#     Phi_i((t1, .., tm)) = prod_k sum_j a_ij Phi_j(tk),   gamma((t1, .., tm)) = |t| prod_k gamma(tk)
#
# Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, section II.2.


Tree = tuple["Tree", ...]
Number = TypeVar("Number", Fraction, float)


@cache
def rooted_trees(size: int) -> tuple[Tree, ...]:
    """Return every rooted tree of `size` nodes once (1, 1, 2, 4, 9, 20, 48, ... of them), in a fixed order."""
    if size == 1:
        return ((),)
    return tuple(sorted({larger for tree in rooted_trees(size - 1) for larger in _with_one_more_leaf(tree)}))


def _with_one_more_leaf(tree: Tree) -> Iterator[Tree]:
    yield tuple(sorted((*tree, ())))
    for index, branch in enumerate(tree):
        for larger in _with_one_more_leaf(branch):
            yield tuple(sorted((*tree[:index], larger, *tree[index + 1 :])))


@cache
def node_count(tree: Tree) -> int:
    """Return |t|, the number of nodes of `tree`."""
    return 1 + sum(map(node_count, tree))


@cache
def density(tree: Tree) -> int:
    """Return gamma(t), the product over all nodes of the number of nodes above and including it."""
    return node_count(tree) * prod(map(density, tree))


def stage_weights(A: Sequence[Sequence[Number]], size: int) -> dict[Tree, list[Number]]:
    """Return Phi_i(t) by stage for every tree of at most `size` nodes of the method with coefficients `A`."""
    weights: dict[Tree, list[Number]] = {}
    branches: dict[Tree, list[Number]] = {}
    scalar: Any = next((type(a) for row in A for a in row), Fraction)
    zero, one = scalar(0), scalar(1)
    for nodes in range(1, size + 1):
        for tree in rooted_trees(nodes):
            phi = [prod((branches[t][i] for t in tree), start=one) for i in range(len(A))]
            weights[tree] = phi
            branches[tree] = [sum((a * p for a, p in zip(row, phi, strict=False) if a and p), zero) for row in A]
    return weights


def reached_order(weights: dict[Tree, list[Number]], b: Sequence[Number], tolerance: float = 0.0) -> int:
    """Return the order of the method with weights `b`, as far as the trees in `weights` can tell.

    Conditions count as satisfied to within `tolerance`.
    """
    wrong = (node_count(t) - 1 for t, phi in weights.items() if not _equal(_dot(b, phi), t, tolerance))
    return min(wrong, default=max(map(node_count, weights)))


def reached_dense_order(
    weights: dict[Tree, list[Number]], dense: Sequence[Sequence[Number]], tolerance: float = 0.0
) -> int:
    """Return the order of the extension b_i(theta) = sum_k dense[i][k] theta^(k+1), as far as `weights` can tell.

    It is p when sum_i b_i(theta) Phi_i(t) = theta^|t| / gamma(t) as polynomials for every tree of at most p nodes,
    to within `tolerance` for each coefficient.
    """
    columns = list(enumerate(zip(*dense, strict=True), 1))
    wrong = (
        node_count(t) - 1
        for t, phi in weights.items()
        if node_count(t) > len(columns)
        or any(not _equal(_dot(c, phi), t if k == node_count(t) else None, tolerance) for k, c in columns)
    )
    return min(wrong, default=max(map(node_count, weights)))


def _equal(value: Number, tree: Tree | None, tolerance: float) -> bool:
    """Tell whether `value` is 1 / gamma of the tree, or 0 without one."""
    wanted = Fraction(1, density(tree)) if tree is not None else Fraction(0)
    return bool(abs(value - wanted) <= tolerance)


def _dot(a: Sequence[Number], b: Sequence[Number]) -> Number:
    zero: Any = 0
    return sum((x * y for x, y in zip(a, b, strict=True) if x and y), zero)


Weights = tuple[Fraction, ...]


_ROUNDING: Final = 1e-11  # of order conditions in floating point


@dataclass(frozen=True)
class Tableau:
    """A method in floating point, as the stepping loops in C and Python read it.

    `stages`, the last of them at the end point, make the step; those after it, up to s, serve the extension only.
    `A` (s, s), `c` (s,), `error` (stages,) or None, `coarse_error` (stages,) or None, `dense` (s, degree); `order` of
    the step, `error_order` of the estimated error; `end_in_error` tells that the estimate needs the last slope.
    """

    stages: int
    A: Floats
    c: Floats
    error: Floats | None
    coarse_error: Floats | None
    dense: Floats
    order: int
    error_order: int

    @property
    def end_in_error(self) -> bool:
        return any(e is not None and bool(e[-1] != 0.0) for e in (self.error, self.coarse_error))


@dataclass(frozen=True)
class RungeKutta:
    """An explicit Runge-Kutta method; construction raises ValueError unless every claim it makes is true.

        k_i = f(t + c_i h, x + h sum_j a_ij k_j),   x_new = x + h sum_j a_sj k_j,   k_s = f(t + h, x_new)
        x(t + theta h) = x + h sum_i b_i(theta) k_i,   b_i(theta) = sum_k dense[i][k] theta^(k+1)

    `A`: row i has i entries; the last row is b. `extra`: rows of the stages after the end point. `c`: nodes. `order`:
    of x_new. `error`: weights b - b_hat of the error estimate; None without one. `error_order`: that of b_hat, 0
    without an estimate. `coarse`: weights of a second estimate e3, of `coarse_order`; the first, e5, then counts as
    e5^2 / sqrt(e5^2 + 0.01 e3^2), which makes `error_order` twice that of b_hat less the coarse one. `dense_order`:
    the local error of the continuous extension is O(h^(dense_order + 1)). `decimals`: the coefficients are decimals,
    whose orders hold to rounding; else exactly.
    """

    name: str
    A: tuple[Weights, ...]
    c: Weights
    order: int
    dense: tuple[Weights, ...]
    dense_order: int
    error: Weights | None = None
    error_order: int = 0
    coarse: Weights | None = None
    coarse_order: int = 0
    extra: tuple[Weights, ...] = ()
    decimals: bool = False

    def __post_init__(self) -> None:
        rows = (*self.A, *self.extra)
        sums = [self._number(sum(row, Fraction(0))) - self._number(c) for row, c in zip(rows, self.c, strict=False)]
        for true, claim in (
            ([len(row) for row in rows] == list(range(len(rows))), "row i of A has i entries"),
            (len(self.c) == len(self.dense) == len(rows), "c and dense have one entry a stage"),
            (max(map(abs, sums)) <= self._tolerance, "c_i is the sum of row i of A"),
            (self.c[self.stages - 1] == 1, "the last stage is the end point"),
            ((self.error is None) == (self.error_order == 0), "an error estimate has an order"),
            (self.error is None or len(self.error) == self.stages, "error has one entry a stage"),
        ):
            self._require(true, claim)
        self._check_orders()

    def _check_orders(self) -> None:
        A, dense = (tuple(map(self._numbers, rows)) for rows in ((*self.A, *self.extra), self.dense))
        b = (*A[self.stages - 1], *[self._number(Fraction(0))] * (1 + len(self.extra)))
        weights, tolerance = stage_weights(A, self.order + 1), self._tolerance
        self._require(reached_order(weights, b, tolerance) == self.order, f"the order is {self.order}")
        for error, order in ((self.error, self.fine_order), (self.coarse, self.coarse_order)):
            if error is not None:
                b_hat = [x - e for x, e in zip(b, (*self._numbers(error), *b[self.stages :]), strict=True)]
                embedded = reached_order(weights, b_hat, tolerance)
                self._require(embedded == order < self.order, f"the embedded order is {order}")
        ends = [sum(row) - x for row, x in zip(dense, b, strict=True)]
        self._require(max(map(abs, ends)) <= tolerance, "the continuous extension ends at x_new")
        dense_order = reached_dense_order(weights, dense, tolerance)
        self._require(dense_order == self.dense_order, f"the continuous extension has order {self.dense_order}")

    def _require(self, true: bool, claim: str) -> None:
        if not true:
            raise ValueError(f"{self.name}: not true that {claim}")

    @property
    def _tolerance(self) -> float:
        return _ROUNDING if self.decimals else 0.0

    def _number(self, value: Fraction) -> Any:
        """Return a coefficient as it is checked: rational arithmetic on thirty decimals takes half a second."""
        return float(value) if self.decimals else value

    def _numbers(self, row: Weights) -> tuple[Any, ...]:
        return tuple(map(self._number, row))

    @property
    def stages(self) -> int:
        """The number of stages of a step, the end point included."""
        return len(self.A)

    @property
    def fine_order(self) -> int:
        """The order of b_hat."""
        return (self.error_order + self.coarse_order) // 2 if self.coarse else self.error_order

    @cached_property
    def tableau(self) -> Tableau:
        """The method in floating point."""
        rows = (*self.A, *self.extra)
        square = [[*row, *[0] * (len(rows) - len(row))] for row in rows]
        error, coarse = (None if e is None else np.array(e, dtype=float) for e in (self.error, self.coarse))
        return Tableau(
            stages=self.stages,
            A=np.array(square, dtype=float),
            c=np.array(self.c, dtype=float),
            error=error,
            coarse_error=coarse,
            dense=np.array(self.dense, dtype=float),
            order=self.order,
            error_order=self.error_order,
        )


# ----------------------------------------------------------------------------------------------------------------------
# The explicit Runge-Kutta methods; `EXPLICIT` makes each of them by name.


def hermite(b: Sequence[Fraction]) -> tuple[Weights, ...]:
    """Return the cubic Hermite interpolant of x and f at both ends as an extension of weights `b` (end included).

    b_i(theta) = theta^2 (3 - 2 theta) b_i, plus theta (1 - theta)^2 for the first and theta^2 (theta - 1) for the
    last stage: order 3, or that of b if lower.
    """
    zero, one = Fraction(0), Fraction(1)
    rows = [[zero, 3 * x, -2 * x] for x in b]
    rows[0] = [r + e for r, e in zip(rows[0], (one, -2 * one, one), strict=True)]
    rows[-1] = [r + e for r, e in zip(rows[-1], (zero, -one, one), strict=True)]
    return tuple(map(tuple, rows))


def _row(text: str) -> Weights:
    return tuple(map(Fraction, text.split()))


def _method(name: str, order: int, A: str, b_hat: str = "", error_order: int = 0) -> RungeKutta:
    """Return a method from the rows of `A` after the first (empty) one, separated by `;`, with Hermite extension."""
    rows = ((), *map(_row, A.split(";")))
    b = (*rows[-1], Fraction(0))
    return RungeKutta(
        name=name,
        A=rows,
        c=tuple(sum(row, Fraction(0)) for row in rows),
        order=order,
        dense=hermite(b),
        dense_order=min(order, 3),
        error=tuple(x - y for x, y in zip(b, _row(b_hat), strict=True)) if b_hat else None,
        error_order=error_order,
    )


def _dormand_prince() -> RungeKutta:
    """Return the 5(4) pair of J. R. Dormand and P. J. Prince (J. Comput. Appl. Math. 6, 1980), extended with order 4.

    The extensions of order 4 that share x and f with the step at both ends form one family, in the last number of
    d; taken is the member whose fifth-order error coefficients have the least mean square over the step. It is the
    one L. F. Shampine chose (Math. Comp. 46, 1986).
    """
    rows = (
        (),
        _row("1/5"),
        _row("3/40 9/40"),
        _row("44/45 -56/15 32/9"),
        _row("19372/6561 -25360/2187 64448/6561 -212/729"),
        _row("9017/3168 -355/33 46732/5247 49/176 -5103/18656"),
        _row("35/384 0 500/1113 125/192 -2187/6784 11/84"),
    )
    b = (*rows[-1], Fraction(0))
    b_hat = _row("5179/57600 0 7571/16695 393/640 -92097/339200 187/2100 1/40")
    d = _row(
        "-12715105075/11282082432 0 87487479700/32700410799 -10690763975/1880347072"
        " 701980252875/199316789632 -1453857185/822651844 69997945/29380423"
    )
    # Hermite's extension, plus theta^2 (1 - theta)^2 d_i
    dense = ((linear, square + x, cube - 2 * x, x) for (linear, square, cube), x in zip(hermite(b), d, strict=True))
    return RungeKutta(
        name="dormand_prince",
        A=rows,
        c=_row("0 1/5 3/10 4/5 8/9 1 1"),
        order=5,
        dense=tuple(dense),
        dense_order=4,
        error=tuple(x - y for x, y in zip(b, b_hat, strict=True)),
        error_order=4,
    )


# ----------------------------------------------------------------------------------------------------------------------
# The explicit method of order 8(5,3) of Dormand and Prince with its continuous extension of order 7.
#
# Source of the coefficients: the program DOP853 of E. Hairer and G. Wanner, in the digits that it publishes; it is
# described in E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, section II.10.


_A: Final = """
    0.0526001519587677318785587544488;
    0.0197250569845378994544595329183 0.0591751709536136983633785987549;
    0.0295875854768068491816892993775 0 0.0887627564304205475450678981324;
    0.241365134159266685502369798665 0 -0.884549479328286085344864962717 0.924834003261792003115737966543;
    0.037037037037037037037037037037 0 0 0.170828608729473871279604482173 0.125467687566822425016691814123;
    0.037109375 0 0 0.170252211019544039314978060272 0.0602165389804559606850219397283 -0.017578125;
    0.0370920001185047927108779319836 0 0 0.170383925712239993810214054705 0.107262030446373284651809199168
    -0.0153194377486244017527936158236 0.00827378916381402288758473766002;
    0.624110958716075717114429577812 0 0 -3.36089262944694129406857109825 -0.868219346841726006818189891453
    27.5920996994467083049415600797 20.1540675504778934086186788979 -43.4898841810699588477366255144;
    0.477662536438264365890433908527 0 0 -2.48811461997166764192642586468 -0.590290826836842996371446475743
    21.2300514481811942347288949897 15.2792336328824235832596922938 -33.2882109689848629194453265587
    -0.0203312017085086261358222928593;
    -0.93714243008598732571704021658 0 0 5.18637242884406370830023853209 1.09143734899672957818500254654
    -8.14978701074692612513997267357 -18.5200656599969598641566180701 22.7394870993505042818970056734
    2.49360555267965238987089396762 -3.0467644718982195003823669022;
    2.27331014751653820792359768449 0 0 -10.5344954667372501984066689879 -2.00087205822486249909675718444
    -17.9589318631187989172765950534 27.9488845294199600508499808837 -2.85899827713502369474065508674
    -8.87285693353062954433549289258 12.3605671757943030647266201528 0.643392746015763530355970484046;
    0.0542937341165687622380535766363 0 0 0 0 4.45031289275240888144113950566 1.89151789931450038304281599044
    -5.8012039600105847814672114227 0.31116436695781989440891606237 -0.152160949662516078556178806805
    0.201365400804030348374776537501 0.0447106157277725905176885569043
"""
_EXTRA: Final = """
    0.0561675022830479523392909219681 0 0 0 0 0 0.253500210216624811088794765333 -0.246239037470802489917441475441
    -0.124191423263816360469010140626 0.15329179827876569731206322685 0.00820105229563468988491666602057
    0.00756789766054569976138603589584 -0.008298;
    0.0318346481635021405060768473261 0 0 0 0 0.0283009096723667755288322961402 0.0535419883074385676223797384372
    -0.0549237485713909884646569340306 0 0 -0.000108347328697249322858509316994 0.000382571090835658412954920192323
    -0.000340465008687404560802977114492 0.141312443674632500278074618366;
    -0.428896301583791923408573538692 0 0 0 0 -4.69762141536116384314449447206 7.68342119606259904184240953878
    4.06898981839711007970213554331 0.356727187455281109270669543021 0 0 0 -0.00139902416515901462129418009734
    2.9475147891527723389556272149 -9.15095847217987001081870187138
"""
_ERROR: Final = """
    0.01312004499419488073250102996 0 0 0 0 -1.225156446376204440720569753 -0.4957589496572501915214079952
    1.664377182454986536961530415 -0.3503288487499736816886487290 0.3341791187130174790297318841
    0.08192320648511571246570742613 -0.02235530786388629525884427845 0
"""
_THIRD_ORDER: Final = """
    0.244094488188976377952755905512 0 0 0 0 0 0 0 0.733846688281611857341361741547 0 0
    0.0220588235294117647058823529412 0
"""
_DENSE: Final = """
    -8.4289382761090128651353491142 0 0 0 0 0.56671495351937776962531783590 -3.0689499459498916912797304727
    2.3846676565120698287728149680 2.1170345824450282767155149946 -0.87139158377797299206789907490
    2.2404374302607882758541771650 0.63157877876946881815570249290 -0.088990336451333310820698117400
    18.148505520854727256656404962 -9.1946323924783554000451984436 -4.4360363875948939664310572000;
    10.427508642579134603413151009 0 0 0 0 242.28349177525818288430175319 165.20045171727028198505394887
    -374.54675472269020279518312152 -22.113666853125306036270938578 7.7334326684722638389603898808
    -30.674084731089398182061213626 -9.3321305264302278729567221706 15.697238121770843886131091075
    -31.139403219565177677282850411 -9.3529243588444783865713862664 35.816841486394083752465898540;
    19.985053242002433820987653617 0 0 0 0 -387.03730874935176555105901742 -189.17813819516756882830838328
    527.80815920542364900561016686 -11.573902539959630126141871134 6.8812326946963000169666922661
    -1.0006050966910838403183860980 0.77771377980534432092869265740 -2.7782057523535084065932004339
    -60.196695231264120758267380846 84.320405506677161018159903784 11.992291136182789328035130030;
    -25.693933462703749003312586129 0 0 0 0 -154.18974869023643374053993627 -231.52937917604549567536039109
    357.63911791061412378285349910 93.405324183624310003907691704 -37.458323136451633156875139351
    104.09964950896230045147246184 29.840293426660503123344363579 -43.533456590011143754432175058
    96.324553959188282948394950600 -39.177261675615439165231486172 -149.72683625798562581422125276
"""


@cache  # its orders are checked when it is made, which takes longer than a step
def dormand_prince_8() -> RungeKutta:
    """Return the method; its error estimates are of order 5 (b - b_hat given) and 3 (b_hat given)."""
    rows = ((), *_rows(_A))
    b = (*rows[-1], Fraction(0))
    extra = _rows(_EXTRA)
    (error,), (third_order,) = _rows(_ERROR), _rows(_THIRD_ORDER)
    sums = [sum(row, Fraction(0)) for row in (*rows, *extra)]
    return RungeKutta(
        name="dormand_prince_8",
        A=rows,
        extra=extra,
        c=tuple(Fraction(1) if abs(x - 1) < Fraction(1, 10**20) else x for x in sums),  # exactly the end of the step
        order=8,
        dense=_extension(b, _rows(_DENSE)),
        dense_order=7,
        error=error,
        error_order=7,
        coarse=tuple(x - y for x, y in zip(b, third_order, strict=True)),
        coarse_order=3,
        decimals=True,
    )


def _rows(text: str) -> tuple[Weights, ...]:
    return tuple(tuple(map(Fraction, row.split())) for row in text.split(";"))


def _extension(b: Weights, d: tuple[Weights, ...]) -> tuple[Weights, ...]:
    """Return the extension as polynomials in theta, from the nested form in which it is published:

        x + h theta (F0 + (1 - theta) (F1 + theta (F2 + (1 - theta) (F3 + theta (F4 + (1 - theta) (F5 + theta F6))))))

    where F0 = b, F1 = e_1 - b, F2 = 2 b - e_1 - e_end are weights of the slopes as F3 .. F6 = d are.
    """
    end, zero, one = len(b) - 1, Fraction(0), Fraction(1)
    rows = []
    for stage, high in enumerate(zip(*d, strict=True)):
        weight = b[stage] if stage <= end else zero
        first, last = (one if stage == place else zero for place in (0, end))
        rows.append(_nested_coefficients((weight, first - weight, 2 * weight - first - last, *high)))
    return tuple(rows)


def _nested_coefficients(F: Weights) -> Weights:
    """Return the coefficients of F0 + (1 - theta) (F1 + theta (F2 + (1 - theta) (F3 + ..)))."""
    inner = [F[-1]]
    for number in range(len(F) - 2, -1, -1):
        outer = [Fraction(0), *inner]
        if number % 2 == 0:
            outer = [x - y for x, y in zip((*inner, Fraction(0)), outer, strict=True)]
        outer[0] += F[number]
        inner = outer
    return tuple(inner)


EXPLICIT: Final[Mapping[str, Callable[[], RungeKutta]]] = MappingProxyType(
    {
        "explicit_euler": lambda: _method("explicit_euler", 1, "1"),
        "midpoint": lambda: _method("midpoint", 2, "1/2; 0 1"),
        "heun": lambda: _method("heun", 2, "1; 1/2 1/2"),
        "rk4": lambda: _method("rk4", 4, "1/2; 0 1/2; 0 0 1; 1/6 1/3 1/3 1/6"),
        "bogacki_shampine": lambda: _method(
            "bogacki_shampine", 3, "1/2; 0 3/4; 2/9 1/3 4/9", "7/24 1/4 1/3 1/8", 2
        ),
        "dormand_prince": _dormand_prince,
        "dormand_prince_8": dormand_prince_8,
    }
)
