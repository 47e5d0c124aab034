/* A model as an FMU: what both versions of FMI have in common. */
#include "fmu.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NX = MBS_FMU_NX, NQ = MBS_FMU_NQ, NP = MBS_FMU_NP, NG = MBS_FMU_NG, FREE = MBS_FMU_FREE };

/* Inputs from outside stand behind so many parameters. */
#if MBS_FMU_CONTACTS
enum { BEHIND = MBS_CONTACTS_NP };
#else
enum { BEHIND = MBS_FMU_NP };
#endif

static void tell(const mbs_fmu *f, int status, const char *category, const char *format, va_list values)
{
    char text[512];
    vsnprintf(text, sizeof text, format, values);
    if (!f->logger || (status == MBS_FMU_OK && !f->logging))
        return;
#if MBS_FMU_FMI == 2
    f->logger(f->environment, f->name, status, category, "%s", text);
#else
    f->logger(f->environment, status, category, text);
#endif
}

int mbs_fmu_fail(const mbs_fmu *f, const char *format, ...)
{
    va_list values;
    va_start(values, format);
    tell(f, MBS_FMU_ERROR, "logStatusError", format, values);
    va_end(values);
    return MBS_FMU_ERROR;
}

static void tell_event(const mbs_fmu *f, const char *format, ...)
{
    va_list values;
    va_start(values, format);
    tell(f, MBS_FMU_OK, "logEvents", format, values);
    va_end(values);
}

static void tell_stop(mbs_fmu *f, const char *what)
{
    tell_event(f, "the motion ends at t = %.9g s: %s", f->now.time, what);
    f->now.stopped = 1;
}

/* ---- instances ---- */

API(const char *, GetVersion)(void) { return MBS_FMU_FMI == 2 ? "2.0" : "3.0"; }

API(void, FreeInstance)(mbs_fmu *f)
{
    if (f) {
        free(f->work);
        free(f->run);
    }
    free(f);
}

/* Let all values be those of the export. */
API(int, Reset)(mbs_fmu *f)
{
    memset(&f->now, 0, sizeof f->now);
    f->now.tolerance = MBS_FMU_RTOL;
    memcpy(f->now.x, mbs_fmu_start, NX * sizeof(double));
    memcpy(f->now.parameters, mbs_fmu_values, (NP + FREE) * sizeof(double));
    f->known = f->stale = 0;
    return MBS_FMU_OK;
}

mbs_fmu *mbs_fmu_create(const char *name, const char *token, void *environment, mbs_fmu_logger logger, int logging)
{
    mbs_fmu *f = calloc(1, sizeof *f);
    if (!f)
        return NULL;
    snprintf(f->name, sizeof f->name, "%s", name ? name : "");
    f->environment = environment;
    f->logger = logger;
    f->logging = logging;
    FMI(Reset)(f);
    if (token && strcmp(token, MBS_FMU_TOKEN) == 0)
        return f;
    mbs_fmu_fail(f, "the %s is %s, and that of this FMU is %s", MBS_FMU_FMI == 2 ? "guid" : "instantiation token",
                 token ? token : "missing", MBS_FMU_TOKEN);
    FMI(FreeInstance)(f);
    return NULL;
}

API(int, SetDebugLogging)(mbs_fmu *f, boolean on, size_t count, const char *const *categories)
{
    (void)count, (void)categories;
    f->logging = on;
    return MBS_FMU_OK;
}

API(int, Terminate)(mbs_fmu *f)
{
    f->now.phase = MBS_FMU_ENDED;
    return MBS_FMU_OK;
}

/* ---- values ---- */

/* The program of inputs, with those from outside in their places. */
static void all_inputs(const double *const *in, double *const *out)
{
    mbs_programs[MBS_FMU_INPUTS_PROGRAM].call(in, out);
    for (int k = 0; k < FREE; ++k)
        out[0][mbs_fmu_free_inputs[k]] = in[3][BEHIND + k];
}

/* Let parameters follow from those that were set. */
static void update(mbs_fmu *f)
{
    const double *in[6] = {&f->now.time, f->now.x, f->now.x + NQ, f->now.parameters, f->inputs, f->inputs};
    double found[NP + 1], *all = found;
    if (!f->stale)
        return;
    mbs_programs[MBS_FMU_PARAMETERS_PROGRAM].call(in, &all);
    memcpy(f->now.parameters, found, NP * sizeof(double));
    f->stale = 0;
}

/* Call a program with parameters, behind which inputs from outside stand, and the numbers of a state of contacts. */
static void call_with(mbs_fmu *f, const double *parameters, const double *modes, int program, double *const *out)
{
    const double *in[7] = {&f->now.time, f->now.x, f->now.x + NQ, parameters, f->inputs, modes, f->multipliers};
    double *inputs = f->inputs;
    if (MBS_FMU_NW > 0)
        all_inputs(in, &inputs);
    mbs_programs[program].call(in, out);
}

static void evaluate_with(mbs_fmu *f, const double *parameters, const double *modes, const double *margins)
{
    double *out[4] = {f->rates, f->rates + NQ, f->multipliers, f->report}, *outputs = f->outputs;
    double *indicators = f->indicators;
    call_with(f, parameters, modes, MBS_FMU_DERIVATIVE_PROGRAM, out);
    if (MBS_FMU_NO > 0)
        call_with(f, parameters, modes, MBS_FMU_OUTPUTS_PROGRAM, &outputs);
    if (NG > 0)
        call_with(f, parameters, modes, MBS_FMU_EVENTS_PROGRAM, &indicators);
    for (int k = 0; k < MBS_FMU_SWITCHES; ++k)
        f->indicators[NG - MBS_FMU_SWITCHES + k] -= margins[k];
}

#if MBS_FMU_CONTACTS
/* ---- contacts, which go from state to state ---- */

/* The run from where the instance is to `end`: in the state of its contacts, which is found where it is to begin; null
   without memory. */
static mbs_contact_run *run_of(mbs_fmu *f, double end)
{
    static const int sizes[4] = {1, MBS_FMU_NQ, MBS_FMU_NX - MBS_FMU_NQ, MBS_CONTACTS_NP}, size[1] = {MBS_FMU_NW};
    static const mbs_program inputs = {"inputs", 4, sizes, 1, size, all_inputs};
    mbs_contact_run *run = f->run ? f->run : (f->run = calloc(1, sizeof *run));
    if (run) {
        update(f);
        mbs_contacts_begin(run, f->now.time, end, 2);
        if (MBS_FMU_NW > 0)
            run->system.inputs = run->laws.inputs = &inputs;
        run->problem.rtol = f->now.tolerance;
        run->problem.atol = f->now.tolerance * MBS_FMU_ATOL_BY_RTOL;
        for (int k = 0; k < MBS_CONTACTS_NP; ++k)
            if (mbs_fmu_contact_parameters[k] >= 0)
                run->parameters[k] = f->now.parameters[mbs_fmu_contact_parameters[k]];
        memcpy(run->parameters + MBS_CONTACTS_NP, f->now.parameters + NP, FREE * sizeof(double));
        if (!f->work)
            f->work = calloc((size_t)mbs_contacts_work(run), sizeof(double));
    }
    if (!run || !f->work) {
        mbs_fmu_fail(f, "there is no memory for the contacts");
        return NULL;
    }
    if (f->now.phase <= MBS_FMU_BEGINNING)
        mbs_contacts_start(run, f->now.x, f->work);
    else {
        run->now = f->now.contacts;
        mbs_contacts_resume(run, f->now.x, f->work);
    }
    return run;
}

/* Take over where a run stands, and log what happened; returns a status. */
static int take_over(mbs_fmu *f, const mbs_contact_run *run)
{
    f->known = 0;
    for (int k = 0; k < run->event_count; ++k)
        tell_event(f, "t = %.9g s: %s %s", run->events[k].time, run->events[k].name, run->events[k].word);
    if (run->status > MBS_CONTACTS_STOPPED)
        return mbs_fmu_fail(f, "%s at t = %.9g s", mbs_contacts_words(run->status), f->now.time);
    memcpy(f->now.x, f->work, NX * sizeof(double));
    f->now.contacts = run->now;
    return MBS_FMU_OK;
}

static int evaluate_model(mbs_fmu *f)
{
    mbs_contact_run *run = run_of(f, f->now.time + 1.0);
    if (!run)
        return MBS_FMU_ERROR;
    if (run->status != MBS_CONTACTS_GOES_ON)
        return mbs_fmu_fail(f, "%s at t = %.9g s", mbs_contacts_words(run->status), f->now.time);
    evaluate_with(f, run->parameters, run->numbers, run->margins);
    return MBS_FMU_OK;
}
#else
static void call(mbs_fmu *f, int program, double *const *out)
{
    const double none[1] = {0.0};
    update(f);
    call_with(f, f->now.parameters, none, program, out);
}

static int evaluate_model(mbs_fmu *f)
{
    const double none[1] = {0.0};
    update(f);
    evaluate_with(f, f->now.parameters, none, mbs_fmu_margins);
    return MBS_FMU_OK;
}
#endif

static int evaluate(mbs_fmu *f)
{
    if (f->known)
        return MBS_FMU_OK;
    if (evaluate_model(f) != MBS_FMU_OK)
        return MBS_FMU_ERROR;
    for (int k = 0; k < NX; ++k)
        if (!isfinite(f->rates[k]))
            return mbs_fmu_fail(f, "the rate of %s is not finite at t = %.9g s", mbs_fmu_states[k], f->now.time);
    f->known = 1;
    return MBS_FMU_OK;
}

static double value_of(const mbs_fmu *f, unsigned reference)
{
    if (reference == MBS_FMU_TIME)
        return f->now.time;
    if (reference < MBS_FMU_RATES)
        return f->now.x[reference - MBS_FMU_STATES];
    if (reference < MBS_FMU_INPUTS)
        return f->rates[reference - MBS_FMU_RATES];
    if (reference < MBS_FMU_OUTPUTS)
        return f->inputs[reference - MBS_FMU_INPUTS];
    if (reference < MBS_FMU_PARAMETERS)
        return f->outputs[reference - MBS_FMU_OUTPUTS];
    if (reference < MBS_FMU_INDICATORS)
        return f->now.parameters[reference - MBS_FMU_PARAMETERS];
    return f->indicators[reference - MBS_FMU_INDICATORS];
}

/* Whether a value reference is that of a variable: some parameters are none. */
static int exists(unsigned reference)
{
    const int parameter = reference >= MBS_FMU_PARAMETERS && reference < MBS_FMU_INDICATORS;
    return reference < MBS_FMU_END &&
           !(parameter && mbs_fmu_parameter_kinds[reference - MBS_FMU_PARAMETERS] == MBS_FMU_HIDDEN);
}

static int fail_unknown(const mbs_fmu *f, unsigned reference)
{
    return mbs_fmu_fail(f, "there is no variable with the value reference %u", reference);
}

/* Values of states, and of independent parameters, can be read where the model cannot be evaluated. */
static int stands(const mbs_fmu *f, unsigned reference)
{
    return reference < MBS_FMU_RATES ||
           (reference >= MBS_FMU_PARAMETERS && reference < MBS_FMU_INDICATORS && !f->stale);
}

int mbs_fmu_get(mbs_fmu *f, references at, size_t count, double *values)
{
    for (size_t k = 0; k < count; ++k) {
        if (!exists(at[k]))
            return fail_unknown(f, at[k]);
        if (!stands(f, at[k]) && evaluate(f) != MBS_FMU_OK)
            return MBS_FMU_ERROR;
        values[k] = value_of(f, at[k]);
    }
    return MBS_FMU_OK;
}

static int set_parameter(mbs_fmu *f, int place, double value)
{
    int kind = mbs_fmu_parameter_kinds[place];
    const char *name = mbs_fmu_parameters[place];
    if (kind == MBS_FMU_FOLLOWS)
        return mbs_fmu_fail(f, "the parameter %s follows from others and cannot be set", name);
    if (kind == MBS_FMU_FIXED && f->now.phase > MBS_FMU_BEGINNING)
        return mbs_fmu_fail(f, "the parameter %s is fixed: set it before the end of the initialization", name);
    if (mbs_fmu_positive[place] && !(value > 0.0))
        return mbs_fmu_fail(f, "the parameter %s must be positive, not %.9g", name, value);
    f->now.parameters[place] = value;
    f->stale = 1;
    return MBS_FMU_OK;
}

static int set_input(mbs_fmu *f, int place, double value)
{
    for (int k = 0; k < FREE; ++k)
        if (mbs_fmu_free_inputs[k] == place) {
            f->now.parameters[NP + k] = value;
            return MBS_FMU_OK;
        }
    return mbs_fmu_fail(f, "the input with the value reference %d is computed in the FMU", MBS_FMU_INPUTS + place);
}

int mbs_fmu_set(mbs_fmu *f, references at, size_t count, const double *values)
{
    for (size_t k = 0; k < count; ++k) {
        unsigned one = at[k];
        int status = MBS_FMU_OK;
        if (!exists(one))
            return fail_unknown(f, one);
        if (!isfinite(values[k]))
            return mbs_fmu_fail(f, "the value for the reference %u is not finite", one);
        if (one >= MBS_FMU_STATES && one < MBS_FMU_RATES && f->now.phase <= MBS_FMU_BEGINNING)
            f->now.x[one - MBS_FMU_STATES] = values[k];
        else if (one >= MBS_FMU_STATES && one < MBS_FMU_RATES)
            status = mbs_fmu_fail(f, "%s is set before the end of the initialization, or with all states",
                                  mbs_fmu_states[one - MBS_FMU_STATES]);
        else if (one >= MBS_FMU_INPUTS && one < MBS_FMU_OUTPUTS)
            status = set_input(f, (int)one - MBS_FMU_INPUTS, values[k]);
        else if (one >= MBS_FMU_PARAMETERS && one < MBS_FMU_INDICATORS)
            status = set_parameter(f, (int)one - MBS_FMU_PARAMETERS, values[k]);
        else
            status = mbs_fmu_fail(f, "the variable with the value reference %u follows from others and cannot be set", one);
        f->known = 0;
        if (status != MBS_FMU_OK)
            return status;
    }
    return MBS_FMU_OK;
}

/* ---- states on the constraints ---- */

static double size_of(int count, const double *x)
{
    double most = 0.0;
    for (int k = 0; k < count; ++k)
        most = fabs(x[k]) > most ? fabs(x[k]) : most;
    return most;
}

#if MBS_FMU_CONTACTS
/* By how much states miss the rows that act. */
static double drift(mbs_fmu *f)
{
    mbs_contact_run *run = run_of(f, f->now.time + 1.0);
    double phi[MBS_CONTACTS_ROWS + 1], phidot[MBS_CONTACTS_ROWS + 1], *out[2] = {phi, phidot};
    if (!run)
        return 0.0;
    call_with(f, run->parameters, run->numbers, MBS_FMU_MISSED_PROGRAM, out);
    return fmax(size_of(MBS_CONTACTS_ROWS, phi) / (1.0 + size_of(NQ, f->now.x)),
                size_of(MBS_CONTACTS_ROWS, phidot) / (1.0 + size_of(NX - NQ, f->now.x + NQ)));
}

static int put_back(mbs_fmu *f)
{
    for (int round = 0; round < MBS_CLOSING_ROUNDS && drift(f) > 8.0 * MBS_EPSILON; ++round) {
        mbs_contact_run *run = run_of(f, f->now.time + 1.0);
        double change[NX + 1], *out[2] = {change, change + NQ};
        if (!run)
            return MBS_FMU_ERROR;
        call_with(f, run->parameters, run->numbers, MBS_FMU_PUT_BACK_PROGRAM, out);
        for (int k = 0; k < NX; ++k)
            f->now.x[k] += change[k];
    }
    f->known = 0;
    if (drift(f) <= MBS_FMU_CLOSURE)
        return MBS_FMU_OK;
    return mbs_fmu_fail(f, "the constraints cannot be closed at t = %.9g s", f->now.time);
}
#else
/* The largest row of a program that corrects `count` states, over their size; `change` receives the correction. */
static double missed(mbs_fmu *f, int program, int first, int count, double *change)
{
    double rows[MBS_FMU_NS + 1], *out[2] = {rows, change};
    call(f, program, out);
    return size_of(MBS_FMU_NS, rows) / (1.0 + size_of(count, f->now.x + first));
}

/* Correct states until no row gets better; its length `left`. */
static double close_rows(mbs_fmu *f, int program, int first, int count)
{
    double change[NX + 1], kept[NX + 1], left = missed(f, program, first, count, change), before = HUGE_VAL;
    for (int round = 0; round < MBS_CLOSING_ROUNDS && left > 0.0 && left < 0.5 * before; ++round) {
        before = left;
        memcpy(kept, f->now.x, NX * sizeof(double));
        for (int k = 0; k < count; ++k)
            f->now.x[first + k] += change[k];
        left = missed(f, program, first, count, change);
        if (!(left < before)) {
            memcpy(f->now.x, kept, NX * sizeof(double));
            return before;
        }
    }
    return left;
}

static void normalize(mbs_fmu *f, double *deviation)
{
    double q[NX + 1], *out[2] = {q, deviation};
    *deviation = 0.0;
    if (MBS_FMU_NORMALIZE_PROGRAM < 0)
        return;
    call(f, MBS_FMU_NORMALIZE_PROGRAM, out);
    memcpy(f->now.x, q, NQ * sizeof(double));
}

static int put_back(mbs_fmu *f)
{
    double deviation, left;
    normalize(f, &deviation);
    f->known = 0;
    if (MBS_FMU_NS == 0)
        return MBS_FMU_OK;
    left = close_rows(f, MBS_FMU_POSITION_PROGRAM, 0, NQ);
    if (left <= MBS_FMU_CLOSURE)
        left = close_rows(f, MBS_FMU_VELOCITY_PROGRAM, NQ, NX - NQ);
    if (left <= MBS_FMU_CLOSURE)
        return MBS_FMU_OK;
    return mbs_fmu_fail(f, "the constraints cannot be closed at t = %.9g s", f->now.time);
}

/* By how much states miss the constraints. */
static double drift(mbs_fmu *f)
{
    double change[NX + 1], q[NX + 1], deviation = 0.0, *out[2] = {q, &deviation}, most;
    if (MBS_FMU_NORMALIZE_PROGRAM >= 0)
        call(f, MBS_FMU_NORMALIZE_PROGRAM, out);
    most = fabs(deviation);
    if (MBS_FMU_NS > 0) {
        most = fmax(most, missed(f, MBS_FMU_POSITION_PROGRAM, 0, NQ, change));
        most = fmax(most, missed(f, MBS_FMU_VELOCITY_PROGRAM, NQ, NX - NQ, change));
    }
    return most;
}

#endif

/* ---- initialization, model exchange ---- */

static double side(double value)
{
    return (double)((value > 0.0) - (value < 0.0));
}

/* What ends the motion has to come from below zero. */
static void note_sides(mbs_fmu *f)
{
    for (int k = 0; k < NG; ++k)
        if (f->indicators[k] != 0.0)
            f->now.sides[k] = side(f->indicators[k]);
}

API(int, SetTime)(mbs_fmu *f, double time)
{
    f->known = f->known && time == f->now.time;
    f->now.time = time;
    return MBS_FMU_OK;
}

int mbs_fmu_begin(mbs_fmu *f, double start, int has_tolerance, double tolerance)
{
    if (!isfinite(start))
        return mbs_fmu_fail(f, "the start time is not finite");
    FMI(SetTime)(f, start);
    if (has_tolerance && tolerance > 0.0)
        f->now.tolerance = fmin(fmax(tolerance, 1e-14), 0.1);
    return MBS_FMU_OK;
}

/* Put the start onto the constraints. */
API(int, ExitInitializationMode)(mbs_fmu *f)
{
#if MBS_FMU_CONTACTS
    const mbs_contact_run *run = run_of(f, f->now.time + 1.0);
    if (!run || take_over(f, run) != MBS_FMU_OK)
        return MBS_FMU_ERROR;
    f->now.phase = MBS_FMU_RUNNING;
#endif
    if (put_back(f) != MBS_FMU_OK || evaluate(f) != MBS_FMU_OK)
        return MBS_FMU_ERROR;
    note_sides(f);
    f->now.phase = MBS_FMU_RUNNING;
    return MBS_FMU_OK;
}

static int verify_count(const mbs_fmu *f, size_t count, int wanted, const char *what)
{
    return count == (size_t)wanted ? MBS_FMU_OK
                                   : mbs_fmu_fail(f, "there are %d %s, not %lu", wanted, what, (unsigned long)count);
}

API(int, SetContinuousStates)(mbs_fmu *f, const double *x, size_t count)
{
    if (verify_count(f, count, NX, "states") != MBS_FMU_OK)
        return MBS_FMU_ERROR;
    memcpy(f->now.x, x, NX * sizeof(double));
    f->known = 0;
    return MBS_FMU_OK;
}

API(int, GetContinuousStates)(mbs_fmu *f, double *x, size_t count)
{
    if (verify_count(f, count, NX, "states") != MBS_FMU_OK)
        return MBS_FMU_ERROR;
    memcpy(x, f->now.x, NX * sizeof(double));
    return MBS_FMU_OK;
}

API(int, GetNominalsOfContinuousStates)(mbs_fmu *f, double *nominals, size_t count)
{
    if (verify_count(f, count, NX, "states") != MBS_FMU_OK)
        return MBS_FMU_ERROR;
    for (int k = 0; k < NX; ++k)
        nominals[k] = 1.0;
    return MBS_FMU_OK;
}

API(int, GET_RATES)(mbs_fmu *f, double *rates, size_t count)
{
    if (verify_count(f, count, NX, "states") != MBS_FMU_OK || evaluate(f) != MBS_FMU_OK)
        return MBS_FMU_ERROR;
    memcpy(rates, f->rates, NX * sizeof(double));
    return MBS_FMU_OK;
}

API(int, GetEventIndicators)(mbs_fmu *f, double *values, size_t count)
{
    if (verify_count(f, count, NG, "event indicators") != MBS_FMU_OK || evaluate(f) != MBS_FMU_OK)
        return MBS_FMU_ERROR;
    memcpy(values, f->indicators, NG * sizeof(double));
    return MBS_FMU_OK;
}

API(int, EnterEventMode)(mbs_fmu *f)
{
    (void)f;
    return MBS_FMU_OK;
}

API(int, EnterContinuousTimeMode)(mbs_fmu *f)
{
    (void)f;
    return MBS_FMU_OK;
}

/* Whether an indicator whose positive values end the motion, or the state of a contact, has become positive. States of contacts
   are such that theirs begin below zero, but for rounding; a flight may be shorter than a step. */
static int stop_met(const mbs_fmu *f)
{
    for (int k = 0; k < NG; ++k)
        if (mbs_fmu_terminal[k] && f->indicators[k] > 0.0 &&
            (f->now.sides[k] <= 0.0 || (MBS_FMU_CONTACTS && k >= NG - MBS_FMU_SWITCHES)))
            return k;
    return -1;
}

/* After a step of the importing tool: whether states are to be put back onto the constraints, or the motion ends. */
API(int, CompletedIntegratorStep)(mbs_fmu *f, boolean final, boolean *event, boolean *ends)
{
    (void)final;
    *ends = 0;
    *event = drift(f) > 10.0 * f->now.tolerance;
    if (evaluate(f) != MBS_FMU_OK)
        return MBS_FMU_ERROR;
    *event = *event || stop_met(f) >= 0;
    if (!*event)
        note_sides(f);
    return MBS_FMU_OK;
}

/* Decide at an event, which an indicator has told; returns a status. */
static int meet(mbs_fmu *f, int place, int *changed)
{
#if MBS_FMU_CONTACTS
    if (place >= NG - MBS_FMU_SWITCHES) {
        mbs_contact_run *run = run_of(f, f->now.time + 1.0);
        if (!run)
            return MBS_FMU_ERROR;
        run->steps = f->now.tolerance;
        mbs_contacts_switch(run, place, f->work);
        if (take_over(f, run) != MBS_FMU_OK)
            return MBS_FMU_ERROR;
        *changed = 1;
        if (run->status == MBS_CONTACTS_STOPPED)
            tell_stop(f, run->events[0].name);
        return evaluate(f);
    }
#endif
    *changed |= 0;
    tell_stop(f, mbs_fmu_ends[place]);
    return MBS_FMU_OK;
}

int mbs_fmu_event(mbs_fmu *f, int *changed, int *stops, double *next)
{
    int met;
    *changed = drift(f) > 0.0;
    *next = HUGE_VAL;
    if ((*changed && put_back(f) != MBS_FMU_OK) || evaluate(f) != MBS_FMU_OK)
        return MBS_FMU_ERROR;
    met = stop_met(f);
    if (met >= 0 && meet(f, met, changed) != MBS_FMU_OK)
        return MBS_FMU_ERROR;
    if (!f->now.stopped)
        note_sides(f);
    *stops = (int)f->now.stopped;
    for (int k = MBS_FMU_MOMENTS - 1; k >= 0; --k)
        if (mbs_fmu_moments[k] > f->now.time * (1.0 + 8.0 * MBS_EPSILON))
            *next = mbs_fmu_moments[k];
    return MBS_FMU_OK;
}

/* ---- co-simulation ---- */

#if MBS_FMU_CONTACTS
static int integrate(mbs_fmu *f, double end)
{
    double samples[3 * (NX + 1)];
    mbs_contact_run *run = run_of(f, end);
    if (!run)
        return MBS_FMU_ERROR;
    while (run->status == MBS_CONTACTS_GOES_ON) {
        mbs_contacts_go(run, f->work, samples, 3);
        f->now.time = run->status == MBS_CONTACTS_DONE ? end : run->state.t;
        if (take_over(f, run) != MBS_FMU_OK)
            return MBS_FMU_ERROR;
    }
    if (run->status != MBS_CONTACTS_STOPPED)
        return MBS_FMU_OK;
    tell_stop(f, run->events[0].name);
    return MBS_FMU_DISCARD;
}
#else

static const char *words(int status)
{
    switch (status) {
    case MBS_NOT_FINITE: return "a rate is not finite";
    case MBS_STEP_UNDERFLOW: return "no step is short enough for the tolerance";
    case MBS_STEP_LIMIT: return "there are too many steps";
    case MBS_NOT_CLOSED: return "the constraints cannot be closed";
    case MBS_CONTRADICTION: return "constraints contradict each other";
    case MBS_SINGULAR: return "the motion comes to a singular position";
    default: return "the motion cannot be integrated";
    }
}

#define PROGRAM(place) ((place) < 0 ? NULL : &mbs_programs[place])

static int integrate(mbs_fmu *f, double end)
{
    static const int sizes[4] = {1, MBS_FMU_NQ, MBS_FMU_NX - MBS_FMU_NQ, MBS_FMU_NP}, size[1] = {MBS_FMU_NW};
    static const mbs_program inputs = {"inputs", 4, sizes, 1, size, all_inputs};
    double samples[3 * (NX + 1)], none[1] = {0.0}, independent = MBS_FMU_INDEPENDENT;
    mbs_state state;
    mbs_system system = {.inputs = MBS_FMU_NW > 0 ? &inputs : NULL,
                         .state_derivative = PROGRAM(MBS_FMU_DERIVATIVE_PROGRAM),
                         .jacobian = PROGRAM(MBS_FMU_JACOBIAN_PROGRAM),
                         .project_position = PROGRAM(MBS_FMU_POSITION_PROGRAM),
                         .project_velocity = PROGRAM(MBS_FMU_VELOCITY_PROGRAM),
                         .normalize = PROGRAM(MBS_FMU_NORMALIZE_PROGRAM),
                         .events = PROGRAM(MBS_FMU_EVENTS_PROGRAM),
                         .terminal = mbs_fmu_terminal,
                         .parameters = f->now.parameters,
                         .modes = none,
                         .nq = NQ,
                         .nu = NX - NQ,
                         .ns = MBS_FMU_NS,
                         .nw = MBS_FMU_NW,
                         .ng = NG,
                         .plain = mbs_fmu_plain,
                         .ball = mbs_fmu_ball,
                         .plains = MBS_FMU_PLAINS,
                         .balls = MBS_FMU_BALLS,
                         .margins = mbs_fmu_margins,
                         .switches = MBS_FMU_SWITCHES,
                         .moments = mbs_fmu_moments,
                         .moment_count = MBS_FMU_MOMENTS};
    mbs_problem problem = {.method = &mbs_fmu_method,
                           .system = &system,
                           .t0 = f->now.time,
                           .t_end = end,
                           .step = MBS_FMU_FIXED_STEP,
                           .rtol = f->now.tolerance,
                           .atol = f->now.tolerance * MBS_FMU_ATOL_BY_RTOL,
                           .contradiction = MBS_FMU_CONTRADICTION,
                           .closure = MBS_FMU_CLOSURE,
                           .independent = independent,
                           .max_steps = MBS_FMU_MOST_STEPS,
                           .samples = 2,
                           .project = MBS_FMU_NS > 0,
                           .crosses = 1};
    if (!f->work)
        f->work = calloc((size_t)mbs_work(&problem), sizeof(double));
    if (!f->work)
        return mbs_fmu_fail(f, "there is no memory for the integrator");
    mbs_start(&problem, f->now.x, &state, f->work);
    for (int events = 0; state.status == MBS_RUNNING; ++events) {
        if (events > MBS_FMU_MOST_EVENTS)
            return mbs_fmu_fail(f, "a force jumps to and fro at t = %.9g s and time does not go on", state.t);
        mbs_integrate(&problem, &state, f->work, MBS_FMU_MOST_STEPS, 3, samples);
    }
    memcpy(f->now.x, f->work, NX * sizeof(double));
    f->now.time = state.t;
    f->known = 0;
    if (state.status == MBS_STOPPED) {
        tell_stop(f, mbs_fmu_ends[state.event]);
        return MBS_FMU_DISCARD;
    }
    if (state.status != MBS_DONE)
        return mbs_fmu_fail(f, "%s at t = %.9g s", words(state.status), state.failure_time);
    f->now.time = end;
    return MBS_FMU_OK;
}
#endif

int mbs_fmu_step(mbs_fmu *f, double from, double h)
{
    if (!(fabs(from - f->now.time) <= 1e-9 * (1.0 + fabs(from))))
        return mbs_fmu_fail(f, "the step begins at t = %.9g s, but the FMU is at %.9g s", from, f->now.time);
    if (!(h >= 0.0) || !isfinite(h))
        return mbs_fmu_fail(f, "a step of %.9g s cannot be made", h);
    if (f->now.stopped)
        return MBS_FMU_DISCARD;
    if (f->stale && evaluate(f) != MBS_FMU_OK)
        return MBS_FMU_ERROR;
    if (NX > 0 && from + h > f->now.time)
        return integrate(f, from + h);
    return FMI(SetTime)(f, from + h);
}

/* ---- directional derivatives ---- */

#if MBS_FMU_HAS_SLOPES
/* Fill a row of d unknown / d (states, inputs from outside). */
static int slope_row(const mbs_fmu *f, unsigned unknown, const double *of_rates, const double *of_outputs, double *row)
{
    enum { WIDTH = NX + FREE };
    memset(row, 0, WIDTH * sizeof(double));
    if (unknown >= MBS_FMU_STATES && unknown < MBS_FMU_RATES)
        row[unknown - MBS_FMU_STATES] = 1.0;
    else if (unknown >= MBS_FMU_RATES && unknown < MBS_FMU_INPUTS)
        memcpy(row, of_rates + (unknown - MBS_FMU_RATES) * WIDTH, WIDTH * sizeof(double));
    else if (unknown >= MBS_FMU_OUTPUTS && unknown < MBS_FMU_PARAMETERS)
        memcpy(row, of_outputs + (unknown - MBS_FMU_OUTPUTS) * WIDTH, WIDTH * sizeof(double));
    else
        return mbs_fmu_fail(f, "the variable with the value reference %u has no directional derivative", unknown);
    return MBS_FMU_OK;
}

/* The column of a known variable; -1 for one that is none. */
static int column_of(unsigned known)
{
    if (known >= MBS_FMU_STATES && known < MBS_FMU_RATES)
        return (int)known - MBS_FMU_STATES;
    for (int k = 0; k < FREE; ++k)
        if (known == (unsigned)(MBS_FMU_INPUTS + mbs_fmu_free_inputs[k]))
            return NX + k;
    return -1;
}

int mbs_fmu_slopes(mbs_fmu *f, references unknowns, size_t rows, references knowns, size_t columns, const double *seeds,
                   double *results, int transposed)
{
    double *of_rates = calloc((NX + MBS_FMU_NO + 1) * (size_t)(NX + FREE) + 1, sizeof(double)), row[NX + FREE + 1];
    double *of_outputs = of_rates ? of_rates + NX * (NX + FREE) : NULL;
    int status = of_rates ? MBS_FMU_OK : mbs_fmu_fail(f, "there is no memory for derivatives");
    if (of_rates) {
        call(f, MBS_FMU_RATE_SLOPES_PROGRAM, &of_rates);
        if (MBS_FMU_NO > 0)
            call(f, MBS_FMU_OUTPUT_SLOPES_PROGRAM, &of_outputs);
    }
    for (size_t k = 0; k < (transposed ? columns : rows); ++k)
        results[k] = 0.0;
    for (size_t i = 0; i < rows && status == MBS_FMU_OK; ++i) {
        status = slope_row(f, unknowns[i], of_rates, of_outputs, row);
        for (size_t j = 0; j < columns && status == MBS_FMU_OK; ++j) {
            int place = column_of(knowns[j]);
            if (place < 0)
                status = mbs_fmu_fail(f, "there is no derivative by the variable with the value reference %u", knowns[j]);
            else if (transposed)
                results[j] += row[place] * seeds[i];
            else
                results[i] += row[place] * seeds[j];
        }
    }
    free(of_rates);
    return status;
}
#else
int mbs_fmu_slopes(mbs_fmu *f, references unknowns, size_t rows, references knowns, size_t columns, const double *seeds,
                   double *results, int transposed)
{
    (void)unknowns, (void)rows, (void)knowns, (void)columns, (void)seeds, (void)results, (void)transposed;
    return mbs_fmu_fail(f, "this FMU has no directional derivatives");
}
#endif

/* ---- saved states: a token of the model and the point ---- */

enum { SAVED = sizeof MBS_FMU_TOKEN + sizeof(mbs_fmu_point) };

static int room_for_saved(const mbs_fmu *f, char **saved)
{
    if (!*saved)
        *saved = malloc(SAVED);
    return *saved ? MBS_FMU_OK : mbs_fmu_fail(f, "there is no memory for a saved state");
}

API(int, FMU_STATE(Get, ))(mbs_fmu *f, char **saved)
{
    const int status = room_for_saved(f, saved);
    if (status == MBS_FMU_OK) {
        memcpy(*saved, MBS_FMU_TOKEN, sizeof MBS_FMU_TOKEN);
        memcpy(*saved + sizeof MBS_FMU_TOKEN, &f->now, sizeof f->now);
    }
    return status;
}

API(int, FMU_STATE(Set, ))(mbs_fmu *f, const char *saved)
{
    if (memcmp(saved, MBS_FMU_TOKEN, sizeof MBS_FMU_TOKEN) != 0)
        return mbs_fmu_fail(f, "this is not a saved state of this FMU");
    memcpy(&f->now, saved + sizeof MBS_FMU_TOKEN, sizeof f->now);
    f->known = 0;
    f->stale = 1;
    return MBS_FMU_OK;
}

API(int, FMU_STATE(Free, ))(mbs_fmu *f, char **saved)
{
    (void)f;
    free(*saved);
    *saved = NULL;
    return MBS_FMU_OK;
}

API(int, FMU_STATE(Serialized, Size))(mbs_fmu *f, const char *saved, size_t *size)
{
    (void)f, (void)saved;
    *size = SAVED;
    return MBS_FMU_OK;
}

API(int, FMU_STATE(Serialize, ))(mbs_fmu *f, const char *saved, char *bytes, size_t size)
{
    if (size < SAVED)
        return mbs_fmu_fail(f, "a saved state takes %d bytes, not %lu", SAVED, (unsigned long)size);
    memcpy(bytes, saved, SAVED);
    return MBS_FMU_OK;
}

API(int, DESERIALIZE)(mbs_fmu *f, const char *bytes, size_t size, char **saved)
{
    if (size != SAVED)
        return mbs_fmu_fail(f, "a saved state of this FMU has %d bytes, not %lu", SAVED, (unsigned long)size);
    const int status = room_for_saved(f, saved);
    if (status == MBS_FMU_OK)
        memcpy(*saved, bytes, size);
    return status;
}
