/* Explicit Runge-Kutta methods. The stage slopes k are rows from r->slope on: the first one is the slope at x. */
#include "stepper.h"

static long long own_work(const mbs_problem *problem)
{
    const mbs_system *system = problem->system;
    return (long long)(problem->method->stages - 1) * (system->nq + system->nu);
}

static void restart(mbs_run *r)
{
    (void)r;
}

/* to = sum_j weights_j k_j, added in order of j and without the zero weights. */
static void combine(const mbs_run *r, int count, const double *weights, double *to)
{
    mbs_fill(r->n, 0.0, to);
    for (int j = 0; j < count; ++j) {
        const double *k = r->slope + j * r->n;
        double weight = weights[j];
        if (weight != 0.0)
            for (int i = 0; i < r->n; ++i)
                to[i] += weight * k[i];
    }
}

static void extrapolate(const mbs_run *r, double h, int count, const double *weights, double *to)
{
    combine(r, count, weights, to);
    for (int i = 0; i < r->n; ++i)
        to[i] = r->x[i] + h * to[i];
}

static int end_in_error(const mbs_method *method)
{
    return method->error && method->error[method->stages - 1] != 0.0;
}

static void estimate(mbs_run *r, double h)
{
    combine(r, r->method->stages, r->method->error, r->error);
    for (int i = 0; i < r->n; ++i)
        r->error[i] *= h;
}

/* Fill x_new and the slopes; the last slope only if the error estimate needs it before x_new is settled. */
static int attempt(mbs_run *r, double h, double t_new)
{
    const mbs_method *m = r->method;
    int end = m->stages - 1, status;
    for (int i = 1; i < end; ++i) {
        extrapolate(r, h, i, m->a + i * m->stages, r->stage);
        if ((status = mbs_derivative(r, r->state->t + m->c[i] * h, r->stage, r->slope + i * r->n)) != MBS_RUNNING)
            return status;
    }
    extrapolate(r, h, end, m->a + end * m->stages, r->x_new);
    if ((status = mbs_all_finite(r, t_new, r->x_new)) != MBS_RUNNING)
        return status;
    if (end_in_error(m) && (status = mbs_derivative(r, t_new, r->x_new, r->slope + end * r->n)) != MBS_RUNNING)
        return status;
    if (!(r->problem->step > 0.0))
        estimate(r, h);
    return MBS_RUNNING;
}

/* A changed end needs a slope of its own where the error estimate has one already. */
static int finish(mbs_run *r, double t_new, int changed)
{
    double *last = r->slope + (r->method->stages - 1) * r->n;
    int status = MBS_RUNNING;
    if (end_in_error(r->method) && changed)
        return mbs_derivative(r, t_new, r->x_new, r->slope_new);
    if (!end_in_error(r->method))
        status = mbs_derivative(r, t_new, r->x_new, last);
    mbs_copy(r->n, last, r->slope_new);
    return status;
}

static void advance(mbs_run *r)
{
    (void)r;
}

static void value(const mbs_run *r, double theta, double *x)
{
    const mbs_method *m = r->method;
    mbs_fill(r->n, 0.0, x);
    for (int j = 0; j < m->stages; ++j) {
        const double *coefficients = m->dense + j * m->dense_degree, *k = r->slope + j * r->n;
        double weight = 0.0;
        for (int power = m->dense_degree - 1; power >= 0; --power)
            weight = (weight + coefficients[power]) * theta;
        if (weight != 0.0)
            for (int i = 0; i < r->n; ++i)
                x[i] += weight * k[i];
    }
    for (int i = 0; i < r->n; ++i)
        x[i] = r->x[i] + r->state->h * x[i];
}

const mbs_stepper mbs_explicit = {own_work, restart, attempt, finish, advance, value};
