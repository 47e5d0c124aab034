/* Explicit Runge-Kutta methods. The stage slopes k are rows from r->slope on: the first one is the slope at x. */
#include "stepper.h"

static long long own_work(const mbs_problem *problem)
{
    const mbs_system *system = problem->system;
    return (long long)(problem->method->all_stages - 1) * (system->nq + system->nu);
}

static void restart(mbs_run *r)
{
    (void)r;
}

/* to = sum_j weights_j k_j, added in order of j and without the zero weights. */
static void combine(const mbs_run *r, int count, const double *weights, double *to)
{
    int first = 0, n = r->n;
    while (first < count - 1 && weights[first] == 0.0)
        ++first;
    const double *k = r->slope + first * n;
    for (int i = 0; i < n; ++i)
        to[i] = weights[first] * k[i];
    for (int j = first + 1; j < count; ++j) {
        k += n;
        double weight = weights[j];
        if (weight != 0.0)
            for (int i = 0; i < n; ++i)
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
    int end = method->stages - 1;
    return (method->error && method->error[end] != 0.0) || (method->coarse_error && method->coarse_error[end] != 0.0);
}

static void estimate(const mbs_run *r, double h, const double *weights, double *error)
{
    combine(r, r->method->stages, weights, error);
    for (int i = 0; i < r->n; ++i)
        error[i] *= h;
}

/* Fill the slopes of the stages from `first` up to `last`. */
static int evaluate(mbs_run *r, double h, int first, int last)
{
    const mbs_method *m = r->method;
    int status = MBS_RUNNING;
    for (int i = first; i < last && status == MBS_RUNNING; ++i) {
        extrapolate(r, h, i, m->a + i * m->all_stages, r->stage);
        status = mbs_derivative(r, r->state->t + m->c[i] * h, r->stage, r->slope + i * r->n);
    }
    return status;
}

/* Fill x_new and the slopes; the last slope only if the error estimate needs it before x_new is settled. */
static int attempt(mbs_run *r, double h, double t_new)
{
    const mbs_method *m = r->method;
    int end = m->stages - 1, status;
    if ((status = evaluate(r, h, 1, end)) != MBS_RUNNING)
        return status;
    extrapolate(r, h, end, m->a + end * m->all_stages, r->x_new);
    if ((status = mbs_all_finite(r, t_new, r->x_new)) != MBS_RUNNING)
        return status;
    if (end_in_error(m) && (status = mbs_derivative(r, t_new, r->x_new, r->slope + end * r->n)) != MBS_RUNNING)
        return status;
    if (!(r->problem->step > 0.0)) {
        estimate(r, h, m->error, r->error);
        if (m->coarse_error)
            estimate(r, h, m->coarse_error, r->coarse);
    }
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

static int extend(mbs_run *r)
{
    return evaluate(r, r->state->h, r->method->stages, r->method->all_stages);
}

static void value(const mbs_run *r, double theta, double *x)
{
    const mbs_method *m = r->method;
    mbs_fill(r->n, 0.0, x);
    for (int j = 0; j < m->all_stages; ++j) {
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

const mbs_stepper mbs_explicit = {own_work, restart, attempt, finish, advance, extend, value, 1.0};
