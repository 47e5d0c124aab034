/* Steps over singular positions, in which constraint rows become dependent.

   On one side of such a position and on the other the motion is smooth, but an acceleration off the constraints by e, at
   the distance s from it, is wrong by e/s, and by round-off/s^3 on them. So a step that comes near one is made with its
   slopes taken at states put back onto the constraints, and with another length if one of them falls too near to it or
   onto another branch of the motion: it steps across, and goes on where the way it came by leads. */
#include "stepper.h"


static double smaller(double a, double b)
{
    return a < b ? a : b;
}

static double larger(double a, double b)
{
    return a > b ? a : b;
}

static double independence(const mbs_run *r)
{
    if (r->report[0] < r->problem->independent)
        return 0.0;
    return r->report[0] > 0.0 ? r->report[1] : 1.0;
}

static double most(const mbs_state *s)
{
    return s->start < HUGE_VAL ? larger(larger(s->before, s->start), s->greatest) : 0.0;
}

/* The largest in the trial itself: what is nearest in it is near beside that. */
static double most_within(const mbs_state *s)
{
    return s->start < HUGE_VAL ? larger(s->start, s->greatest) : 0.0;
}

static double least(const mbs_state *s)
{
    return smaller(s->least, s->start);
}

static int comes_near(const mbs_state *s)
{
    return least(s) < larger(MBS_NEAR * most(s), MBS_NEAR_BY * s->peak);
}

static int singular(mbs_run *r, double t)
{
    return mbs_failed(r, MBS_SINGULAR, t, -1);
}

void mbs_begin_approach(mbs_run *r)
{
    r->state->least = HUGE_VAL;
    r->state->least_time = r->state->t;
    r->state->greatest = 0.0;
}

void mbs_look_at_rows(mbs_run *r, double t, const double *x)
{
    mbs_evaluate(r, t, x);
    if (isfinite(independence(r)))
        mbs_note_independence(r, t);
}

void mbs_note_independence(mbs_run *r, double t)
{
    mbs_state *s = r->state;
    s->latest = independence(r);
    if (s->latest < s->least)
        s->least_time = t;
    s->least = smaller(s->least, s->latest);
    s->greatest = larger(s->greatest, s->latest);
}

/* The part of the speeds by which round-off may falsify a state. */
static double round_off(const mbs_state *s)
{
    return MBS_NOISE / (least(s) * least(s));
}

/* As much noise, or more of it where many rows depend on each other. */
static double among_many(double noise)
{
    return larger(noise, smaller(MBS_MANY * noise, MBS_MOST_NOISE));
}

/* A state has been put onto another branch of the motion: further than round-off puts it. */
static int strays(const mbs_run *r, const double *x, const double *closed)
{
    return mbs_moved_far(r, x, closed, among_many(round_off(r->state)) * mbs_largest(r->n, x)) >= 0;
}

int mbs_put_onto_rows(mbs_run *r, double t, double *x)
{
    return mbs_project_aside(r, t, x, 0.0);
}

int mbs_closed(mbs_run *r, double t, const double *x, double *closed)
{
    mbs_copy(r->n, x, closed);
    int status = mbs_put_onto_rows(r, t, closed);
    return status == MBS_RUNNING && strays(r, x, closed) ? singular(r, t) : status;
}

int mbs_slope_on_rows(mbs_run *r, const double *x, double *slope)
{
    double t = r->state->t;
    mbs_copy(r->n, x, r->settled);
    int status = mbs_put_onto_rows(r, t, r->settled);
    if (status != MBS_RUNNING)
        return status;
    mbs_evaluate(r, t, r->settled);
    mbs_copy(r->n, r->known_slope, slope);
    ++r->state->evaluations;
    return mbs_all_finite(r, t, slope);
}

int mbs_restart_approach(mbs_run *r)
{
    mbs_state *s = r->state;
    s->near = s->stiff = 0;
    s->before = s->rate = 0.0;
    s->start = s->latest;
    return s->start < MBS_LEAST ? singular(r, s->t) : MBS_RUNNING;
}

void mbs_advance_approach(mbs_run *r)
{
    mbs_state *s = r->state;
    s->rate = (s->start - s->end) / (s->t_new - s->t);
    int near = s->near;
    s->near = s->near && comes_near(s);
    s->stiff = s->stiff && s->near;
    s->vain = 0;
    if (near && !s->near && r->method->collocation)
        r->stepper->restart(r);
    s->before = s->start;
    s->start = s->end;
    s->peak = larger(s->peak, s->start);
}

int mbs_comes_unforeseen(const mbs_run *r)
{
    return r->problem->crosses && comes_near(r->state) && !r->state->near;
}

static int comes_too_near(const mbs_run *r)
{
    const mbs_state *s = r->state;
    if (!r->problem->crosses)
        return s->start < HUGE_VAL && s->least < larger(MBS_LEAST_HELD, MBS_HELD * s->start);
    return comes_near(s) && s->least < larger(MBS_LEAST, MBS_MARGIN * most_within(s));
}

/* A step that must not lead across may have done so. */
static int dips(const mbs_run *r)
{
    const mbs_state *s = r->state;
    return !r->problem->crosses && s->least < MBS_DIPS * smaller(s->start, s->end);
}

int mbs_turns_stiff(mbs_run *r)
{
    mbs_state *s = r->state;
    if (!r->method->collocation || s->stiff || !s->near || comes_too_near(r))
        return 0;
    if (++s->vain < MBS_MOST_VAIN)
        return 0;
    s->stiff = 1;
    r->stepper->restart(r);
    return 1;
}

int mbs_verify_approach(mbs_run *r, double t)
{
    if (mbs_comes_unforeseen(r) || comes_too_near(r))
        return singular(r, t);
    return MBS_RUNNING;
}

/* The middle of the widest gap between the nodes of a step, as a part of it. */
static double widest_gap(const mbs_method *m)
{
    const double *nodes = m->collocation ? m->collocation->c : m->c;
    int count = m->collocation ? m->collocation->stages : m->family == MBS_EXPLICIT ? m->stages : 0;
    double from = 0.0, widest = 0.0, middle = 0.5;
    while (from < 1.0) {
        double to = 1.0;
        for (int i = 0; i < count; ++i)
            if (nodes[i] > from && nodes[i] < to)
                to = nodes[i];
        if (to - from > widest) {
            widest = to - from;
            middle = 0.5 * (from + to);
        }
        from = to;
    }
    return middle;
}

/* The step ends so near before the singular position that the one across it would be much shorter. */
static int leaves_no_room(const mbs_run *r)
{
    const mbs_state *s = r->state;
    double left = MBS_ROOM * MBS_SHORTER_AHEAD * MBS_SHORTER_AHEAD * widest_gap(r->method);
    return s->end < s->start && s->end <= s->least && s->end < left * (s->start - s->end);
}

int mbs_verify_end(mbs_run *r, double t)
{
    mbs_state *s = r->state;
    s->end = s->latest;
    int status = mbs_verify_approach(r, t);
    if (status == MBS_RUNNING && dips(r))
        return singular(r, t);
    if (status == MBS_RUNNING && s->near && (leaves_no_room(r) || strays(r, r->spare, r->x_new)))
        return singular(r, t);
    return status;
}

/* A step no longer than those that do elsewhere has no other error than round-off of that size. */
double mbs_noise(const mbs_run *r)
{
    const mbs_state *s = r->state;
    if (!s->near)
        return 0.0;
    double noise = round_off(s) * (most(s) - least(s)) / least(s);
    return s->h <= s->smooth ? among_many(noise) : noise;
}

/* How long after the start of the step the independence is zero: beside the place in the trial where it was least, on the
   side on which, going on as before, it would be; 0 if nothing tells. */
static double way_to_singular(const mbs_state *s)
{
    double expected = s->rate > 0.0 ? s->start / s->rate : 0.0, ahead = s->least_time - s->t;
    if (!(ahead > 0.0 && s->least < MBS_NEAR * s->start))
        return expected;
    double before = ahead * s->start / (s->start - s->least), behind = ahead * s->start / (s->start + s->least);
    if (!(expected > 0.0))
        return ahead;
    return fabs(before - expected) < fabs(behind - expected) ? before : behind;
}

/* The next trial is to have the singular position in its widest gap between nodes; else the step after it will. */
double mbs_retreat(mbs_run *r, double h, double otherwise)
{
    const mbs_state *s = r->state;
    if (!s->near)
        return otherwise;
    double way = way_to_singular(s) / h, gap = widest_gap(r->method);
    if (!(way > 0.0))
        return MBS_GOLDEN_RETREAT;
    if (way <= MBS_SHORTER_AHEAD * gap)
        return way / gap;
    return smaller(way - MBS_SHORTER_AHEAD * MBS_SHORTER_AHEAD * gap, MBS_SHORTER_AHEAD);
}

/* How long to make a step that might be h: where the singular position comes into it, or so near behind it that the next
   one has no room, it is to lie in the widest gap between the nodes of this step, or of the next. */
double mbs_laid(const mbs_run *r, double h)
{
    const mbs_state *s = r->state;
    double way = s->near && s->rate > 0.0 ? s->start / s->rate / h : 0.0;
    if (!(way > 0.0))
        return h;
    double gap = widest_gap(r->method);
    if (way >= 1.0 + gap)
        return h;
    if (way <= gap)
        return h * (way / gap);
    return way <= MBS_ASIDE * gap ? h : h * smaller(way - gap, 1.0);
}

/* ---- when they were passed ---- */

/* The independence at t + theta h in the step that is finished. */
static double within(mbs_run *r, double theta)
{
    double t = r->state->t + theta * r->state->h, *x = r->settled;
    if (mbs_value(r, theta, x) != MBS_RUNNING)
        return NAN;
    mbs_evaluate(r, t, x);
    return independence(r);
}

/* Where between two places the independence goes down to zero and up again as steeply; its value beside it. */
static double dip(mbs_run *r, const double *places, const double *values, double *left)
{
    double low = places[0], high = places[1], at_low = values[0], at_high = values[1], theta = low;
    for (int round = 0; round < MBS_DIP_ROUNDS; ++round) {
        double width = 0.125 * (high - low);
        theta = low + (high - low) * (at_low / (at_low + at_high));
        low = larger(theta - width, places[0]);
        high = smaller(theta + width, places[1]);
        at_low = within(r, low);
        at_high = within(r, high);
    }
    *left = smaller(at_low, at_high);
    return theta;
}

/* Fill in every `stride`-th look but those of every `known`-th. */
static void look_within(mbs_run *r, double end, int stride, int known, double *looks)
{
    for (int k = 0; k <= MBS_LOOKS; k += stride)
        if (known == 0 || k % known)
            looks[k] = within(r, end * k / MBS_LOOKS);
}

/* Whether the independence may go down to zero and up again between two looks, of every `stride`-th, as steeply as it goes
   elsewhere. */
static int may_vanish(const double *looks, int stride, int low, int high)
{
    double steepest = 0.0;
    for (int k = 0; k < MBS_LOOKS; k += stride)
        steepest = larger(steepest, fabs(looks[k + stride] - looks[k]));
    return !(looks[low] + looks[high] > MBS_STEEPER * steepest * ((high - low) / stride));
}

/* Whether the independence goes one way all along, as a few looks and all slopes of the step have it. */
static int vanishes_nowhere(const mbs_state *s, const double *looks)
{
    int stride = MBS_LOOKS / MBS_FEW_LOOKS, up = 1, down = 1;
    for (int k = 0; k < MBS_LOOKS; k += stride) {
        up &= looks[k] <= looks[k + stride];
        down &= looks[k] >= looks[k + stride];
        if (may_vanish(looks, stride, k, k + stride))
            return 0;
    }
    double lowest = up ? looks[0] : looks[MBS_LOOKS], highest = up ? looks[MBS_LOOKS] : looks[0];
    return (up || down) && least(s) >= lowest / MBS_SEEN && most_within(s) <= highest * MBS_SEEN;
}

/* Beside a singular position the independence goes down, and up again, in proportion to the distance. */
void mbs_find_singular(mbs_run *r)
{
    mbs_state *s = r->state;
    double looks[MBS_LOOKS + 1], largest = 0.0, end = (s->t_new - s->t) / s->h;
    s->passed = 0;
    if (!s->near)
        return;
    look_within(r, end, MBS_LOOKS / MBS_FEW_LOOKS, 0, looks);
    if (vanishes_nowhere(s, looks))
        return;
    look_within(r, end, 1, MBS_LOOKS / MBS_FEW_LOOKS, looks);
    for (int k = 0; k <= MBS_LOOKS; ++k)
        largest = larger(largest, looks[k]);
    for (int k = 0; k <= MBS_LOOKS; ++k) {
        int low = k > 0 ? k - 1 : 0, high = k < MBS_LOOKS ? k + 1 : MBS_LOOKS;
        if (!((k == 0 || looks[k] < looks[low]) && (k == MBS_LOOKS || looks[k] <= looks[high])))
            continue;
        if (!may_vanish(looks, 1, low, high))
            continue;
        double places[] = {end * low / MBS_LOOKS, end * high / MBS_LOOKS}, values[] = {looks[low], looks[high]}, left;
        double theta = dip(r, places, values, &left);
        if (left < 0.5 * smaller(looks[low], looks[high]) && left < MBS_MARGIN * largest && s->passed < MBS_PASSED)
            s->singular[s->passed++] = s->t + theta * s->h;
    }
}
