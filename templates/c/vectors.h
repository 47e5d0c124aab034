/* Vectors as plain arrays. */
#ifndef MBS_VECTORS_H
#define MBS_VECTORS_H

#include "constants.h"

#include <math.h>

/* The largest |x_i|; nan if one of them is nan. */
static inline double mbs_largest(int n, const double *x)
{
    double result = 0.0;
    for (int i = 0; i < n && !isnan(result); ++i)
        if (!(fabs(x[i]) <= result))
            result = fabs(x[i]);
    return result;
}

static inline void mbs_copy(int n, const double *from, double *to)
{
    for (int i = 0; i < n; ++i)
        to[i] = from[i];
}

static inline void mbs_fill(int n, double value, double *x)
{
    for (int i = 0; i < n; ++i)
        x[i] = value;
}

#endif
