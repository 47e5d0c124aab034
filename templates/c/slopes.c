/* The slope of a state: on the constraints near singular positions, watched for kinks and for the rank of the rows. */
#include "stepper.h"

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

int mbs_derivative(mbs_run *r, double t, const double *x, double *slope)
{
    int status = MBS_RUNNING, near = r->state->near;
    if (near && (status = mbs_closed(r, t, x, r->settled)) != MBS_RUNNING)
        return status;
    t = mbs_time_of_slope(r, t, x);
    mbs_evaluate(r, t, near ? r->settled : x);
    mbs_copy(r->n, r->known_slope, slope);
    ++r->state->evaluations;
    if ((status = mbs_all_finite(r, t, slope)) == MBS_RUNNING && r->system->ns > 0) {
        note_report(r, t);
        mbs_note_independence(r, t);
    }
    return status;
}

/* Start the step on the constraints. */
static void start_on_rows(mbs_run *r)
{
    mbs_copy(r->n, r->x, r->x_new);
    if (mbs_put_onto_rows(r, r->state->t, r->x) == MBS_RUNNING &&
        mbs_derivative(r, r->state->t, r->x, r->slope_new) == MBS_RUNNING)
        mbs_copy(r->n, r->slope_new, r->slope);
    else
        mbs_copy(r->n, r->x_new, r->x);
}

void mbs_foresee(mbs_run *r)
{
    r->state->near = 1;
    if (r->method->collocation)
        r->stepper->restart(r);
    if (!r->problem->project)
        start_on_rows(r);
}
