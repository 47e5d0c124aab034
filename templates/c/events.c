/* Events: where switching functions change sign within a step.

   A step that crosses, or looks beyond a kink in one of its slopes, is taken again to just before the crossing, until no
   slope is from beyond; its continuous extension then leads over it. A slope at a kink but for round-off is that just
   before it, as a force may jump there, and the step ends just behind. What nothing crosses at the end of a step may cross
   and cross back within it: the functions are looked at until their signs are certain (looks.c). What has just been
   crossed counts as crossed whatever round-off says, and a function that starts at zero has no side until it has left
   it. A stop that is above zero counts anew once it has been below: a step in which it goes there and comes back ends in
   between, as nothing crosses. */
#include "stepper.h"


/* The way that nothing from beyond a kink can bend. */
static int straight_on(mbs_run *r, double theta, double *x)
{
    for (int i = 0; i < r->n; ++i)
        x[i] = r->x[i] + theta * r->state->h * r->slope[i];
    return MBS_RUNNING;
}

/* Reduce [low, high], parts of the step at whose upper end function i has been crossed, to round-off of the time by the
   Illinois method, with a bisection now and then; returns the upper end. Where an end is the crossing but for round-off, a
   look beside it, by what is sought, is the last. */
static double located(mbs_run *r, mbs_path along, int i, double low, double high)
{
    double end = fabs(r->state->t) + fabs(r->state->h), least = MBS_EPSILON * end / r->state->h;
    least = least > MBS_EPSILON ? least : MBS_EPSILON;
    mbs_switching_at(r, along, high);
    double at_high = r->values[i], at_low;
    mbs_switching_at(r, along, low);
    at_low = r->values[i];
    for (int round = 0, last = 0; round < MBS_LOCATING_ROUNDS && high - low > least; ++round) {
        double middle = low + (high - low) * (at_low / (at_low - at_high));
        if (round % 3 == 2 || !(middle >= low && middle <= high)) {
            middle = 0.5 * (low + high);
        } else {
            middle = middle > low + least ? middle : low + least;
            middle = middle < high - least ? middle : high - least;
        }
        mbs_switching_at(r, along, middle);
        if (mbs_crossed(r, i)) {
            high = middle;
            at_high = r->values[i];
            at_low = last > 0 ? 0.5 * at_low : at_low;
            last = 1;
        } else {
            low = middle;
            at_low = r->values[i];
            at_high = last < 0 ? 0.5 * at_high : at_high;
            last = -1;
        }
    }
    return high;
}

/* The part of the step at which the first of the functions crosses that have crossed at `high`. */
static double first_crossing(mbs_run *r, mbs_path along, double low, double high)
{
    mbs_switching_at(r, along, high);
    for (int i = 0; i < r->system->ng; ++i) {
        if (!mbs_crossed(r, i))
            continue;
        double left = i == r->state->origin ? r->left / r->state->h : 0.0;
        high = located(r, along, i, left > low && left < high ? left : low, high);
        mbs_switching_at(r, along, high);
    }
    return high;
}

/* End the step at (t_new, event_x), where `values` are those of the functions: note which one it was, stops first. */
static int end_at(mbs_run *r, double t_new)
{
    mbs_state *s = r->state;
    for (int i = 0; i < r->system->ng; ++i)
        if (mbs_crossed(r, i) && (s->crossing < 0 || r->system->terminal[i] > r->system->terminal[s->crossing]))
            s->crossing = i;
    mbs_note_sides(r);
    s->t_new = t_new < r->problem->t_end ? t_new : r->problem->t_end;
    return MBS_RUNNING;
}

/* What crosses only in the end as it was settled, not in the continuous extension, crosses at the end. */
static int end_at_once(mbs_run *r)
{
    mbs_copy(r->n, r->x_new, r->event_x);
    mbs_switching(r, r->state->t_new, r->event_x);
    return end_at(r, r->state->t_new);
}

static int end_within(mbs_run *r, double theta)
{
    mbs_switching_at(r, mbs_value, theta);
    mbs_settle_sample(r, r->state->t + theta * r->state->h, r->event_x);
    return end_at(r, r->state->t + theta * r->state->h);
}

int mbs_stuck_at_kink(const mbs_run *r, int status)
{
    return status == MBS_NOT_CONVERGED && r->beyond;
}

/* The values at (t, x + h slope). */
static void look_at(mbs_run *r, double t, const double *x, double h, const double *slope)
{
    for (int i = 0; i < r->n; ++i)
        r->event_x[i] = x[i] + h * slope[i];
    mbs_switching(r, t, r->event_x);
}

void mbs_begin_watch(mbs_run *r)
{
    int i = r->state->origin;
    r->left = 0.0;
    r->chattering = 0;
    if (i < 0)
        return;
    double t = r->state->t, way = mbs_largest(r->n, r->x), rate = mbs_largest(r->n, r->slope);
    double by_state = rate > 0.0 ? way / rate : 0.0, soon = MBS_SOON * (fabs(t) > by_state ? fabs(t) : by_state);
    look_at(r, t, r->x, 0.0, r->slope);
    double before = r->values[i];
    look_at(r, t + soon, r->x, soon, r->slope);
    r->chattering = !(r->sides[i] * (r->values[i] - before) > 0.0);
    r->left = r->chattering ? 0.0 : soon;
}

/* A function that turns back and crosses at once after its own event, as dry friction at rest: it may, in this step. */
static void let_chatter(mbs_run *r)
{
    int i = r->state->origin;
    if (i < 0 || !r->chattering)
        return;
    mbs_switching(r, r->state->t_new, r->x_new);
    if (!mbs_crossed(r, i))
        return;
    mbs_switching_at(r, mbs_value, 1.0);
    if (!mbs_crossed(r, i))
        return;
    r->flipped = located(r, mbs_value, i, 0.0, 1.0) < MBS_AT_ONCE;
    r->sides[i] = r->flipped ? -r->sides[i] : r->sides[i];
}

/* End the step where it ends, where the functions have the `values`. */
static int pass_with_values(mbs_run *r)
{
    mbs_note_sides(r);
    mbs_keep_switching(r, r->state->t_new, r->x_new);
    return MBS_RUNNING;
}

static int pass(mbs_run *r)
{
    mbs_switching(r, r->state->t_new, r->x_new);
    return pass_with_values(r);
}

/* A step without a slope from beyond a kink ends at a crossing just behind its end, if there is one before the run ends.
   One that was taken again may have become inaccurate, as the one before met no force there. */
static int end_clean(mbs_run *r)
{
    if (!(r->retaken <= 1.0)) {
        if (r->flipped)
            r->sides[r->state->origin] = -r->sides[r->state->origin];
        return mbs_failed(r, MBS_STEP_UNDERFLOW, r->state->t, 0);
    }
    mbs_switching_at(r, mbs_value, 1.0 + MBS_BEYOND);
    if (!mbs_any_crossed(r))
        return pass(r);
    double theta = first_crossing(r, mbs_value, 1.0, 1.0 + MBS_BEYOND), t = r->state->t + theta * r->state->h;
    return t - r->problem->t_end > MBS_ROUNDED_TIME * fabs(t) ? pass(r) : end_within(r, theta);
}

/* The first part of a way, that nothing crosses at its end x_new, at which something is seen to have crossed; 2 if nothing
   is. The `values` are those at the end, before and behind. What is zero at the start is on the side to which it goes.
   `below` becomes the first part at which a stop that is above zero at both ends is seen below it, 2 if none is. */
static double looked(mbs_run *r, mbs_path along, const double *x_new, const double *slope_new)
{
    const mbs_state *s = r->state;
    int ng = r->system->ng;
    double *end = r->looks, *after = end + ng, *before = after + ng, *start = before + ng, probe = MBS_PROBE * s->h;
    double high = 2.0;
    r->below = 2.0;
    mbs_copy(ng, r->values, end);
    look_at(r, s->t + probe, r->x, probe, r->slope);
    mbs_copy(ng, r->values, after);
    look_at(r, s->t_new - probe, x_new, -probe, slope_new);
    mbs_copy(ng, r->values, before);
    mbs_switching(r, s->t, r->x);
    mbs_copy(ng, r->values, start);
    for (int i = 0; i < ng; ++i) {
        r->sides[i] = r->sides[i] == 0.0 ? mbs_side(after[i]) : r->sides[i];
        double on = r->sides[i], first = on * start[i];
        int above = r->system->terminal[i] && on > 0.0;
        if ((above && end[i] < 0.0) || (i == s->origin && r->chattering))
            continue;
        double found = mbs_first_seen(r, along, i, first < 0.0 ? 0.0 : first, on * after[i], on * before[i], on * end[i]);
        double *least = above ? &r->below : &high;
        *least = found < *least ? found : *least;
    }
    mbs_copy(ng, end, r->values);
    return high;
}

/* A part of the step at which something has crossed, its end first; 2 if nothing is known to. */
static double trouble(mbs_run *r)
{
    r->below = 2.0;
    mbs_switching(r, r->state->t_new, r->x_new);
    if (mbs_any_crossed(r))
        return 1.0;
    return r->beyond ? 2.0 : looked(r, mbs_value, r->x_new, r->slope_new);
}

/* A part of the step at which something has crossed straight on; 2 if nothing does. */
static double ahead(mbs_run *r)
{
    mbs_switching_at(r, straight_on, 1.0);
    if (mbs_any_crossed(r))
        return 1.0;
    mbs_copy(r->n, r->event_x, r->spare);
    return looked(r, straight_on, r->spare, r->slope);
}

/* The time in which a kink that has crossed, by the values, changes by its round-off alone: nearer to it a step may leave
   all components as they are, so that none would ever get there. */
static double unresolved(mbs_run *r)
{
    mbs_state *s = r->state;
    double probe = MBS_PROBE * s->h;
    for (int i = 0; i < r->system->ng; ++i) {
        if (r->system->terminal[i] || !mbs_crossed(r, i))
            continue;
        straight_on(r, MBS_PROBE, r->event_x);
        mbs_switching(r, s->t + probe, r->event_x);
        double after = r->values[i];
        mbs_switching(r, s->t, r->x);
        double change = fabs(after - r->values[i]);
        return change > 0.0 ? mbs_unseen(r, i) * probe / change : 0.0;
    }
    return 0.0;
}

int mbs_find_event(mbs_run *r, int status)
{
    mbs_state *s = r->state;
    double least = MBS_ROUNDED_TIME * fabs(s->t), way = s->h, margin = MBS_SHORT_OF;
    int taken = status == MBS_RUNNING;
    r->flipped = 0;
    r->retaken = 0.0;
    if (taken)
        let_chatter(r);
    for (int round = 0;; ++round) {
        double high = taken ? trouble(r) : 2.0;
        int below = taken && high > 1.0 && r->below <= 1.0 && round < MBS_REPEATS;
        if (taken && high > 1.0 && !r->beyond && !below)
            return round || r->touched ? end_clean(r) : pass_with_values(r);
        if (below) {
            status = mbs_take(r, r->below * s->h, s->t + r->below * s->h);
            taken = status == MBS_RUNNING;
            if (!taken && !mbs_stuck_at_kink(r, status))
                return status;
            continue;
        }
        if (high <= 1.0) {
            mbs_switching_at(r, mbs_value, high);
            if (!mbs_any_crossed(r))
                return end_at_once(r);
            double theta = first_crossing(r, mbs_value, 0.0, high);
            way = theta * s->h;
            double near = unresolved(r), soon = near > least ? near : least;
            if (!(way * (1.0 - (margin < 0.5 ? margin : 0.5)) > soon) || round == MBS_REPEATS)
                return end_within(r, theta);
        } else {
            if (round == MBS_REPEATS)
                return taken ? pass(r) : status;
            if ((high = ahead(r)) <= 1.0) {
                way = first_crossing(r, straight_on, 0.0, high) * s->h;
                if (taken && !(way > least)) { /* at the very start: the function may tell another kink within */
                    mbs_note_sides(r); /* of where it has crossed */
                    r->beyond = 0;
                    continue;
                }
            }
        }
        double h = way * (1.0 - (margin < 0.5 ? margin : 0.5));
        status = mbs_take(r, h, s->t + h);
        taken = status == MBS_RUNNING;
        if (!taken && !mbs_stuck_at_kink(r, status))
            return status;
        if (r->beyond)
            margin *= MBS_SHORTER;
        if (margin > 0.5)
            way = h;
    }
}
