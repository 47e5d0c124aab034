/* Elimination of rows as they come: x of least norm with A x = r by Householder QR of A^T without pivoting, over the
   profile. In a header, so that compilers can unroll the loops where a pattern is small and constant. */
#ifndef MBS_IN_ORDER_H
#define MBS_IN_ORDER_H

#include "runtime.h"
#include "vectors.h"

#if defined(__GNUC__) && !defined(__clang__)
#ifndef MBS_UNROLLED
#define MBS_UNROLLED _Pragma("GCC unroll 8")
#endif
#define MBS_INLINE static inline __attribute__((always_inline))
#define MBS_CALLED static __attribute__((noinline, unused))
#else
#define MBS_UNROLLED
#define MBS_INLINE static inline
#define MBS_CALLED static inline
#endif

/* Before loops whose turns read nothing that others write */
#ifdef MBS_VECTORS
#define MBS_SIDE_BY_SIDE _Pragma("omp simd")
#else
#define MBS_SIDE_BY_SIDE
#endif

/* Write zeros: a call, since GCC writes so many as it knows by an instruction that takes long to begin. */
MBS_CALLED void mbs_zeros(int n, double *x)
{
#if defined(__GNUC__)
    __builtin_memset(x, 0, (unsigned long)n * sizeof *x);
#else
    mbs_fill(n, 0.0, x);
#endif
}

/* The factors of a matrix begin with its rank and conditioning, and whether rows were taken in another order. */
enum { MBS_RANK, MBS_CONDITIONING, MBS_PIVOTED, MBS_HEAD };

/* Where the parts of the factors stand. Reflection k is E - factors[k] v v^T. */
typedef struct {
    double *inverse; /* 1 / R_kk */
    double *factors;
    double *y;
    double *vectors; /* row j: entries of R, then the vector v of its reflection */
    double *scale, *order, *scaled; /* where rows are pivoted: see solve.c */
} mbs_parts;

MBS_INLINE mbs_parts mbs_parts_of(const mbs_pattern *pattern, double *space)
{
    int rows = pattern->rows;
    double *vectors = space + MBS_HEAD + 3 * rows, *scale = vectors + rows * pattern->columns;
    mbs_parts parts = {vectors - 3 * rows, vectors - 2 * rows, vectors - rows, vectors,
                       scale,              scale + rows,       scale + 2 * rows};
    return parts;
}

MBS_INLINE double mbs_dot(int n, const double *a, const double *b)
{
    double sum = 0.0;
    MBS_UNROLLED
    for (int i = 0; i < n; ++i)
        sum += a[i] * b[i];
    return sum;
}

/* Take `amount` times v from x. */
MBS_INLINE void mbs_subtract(int n, double amount, const double *v, double *x)
{
    MBS_UNROLLED
    for (int i = 0; i < n; ++i)
        x[i] -= amount * v[i];
}

/* Make v, what is left of row k, the vector that turns it onto the k-th axis. */
MBS_INLINE void mbs_reflection(const mbs_parts *parts, int k, double length, double *v)
{
    double whole = length + fabs(v[0]), factor = 1.0 / (length * whole), inverse = factor * whole;
    parts->factors[k] = factor;
    parts->inverse[k] = -copysign(inverse, v[0]);
    v[0] += copysign(length, v[0]);
}

/* Returns 0 where a row might depend on those before it. */
MBS_INLINE int mbs_keep_in_order(const mbs_pattern *pattern, const double *matrix, double most, double *space)
{
    mbs_parts parts = mbs_parts_of(pattern, space);
    double longest = 0.0, shortest = MBS_LARGEST, least = HUGE_VAL;
    int rows = pattern->rows, columns = pattern->columns;
    if (!pattern->spans || rows == 0 || rows > columns || most < rows)
        return 0;
    MBS_UNROLLED
    for (int j = 0; j < rows; ++j) {
        const mbs_span *span = pattern->spans + j;
        double *row = parts.vectors + j * columns;
        int count = span->end - span->first;
        MBS_UNROLLED
        for (int i = span->low; i < span->high; ++i)
            row[i] = i < span->first || i >= span->end ? 0.0 : matrix[i - span->first];
        double whole = mbs_dot(count, matrix, matrix);
        MBS_UNROLLED
        for (int k = span->low; k < j; ++k) {
            const double *v = parts.vectors + k * columns + k;
            int size = pattern->spans[k].high - k;
            mbs_subtract(size, parts.factors[k] * mbs_dot(size, v, row + k), v, row + k);
        }
        double rest = mbs_dot(span->high - j, row + j, row + j);
        if (!(rest > MBS_CLEAR * MBS_CLEAR * whole))
            return 0;
        mbs_reflection(&parts, j, sqrt(rest), row + j);
        longest = whole > longest ? whole : longest;
        shortest = whole < shortest ? whole : shortest;
        least = rest < least * whole ? rest / whole : least;
        matrix += count;
    }
    space[MBS_RANK] = rows;
    space[MBS_CONDITIONING] = sqrt(least * longest < shortest ? least : shortest / longest);
    space[MBS_PIVOTED] = 0.0;
    return longest < MBS_LARGEST && shortest > MBS_SMALLEST && shortest > MBS_ALIKE * MBS_ALIKE * longest;
}

/* y = R^-T r, multipliers = R^-1 y, x = Q (y, 0). Returns 0 where a right side is not finite. */
MBS_INLINE int mbs_solve_in_order(const mbs_pattern *pattern, double *space, const double *right, double *solution,
                                  double *multipliers)
{
    mbs_parts parts = mbs_parts_of(pattern, space);
    double *y = parts.y, zero = 0.0;
    int rows = pattern->rows, columns = pattern->columns;
    MBS_UNROLLED
    for (int k = 0; k < rows; ++k) {
        const double *row = parts.vectors + k * columns;
        int low = pattern->spans[k].low;
        y[k] = (right[k] - mbs_dot(k - low, row + low, y + low)) * parts.inverse[k];
        zero += 0.0 * right[k];
    }
    MBS_UNROLLED
    for (int i = 0; i < columns; ++i)
        solution[i] = i < rows ? y[i] : 0.0;
    MBS_UNROLLED
    for (int k = rows - 1; k >= 0; --k) {
        const mbs_span *span = pattern->spans + k;
        const double *row = parts.vectors + k * columns;
        int size = span->high - k;
        multipliers[k] = y[k] * parts.inverse[k];
        mbs_subtract(k - span->low, multipliers[k], row + span->low, y + span->low);
        mbs_subtract(size, parts.factors[k] * mbs_dot(size, row + k, solution + k), row + k, solution + k);
    }
    return zero == 0.0;
}

/* mbs_factorise and mbs_substitute for patterns that are small and constant. */
MBS_INLINE void mbs_factorise_unrolled(const mbs_pattern *pattern, const double *matrix, double most, double *factors)
{
    if (!mbs_keep_in_order(pattern, matrix, most, factors))
        mbs_factorise_pivoted(pattern, matrix, most, factors);
}

MBS_INLINE void mbs_substitute_unrolled(const mbs_pattern *pattern, double *factors, const double *right,
                                        double *solution, double *multipliers, double *report)
{
    if (factors[MBS_PIVOTED] != 0.0 || !mbs_solve_in_order(pattern, factors, right, solution, multipliers)) {
        mbs_substitute_pivoted(pattern, factors, right, solution, multipliers, report);
        return;
    }
    report[0] = factors[MBS_RANK];
    report[1] = factors[MBS_CONDITIONING];
    report[2] = 0.0;
}

#endif
