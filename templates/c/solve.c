/* Rank-revealing solve of generated models. Allocates nothing, keeps no state of its own. */
#include "runtime.h"
#include "vectors.h"

/* ---- minimum-norm solution of A x = r by Householder QR of A^T ---- */

#define ROUNDING 2e-14 /* of the longest row's largest number: rows of smaller ones count as zero */
#define TIE 1e-8 /* lengths closer than this fraction count as equal: the row declared first is taken */
#define CLEAR 1e-6 /* of a row's length: where that much is left of every row in turn, all are independent */
#define ALIKE 1e-12 /* of the longest row: lengths below that may be rounding */

enum { RANK, CONDITIONING, PIVOTED, HEAD };

typedef struct {
    int rows, columns;
    const mbs_span *spans;
    double *head;
    double *scale;   /* what the rows of A were divided by */
    double *order;   /* order[k]: the row kept k-th, as a whole number */
    double *inverse; /* 1 / R_kk */
    double *factors; /* reflection k is E - factors[k] v v^T */
    double *y, *scaled;
    double *vectors; /* row j: R entries, then the Householder vector of a kept row */
} qr;

static qr laid_out(const mbs_pattern *pattern, double *space)
{
    int rows = pattern->rows;
    qr f = {.rows = rows, .columns = pattern->columns, .spans = pattern->spans, .head = space};
    f.scale = f.head + HEAD;
    f.order = f.scale + rows;
    f.inverse = f.order + rows;
    f.factors = f.inverse + rows;
    f.y = f.factors + rows;
    f.scaled = f.y + rows;
    f.vectors = f.scaled + rows;
    return f;
}

static double dot(int n, const double *a, const double *b)
{
    double sum = 0.0;
    for (int i = 0; i < n; ++i)
        sum += a[i] * b[i];
    return sum;
}

static mbs_span span_of(const qr *f, int row)
{
    const mbs_span whole = {0, f->columns, 0, f->columns};
    return f->spans ? f->spans[row] : whole;
}

static double *row_of(const qr *f, int k)
{
    return f->vectors + (int)f->order[k] * f->columns;
}

/* Take x less amount times v. */
static void subtract(int n, double amount, const double *v, double *x)
{
    for (int i = 0; i < n; ++i)
        x[i] -= amount * v[i];
}

/* Make v, the rest of the row kept k-th, the vector that turns it onto the k-th axis. */
static void make_reflection(const qr *f, int k, double length, double *v)
{
    double whole = length + fabs(v[0]), factor = 1.0 / (length * whole);
    double inverse = factor * whole;
    f->factors[k] = factor;
    f->inverse[k] = v[0] > 0.0 ? -inverse : inverse;
    v[0] += v[0] > 0.0 ? length : -length;
}

/* ---- without pivoting, over the profile ---- */

/* Take the rows as they come; returns 0 where one of them might depend on those before it. */
static int keep_in_order(const qr *f, const double *matrix)
{
    double longest = 0.0, shortest = HUGE_VAL, least = 1.0;
    for (int j = 0; j < f->rows; ++j) {
        const mbs_span *span = f->spans + j;
        double *row = f->vectors + j * f->columns;
        int count = span->end - span->first;
        mbs_fill(span->first - span->low, 0.0, row + span->low);
        mbs_copy(count, matrix, row + span->first);
        mbs_fill(span->high - span->end, 0.0, row + span->end);
        double whole = dot(count, matrix, matrix);
        for (int k = span->low; k < j; ++k) {
            const double *v = f->vectors + k * f->columns + k;
            int size = f->spans[k].high - k;
            subtract(size, f->factors[k] * dot(size, v, row + k), v, row + k);
        }
        double rest = dot(span->high - j, row + j, row + j);
        if (!(rest > CLEAR * CLEAR * whole && whole > 1e-200 && whole < 1e200))
            return 0;
        make_reflection(f, j, sqrt(rest), row + j);
        f->scale[j] = 1.0;
        f->order[j] = j;
        longest = whole > longest ? whole : longest;
        shortest = whole < shortest ? whole : shortest;
        least = rest < least * whole ? rest / whole : least;
        matrix += count;
    }
    f->head[RANK] = f->rows;
    f->head[CONDITIONING] = sqrt(least);
    f->head[PIVOTED] = 0.0;
    return shortest > ALIKE * ALIKE * longest;
}

/* ---- with column pivoting ---- */

/* A row that is zero but for rounding (of numbers like those of the longest row) counts as zero: what is left of it has
   no direction. Its length counts as that of the longest row, or one. */
static void scale_rows(const qr *f, const double *matrix, double longest)
{
    for (int j = 0; j < f->rows; ++j) {
        int first = span_of(f, j).first, count = span_of(f, j).end - first;
        double *row = f->vectors + j * f->columns, *to = row + first;
        double size = mbs_largest(count, matrix), length = 1.0;
        int empty = size <= ROUNDING * longest;
        if (empty)
            size = longest > 0.0 ? longest : 1.0;
        mbs_fill(f->columns, 0.0, row);
        for (int i = 0; i < count && !empty; ++i)
            to[i] = matrix[i] / size;
        if (!empty)
            length = sqrt(dot(count, to, to));
        for (int i = 0; i < count; ++i)
            to[i] /= length;
        f->scale[j] = size * length;
        f->order[j] = j;
        matrix += count;
    }
}

/* Bring the longest remaining row to place k, those between one place back; returns its length. */
static double take_pivot(const qr *f, int k)
{
    double longest = 0.0, *lengths = f->y;
    for (int j = k; j < f->rows; ++j) {
        const double *rest = row_of(f, j) + k;
        lengths[j] = sqrt(dot(f->columns - k, rest, rest));
        if (lengths[j] > longest)
            longest = lengths[j];
    }
    int chosen = k;
    while (chosen < f->rows - 1 && !(lengths[chosen] >= (1.0 - TIE) * longest))
        ++chosen;
    double row = f->order[chosen];
    for (int j = chosen; j > k; --j)
        f->order[j] = f->order[j - 1];
    f->order[k] = row;
    return lengths[chosen];
}

static void keep_longest(const qr *f, double most_kept)
{
    int most = f->rows < f->columns ? f->rows : f->columns, k = 0;
    if (most_kept < most)
        most = (int)ceil(most_kept);
    double tolerance = 100.0 * MBS_EPSILON * (f->rows > f->columns ? f->rows : f->columns);
    double first = 0.0, smallest = 0.0;
    for (; k < most; ++k) {
        double length = take_pivot(f, k), *v = row_of(f, k) + k;
        int size = f->columns - k;
        first = k ? first : length;
        if (!(length > tolerance * first))
            break;
        smallest = k && smallest < length ? smallest : length;
        make_reflection(f, k, length, v);
        for (int j = k + 1; j < f->rows; ++j) {
            double *other = row_of(f, j) + k;
            subtract(size, f->factors[k] * dot(size, v, other), v, other);
        }
    }
    f->head[RANK] = k;
    f->head[CONDITIONING] = k ? smallest / first : 0.0;
    f->head[PIVOTED] = 1.0;
}

void mbs_factorise(const mbs_pattern *pattern, const double *matrix, double most, double *factors)
{
    qr f = laid_out(pattern, factors);
    if (f.spans && 0 < f.rows && f.rows <= f.columns && most >= f.rows && keep_in_order(&f, matrix))
        return;
    int size = 0;
    for (int j = 0; j < f.rows; ++j)
        size += span_of(&f, j).end - span_of(&f, j).first;
    double longest = mbs_largest(size, matrix);
    f.head[RANK] = NAN;
    if (!isfinite(longest))
        return;
    scale_rows(&f, matrix, longest);
    keep_longest(&f, most);
}

void mbs_independent(const mbs_pattern *pattern, double *factors, double *independent)
{
    qr f = laid_out(pattern, factors);
    mbs_fill(f.rows, 0.0, independent);
    for (int k = 0; k < f.head[RANK]; ++k)
        independent[(int)f.order[k]] = 1.0;
}

/* ---- solution from the factors ---- */

/* y = R^-T r over the kept rows; returns the largest |A x - r| of the others. */
static double forward(const qr *f, int rank)
{
    double largest = 0.0;
    for (int k = 0; k < f->rows; ++k) {
        int low = f->head[PIVOTED] != 0.0 ? 0 : f->spans[k].low, end = k < rank ? k : rank;
        double left = f->scaled[(int)f->order[k]] - dot(end - low, row_of(f, k) + low, f->y + low);
        if (k < rank)
            f->y[k] = left * f->inverse[k];
        else if (fabs(left) > largest)
            largest = fabs(left);
    }
    return largest;
}

/* Multipliers = R^-1 y, x = Q (y, 0). */
static void backward(const qr *f, int rank, double *solution, double *multipliers)
{
    const mbs_span whole = {0, f->columns, 0, f->columns};
    mbs_fill(f->columns, 0.0, solution);
    mbs_fill(f->rows, 0.0, multipliers);
    mbs_copy(rank, f->y, solution);
    for (int k = rank - 1; k >= 0; --k) {
        const mbs_span *span = f->head[PIVOTED] != 0.0 ? &whole : f->spans + k;
        const double *row = row_of(f, k);
        int size = span->high - k, j = (int)f->order[k];
        double value = f->y[k] * f->inverse[k];
        subtract(k - span->low, value, row + span->low, f->y + span->low);
        multipliers[j] = value / f->scale[j];
        subtract(size, f->factors[k] * dot(size, row + k, solution + k), row + k, solution + k);
    }
}

void mbs_substitute(const mbs_pattern *pattern, double *factors, const double *right, double *solution,
                    double *multipliers, double *report)
{
    qr f = laid_out(pattern, factors);
    if (isnan(f.head[RANK]) || !isfinite(mbs_largest(f.rows, right))) {
        mbs_fill(f.columns, NAN, solution);
        mbs_fill(f.rows, NAN, multipliers);
        mbs_fill(3, NAN, report);
        return;
    }
    for (int j = 0; j < f.rows; ++j)
        f.scaled[j] = right[j] / f.scale[j];
    int rank = (int)f.head[RANK];
    double left = forward(&f, rank);
    backward(&f, rank, solution, multipliers);
    report[0] = rank;
    report[1] = f.head[CONDITIONING];
    report[2] = left > 0.0 ? left / mbs_largest(f.rows, f.scaled) : 0.0;
}
