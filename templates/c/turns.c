/* Switches that were decided before; `known_switches.py` says what is verified, and does the same. */
#include "stepper.h"
#include "turns.h"

/* The forces of what acts, what they do, by what they are measured. */
typedef struct {
    double z[MBS_MOST_ACTIVE], *x;
    double force, rounded;
} solved;

static int width(const mbs_course *c)
{
    return c->modes->problem->system->nu;
}

long long mbs_room(const mbs_course *course)
{
    const mbs_system *s = course->modes->problem->system;
    int widest = s->nu > MBS_MOST_ACTIVE ? s->nu : MBS_MOST_ACTIVE;
    return (long long)(MBS_MOST_ACTIVE + 5) * s->nu + 4LL * s->nq + MBS_FACTORS(MBS_MOST_ACTIVE, widest);
}

void mbs_ask(const mbs_course *c, double t, const double *q, const double *u)
{
    mbs_laws *l = c->laws;
    const double *in[6] = {&t, q, u, l->parameters, l->given, l->given};
    if (l->inputs)
        l->inputs->call(in, &l->given);
    l->laws->call(in, l->outputs);
    for (int j = 0; j < l->matrices; ++j) {
        const mbs_entries *e = l->entries + j;
        if (e->base)
            mbs_copy(e->size, e->base, e->whole);
        for (int k = 0; k < e->count; ++k)
            e->whole[e->places[k]] = e->values[k];
    }
}

static double dot(int n, const double *a, const double *b)
{
    double total = 0.0;
    for (int k = 0; k < n; ++k)
        total += a[k] * b[k];
    return total;
}

static double length_of(int n, const double *row)
{
    double size = sqrt(dot(n, row, row));
    return size == 0.0 ? 1.0 : size;
}

/* The largest speed along a row of which a part counts. */
double mbs_speed_along(const mbs_course *c, int row)
{
    const mbs_laws *l = c->laws;
    double total = 0.0;
    for (int k = 0; k < width(c); ++k) {
        double size = l->slides[k] * l->speed + (1.0 - l->slides[k]) * (l->speed / l->length);
        total += fabs(l->jacobian[row * width(c) + k]) * size;
    }
    return total;
}

int mbs_standing(const mbs_course *c, int element)
{
    const mbs_laws *l = c->laws;
    int normal = l->normals[element];
    double gap = l->phi[normal], rate = l->phidot[normal];
    double allowed = MBS_TOUCHING * (l->angles[element] ? 1.0 : l->length);
    if (gap > allowed || l->reaches[element] < -fmin(allowed, l->past_ends[element]))
        return MBS_OPEN;
    if (gap < -allowed)
        return MBS_INSIDE;
    return fabs(rate) <= MBS_TOUCHING * mbs_speed_along(c, normal) ? MBS_RESTING : rate > 0.0 ? MBS_LEAVING : MBS_CLOSING;
}

/* What touches is what did when the switch was decided, and nothing closes. */
static int touches_alike(const mbs_course *c, const mbs_turn *turn, const int *closed)
{
    const mbs_laws *l = c->laws;
    for (int k = 0; k < l->elements; ++k) {
        int now = mbs_standing(c, k), touches = now == MBS_RESTING || now == MBS_CLOSING || (closed[k] && now != MBS_LEAVING);
        if (touches != turn->touching[k])
            return 0;
        if (touches && l->phidot[l->normals[k]] < -MBS_TOUCHING * mbs_speed_along(c, l->normals[k]))
            return 0;
    }
    return 1;
}

static int signs_alike(const mbs_course *c, const mbs_turn *turn)
{
    for (int k = 0; k < turn->parts; ++k) {
        int tangent = turn->signs[k].tangent;
        double speed = c->laws->phidot[tangent], allowed = MBS_TOUCHING * mbs_speed_along(c, tangent);
        if (turn->signs[k].sign != (fabs(speed) <= allowed ? 0 : speed > 0.0 ? 1 : -1))
            return 0;
    }
    return 1;
}

/* `x` receives the least x with rows x = wanted; 0 where others leave no more than a part `least` of a row. */
static int least_norm(const mbs_course *c, mbs_pattern rows, const double *matrix, const double *wanted, double least,
                      double *x)
{
    double *factors = c->room + (MBS_MOST_ACTIVE + 5) * width(c) + 4 * c->modes->problem->system->nq;
    double multipliers[MBS_MOST_ACTIVE], report[3];
    mbs_factorise(&rows, matrix, rows.rows, factors);
    mbs_substitute(&rows, factors, wanted, x, multipliers, report);
    return report[0] == rows.rows && report[1] > least;
}

/* `change` receives inverse x with the least x for which rows x = wanted; 0 where rows are many or nearly dependent. */
static int least_change(const mbs_course *c, int count, const int *rows, const double *wanted, double *change)
{
    int n = width(c);
    double *x = c->room, *some = c->room + 5 * n;
    const mbs_pattern pattern = {count, n, 0};
    for (int i = 0; i < count; ++i)
        mbs_copy(n, c->laws->matrix + rows[i] * n, some + i * n);
    if (!least_norm(c, pattern, some, wanted, MBS_INDEPENDENT, x))
        return 0;
    for (int k = 0; k < n; ++k)
        change[k] = dot(n, c->laws->inverse + k * n, x);
    return 1;
}

/* Put coordinates onto rows that hold; 0 where that is left to others. */
static int onto_rows(const mbs_course *c, const mbs_turn *turn, double t, double *q, const double *u)
{
    const mbs_system *s = c->modes->problem->system;
    int rows[MBS_MOST_PUT_BACK], count = 0;
    double wanted[MBS_MOST_PUT_BACK], largest = 0.0, *change = c->room + s->nu;
    for (int k = 0; k < turn->keeps; ++k) {
        double phi = c->laws->phi[turn->kept[k]];
        largest = fabs(phi) > largest ? fabs(phi) : largest;
        if (phi != 0.0) {
            if (count == MBS_MOST_PUT_BACK)
                return 0;
            wanted[count] = -phi;
            rows[count++] = turn->kept[k];
        }
    }
    if (!(largest > MBS_NOT_PUT_BACK * c->laws->length))
        return 1;
    if (!least_change(c, count, rows, wanted, change))
        return 0;
    for (int k = 0; k < s->plains; ++k)
        q[s->plain[2 * k]] += change[s->plain[2 * k + 1]];
    mbs_ask(c, t, q, u);
    return 1;
}

/* Bring to rest what touches and does not slide. */
static int at_rest(const mbs_course *c, const mbs_turn *turn, double t, const double *q, double *u)
{
    const mbs_laws *l = c->laws;
    int rows[MBS_MOST_PUT_BACK], count = 0, n = width(c);
    double wanted[MBS_MOST_PUT_BACK], largest = 0.0, *change = c->room + n;
    for (int k = 0; k < turn->keeps + turn->parts; ++k) {
        if (k >= turn->keeps && turn->signs[k - turn->keeps].sign)
            continue;
        if (count == MBS_MOST_PUT_BACK)
            return 0;
        rows[count] = k < turn->keeps ? turn->kept[k] : turn->signs[k - turn->keeps].tangent;
        wanted[count] = -l->phidot[rows[count]];
        largest = fabs(wanted[count]) > largest ? fabs(wanted[count]) : largest;
        ++count;
    }
    if (!(largest > MBS_NOT_PUT_BACK * l->speed))
        return 1;
    if (!least_change(c, count, rows, wanted, change))
        return 0;
    for (int k = 0; k < n; ++k)
        if (!(fabs(change[k]) <= MBS_SLIGHT * (l->slides[k] * l->speed + (1.0 - l->slides[k]) * (l->speed / l->length))))
            return 0;
    for (int k = 0; k < n; ++k)
        u[k] += change[k];
    mbs_ask(c, t, q, u);
    return 1;
}

static int place_of(const mbs_acting *acting, int row)
{
    int k = 0;
    while (acting->active[k] != row)
        ++k;
    return k;
}

/* The forces of what acts, with static coefficients for what slides from rest or not. */
static int solve(const mbs_course *c, const mbs_turn *turn, const mbs_acting *acting, int with_static, solved *s)
{
    const mbs_laws *l = c->laws;
    int n = width(c), m = acting->actives;
    double matrix[MBS_MOST_ACTIVE * MBS_MOST_ACTIVE], right[MBS_MOST_ACTIVE], sizes[MBS_MOST_ACTIVE];
    double *pushes = c->room + 5 * n, largest = 0.0;
    const mbs_pattern pattern = {m, m, 0};
    s->x = c->room + 4 * n;
    for (int i = 0; i < m; ++i)
        mbs_copy(n, l->exerted + acting->active[i] * n, pushes + i * n);
    for (int j = 0; j < acting->slidings; ++j) {
        const mbs_rub *one = acting->sliding + j;
        double mu = l->coefficients[2 * one->part + !(with_static && one->begins)];
        double *push = pushes + place_of(acting, one->normal) * n;
        for (int p = 0; p < n; ++p)
            push[p] -= one->sense * mu * l->exerted[one->tangent * n + p];
    }
    for (int i = 0; i < m; ++i)
        sizes[i] = length_of(n, l->exerted + acting->active[i] * n);
    for (int i = 0; i < m; ++i) {
        const double *row = l->matrix + acting->active[i] * n;
        double size = length_of(n, row);
        for (int j = 0; j < m; ++j)
            matrix[i * m + j] = dot(n, row, pushes + j * n) / (size * sizes[j]);
        right[i] = l->right[acting->active[i]] / size;
    }
    if (m && !least_norm(c, pattern, matrix, right, MBS_DETERMINED, s->z))
        return 0;
    mbs_fill(n, 0.0, s->x);
    s->force = 0.0;
    for (int j = 0; j < acting->slidings; ++j) {
        const mbs_rub *one = acting->sliding + j;
        int i = place_of(acting, one->normal);
        double mu = l->coefficients[2 * one->part + !(with_static && one->begins)];
        double force = mu * fabs(s->z[i]) / sizes[i] * length_of(n, l->exerted + one->tangent * n);
        s->force = force > s->force ? force : s->force;
    }
    for (int i = 0; i < m; ++i) {
        s->force = fabs(s->z[i]) > s->force ? fabs(s->z[i]) : s->force;
        s->z[i] /= sizes[i];
        for (int p = 0; p < n; ++p)
            s->x[p] += pushes[i * n + p] * s->z[i];
    }
    for (int i = 0; i < turn->takes; ++i) {
        double wanted = fabs(l->right[turn->rows[i]]) / length_of(n, l->matrix + turn->rows[i] * n);
        largest = wanted > largest ? wanted : largest;
    }
    s->rounded = MBS_CLEAR_MOTION / MBS_CLEAR_BY * (sqrt(dot(n, s->x, s->x)) + largest);
    s->force += s->rounded;
    return 1;
}

/* What is left of a row lies clearly on a side. */
static int clearly(const mbs_course *c, const solved *s, int row, int side)
{
    int n = width(c);
    const double *a = c->laws->matrix + row * n;
    double size = length_of(n, a), terms = fabs(c->laws->right[row]);
    for (int k = 0; k < n; ++k)
        terms += fabs(a[k]) * fabs(s->x[k]);
    return side * (dot(n, a, s->x) - c->laws->right[row]) / size > MBS_CLEAR_BY * (terms / size + s->rounded);
}

static double sized(const mbs_course *c, int row)
{
    return length_of(width(c), c->laws->exerted + row * width(c));
}

/* All inequalities of what acts hold clearly, but for those of the row `open`. */
static int all_hold(const mbs_course *c, const mbs_acting *acting, const solved *s, int open)
{
    double least = MBS_CLEAR_BY * s->force;
    for (int i = 0; i < acting->pressings; ++i) {
        int row = acting->pressing[i];
        if (row != open && !(s->z[place_of(acting, row)] * sized(c, row) > least))
            return 0;
    }
    for (int i = 0; i < acting->stickings; ++i) {
        const mbs_rub *one = acting->sticking + i;
        double limit = c->laws->coefficients[2 * one->part] * s->z[place_of(acting, one->normal)];
        if (one->tangent != open &&
            !(sized(c, one->tangent) * (limit - fabs(s->z[place_of(acting, one->tangent)])) > least))
            return 0;
    }
    for (int i = 0; i < acting->aparts; ++i)
        if (acting->apart[i] != open && !clearly(c, s, acting->apart[i], 1))
            return 0;
    for (int i = 0; i < acting->slidings; ++i) {
        const mbs_rub *one = acting->sliding + i;
        if (one->begins && one->tangent != open && !clearly(c, s, one->tangent, one->sense))
            return 0;
    }
    return 1;
}

static int rub_at_all(const mbs_course *c, int count, const mbs_rub *rubs, int *differ)
{
    for (int i = 0; i < count; ++i) {
        const double *mu = c->laws->coefficients + 2 * rubs[i].part;
        if (!(mu[0] > 0.0) || !(mu[1] > 0.0))
            return 0;
        *differ |= rubs[i].begins && mu[0] != mu[1];
    }
    return 1;
}

static int holds(const mbs_course *c, const mbs_turn *turn, const mbs_acting *acting, int open, solved *s)
{
    int differ = 0;
    if (!signs_alike(c, turn) || !rub_at_all(c, acting->slidings, acting->sliding, &differ) ||
        !rub_at_all(c, acting->stickings, acting->sticking, &differ))
        return 0;
    for (int with_static = differ; with_static >= 0; --with_static)
        if (!solve(c, turn, acting, with_static, s) || !all_hold(c, acting, s, open))
            return 0;
    return 1;
}

/* By how much the force of the row that had come to its limit exceeds it. */
static double over(const mbs_course *c, const mbs_turn *turn, const solved *s)
{
    const mbs_acting *before = &turn->before;
    double force = s->z[place_of(before, turn->cause)], size = sized(c, turn->cause);
    for (int i = 0; i < before->stickings; ++i)
        if (before->sticking[i].tangent == turn->cause) {
            const mbs_rub *one = before->sticking + i;
            double limit = c->laws->coefficients[2 * one->part] * s->z[place_of(before, one->normal)];
            return size * (-turn->way * force - limit);
        }
    return -size * force;
}

/* What holds soon after, where forces have clearly left the limit that they keep now. */
static int ahead(const mbs_course *c, const mbs_turn *turn, double t, const double *q, const double *u, solved *s)
{
    static const double parts[] = {0.0, 1e-7, 1e-5, 1e-3};
    const mbs_system *system = c->modes[c->mode].problem->system;
    int nq = system->nq, n = system->nu;
    double *later_q = c->room + (MBS_MOST_ACTIVE + 5) * n, *qdot = later_q + nq;
    double *later_u = c->room + 2 * n, *udot = c->room + 3 * n;
    double *inputs = c->laws->given;
    const double *in[6] = {&t, q, u, system->parameters, inputs, system->modes};
    double multipliers[4 * MBS_MOST_ACTIVE], report[3], *const out[4] = {qdot, udot, multipliers, report};
    if (system->ns > 4 * MBS_MOST_ACTIVE)
        return 0;
    system->state_derivative->call(in, out);
    for (int k = 0; k < 4; ++k) {
        double soon = parts[k] * c->laws->length / c->laws->speed;
        for (int i = 0; i < nq; ++i)
            later_q[i] = q[i] + soon * qdot[i];
        for (int i = 0; i < n; ++i)
            later_u[i] = u[i] + soon * udot[i];
        mbs_ask(c, t + soon, later_q, later_u);
        if (!holds(c, turn, &turn->before, turn->cause, s))
            return 0;
        double beyond = over(c, turn, s);
        if (beyond > MBS_CLEAR_BY * s->force)
            return k > 0 && holds(c, turn, &turn->after, -1, s);
        if (beyond > MBS_WITHIN * MBS_CLEAR_BY * s->force)
            return 0;
    }
    return 0;
}

/* Rounded up to a power of two, so that it does not hang on digits. */
double mbs_rounded_up(double value)
{
    return value > 0.0 ? ldexp(1.0, (int)ceil(log2(MBS_BETWEEN_POWERS * value))) / MBS_BETWEEN_POWERS : 0.0;
}

/* The largest force of the rows that take part. */
static double largest_force(const mbs_course *c, const mbs_turn *turn, const solved *s)
{
    const mbs_acting *acting = &turn->after;
    double largest = 0.0;
    for (int i = 0; i < acting->actives; ++i)
        largest = fabs(s->z[i]) > largest ? fabs(s->z[i]) : largest;
    for (int i = 0; i < acting->slidings; ++i) {
        const mbs_rub *one = acting->sliding + i;
        double force = c->laws->coefficients[2 * one->part + 1] * fabs(s->z[place_of(acting, one->normal)]);
        largest = force > largest ? force : largest;
    }
    return largest;
}

/* What acts on all that these rows are joined to, or a thousandth of what would move them. */
static double largest_cause(const mbs_course *c, const mbs_turn *turn)
{
    double largest = 0.0;
    for (int i = 0; i < turn->takes; ++i) {
        int row = turn->rows[i];
        double cause = 1e-3 * fabs(c->laws->right[row]), weight = c->laws->driven[row] / sized(c, row);
        largest = cause > largest ? cause : largest;
        largest = weight > largest ? weight : largest;
    }
    return largest;
}

double mbs_margin_of(const mbs_course *c, const mbs_margin *rule, double t, double largest)
{
    if (rule->kind == MBS_FORCE)
        return MBS_FORCE_MARGIN * largest;
    if (rule->kind == MBS_SPEED) {
        double along = mbs_speed_along(c, rule->row);
        double by_time = MBS_TIME_MARGIN * fabs(t) * fabs(c->laws->right[rule->row]);
        return mbs_rounded_up(MBS_SPEED_MARGIN * along + fmin(by_time, MBS_MOST_TIME_MARGIN * along));
    }
    return MBS_ROUNDED_GAP * (rule->kind == MBS_ANGLE ? 1.0 : c->laws->length);
}

/* Verify where a switch leads; q and u are put where the mode that follows begins, and its margins are set. */
static int followed(const mbs_course *c, const mbs_turn *turn, double t, double *q, double *u)
{
    const mbs_mode *to = c->modes + turn->to;
    int count = to->problem->system->switches;
    double largest, cause;
    solved s;
    mbs_ask(c, t, q, u);
    if (!touches_alike(c, turn, c->modes[c->mode].closed) || !onto_rows(c, turn, t, q, u))
        return 0;
    if (!signs_alike(c, turn) || !at_rest(c, turn, t, q, u))
        return 0;
    cause = largest_cause(c, turn);
    if (turn->cause < 0 ? !holds(c, turn, &turn->after, -1, &s) : !ahead(c, turn, t, q, u, &s))
        return 0;
    largest = largest_force(c, turn, &s);
    largest = mbs_rounded_up(largest > cause ? largest : cause);
    if (turn->cause >= 0)
        mbs_ask(c, t, q, u);
    for (int i = 0; i < count; ++i)
        to->margins[i] = mbs_margin_of(c, to->rules + i, t, largest);
    for (int i = 0; i < to->holds; ++i)
        u[to->held[i]] = 0.0;
    return 1;
}

/* Begin in another mode at (t, x), with all that was counted. */
void mbs_enter(const mbs_problem *problem, mbs_state *state, const double *x, double *work)
{
    mbs_state before = *state;
    mbs_start(problem, x, state, work);
    state->t = state->t_new = before.t;
    mbs_copy(MBS_DOUBLED, before.doubled, state->doubled);
    state->drift_position = before.drift_position;
    state->drift_velocity = before.drift_velocity;
    state->removed_position = before.removed_position;
    state->removed_velocity = before.removed_velocity;
    state->quaternion_deviation = before.quaternion_deviation;
    state->least_rank = before.least_rank;
    state->greatest_rank = before.greatest_rank;
    state->conditioning = before.conditioning;
    state->conditioning_time = before.conditioning_time;
    state->steps = before.steps;
    state->rejected = before.rejected;
    state->evaluations = before.evaluations;
    state->jacobians = before.jacobians;
    state->factorisations = before.factorisations;
    state->sample = before.sample;
}

void mbs_grow_speed(mbs_laws *l, int n, const double *u)
{
    double fastest = 0.0;
    for (int k = 0; k < n; ++k) {
        double speed = fabs(u[k]) * (l->slides[k] + (1.0 - l->slides[k]) * l->length);
        fastest = speed > fastest ? speed : fastest;
    }
    l->speed = fastest > l->speed ? fastest : l->speed;
}

/* Take a turn that is known at the switch where a run stands; 0 where none leads on. */
static int turned(mbs_course *c, mbs_state *state, double *work)
{
    const mbs_mode *now = c->modes + c->mode;
    const mbs_system *s = now->problem->system;
    int index = state->event - (s->ng - s->switches), n = s->nq + s->nu;
    const mbs_turn *turn = now->turn;
    double *x = c->states + c->passed * n;
    if (index < 0 || state->status != MBS_STOPPED || c->passed == c->most || state->sample >= now->problem->samples)
        return 0;
    if (!(state->t < now->problem->t_end - MBS_LEAST_LEFT * fabs(state->t)) || !(state->t - c->since > c->least))
        return 0;
    for (int k = 0; k < index; ++k)
        turn += now->turns[k];
    mbs_grow_speed(c->laws, s->nu, work + s->nq);
    for (int k = 0; k < now->turns[index]; ++k, ++turn) {
        mbs_copy(n, work, x);
        if (!followed(c, turn, state->t, x, x + s->nq))
            continue;
        mbs_passage passage = {state->t, turn - now->turn, state->sample, state->steps};
        const mbs_mode *to = c->modes + turn->to;
        mbs_copy(to->problem->system->switches, to->margins, c->margins + c->passed * c->width);
        c->passages[c->passed++] = passage;
        c->since = state->t;
        c->mode = turn->to;
        mbs_enter(c->modes[turn->to].problem, state, x, work);
        return 1;
    }
    return 0;
}

long long mbs_follow(mbs_course *course, mbs_state *state, double *work, long long steps, long long rows,
                     double *samples)
{
    const mbs_system *s = course->modes[course->mode].problem->system;
    long long written = 0, last = state->steps + steps;
    int n = s->nq + s->nu;
    for (;;) {
        const mbs_problem *problem = course->modes[course->mode].problem;
        written += mbs_integrate(problem, state, work, last - state->steps, rows - written, samples + written * n);
        if (!turned(course, state, work) || state->steps >= last)
            return written;
    }
}
