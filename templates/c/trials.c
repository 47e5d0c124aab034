/* One trial of a step: the attempt of the method, its error, and its end, which is put back onto the constraints. */
#include "stepper.h"

int mbs_attempt(mbs_run *r, double h, double t_new)
{
    r->residual = 0.0;
    r->beyond = r->touched = 0;
    r->state->crossing = -1;
    r->state->extended = 0;
    r->state->h = h;
    r->state->t_new = t_new;
    mbs_begin_approach(r);
    int status = r->stepper->attempt(r, h, t_new);
    if (status != MBS_RUNNING && mbs_turns_stiff(r)) {
        mbs_begin_approach(r);
        status = r->stepper->attempt(r, h, t_new);
    }
    return status == MBS_RUNNING ? mbs_verify_approach(r, t_new) : status;
}

int mbs_close_step(mbs_run *r, double t_new)
{
    int status = MBS_RUNNING, changed = 0;
    mbs_copy(r->n, r->x_new, r->spare);
    mbs_normalize(r, t_new, r->x_new, &r->deviation);
    if (r->problem->project)
        status = mbs_project(r, t_new, r->x_new, MBS_ROUND_OFF);
    if (status == MBS_RUNNING && r->state->near && (status = mbs_closed(r, t_new, r->x_new, r->settled)) == MBS_RUNNING)
        mbs_copy(r->n, r->settled, r->x_new);
    for (int i = 0; i < r->n; ++i)
        changed |= r->x_new[i] != r->spare[i];
    if (status == MBS_RUNNING)
        status = r->stepper->finish(r, t_new, changed);
    return status == MBS_RUNNING ? mbs_verify_end(r, t_new) : status;
}

double mbs_error_beside(mbs_run *r, double noise, int *worst)
{
    double fine = mbs_scaled_norm(r, r->error, r->x, r->x_new, noise, worst);
    int ignored;
    if (!r->method->coarse_error || fine == 0.0)
        return fine;
    double coarse = mbs_scaled_norm(r, r->coarse, r->x, r->x_new, noise, &ignored);
    return fine * fine / sqrt(fine * fine + 0.01 * (coarse * coarse));
}

double mbs_error_allowing(mbs_run *r, double plain, int *worst)
{
    double noise = mbs_noise(r);
    return noise == 0.0 ? plain : mbs_error_beside(r, noise * mbs_largest(r->n, r->x_new), worst);
}

static double trial_error(mbs_run *r, int *worst)
{
    return mbs_error_allowing(r, mbs_error_beside(r, 0.0, worst), worst);
}

int mbs_take(mbs_run *r, double h, double t_new)
{
    int status = mbs_attempt(r, h, t_new), worst;
    if (status != MBS_RUNNING)
        return status;
    r->retaken = r->problem->step > 0.0 ? 0.0 : trial_error(r, &worst);
    return mbs_close_step(r, t_new);
}
