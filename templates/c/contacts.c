/* From state to state of contacts: which touch, what strikes, and which state follows. It decides as simulate does, in numbers,
   for elements that press along one row and rub along at most one other. */
#include "contact_laws.h"
#include "vectors.h"

#include <string.h>

/* ---- the mode as numbers of the programs ---- */

static void set_mode(mbs_contact_run *c, double t, double largest)
{
    const mbs_contacts_mode *m = &c->now.mode;
    c->now.largest = largest;
    int acting = FIXED, limits = 0, slides = 0;
    mbs_copy(MBS_CONTACTS_NUMBERS, mbs_contacts_open, c->numbers);
    for (int k = 0; k < FIXED; ++k)
        c->numbers[mbs_contacts_acts[k]] = 1.0;
    for (int e = 0; e < ELEMENTS; ++e) {
        const mbs_margin closes = {mbs_contacts_angles[e] ? MBS_ANGLE : MBS_LENGTH, -1}, opens = {MBS_FORCE, -1};
        int place = mbs_contacts_functions[e], p = mbs_contacts_parts[e];
        c->margins[place] = mbs_margin_of(&c->course, m->closed[e] == 1 ? &opens : &closes, t, largest);
        if (p >= 0)
            c->margins[mbs_contacts_slip_functions[p]] = 0.0;
        if (m->closed[e] != 1)
            continue;
        c->limiting[limits++] = place;
        c->numbers[mbs_contacts_acts[mbs_contacts_normals[e]]] = 1.0;
        ++acting;
        if (p < 0)
            continue;
        const mbs_margin slips = {MBS_FORCE, -1}, stops = {MBS_SPEED, mbs_contacts_tangents[p]};
        place = mbs_contacts_slip_functions[p];
        c->numbers[mbs_contacts_slip_numbers[p]] = m->slip[p] + m->carried[p];
        c->numbers[mbs_contacts_limit_numbers[p]] = m->carried[p] != 0;
        c->numbers[mbs_contacts_watched[p]] = !m->carried[p];
        slides |= m->slip[p] != 0;
        if (m->carried[p])
            continue;
        c->margins[place] = mbs_margin_of(&c->course, m->slip[p] ? &stops : &slips, t, largest);
        if (m->slip[p] || !mbs_contacts_holds[p])
            continue;
        c->limiting[limits++] = place;
        c->numbers[mbs_contacts_acts[mbs_contacts_tangents[p]]] = 1.0;
        ++acting;
    }
    c->numbers[MBS_CONTACTS_SOME_ACT] = acting > 0;
    if (MBS_CONTACTS_INDEPENDENT >= 0)
        c->parameters[MBS_CONTACTS_INDEPENDENT] = acting;
    c->system.limits = limits;
    c->problem.independent = acting;
    c->problem.project = acting > 0;
    c->problem.crosses = !slides;
}

/* ---- the motion of the mode ---- */

static void rates(const mbs_contact_run *c, double t, const double *x, double *slope)
{
    const mbs_system *s = &c->system;
    double given[MBS_CONTACTS_NW + 1] = {0.0}, multipliers[ROWS + 1], report[3], *inputs = given;
    const double *in[6] = {&t, x, x + NQ, c->parameters, given, c->numbers};
    double *const out[4] = {slope, slope + NQ, multipliers, report};
    if (s->inputs)
        s->inputs->call(in, &inputs);
    s->state_derivative->call(in, out);
}

/* One step of order 4. */
static void step(const mbs_contact_run *c, double t, const double *x, double h, double *end)
{
    static const double parts[] = {0.0, 0.5, 0.5, 1.0}, weights[] = {1.0, 2.0, 2.0, 1.0};
    double slope[NX + 1] = {0.0}, at[NX + 1], total[NX + 1] = {0.0};
    for (int s = 0; s < 4; ++s) {
        for (int k = 0; k < NX; ++k)
            at[k] = x[k] + parts[s] * h * slope[k];
        rates(c, t + parts[s] * h, at, slope);
        for (int k = 0; k < NX; ++k)
            total[k] += weights[s] * slope[k];
    }
    for (int k = 0; k < NX; ++k)
        end[k] = x[k] + h / 6.0 * total[k];
}

/* ---- switches ---- */

const char *mbs_contacts_word(const mbs_contacts_mode *m, int e)
{
    int p = mbs_contacts_parts[e];
    if (!m->closed[e] || p < 0)
        return mbs_contacts_state_words[2 * e + !m->closed[e]];
    return mbs_contacts_slip_words[3 * p + 1 + m->slip[p]];
}

/* Note an event after those that are no later. */
static void tell(mbs_contact_run *c, double time, const char *name, const char *word, double impulse)
{
    const mbs_contacts_event one = {time, impulse, name, word};
    int place = c->event_count;
    if (c->event_count == MBS_CONTACTS_MOST_EVENTS)
        return;
    for (; place > 0 && c->events[place - 1].time > time; --place)
        c->events[place] = c->events[place - 1];
    c->events[place] = one;
    ++c->event_count;
}

/* Whether a mode is one at which the model stops, by the number of the condition. */
static int stops_in(int stop, const mbs_contacts_mode *m)
{
    const char *now = mbs_contacts_word(m, mbs_contacts_stop_elements[stop]);
    for (int k = mbs_contacts_stop_begins[stop]; k < mbs_contacts_stop_begins[stop + 1]; ++k)
        if (strcmp(mbs_contacts_stop_words[k], now) == 0)
            return 1;
    return 0;
}

/* End the run where an element enters a state at which the model stops, or strikes; what rests does so `behind` later. */
static void stop_by_state(mbs_contact_run *c, double t, const mbs_contacts_mode *before, const double *impulses,
                          double behind)
{
    for (int k = 0; k < MBS_CONTACTS_STATE_STOPS && c->status == MBS_CONTACTS_GOES_ON; ++k)
        if (mbs_contacts_stop_strikes[k] ? impulses[mbs_contacts_stop_elements[k]] != 0.0
                                         : stops_in(k, &c->now.mode) && !stops_in(k, before)) {
            c->behind = mbs_contacts_stop_strikes[k] ? 0.0 : behind;
            tell(c, c->behind > 0.0 ? t + c->behind : c->state.t,
                 mbs_contacts_stops[MBS_CONTACTS_STOPS - MBS_CONTACTS_STATE_STOPS + k], "stop", 0.0);
            c->status = MBS_CONTACTS_STOPPED;
        }
}

/* What touches: what is closed or closes and does not leave, and what stands so and does not fly. */
static void touches(const mbs_contact_run *c, const int *closed, double t, const double *q, int *touching)
{
    double ahead = MBS_TICKS * fabs(t), left = 0.0;
    for (int e = 0; e < ELEMENTS; ++e)
        if (closed[e] && mbs_contacts_sense(c, e) < 0 && gap(c, e) > 0.0)
            left = fmax(left, -gap(c, e) / rate(c, e));
    for (int e = 0; e < ELEMENTS; ++e) {
        int how = mbs_standing(&c->course, e), senses = mbs_contacts_sense(c, e);
        int stands = how != MBS_OPEN && how != MBS_INSIDE && senses <= 0;
        touching[e] = stands || (closed[e] && (how == MBS_OPEN || how == MBS_INSIDE || senses <= 0));
        if (touching[e] && !closed[e]) {
            double high = fmax(MBS_ROUNDED_GAP * size_of_gap(c, e), (ahead + left) * fabs(rate(c, e)));
            if (!(c->now.bouncing[e] < HUGE_VAL || senses))
                high = fmax(high, mbs_contacts_lost_height(c, e, q));
            touching[e] = gap(c, e) <= high;
        }
    }
}

static int alike(const mbs_contacts_mode *a, const mbs_contacts_mode *b) { return memcmp(a, b, sizeof *a) == 0; }

/* Whether only a later instant decides: nothing was found, or the mode that has come to its limit. */
static int is_at_limit(const mbs_contact_run *c, const mbs_contacts_mode *found, int none)
{
    for (int p = 0; p < PARTS && !none; ++p)
        if (c->now.mode.slip[p] && found->closed[mbs_contacts_elements[p]] == 1 && !found->slip[p])
            return 0;
    return none || alike(found, &c->now.mode);
}

/* Find the mode soon after, as the forces of the mode go on to change. */
static void look_ahead(mbs_contact_run *c, const int *touching, double t, const double *x, mbs_contacts_mode *found,
                       mbs_contacts_status *status, laws *l)
{
    static const double parts[] = {1e-7, 1e-5, 1e-3};
    double slope[NX + 1], there[NX + 1];
    rates(c, t, x, slope);
    for (int k = 0; k < 6; ++k) {
        double soon = parts[k / 2] * c->laws.length / c->laws.speed;
        mbs_contacts_mode later;
        step(c, t, x, soon, there);
        for (int i = 0; i < NX && k % 2; ++i)
            there[i] = x[i] + soon * slope[i];
        mbs_ask(&c->course, t + soon, there, there + NQ);
        mbs_contacts_pose(c, touching, l);
        if (mbs_contacts_find(c, l, &c->now.mode, &later) != MBS_CONTACTS_GOES_ON)
            continue;
        if (*status != MBS_CONTACTS_GOES_ON || !alike(&later, found)) {
            *found = later;
            *status = MBS_CONTACTS_GOES_ON;
            break;
        }
        k |= 1; /* the straight line is for where there is no state */
    }
    mbs_ask(&c->course, t, x, x + NQ);
}

/* Decide what follows at a state x, at which elements `closed` touch, and enter it; udot is null at the start. */
static void decide(mbs_contact_run *c, double t, const int *closed, const double *udot, double *x, double *largest)
{
    int touching[ELEMENTS + 1], late[ELEMENTS + 1] = {0}, struck[ELEMENTS + 1] = {0}, strikes = 0, rests = 0;
    double longer[ELEMENTS + 1] = {0.0}, impulses[ELEMENTS + 1] = {0.0}, *q = x, *u = x + NQ;
    double behind = 0.0;
    mbs_contacts_mode found, before = c->now.mode;
    laws l;
    touches(c, closed, t, q, touching);
    mbs_contacts_onto_rows(c, touching, t, q, u);
    if (udot)
        rests = mbs_contacts_resting(c, touching, t, q, udot, late, longer);
    for (int e = 0; e < ELEMENTS; ++e)
        strikes |= touching[e] && mbs_contacts_sense(c, e) < 0;
    if (strikes) {
        memcpy(struck, touching, sizeof struck);
        c->status = mbs_contacts_strike(c, touching, late, u, impulses);
        if (c->status != MBS_CONTACTS_GOES_ON)
            return;
        mbs_ask(&c->course, t, q, u);
        c->now.last_impact = t;
        for (int e = 0; e < ELEMENTS; ++e)
            if (touching[e] && mbs_contacts_sense(c, e) > 0) {
                double fall = rests ? mbs_contacts_falling(c, e, udot) : 0.0;
                touching[e] = rests && rate(c, e) * rate(c, e) < 2.0 * fall * mbs_contacts_lost_height(c, e, q);
            }
    }
    mbs_contacts_at_rest(c, touching, t, q, u);
    mbs_contacts_pose(c, touching, &l);
    c->status = mbs_contacts_find(c, &l, udot ? &c->now.mode : NULL, &found);
    if (udot && !strikes && is_at_limit(c, &found, c->status != MBS_CONTACTS_GOES_ON))
        look_ahead(c, touching, t, x, &found, &c->status, &l);
    if (c->status != MBS_CONTACTS_GOES_ON)
        return;
    c->now.mode = found;
    *largest = mbs_contacts_largest_force(c, &l);
    for (int e = 0; e < ELEMENTS; ++e)
        behind = fmax(behind, longer[e]);
    if (udot)
        stop_by_state(c, t, &before, impulses, behind);
    for (int k = 0; k < 2 * ELEMENTS; ++k) { /* what touched in an impact, then what changes by itself */
        int e = k % ELEMENTS, changed = udot && strcmp(mbs_contacts_word(&found, e), mbs_contacts_word(&before, e)) != 0;
        if (struck[e] == (k < ELEMENTS) && (changed || (k < ELEMENTS && impulses[e] != 0.0)))
            tell(c, t + longer[e], mbs_contacts_names[e], changed ? mbs_contacts_word(&found, e) : "impact", impulses[e]);
        if (found.closed[e])
            c->now.bouncing[e] = HUGE_VAL;
    }
}

static void enter(mbs_contact_run *c, double t, double largest, const double *x, double *work)
{
    set_mode(c, t, largest);
    c->now.since = t;
    mbs_enter(&c->problem, &c->state, x, work);
}

/* Go on in the same mode from a state x. */
static void go_on(mbs_contact_run *c, int index, const double *x, double *work)
{
    mbs_copy(NX, x, work);
    c->margins[index] = fmin(c->margins[index], 0.0);
    c->state.status = MBS_RUNNING;
    c->state.phase = MBS_STARTING;
    c->state.crossing = c->state.origin = -1;
}

/* Whether what has only left its face, from a state x, goes on so. */
static int leaves(mbs_contact_run *c, int e, double t, double *x)
{
    int only[ELEMENTS + 1] = {0}, on = t - c->now.left[e] > MBS_GOES_ON * fabs(t);
    if (!(rate(c, e) > 0.0))
        return 0;
    if (!(c->now.bouncing[e] < HUGE_VAL && on)) {
        if (mbs_contacts_sense(c, e) <= 0 || mbs_standing(&c->course, e) == MBS_OPEN)
            return 0;
        only[e] = 1;
        if (mbs_contacts_onto_rows(c, only, t, x, x + NQ))
            return 1;
        if (!on)
            return 0;
    }
    c->now.left[e] = t;
    return 1;
}

/* The time by which an element touched before its step has ended, on its parabola; x receives the state then. */
static double touched(mbs_contact_run *c, int e, double t, const double *udot, double *x)
{
    double room, ago, since = fmax(c->now.last_impact, c->now.since), now = rate(c, e), deep = gap(c, e), before[NX + 1];
    double rounded = MBS_ROUNDED_GAP * size_of_gap(c, e);
    if (!(-2.0 * rounded < deep && deep < 0.0 && now < -mbs_contacts_allowed_speed(c, mbs_contacts_normals[e])))
        return t;
    room = fmax(now * now + 2.0 * deep * mbs_contacts_falling(c, e, udot), 0.0);
    ago = -2.0 * deep / (sqrt(room) - now);
    if (!(1e-14 * fabs(t) < fabs(ago) && ago < t - since))
        return t;
    step(c, t, x, -ago, before);
    mbs_copy(NX, before, x);
    mbs_ask(&c->course, t - ago, x, x + NQ);
    return t - ago;
}

/* Whether switches follow each other without time going on, or faster than a run of any length can hold. */
static int stands_still(mbs_contact_run *c, double t)
{
    const int most = 10 * (100 + 20 * ELEMENTS);
    int on = t - c->now.last_switch > MBS_GOES_ON * fabs(t), fast = 0;
    c->now.switches = on ? 1 : c->now.switches + 1;
    c->now.last_switch = t;
    if (on && ++c->now.block > most) {
        fast = (t - c->now.block_begun) * MBS_MOST_SWITCHES < most * (c->problem.t_end - c->problem.t0);
        c->now.block_begun = t;
        c->now.block = 0;
    }
    return fast || c->now.switches > most;
}

/* Decide what follows at the switching function at which the run stands. */
static void switched(mbs_contact_run *c, double *work)
{
    int index = c->state.event - (MBS_CONTACTS_NG - MBS_CONTACTS_SWITCHES), closed[ELEMENTS + 1], closing = -1;
    double t = c->state.t, x[NX + 1], slope[NX + 1], largest = 0.0, at = t;
    mbs_contacts_mode before = c->now.mode;
    if (stands_still(c, t)) {
        c->status = MBS_CONTACTS_STANDS_STILL;
        return;
    }
    c->event_count = 0;
    mbs_copy(NX, work, x);
    for (int e = 0; e < ELEMENTS; ++e) {
        closed[e] = c->now.mode.closed[e] == 1;
        if (mbs_contacts_functions[e] == index && !closed[e])
            closing = e;
    }
    mbs_grow_speed(&c->laws, NU, x + NQ);
    c->now.speed = c->laws.speed;
    mbs_ask(&c->course, t, x, x + NQ);
    if (closing >= 0 && leaves(c, closing, t, x)) {
        go_on(c, index, x, work);
        return;
    }
    rates(c, t, x, slope);
    if (closing >= 0) {
        closed[closing] = 1;
        at = touched(c, closing, t, slope + NQ, x);
        rates(c, at, x, slope);
    }
    decide(c, at, closed, slope + NQ, x, &largest);
    if (c->status == MBS_CONTACTS_STOPPED) {
        set_mode(c, t, largest);
        step(c, at, x, c->behind > 0.0 ? c->behind : t - at, work);
        c->state.t = c->behind > 0.0 ? at + c->behind : t;
    }
    if (c->status != MBS_CONTACTS_GOES_ON)
        return;
    if (at != t) {
        double end[NX + 1];
        set_mode(c, t, largest);
        step(c, at, x, t - at, end);
        mbs_copy(NX, end, x);
    }
    if (c->now.last_impact == at && alike(&before, &c->now.mode))
        go_on(c, index, x, work);
    else
        enter(c, t, largest, x, work);
}

/* ---- runs ---- */

static const mbs_program *program(const char *name)
{
    for (int k = 0; k < mbs_program_count; ++k)
        if (strcmp(mbs_programs[k].name, name) == 0)
            return mbs_programs + k;
    return NULL;
}

void mbs_contacts_begin(mbs_contact_run *c, double t0, double t_end, long long samples)
{
    static const int places[] = {MBS_CONTACTS_JACOBIAN, MBS_CONTACTS_MATRIX, MBS_CONTACTS_EXERTED, MBS_CONTACTS_INVERSE};
    double *place = c->values;
    memset(c, 0, sizeof *c);
    mbs_copy(MBS_CONTACTS_NP, mbs_contacts_values, c->parameters);
    for (int e = 0; e < ELEMENTS; ++e) {
        c->now.bouncing[e] = HUGE_VAL;
        c->now.left[e] = -HUGE_VAL;
    }
    c->now.last_impact = c->now.last_switch = -HUGE_VAL;
    c->system.inputs = MBS_CONTACTS_NW ? program("contacts_inputs") : NULL;
    c->system.state_derivative = program("contacts_state_derivative");
    c->system.missed = program("contacts_missed");
    c->system.put_back = program("contacts_put_back");
    c->system.normalize = program("contacts_normalize");
    c->system.events = program("contacts_events");
    c->system.terminal = mbs_contacts_terminal;
    c->system.parameters = c->parameters;
    c->system.modes = c->numbers;
    c->system.nq = NQ;
    c->system.nu = NU;
    c->system.ns = ROWS;
    c->system.nw = MBS_CONTACTS_NW;
    c->system.ng = MBS_CONTACTS_NG;
    c->system.plain = mbs_contacts_plain;
    c->system.plains = MBS_CONTACTS_PLAINS;
    c->system.margins = c->margins;
    c->system.limiting = c->limiting;
    c->system.switches = MBS_CONTACTS_SWITCHES;
    c->system.moments = mbs_contacts_moments;
    c->system.moment_count = MBS_CONTACTS_MOMENTS;
    c->problem.method = &mbs_contacts_method;
    c->problem.system = &c->system;
    c->problem.t0 = t0;
    c->problem.t_end = t_end;
    c->problem.step = MBS_CONTACTS_STEP;
    c->problem.rtol = MBS_CONTACTS_RTOL;
    c->problem.atol = MBS_CONTACTS_ATOL;
    c->problem.contradiction = MBS_CONTACTS_CONTRADICTION;
    c->problem.closure = MBS_CONTACTS_CLOSURE;
    c->problem.max_steps = MBS_CONTACTS_MOST_STEPS;
    c->problem.samples = samples;
    c->only.problem = &c->problem;
    c->course.laws = &c->laws;
    c->course.modes = &c->only;
    c->laws.inputs = c->system.inputs;
    c->laws.laws = program("contacts_laws");
    for (int k = 0; k < MBS_CONTACTS_OUTPUTS; place += c->laws.laws->out_sizes[k++])
        c->outputs[k] = place;
    c->laws.parameters = c->parameters;
    c->laws.given = c->given;
    c->laws.outputs = c->outputs;
    c->laws.entries = c->entries;
    c->laws.matrices = 4;
    c->laws.jacobian = c->jacobian;
    c->laws.matrix = c->matrix;
    c->laws.exerted = c->exerted;
    c->laws.inverse = c->inverse;
    double *const wholes[] = {c->jacobian, c->matrix, c->exerted, c->inverse};
    for (int k = 0; k < 4; ++k) {
        c->entries[k].count = mbs_contacts_entry_counts[k];
        c->entries[k].size = (k < 3 ? ROWS : NU) * NU;
        c->entries[k].places = mbs_contacts_entries[k];
        c->entries[k].values = c->outputs[places[k]];
        c->entries[k].base = k == 2 ? c->matrix : NULL;
        c->entries[k].whole = wholes[k];
    }
    c->laws.phi = c->outputs[MBS_CONTACTS_PHI];
    c->laws.phidot = c->outputs[MBS_CONTACTS_PHIDOT];
    c->laws.right = c->outputs[MBS_CONTACTS_RIGHT];
    c->laws.driven = c->outputs[MBS_CONTACTS_DRIVEN];
    c->laws.coefficients = c->outputs[MBS_CONTACTS_COEFFICIENTS];
    c->laws.reaches = c->outputs[MBS_CONTACTS_REACHES];
    c->laws.past_ends = c->outputs[MBS_CONTACTS_PAST_ENDS];
    c->laws.rows = ROWS;
    c->laws.elements = ELEMENTS;
    c->laws.normals = mbs_contacts_normals;
    c->laws.angles = mbs_contacts_angles;
    c->laws.slides = mbs_contacts_slides;
    c->laws.length = MBS_CONTACTS_LENGTH;
    c->laws.speed = c->now.speed = MBS_CONTACTS_SPEED;
}

long long mbs_contacts_work(const mbs_contact_run *c) { return mbs_work(&c->problem); }

void mbs_contacts_start(mbs_contact_run *c, const double *x0, double *work)
{
    const int none[ELEMENTS + 1] = {0};
    double x[NX + 1], largest = 0.0;
    for (int k = 0; k < MBS_CONTACTS_NP; ++k)
        if (!isfinite(c->parameters[k]) || (mbs_contacts_positive[k] && !(c->parameters[k] > 0.0)))
            c->status = MBS_CONTACTS_PARAMETERS;
    if (c->status != MBS_CONTACTS_GOES_ON)
        return;
    mbs_copy(NX, x0, x);
    set_mode(c, c->problem.t0, 0.0);
    mbs_ask(&c->course, c->problem.t0, x, x + NQ);
    decide(c, c->problem.t0, none, NULL, x, &largest);
    if (c->status != MBS_CONTACTS_GOES_ON)
        return;
    set_mode(c, c->problem.t0, largest);
    c->now.since = c->problem.t0;
    mbs_start(&c->problem, x, &c->state, work);
}

void mbs_contacts_resume(mbs_contact_run *c, const double *x, double *work)
{
    c->laws.speed = c->now.speed;
    mbs_ask(&c->course, c->problem.t0, x, x + NQ);
    set_mode(c, c->problem.t0, c->now.largest);
    mbs_start(&c->problem, x, &c->state, work);
}

void mbs_contacts_switch(mbs_contact_run *c, int function, double *work)
{
    c->state.t = c->problem.t0;
    c->state.event = function;
    switched(c, work);
}

long long mbs_contacts_go(mbs_contact_run *c, double *work, double *samples, long long rows)
{
    long long written = 0;
    c->event_count = 0;
    while (c->status == MBS_CONTACTS_GOES_ON && c->event_count == 0 && written < rows) {
        double before = c->state.t;
        written += mbs_integrate(&c->problem, &c->state, work, MBS_CONTACTS_MOST_STEPS, rows - written, samples + written * NX);
        c->jumps = c->state.t > before ? 0 : c->jumps + 1;
        if (c->state.status == MBS_STOPPED && c->state.event >= MBS_CONTACTS_NG - MBS_CONTACTS_SWITCHES) {
            if (c->state.sample >= c->problem.samples ||
                !(c->state.t < c->problem.t_end - MBS_LEAST_LEFT * fabs(c->state.t)))
                c->status = MBS_CONTACTS_DONE;
            else
                switched(c, work);
        } else if (c->state.status == MBS_STOPPED) {
            c->status = MBS_CONTACTS_STOPPED;
            tell(c, c->state.t, mbs_contacts_stops[c->state.event], "stop", 0.0);
        }
        else if (c->state.status == MBS_DONE)
            c->status = MBS_CONTACTS_DONE;
        else if (c->state.status != MBS_RUNNING)
            c->status = MBS_CONTACTS_FAILED;
        else if (c->jumps > 1000)
            c->status = MBS_CONTACTS_JUMPS;
    }
    return written;
}

const char *mbs_contacts_words(mbs_contacts_status status)
{
    switch (status) {
    case MBS_CONTACTS_GOES_ON: return "the run goes on";
    case MBS_CONTACTS_DONE: return "the run is done";
    case MBS_CONTACTS_STOPPED: return "a stop of the model holds";
    case MBS_CONTACTS_FAILED: return "the integrator failed";
    case MBS_CONTACTS_NO_STATE: return "no state of the contacts fulfils the laws";
    case MBS_CONTACTS_TOO_MANY: return "too many contacts touch at once";
    case MBS_CONTACTS_IMPACT: return "an impact of several rough contacts, of which some bounce or jam, is not solved here";
    case MBS_CONTACTS_STANDS_STILL: return "states and impacts follow each other and time does not go on";
    case MBS_CONTACTS_PARAMETERS: return "a parameter is no number, or a mass or another one that must be positive is not";
    default: return "a force jumps to and fro and time does not go on";
    }
}
