/* Calls of the programs of a system, states between the ends of a step, and sizes in units of the tolerances. */
#include "stepper.h"

void mbs_map(const mbs_program *program, long long samples, const double **in, const int *advance, double **out)
{
    for (long long sample = 0; sample < samples; ++sample) {
        program->call(in, out);
        for (int i = 0; i < program->n_in; ++i)
            in[i] += advance[i] ? program->in_sizes[i] : 0;
        for (int i = 0; i < program->n_out; ++i)
            out[i] += program->out_sizes[i];
    }
}

int mbs_failed(mbs_run *r, int status, double time, int component)
{
    r->state->failure_time = time;
    r->state->component = component;
    return status;
}

int mbs_all_finite(mbs_run *r, double time, const double *values)
{
    double product = 0.0;
    for (int i = 0; i < r->n; ++i)
        product += 0.0 * values[i];
    if (product == 0.0)
        return MBS_RUNNING;
    int component = 0;
    while (isfinite(values[component]))
        ++component;
    return mbs_failed(r, MBS_NOT_FINITE, time, component);
}

void mbs_call(mbs_run *r, const mbs_program *program, double t, const double *x, double *const *out)
{
    const mbs_system *system = r->system;
    const double *in[7] = {&t, x, x + system->nq, system->parameters, r->inputs, system->modes, r->further};
    if (system->inputs)
        system->inputs->call(in, &r->inputs);
    program->call(in, out);
}

void mbs_evaluate(mbs_run *r, double t, const double *x)
{
    double *out[4] = {r->known_slope, r->known_slope + r->system->nq, r->multipliers, r->report};
    int known = t == r->known_time;
    for (int i = 0; i < r->n && known; ++i)
        known = x[i] == r->known_x[i];
    if (known)
        return;
    mbs_call(r, r->system->state_derivative, t, x, out);
    mbs_copy(r->n, x, r->known_x);
    r->known_time = t;
}

int mbs_value(mbs_run *r, double theta, double *x)
{
    mbs_state *s = r->state;
    int status = s->extended ? MBS_RUNNING : r->stepper->extend(r);
    if (status == MBS_RUNNING) {
        s->extended = 1;
        r->stepper->value(r, theta, x);
    }
    return status;
}

void mbs_hermite(const mbs_run *r, double theta, double *x)
{
    double rest = 1.0 - theta, h = r->state->h;
    double a = theta * theta * (3.0 - 2.0 * theta), b = h * theta * rest * rest, c = -h * theta * theta * rest;
    for (int i = 0; i < r->n; ++i)
        x[i] = r->x[i] + a * (r->x_new[i] - r->x[i]) + b * r->slope[i] + c * r->slope_new[i];
}

static double scale(const mbs_run *r, double before, double after)
{
    double size = fabs(before) > fabs(after) ? fabs(before) : fabs(after);
    return r->problem->atol + r->problem->rtol * size;
}

double mbs_scaled_norm(const mbs_run *r, const double *y, const double *x, const double *x_new, double noise, int *worst)
{
    double sum = 0.0, most = -1.0;
    for (int i = 0; i < r->n; ++i) {
        double part = y[i] / (scale(r, x[i], x_new[i]) + noise);
        sum += part * part;
        if (fabs(part) > most) {
            most = fabs(part);
            *worst = i;
        }
    }
    return sqrt(sum / r->n);
}
