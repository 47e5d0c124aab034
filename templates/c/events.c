/* Events: where switching functions change sign within a step.

   A step that crosses, or looks beyond a kink in one of its slopes, is taken again to just before the crossing, until no
   slope is from beyond; its continuous extension then leads over it. What has just been crossed counts as crossed
   whatever round-off says, and a function that starts at zero has no side until it has left it. */
#include "stepper.h"

#define BEYOND 1e-6      /* part of a step by which its extension is followed beyond its end */
#define SHORT_OF 1e-7    /* part of the way to the crossing by which the repeated step stays away from it, ... */
#define SHORTER 100.0    /* ... this many times more whenever that was not enough */
#define AT_ONCE 1e-3     /* part of a step in which a function that crosses back after its own event chatters */
#define REPEATS 20
#define LOOKS 32 /* how often the functions of stops are looked at within a step that nothing crosses at its end */

static double side(double value)
{
    return (double)((value > 0.0) - (value < 0.0));
}

static void evaluate(mbs_run *r, double t, const double *x)
{
    mbs_call(r, r->system->events, t, x, &r->values);
}

/* A stop is crossed upwards, a kink in both directions. */
static int crossed(const mbs_run *r, int i)
{
    return r->sides[i] * r->values[i] < 0.0 && (!r->system->terminal[i] || r->values[i] > 0.0);
}

static int any_crossed(const mbs_run *r)
{
    for (int i = 0; i < r->system->ng; ++i)
        if (crossed(r, i))
            return 1;
    return 0;
}

static void note_sides(mbs_run *r)
{
    for (int i = 0; i < r->system->ng; ++i)
        if (r->values[i] != 0.0)
            r->sides[i] = side(r->values[i]);
}

void mbs_start_events(mbs_run *r)
{
    mbs_fill(r->system->ng, 0.0, r->sides);
    evaluate(r, r->state->t, r->x);
    note_sides(r);
}

/* A way from x on: the continuous extension of the step, or straight on, which nothing from beyond a kink can bend. */
typedef int (*path)(mbs_run *r, double theta, double *x);

static int straight_on(mbs_run *r, double theta, double *x)
{
    for (int i = 0; i < r->n; ++i)
        x[i] = r->x[i] + theta * r->state->h * r->slope[i];
    return MBS_RUNNING;
}

/* Where the step cannot be interpolated no function has a value, hence none has crossed. */
static void evaluate_at(mbs_run *r, path along, double theta)
{
    if (along(r, theta, r->event_x) != MBS_RUNNING)
        mbs_fill(r->n, NAN, r->event_x);
    evaluate(r, r->state->t + theta * r->state->h, r->event_x);
}

/* Reduce [low, high], parts of the step at whose upper end function i has been crossed, to round-off of the time by the
   Illinois method, with a bisection now and then; returns the upper end. */
static double located(mbs_run *r, path along, int i, double low, double high)
{
    double end = fabs(r->state->t) + fabs(r->state->h), least = MBS_EPSILON * end / r->state->h;
    evaluate_at(r, along, high);
    double at_high = r->values[i], at_low;
    evaluate_at(r, along, low);
    at_low = r->values[i];
    for (int round = 0, last = 0; round < 200 && high - low > (least > MBS_EPSILON ? least : MBS_EPSILON); ++round) {
        double middle = low + (high - low) * (at_low / (at_low - at_high));
        if (round % 3 == 2 || !(middle > low && middle < high))
            middle = 0.5 * (low + high);
        evaluate_at(r, along, middle);
        if (crossed(r, i)) {
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
static double first_crossing(mbs_run *r, path along, double low, double high)
{
    for (int i = 0; i < r->system->ng; ++i) {
        evaluate_at(r, along, high);
        if (crossed(r, i))
            high = located(r, along, i, low, high);
    }
    return high;
}

/* End the step at (t_new, event_x), where `values` are those of the functions: note which one it was, stops first. */
static int end_at(mbs_run *r, double t_new)
{
    mbs_state *s = r->state;
    for (int i = 0; i < r->system->ng; ++i)
        if (crossed(r, i) && (s->crossing < 0 || r->system->terminal[i] > r->system->terminal[s->crossing]))
            s->crossing = i;
    note_sides(r);
    s->t_new = t_new < r->problem->t_end ? t_new : r->problem->t_end;
    return MBS_RUNNING;
}

/* What crosses only in the end as it was settled, not in the continuous extension, crosses at the end. */
static int end_at_once(mbs_run *r)
{
    mbs_copy(r->n, r->x_new, r->event_x);
    evaluate(r, r->state->t_new, r->event_x);
    return end_at(r, r->state->t_new);
}

static int end_within(mbs_run *r, double theta)
{
    evaluate_at(r, mbs_value, theta);
    mbs_settle_sample(r, r->state->t + theta * r->state->h, r->event_x);
    return end_at(r, r->state->t + theta * r->state->h);
}

int mbs_beyond_kink(mbs_run *r, double t, const double *x)
{
    evaluate(r, t, x);
    for (int i = 0; i < r->system->ng; ++i)
        if (i != r->state->origin && !r->system->terminal[i] && crossed(r, i))
            return 1;
    return 0;
}

int mbs_stuck_at_kink(const mbs_run *r, int status)
{
    return status == MBS_NOT_CONVERGED && r->beyond;
}

/* A function that crosses back at once, as dry friction at rest, chatters: it may, in this step. */
static void let_chatter(mbs_run *r)
{
    int i = r->state->origin;
    evaluate_at(r, mbs_value, 1.0);
    if (i >= 0 && crossed(r, i) && located(r, mbs_value, i, 0.0, 1.0) < AT_ONCE)
        r->sides[i] = -r->sides[i];
    evaluate(r, r->state->t_new, r->x_new);
}

static int pass(mbs_run *r)
{
    evaluate(r, r->state->t_new, r->x_new);
    note_sides(r);
    return MBS_RUNNING;
}

/* A step without a slope from beyond a kink ends at a crossing just behind its end, if there is one. */
static int end_clean(mbs_run *r)
{
    evaluate_at(r, mbs_value, 1.0 + BEYOND);
    return any_crossed(r) ? end_within(r, first_crossing(r, mbs_value, 1.0, 1.0 + BEYOND)) : pass(r);
}

/* A stop may become true and false again within a step that nothing else ends: look for it on the way. */
static int pass_looking(mbs_run *r)
{
    const mbs_system *system = r->system;
    int stops = 0;
    for (int i = 0; i < system->ng; ++i)
        stops += system->terminal[i];
    if (!stops) {
        note_sides(r);
        return MBS_RUNNING;
    }
    for (int look = 1; look < LOOKS; ++look) {
        double theta = (double)look / LOOKS;
        evaluate_at(r, mbs_value, theta);
        for (int i = 0; i < system->ng; ++i)
            if (system->terminal[i] && crossed(r, i))
                return end_within(r, located(r, mbs_value, i, 0.0, theta));
    }
    return pass(r);
}

int mbs_find_event(mbs_run *r, int status)
{
    mbs_state *s = r->state;
    double least = 16.0 * MBS_EPSILON * fabs(s->t), way = s->h, margin = SHORT_OF;
    int taken = status == MBS_RUNNING;
    if (taken)
        evaluate(r, s->t_new, r->x_new);
    if (taken && s->origin >= 0 && crossed(r, s->origin))
        let_chatter(r);
    for (int round = 0; !taken || any_crossed(r) || r->beyond; ++round) {
        if (taken && any_crossed(r)) {
            evaluate_at(r, mbs_value, 1.0);
            if (!any_crossed(r))
                return end_at_once(r);
            double theta = first_crossing(r, mbs_value, 0.0, 1.0);
            way = theta * s->h;
            if (!(way > least) || round == REPEATS)
                return end_within(r, theta);
        } else {
            if (round == REPEATS)
                return taken ? pass(r) : status;
            evaluate_at(r, straight_on, 1.0);
            if (any_crossed(r)) {
                way = first_crossing(r, straight_on, 0.0, 1.0) * s->h;
                if (taken && !(way > least)) /* a kink at the very start is none within the step */
                    return pass(r);
            }
        }
        double h = way * (1.0 - (margin < 0.5 ? margin : 0.5));
        status = mbs_take(r, h, s->t + h);
        taken = status == MBS_RUNNING;
        if (!taken && !mbs_stuck_at_kink(r, status))
            return status;
        if (r->beyond)
            margin *= SHORTER;
        if (margin > 0.5)
            way = h;
        if (taken)
            evaluate(r, s->t_new, r->x_new);
        if (taken && !any_crossed(r) && !r->beyond)
            return end_clean(r);
    }
    return pass_looking(r);
}
