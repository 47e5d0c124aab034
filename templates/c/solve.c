/* Rank-revealing solve of generated models. Allocates nothing, keeps no state of its own. */
#include "runtime.h"
#include "vectors.h"

/* ---- minimum-norm solution of A x = r by Householder QR of A^T with column pivoting ---- */

#define ROUNDING 2e-14 /* of the longest row's largest number: rows of smaller ones count as zero */
#define TIE 1e-8 /* lengths closer than this fraction count as equal: the row declared first is taken */

typedef struct {
    int rows, columns, rank;
    double *vectors;  /* row j: R entries, then the Householder vector of a kept row */
    double *scale;    /* lengths of the rows of A */
    double *order;    /* order[k]: the row kept k-th, as a whole number */
    double *diagonal; /* R_kk */
    double *factors;  /* reflection k is E - factors[k] v v^T */
} qr;

static double dot(int n, const double *a, const double *b)
{
    double sum = 0.0;
    for (int i = 0; i < n; ++i)
        sum += a[i] * b[i];
    return sum;
}

static double *row_of(const qr *f, int k)
{
    return f->vectors + (int)f->order[k] * f->columns;
}

/* A row that is zero but for rounding (of numbers like those of the longest row) counts as zero: what is left of it has
   no direction. Its length counts as that of the longest row, or one. */
static int scale_rows(const qr *f, const double *matrix)
{
    double longest = mbs_largest(f->rows * f->columns, matrix);
    if (!isfinite(longest))
        return 0;
    for (int j = 0; j < f->rows; ++j) {
        const double *from = matrix + j * f->columns;
        double *to = f->vectors + j * f->columns;
        double size = mbs_largest(f->columns, from), length = 1.0;
        int empty = size <= ROUNDING * longest;
        if (empty)
            size = longest > 0.0 ? longest : 1.0;
        for (int i = 0; i < f->columns; ++i)
            to[i] = empty ? 0.0 : from[i] / size;
        if (!empty)
            length = sqrt(dot(f->columns, to, to));
        for (int i = 0; i < f->columns; ++i)
            to[i] /= length;
        f->scale[j] = size * length;
        f->order[j] = j;
    }
    return 1;
}

/* Bring the longest remaining row to place k, those between one place back; returns its length. */
static double take_pivot(const qr *f, int k, double *lengths)
{
    double longest = 0.0;
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

static void reflect(const qr *f, int k, double length)
{
    int rest = f->columns - k;
    double *v = row_of(f, k) + k;
    double first = v[0];
    f->diagonal[k] = first > 0.0 ? -length : length;
    f->factors[k] = 1.0 / (length * (length + fabs(first)));
    v[0] = first - f->diagonal[k];
    for (int j = k + 1; j < f->rows; ++j) {
        double *other = row_of(f, j) + k;
        double amount = f->factors[k] * dot(rest, v, other);
        for (int i = 0; i < rest; ++i)
            other[i] -= amount * v[i];
    }
}

static void factorise(qr *f, double most_kept, double *lengths)
{
    int most = f->rows < f->columns ? f->rows : f->columns;
    if (most_kept < most)
        most = (int)ceil(most_kept);
    double tolerance = 100.0 * MBS_EPSILON * (f->rows > f->columns ? f->rows : f->columns);
    for (f->rank = 0; f->rank < most; ++f->rank) {
        double length = take_pivot(f, f->rank, lengths);
        double first = f->rank ? fabs(f->diagonal[0]) : length;
        if (!(length > tolerance * first))
            break;
        reflect(f, f->rank, length);
    }
}

static void fill_report(const qr *f, const double *right, const double *y, double *report)
{
    double biggest = mbs_largest(f->rows, right), smallest = 0.0, residual = 0.0;
    for (int k = 0; k < f->rank; ++k)
        if (k == 0 || fabs(f->diagonal[k]) < smallest)
            smallest = fabs(f->diagonal[k]);
    for (int k = f->rank; k < f->rows; ++k) {
        double left = fabs(right[(int)f->order[k]] - dot(f->rank, row_of(f, k), y));
        if (left > residual)
            residual = left;
    }
    report[0] = f->rank;
    report[1] = f->rank ? smallest / fabs(f->diagonal[0]) : 0.0;
    report[2] = biggest > 0.0 ? residual / biggest : 0.0;
}

/* y = R^-T r over the kept rows, multipliers = R^-1 y, x = Q (y, 0). */
static void substitute(const qr *f, const double *right, double *y, double *solution, double *multipliers)
{
    for (int k = 0; k < f->rank; ++k)
        y[k] = (right[(int)f->order[k]] - dot(k, row_of(f, k), y)) / f->diagonal[k];
    mbs_fill(f->columns, 0.0, solution);
    mbs_fill(f->rows, 0.0, multipliers);
    mbs_copy(f->rank, y, solution);
    for (int k = f->rank - 1; k >= 0; --k) {
        const double *row = row_of(f, k);
        double value = y[k];
        for (int j = k + 1; j < f->rank; ++j)
            value -= row_of(f, j)[k] * multipliers[(int)f->order[j]];
        multipliers[(int)f->order[k]] = value / f->diagonal[k];
        double amount = f->factors[k] * dot(f->columns - k, row + k, solution + k);
        for (int i = k; i < f->columns; ++i)
            solution[i] -= amount * row[i];
    }
    for (int j = 0; j < f->rows; ++j)
        multipliers[j] /= f->scale[j];
}

void mbs_solve(int rows, int columns, const double *matrix, const double *right, double most, double *solution,
               double *multipliers, double *report, double *work)
{
    double *scale = work + rows * columns;
    qr f = {rows, columns, 0, work, scale, scale + rows, scale + 2 * rows, scale + 3 * rows};
    double *y = scale + 4 * rows, *scaled = scale + 5 * rows;
    if (!scale_rows(&f, matrix) || !isfinite(mbs_largest(rows, right))) {
        mbs_fill(columns, NAN, solution);
        mbs_fill(rows, NAN, multipliers);
        mbs_fill(3, NAN, report);
        return;
    }
    factorise(&f, most, y);
    for (int j = 0; j < rows; ++j)
        scaled[j] = right[j] / f.scale[j];
    substitute(&f, scaled, y, solution, multipliers);
    fill_report(&f, scaled, y, report);
}
