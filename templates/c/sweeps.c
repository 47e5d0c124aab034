/* Impulses of many contacts at once, by sweeps over them: multibody_sym/contact_laws/impact_sequence.py has the laws, and
   gives the same bits. */
#include "runtime.h"
#include "vectors.h"


static double speed(const mbs_contacts *c, int row, double start, const double *x)
{
    for (int k = c->begins[row]; k < c->begins[row + 1]; ++k)
        start += c->matrix[k] * x[c->places[k]];
    return start;
}

/* Returns by how much that changes the root of twice an energy. */
static double change(const mbs_contacts *c, int row, double impulse, double *x, double *z)
{
    double more = impulse - z[row];
    z[row] = impulse;
    if (more != 0.0)
        for (int k = c->begins[row]; k < c->begins[row + 1]; ++k)
            x[c->places[k]] += c->matrix[k] * more;
    return fabs(more) * sqrt(c->squares[row]);
}

/* A part sticks where its impulses stay within a limit; else it slips. */
static double rub(const mbs_contacts *c, int first, int end, double limit, const double *speeds, double *x, double *z)
{
    double stiff = 0.0, square = 0.0, largest = 0.0, wanted[3];
    for (int j = first; j < end; ++j)
        stiff += c->squares[j];
    if (!(stiff > 0.0))
        return 0.0;
    for (int j = first; j < end; ++j)
        wanted[j - first] = z[j] - speed(c, j, speeds[j], x) / stiff;
    for (int j = 0; j < end - first; ++j)
        square += wanted[j] * wanted[j];
    double size = sqrt(square), part = size > limit ? limit / size : 1.0;
    for (int j = first; j < end; ++j) {
        double moved = change(c, j, part * wanted[j - first], x, z);
        if (moved > largest)
            largest = moved;
    }
    return largest;
}

long long mbs_sweep(const mbs_contacts *c, const double *speeds, double *x, double *z, double settled, long long most)
{
    long long done = 0;
    while (done < most) {
        double largest = 0.0;
        ++done;
        for (int j = 0; j < c->rubs[0]; ++j)
            if (c->squares[j] > 0.0) {
                double wanted = z[j] - c->relaxed * speed(c, j, speeds[j], x) / c->squares[j];
                double moved = change(c, j, wanted > 0.0 ? wanted : 0.0, x, z);
                if (moved > largest)
                    largest = moved;
            }
        for (int k = 0; k < c->parts; ++k) {
            double limit = c->coefficients[k] * z[c->presses[k]];
            double moved = rub(c, c->rubs[k], c->rubs[k + 1], limit, speeds, x, z);
            if (moved > largest)
                largest = moved;
        }
        if (largest <= settled)
            break;
    }
    return done;
}
