/* The state of a step put back onto the constraints. */
#include "stepper.h"


/* The largest |row| of a projection program at (t, x); the rows stay in r->rows, its correction in r->correction. */
static double violation(mbs_run *r, const mbs_program *program, double t, const double *x)
{
    double *out[2] = {r->rows, r->correction};
    mbs_call(r, program, t, x, out);
    return mbs_largest(r->system->ns, r->rows);
}

int mbs_has_rows(const mbs_system *s, int speeds)
{
    return s->missed || (speeds ? s->project_velocity : s->project_position);
}

double mbs_violation(mbs_run *r, int speeds, double t, const double *x)
{
    const mbs_system *s = r->system;
    if (!s->missed)
        return violation(r, speeds ? s->project_velocity : s->project_position, t, x);
    double *out[2] = {speeds ? r->others : r->rows, speeds ? r->rows : r->others};
    mbs_call(r, s->missed, t, x, out);
    return mbs_largest(s->ns, r->rows);
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
    *before = *after = violation(r, program, t, x);
    for (int round = 0; round < MBS_CLOSING_ROUNDS && *after > goal && *after < 0.5 * previous; ++round) {
        previous = *after;
        mbs_copy(count, part, kept);
        for (int i = 0; i < count; ++i)
            part[i] += r->correction[i];
        *after = violation(r, program, t, x);
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

/* The largest |phi| and |phidot| at (t, x). */
static void look(mbs_run *r, double t, const double *x, double *found)
{
    double *out[2] = {r->rows, r->others};
    mbs_call(r, r->system->missed, t, x, out);
    found[0] = mbs_largest(r->system->ns, r->rows);
    found[1] = mbs_largest(r->system->ns, r->others);
}

/* Correct both levels together until each holds to its goal or gets no better: with one factorisation a round, and none
   to see that they hold. Speeds are corrected for where the coordinates go, and so never without them; that they go is
   nothing to phi where it is round-off. `after` has the largest |row| of both before and after. */
static void correct(mbs_run *r, double t, double *x, const double *sizes, const double *goal, double *after)
{
    const mbs_system *s = r->system;
    double previous[2] = {HUGE_VAL, HUGE_VAL}, *out[2] = {r->correction, r->correction + s->nq};
    for (int round = 0; round < MBS_CLOSING_ROUNDS; ++round) {
        int going[2];
        for (int k = 0; k < 2; ++k)
            going[k] = after[k] > goal[k] && after[k] < 0.5 * previous[k];
        if (!going[0] && !going[1])
            break;
        mbs_copy(r->n, x, r->kept);
        mbs_call(r, s->put_back, t, x, out);
        for (int i = 0; i < r->n; ++i)
            x[i] += r->correction[i];
        previous[0] = after[0];
        previous[1] = after[1];
        look(r, t, x, after);
        int closer = going[0] && after[0] < previous[0];
        int slower = after[0] <= MBS_ROWS_NOTHING * sizes[0] && (going[0] || after[1] < previous[1]);
        if (!closer && !slower) {
            mbs_copy(r->n, r->kept, x);
            mbs_copy(2, previous, after);
            break;
        }
        previous[1] = going[0] ? HUGE_VAL : previous[1];
    }
}

static int project_together(mbs_run *r, double t, double *x, double goal)
{
    const mbs_system *s = r->system;
    double sizes[2] = {1.0 + mbs_largest(s->nq, x), 1.0 + mbs_largest(s->nu, x + s->nq)}, goals[2], found[2];
    for (int k = 0; k < 2; ++k)
        goals[k] = goal > 0.0 ? goal : MBS_ROWS_FLOOR * sizes[k];
    look(r, t, x, found);
    r->removed_position = found[0];
    r->removed_velocity = found[1];
    correct(r, t, x, sizes, goals, found);
    r->drift_position = found[0];
    r->drift_velocity = found[1];
    if (found[0] <= r->problem->closure * sizes[0] && found[1] <= r->problem->closure * sizes[1])
        return MBS_RUNNING;
    mbs_violation(r, found[0] <= r->problem->closure * sizes[0], t, x);
    return mbs_failed(r, MBS_NOT_CLOSED, t, mbs_worst_row(r));
}

int mbs_project(mbs_run *r, double t, double *x, double goal)
{
    const mbs_system *s = r->system;
    int status = MBS_RUNNING;
    if (s->put_back)
        return project_together(r, t, x, goal);
    if (s->project_position)
        status = close_rows(r, s->project_position, t, x, 0, s->nq, goal, &r->removed_position, &r->drift_position);
    if (status == MBS_RUNNING && s->project_velocity)
        status = close_rows(r, s->project_velocity, t, x, s->nq, s->nu, goal, &r->removed_velocity, &r->drift_velocity);
    return status;
}

int mbs_project_aside(mbs_run *r, double t, double *x, double goal)
{
    double kept[] = {r->removed_position, r->drift_position, r->removed_velocity, r->drift_velocity};
    int status = mbs_project(r, t, x, goal);
    r->removed_position = kept[0];
    r->drift_position = kept[1];
    r->removed_velocity = kept[2];
    r->drift_velocity = kept[3];
    return status;
}

int mbs_moved_far(const mbs_run *r, const double *before, const double *settled, double allowed)
{
    double moved = 0.0, step = 0.0;
    int component = 0;
    for (int i = 0; i < r->n; ++i) {
        double change = fabs(settled[i] - before[i]), whole = fabs(before[i] - r->x[i]);
        if (change > moved) {
            moved = change;
            component = i;
        }
        if (whole > step)
            step = whole;
    }
    double round_off = MBS_FAR_BEYOND_ROUND_OFF * (1.0 + mbs_largest(r->n, settled));
    return moved > MBS_MOVED_FAR * step + allowed && moved > round_off ? component : -1;
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
    return moved > MBS_MOVED_FAR * step;
}

void mbs_settle_sample(mbs_run *r, double t, double *x)
{
    double deviation;
    mbs_normalize(r, t, x, &deviation);
    mbs_copy(r->n, x, r->spare);
    int kept_on_rows = r->problem->project || r->system->index_2;
    if (kept_on_rows && (mbs_project_aside(r, t, x, MBS_ROUND_OFF) != MBS_RUNNING || strays(r, r->spare, x)))
        mbs_copy(r->n, r->spare, x);
}
