/* Calls of the programs of a system. */
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

static void note_report(mbs_run *r, double t)
{
    mbs_state *state = r->state;
    if (r->report[0] < state->least_rank)
        state->least_rank = r->report[0];
    if (r->report[0] > state->greatest_rank)
        state->greatest_rank = r->report[0];
    if (r->report[1] < state->conditioning) {
        state->conditioning = r->report[1];
        state->conditioning_time = t;
    }
    if (r->report[2] > r->residual)
        r->residual = r->report[2];
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

int mbs_derivative(mbs_run *r, double t, const double *x, double *slope)
{
    int status = MBS_RUNNING, near = r->state->near;
    if (near && (status = mbs_closed(r, t, x, r->settled)) != MBS_RUNNING)
        return status;
    mbs_evaluate(r, t, near ? r->settled : x);
    mbs_copy(r->n, r->known_slope, slope);
    ++r->state->evaluations;
    if (r->watching && !r->beyond)
        r->beyond = mbs_beyond_kink(r, t, x);
    if ((status = mbs_all_finite(r, t, slope)) == MBS_RUNNING && r->system->ns > 0) {
        note_report(r, t);
        mbs_note_independence(r, t);
    }
    return status;
}
