/* Rank-revealing solve of generated models. Allocates nothing, keeps no state of its own. */
#include "in_order.h"

/* ---- rows that may depend on each other: Householder QR of A^T with column pivoting ---- */

#define ROUNDING 2e-14 /* of the longest row's largest number: rows of smaller ones count as zero */
#define TIE 1e-8 /* lengths closer than this fraction count as equal: the row declared first is taken */

/* The parts of the factors: `order` holds the row kept k-th as a whole number, `scale` what row j of A was divided by;
   `vectors` and multipliers keep the places in which rows are declared. */
typedef struct {
    int rows, columns;
    const mbs_span *spans;
    double *head;
    mbs_parts part;
} qr;

static qr laid_out(const mbs_pattern *pattern, double *space)
{
    qr f = {pattern->rows, pattern->columns, pattern->spans, space, mbs_parts_of(pattern, space)};
    return f;
}

static mbs_span span_of(const qr *f, int row)
{
    const mbs_span whole = {0, f->columns, 0, f->columns};
    return f->spans ? f->spans[row] : whole;
}

static double *row_of(const qr *f, int k)
{
    return f->part.vectors + (int)f->part.order[k] * f->columns;
}

/* A row that is zero but for rounding (of numbers like those of the longest row) counts as zero: what is left of it has
   no direction. Its length counts as that of the longest row, or one. */
static void scale_rows(const qr *f, const double *matrix, double longest)
{
    for (int j = 0; j < f->rows; ++j) {
        int first = span_of(f, j).first, count = span_of(f, j).end - first;
        double *row = f->part.vectors + j * f->columns, *to = row + first;
        double size = mbs_largest(count, matrix), length = 1.0;
        int empty = size <= ROUNDING * longest;
        if (empty)
            size = longest > 0.0 ? longest : 1.0;
        mbs_fill(f->columns, 0.0, row);
        for (int i = 0; i < count && !empty; ++i)
            to[i] = matrix[i] / size;
        if (!empty)
            length = sqrt(mbs_dot(count, to, to));
        for (int i = 0; i < count; ++i)
            to[i] /= length;
        f->part.scale[j] = size * length;
        f->part.order[j] = j;
        matrix += count;
    }
}

/* Bring the longest remaining row to place k, those between one place back; returns its length. */
static double take_pivot(const qr *f, int k)
{
    double longest = 0.0, *lengths = f->part.y, *order = f->part.order;
    for (int j = k; j < f->rows; ++j) {
        const double *rest = row_of(f, j) + k;
        lengths[j] = sqrt(mbs_dot(f->columns - k, rest, rest));
        if (lengths[j] > longest)
            longest = lengths[j];
    }
    int chosen = k;
    while (chosen < f->rows - 1 && !(lengths[chosen] >= (1.0 - TIE) * longest))
        ++chosen;
    double row = order[chosen];
    for (int j = chosen; j > k; --j)
        order[j] = order[j - 1];
    order[k] = row;
    return lengths[chosen];
}

static void keep_longest(const qr *f, double most_kept)
{
    int most = f->rows < f->columns ? f->rows : f->columns, k = 0;
    if (most_kept < most)
        most = (int)ceil(most_kept);
    double tolerance = 100.0 * MBS_EPSILON * (f->rows > f->columns ? f->rows : f->columns);
    double first = 0.0, least = HUGE_VAL, shortest = HUGE_VAL, longest = 0.0;
    for (; k < most; ++k) {
        double length = take_pivot(f, k), *v = row_of(f, k) + k;
        int size = f->columns - k;
        first = k ? first : length;
        if (!(length > tolerance * first))
            break;
        double whole = f->part.scale[(int)f->part.order[k]];
        least = length < least ? length : least;
        shortest = whole < shortest ? whole : shortest;
        longest = whole > longest ? whole : longest;
        mbs_reflection(&f->part, k, length, v);
        while (size > 1 && v[size - 1] == 0.0)
            --size;
        for (int j = k + 1; j < f->rows; ++j) {
            double *other = row_of(f, j) + k;
            mbs_subtract(size, f->part.factors[k] * mbs_dot(size, v, other), v, other);
        }
    }
    f->head[MBS_RANK] = k;
    f->head[MBS_CONDITIONING] = k ? fmin(least, shortest / longest) : 0.0;
}

void mbs_factorise_pivoted(const mbs_pattern *pattern, const double *matrix, double most, double *factors)
{
    qr f = laid_out(pattern, factors);
    int size = 0;
    for (int j = 0; j < f.rows; ++j)
        size += span_of(&f, j).end - span_of(&f, j).first;
    double longest = mbs_largest(size, matrix);
    f.head[MBS_RANK] = NAN;
    f.head[MBS_PIVOTED] = 1.0;
    if (!isfinite(longest))
        return;
    scale_rows(&f, matrix, longest);
    keep_longest(&f, most);
}

void mbs_independent(const mbs_pattern *pattern, double *factors, double *independent)
{
    qr f = laid_out(pattern, factors);
    double rank = f.head[MBS_RANK];
    mbs_fill(f.rows, rank == f.rows, independent);
    for (int k = 0; k < rank && rank < f.rows; ++k)
        independent[(int)f.part.order[k]] = 1.0;
}

/* y = R^-T r over the kept rows; returns the largest |A x - r| of the others. */
static double forward(const qr *f, int rank)
{
    double largest = 0.0, *y = f->part.y;
    for (int k = 0; k < f->rows; ++k) {
        double left = f->part.scaled[(int)f->part.order[k]] - mbs_dot(k < rank ? k : rank, row_of(f, k), y);
        if (k < rank)
            y[k] = left * f->part.inverse[k];
        else if (fabs(left) > largest)
            largest = fabs(left);
    }
    return largest;
}

/* Multipliers = R^-1 y, zero for the rows that were not kept; x = Q (y, 0). */
static void backward(const qr *f, int rank, double *solution, double *multipliers)
{
    double *y = f->part.y;
    mbs_fill(f->columns, 0.0, solution);
    mbs_fill(f->rows, 0.0, multipliers);
    mbs_copy(rank, y, solution);
    for (int k = rank - 1; k >= 0; --k) {
        const double *row = row_of(f, k);
        int size = f->columns - k, j = (int)f->part.order[k];
        double value = y[k] * f->part.inverse[k];
        multipliers[j] = value / f->part.scale[j];
        mbs_subtract(k, value, row, y);
        mbs_subtract(size, f->part.factors[k] * mbs_dot(size, row + k, solution + k), row + k, solution + k);
    }
}

void mbs_substitute_pivoted(const mbs_pattern *pattern, double *factors, const double *right, double *solution,
                            double *multipliers, double *report)
{
    qr f = laid_out(pattern, factors);
    double rank = f.head[MBS_RANK];
    if (isnan(rank) || !isfinite(mbs_largest(f.rows, right))) {
        mbs_fill(f.columns, NAN, solution);
        mbs_fill(f.rows, NAN, multipliers);
        mbs_fill(3, NAN, report);
        return;
    }
    for (int j = 0; j < f.rows; ++j)
        f.part.scaled[j] = right[j] / f.part.scale[j];
    double left = forward(&f, (int)rank);
    backward(&f, (int)rank, solution, multipliers);
    report[0] = rank;
    report[1] = f.head[MBS_CONDITIONING];
    report[2] = left > 0.0 ? left / mbs_largest(f.rows, f.part.scaled) : 0.0;
}

/* ---- patterns of any size ---- */

void mbs_factorise(const mbs_pattern *pattern, const double *matrix, double most, double *factors)
{
    mbs_factorise_unrolled(pattern, matrix, most, factors);
}

void mbs_substitute(const mbs_pattern *pattern, double *factors, const double *right, double *solution,
                    double *multipliers, double *report)
{
    mbs_substitute_unrolled(pattern, factors, right, solution, multipliers, report);
}

/* ---- some rows ---- */

#define SHORTEST 1e-6       /* part of the longest row's length that scales shorter rows */
#define NEARLY_ZERO 1e-150
#define PLAIN 2.0           /* acts, and multipliers are of least norm as they are */

/* The rows that act, one after the other, in what begins with how many they are: which, the room for their right side and
   their multipliers, their elements; what they exert in unit vectors, the lengths of that, and the factors of a matrix. */
typedef struct {
    mbs_pattern pattern;
    double *which, *right, *multipliers, *matrix;
    double *unit, *lengths, *kind, *large, *solution, *factors;
} some;

enum { OWN, REGULAR, TOGETHER }; /* rows exert their own directions; others; and are found with x */

static some laid_out_for(const mbs_rows *all_rows, double *space, const mbs_span *spans, int rubs)
{
    int rows = all_rows->rows, n = all_rows->columns, all = rows + n;
    double *which = space + 1, *matrix = which + 3 * rows, *unit = matrix + rows * n, *large = unit + rows * (n + 1) + 1;
    some s = {.pattern = {(int)space[0], n, spans},
              .which = which,
              .right = which + rows,
              .multipliers = which + 2 * rows,
              .matrix = matrix,
              .factors = unit};
    if (rubs) {
        s.unit = unit;
        s.lengths = unit + rows * n;
        s.kind = s.lengths + rows;
        s.large = large;
        s.solution = large + all * all;
        s.factors = s.solution + 2 * all;
    }
    return s;
}

static void gather(some *s, const mbs_rows *rows, const double *acting, double *space, const double *from, double *to)
{
    int count = 0, n = s->pattern.columns;
    for (int j = 0; j < rows->rows; ++j)
        if (acting[j] != 0.0) {
            double *row = to + count * n;
            mbs_fill(n, 0.0, row);
            for (int k = rows->begins[j]; k < rows->begins[j + 1]; ++k)
                row[rows->places[k]] = from[k];
            s->which[count++] = j;
        }
    s->pattern.rows = count;
    space[0] = count;
}

/* Factorise a matrix of the rows that act, of which all elements are there: those within the spans come to its front. */
static void factorise_within(const some *s, mbs_span *spans, double *matrix, double most)
{
    int n = s->pattern.columns;
    double *to = matrix;
    for (int j = 0; j < s->pattern.rows; ++j) {
        const double *row = matrix + j * n;
        int first = 0, end = n, low = 0;
        while (end > 0 && row[end - 1] == 0.0)
            --end;
        while (first < end && row[first] == 0.0)
            ++first;
        while (low < j && spans[low].high <= first)
            ++low;
        int high = end > j ? end : j + 1;
        for (int k = low; k < j; ++k)
            high = spans[k].high > high ? spans[k].high : high;
        mbs_span span = {first, end, low < first ? low : first, high < n ? high : n};
        spans[j] = span;
        for (int i = first; i < end; ++i)
            *to++ = row[i];
    }
    mbs_factorise(&s->pattern, matrix, most, s->factors);
}

static void scatter(const some *s, int rows, const double *from, double *to)
{
    mbs_fill(rows, 0.0, to);
    for (int k = 0; k < s->pattern.rows; ++k)
        to[(int)s->which[k]] = from[k];
}

static void gather_right(const some *s, const double *right)
{
    for (int k = 0; k < s->pattern.rows; ++k)
        s->right[k] = right[(int)s->which[k]];
}

void mbs_factorise_some(const mbs_rows *rows, const double *matrix, const double *acting, double most, double *factors,
                        mbs_span *spans)
{
    some s = laid_out_for(rows, factors, spans, 0);
    gather(&s, rows, acting, factors, matrix, s.matrix);
    factorise_within(&s, spans, s.matrix, most);
}

void mbs_substitute_some(const mbs_rows *rows, double *factors, const mbs_span *spans, const double *right,
                         double *solution, double *multipliers, double *report)
{
    some s = laid_out_for(rows, factors, spans, 0);
    gather_right(&s, right);
    mbs_substitute(&s.pattern, s.factors, s.right, solution, s.multipliers, report);
    scatter(&s, rows->rows, s.multipliers, multipliers);
}

/* Make what rows exert unit vectors, none of them much shorter than the longest, or leave it as it is where multipliers
   are `plain`; returns whether they differ from A, or are plain. */
static int made_units(const some *s, int plain)
{
    int count = s->pattern.rows, n = s->pattern.columns, differs = plain;
    double longest = 0.0;
    for (int i = 0; i < count * n; ++i)
        differs |= s->unit[i] != s->matrix[i];
    for (int k = 0; k < count && differs; ++k) {
        s->lengths[k] = plain ? 1.0 : sqrt(mbs_dot(n, s->unit + k * n, s->unit + k * n));
        longest = s->lengths[k] > longest ? s->lengths[k] : longest;
    }
    double shortest = SHORTEST * longest > NEARLY_ZERO ? SHORTEST * longest : NEARLY_ZERO;
    for (int k = 0; k < count && differs; ++k) {
        if (!(s->lengths[k] > shortest))
            s->lengths[k] = shortest;
        for (int i = 0; i < n; ++i)
            s->unit[k * n + i] /= s->lengths[k];
    }
    return differs;
}

/* Return the smallest part of a kept row of A that A C^T leaves, beside its other rows. */
static double least_left(const some *s)
{
    mbs_parts part = mbs_parts_of(&s->pattern, s->factors);
    int n = s->pattern.columns, pivoted = s->factors[MBS_PIVOTED] != 0.0;
    double least = s->factors[MBS_RANK] ? HUGE_VAL : 0.0;
    for (int k = 0; k < s->factors[MBS_RANK]; ++k) {
        int j = pivoted ? (int)part.order[k] : k;
        const double *row = s->matrix + j * n;
        least = fmin(least, (pivoted ? part.scale[j] : 1.0) / fabs(part.inverse[k]) / sqrt(mbs_dot(n, row, row)));
    }
    return least;
}

/* [A 0; E -C^T]: x and multipliers are found together. */
static mbs_pattern together(const some *s)
{
    int count = s->pattern.rows, n = s->pattern.columns, all = count + n;
    mbs_fill(all * all, 0.0, s->large);
    for (int k = 0; k < count; ++k)
        mbs_copy(n, s->matrix + k * n, s->large + k * all);
    for (int i = 0; i < n; ++i) {
        double *row = s->large + (count + i) * all;
        row[i] = 1.0;
        for (int k = 0; k < count; ++k)
            row[n + k] = -s->unit[k * n + i];
    }
    mbs_pattern pattern = {all, all, 0};
    return pattern;
}

static void factorise_own(const some *s, mbs_span *spans, double most) /* of A C^T, with zeros beside it up to n columns */
{
    int count = s->pattern.rows, n = s->pattern.columns;
    mbs_fill(count * n, 0.0, s->large);
    for (int j = 0; j < count; ++j)
        for (int k = 0; k < count; ++k)
            s->large[j * n + k] = mbs_dot(n, s->matrix + j * n, s->unit + k * n);
    factorise_within(s, spans, s->large, most);
}

/* Return whether A, C and A C^T have the same rank: then x is unique, and multipliers of least norm follow from the last.
   Its factors are made again. */
static int same_rank(const some *s, mbs_span *spans, double most)
{
    double rank = s->factors[MBS_RANK];
    const double *both[] = {s->matrix, s->unit};
    const mbs_pattern whole = {s->pattern.rows, s->pattern.columns, 0};
    for (int k = 0; k < 2; ++k) {
        mbs_factorise_pivoted(&whole, both[k], most + k, s->factors);
        double found = s->factors[MBS_RANK];
        if (found > most && 1.0 <= MBS_CLEAR * fabs(mbs_parts_of(&whole, s->factors).inverse[(int)most]))
            found = most; /* by rounding */
        if (found != rank)
            return 0;
    }
    factorise_own(s, spans, most);
    return 1;
}

void mbs_factorise_rubbing(const mbs_rows *rows, const double *matrix, const mbs_rows *forces, const double *exerted,
                           const double *acting, double most, double *factors, mbs_span *spans)
{
    some s = laid_out_for(rows, factors, spans, 1);
    gather(&s, rows, acting, factors, matrix, s.matrix);
    gather(&s, forces, acting, factors, exerted, s.unit);
    int count = s.pattern.rows, n = s.pattern.columns;
    *s.kind = OWN;
    int plain = 0;
    for (int j = 0; j < rows->rows; ++j)
        plain |= acting[j] == PLAIN;
    if (!made_units(&s, plain)) {
        factorise_within(&s, spans, s.matrix, most);
        return;
    }
    *s.kind = REGULAR;
    if (count <= n) {
        factorise_own(&s, spans, most);
        /* what is not finite has no rank and no factors, nor more of it */
        if (isnan(s.factors[MBS_RANK]))
            return;
        if (s.factors[MBS_RANK] == count || same_rank(&s, spans, most)) {
            s.factors[MBS_CONDITIONING] = least_left(&s); /* what is left of rows is measured by the rows of A */
            return;
        }
    }
    *s.kind = TOGETHER;
    mbs_pattern own = together(&s);
    mbs_factorise(&own, s.large, most + n, s.factors);
}

void mbs_substitute_rubbing(const mbs_rows *rows, double *factors, const mbs_span *spans, const double *right,
                            double *solution, double *multipliers, double *report)
{
    some s = laid_out_for(rows, factors, spans, 1);
    int count = s.pattern.rows, n = s.pattern.columns, large = *s.kind == TOGETHER;
    gather_right(&s, right);
    if (*s.kind == OWN) {
        mbs_substitute(&s.pattern, s.factors, s.right, solution, s.multipliers, report);
        scatter(&s, rows->rows, s.multipliers, multipliers);
        return;
    }
    mbs_pattern both = {count + n, count + n, 0};
    double *wanted = s.large, *unused = wanted + both.rows;
    mbs_fill(both.rows, 0.0, wanted);
    mbs_copy(count, s.right, wanted);
    mbs_substitute(large ? &both : &s.pattern, s.factors, wanted, s.solution, unused, report);
    const double *carried = large ? s.solution + n : s.solution;
    report[0] -= large ? n : 0;
    mbs_fill(n, 0.0, solution);
    for (int k = 0; k < count; ++k) {
        mbs_subtract(n, -carried[k], s.unit + k * n, solution);
        s.multipliers[k] = carried[k] / s.lengths[k];
    }
    scatter(&s, rows->rows, s.multipliers, multipliers);
}
