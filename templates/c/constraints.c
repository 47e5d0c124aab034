/* The state of a step put back onto the constraints. */
#include "stepper.h"

double mbs_violation(mbs_run *r, const mbs_program *program, double t, const double *x)
{
    double *out[2] = {r->rows, r->correction};
    mbs_call(r, program, t, x, out);
    return mbs_largest(r->system->ns, r->rows);
}

int mbs_worst_row(const mbs_run *r)
{
    int row = 0;
    for (int i = 1; i < r->system->ns; ++i)
        if (!(fabs(r->rows[i]) <= fabs(r->rows[row])))
            row = i;
    return row;
}

/* Correct `count` entries of x from `first` on until the rows hold to `goal` or get no better; `before` and `after`
   receive the largest |row|. */
static int close_rows(mbs_run *r, const mbs_program *program, double t, double *x, int first, int count, double goal,
                      double *before, double *after)
{
    double *part = x + first, *kept = r->kept;
    double size = 1.0 + mbs_largest(count, part), previous = HUGE_VAL;
    *before = *after = mbs_violation(r, program, t, x);
    for (int round = 0; round < 20 && *after > goal && *after < 0.5 * previous; ++round) {
        previous = *after;
        mbs_copy(count, part, kept);
        for (int i = 0; i < count; ++i)
            part[i] += r->correction[i];
        *after = mbs_violation(r, program, t, x);
        if (!(*after < previous)) {
            mbs_copy(count, kept, part);
            *after = previous;
        }
    }
    if (*after <= r->problem->closure * size)
        return MBS_RUNNING;
    return mbs_failed(r, MBS_NOT_CLOSED, t, mbs_worst_row(r));
}

void mbs_normalize(mbs_run *r, double t, double *x, double *deviation)
{
    double *out[2] = {r->correction, deviation};
    if (!r->system->normalize)
        return;
    mbs_call(r, r->system->normalize, t, x, out);
    mbs_copy(r->system->nq, r->correction, x);
}

int mbs_project(mbs_run *r, double t, double *x, double goal)
{
    const mbs_system *s = r->system;
    int status = MBS_RUNNING;
    if (s->project_position)
        status = close_rows(r, s->project_position, t, x, 0, s->nq, goal, &r->removed_position, &r->drift_position);
    if (status == MBS_RUNNING && s->project_velocity)
        status = close_rows(r, s->project_velocity, t, x, s->nq, s->nu, goal, &r->removed_velocity, &r->drift_velocity);
    return status;
}

/* A state between steps that was moved by over a tenth of the step has settled on another branch of the motion. */
static int strays(const mbs_run *r, const double *before, const double *settled)
{
    double moved = 0.0, step = 0.0;
    for (int i = 0; i < r->n; ++i) {
        double change = fabs(settled[i] - before[i]), whole = fabs(r->x_new[i] - r->x[i]);
        moved = change > moved ? change : moved;
        step = whole > step ? whole : step;
    }
    return moved > 0.1 * step;
}

void mbs_settle_sample(mbs_run *r, double t, double *x)
{
    double deviation;
    mbs_normalize(r, t, x, &deviation);
    mbs_copy(r->n, x, r->spare);
    int kept_on_rows = r->problem->project || r->system->index_2;
    if (kept_on_rows && (mbs_project(r, t, x, MBS_ROUND_OFF) != MBS_RUNNING || strays(r, r->spare, x)))
        mbs_copy(r->n, r->spare, x);
}
