/* FMI 2.0 for model exchange and co-simulation: the functions that FMI 3.0 does not have, or has otherwise. */
#include "fmu.h"

#include <math.h>

typedef enum { DO_STEP_STATUS, PENDING_STATUS, LAST_SUCCESSFUL_TIME, TERMINATED } status_kind;

typedef struct {
    mbs_fmu_logger logger;
    void *(*allocate)(size_t count, size_t size);
    void (*free)(void *memory);
    void (*step_finished)(void *environment, int status);
    void *environment;
} callback_functions;

typedef struct {
    int new_states_needed, terminate, nominals_changed, values_changed, next_time_defined;
    double next_time;
} event_info;

/* ---- instances ---- */

API(const char *, GetTypesPlatform)(void) { return "default"; }

API(mbs_fmu *, Instantiate)(const char *name, int type, const char *guid, const char *resources,
                            const callback_functions *callbacks, int visible, int logging)
{
    (void)type, (void)resources, (void)visible;
    return mbs_fmu_create(name, guid, callbacks ? callbacks->environment : NULL, callbacks ? callbacks->logger : NULL, logging);
}

API(int, SetupExperiment)(mbs_fmu *f, int has_tolerance, double tolerance, double start, int has_stop, double stop)
{
    (void)has_stop, (void)stop;
    return mbs_fmu_begin(f, start, has_tolerance, tolerance);
}

API(int, EnterInitializationMode)(mbs_fmu *f)
{
    f->now.phase = MBS_FMU_BEGINNING;
    return MBS_FMU_OK;
}

/* ---- values ---- */

API(int, GetReal)(mbs_fmu *f, references at, size_t count, double *values) { return mbs_fmu_get(f, at, count, values); }

API(int, SetReal)(mbs_fmu *f, references at, size_t count, const double *values) { return mbs_fmu_set(f, at, count, values); }

static int none(const mbs_fmu *f, size_t count, const char *why)
{
    return count == 0 ? MBS_FMU_OK : mbs_fmu_fail(f, "%s", why);
}

#define NO_VALUES(name, type) \
    API(int, name)(mbs_fmu *f, references at, size_t count, type values) \
    { \
        (void)at, (void)values; \
        return none(f, count, "all variables of this FMU are real numbers"); \
    }

NO_VALUES(GetInteger, int *)
NO_VALUES(SetInteger, const int *)
NO_VALUES(GetBoolean, int *)
NO_VALUES(SetBoolean, const int *)
NO_VALUES(GetString, const char **)
NO_VALUES(SetString, const char *const *)

API(int, GetDirectionalDerivative)(mbs_fmu *f, references unknowns, size_t rows, references knowns, size_t columns,
                                   const double *seeds, double *results)
{
    return mbs_fmu_slopes(f, unknowns, rows, knowns, columns, seeds, results, 0);
}

/* ---- model exchange ---- */

API(int, NewDiscreteStates)(mbs_fmu *f, event_info *info)
{
    int changed, stops, status;
    double next;
    status = mbs_fmu_event(f, &changed, &stops, &next);
    info->new_states_needed = info->nominals_changed = 0;
    if (status != MBS_FMU_OK)
        return status;
    info->terminate = stops;
    info->values_changed = changed;
    info->next_time_defined = next < HUGE_VAL;
    info->next_time = next < HUGE_VAL ? next : 0.0;
    return MBS_FMU_OK;
}

/* ---- co-simulation ---- */

API(int, SetRealInputDerivatives)(mbs_fmu *f, references at, size_t count, const int *orders, const double *values)
{
    (void)at, (void)orders, (void)values;
    return none(f, count, "inputs are constant during a step");
}

API(int, GetRealOutputDerivatives)(mbs_fmu *f, references at, size_t count, const int *orders, double *values)
{
    (void)at, (void)orders, (void)values;
    return none(f, count, "outputs have no derivatives by time");
}

API(int, DoStep)(mbs_fmu *f, double from, double h, int final)
{
    (void)final;
    return mbs_fmu_step(f, from, h);
}

API(int, CancelStep)(mbs_fmu *f) { return mbs_fmu_fail(f, "no step is pending"); }

API(int, GetRealStatus)(mbs_fmu *f, const status_kind kind, double *value)
{
    if (kind != LAST_SUCCESSFUL_TIME)
        return MBS_FMU_DISCARD;
    *value = f->now.time;
    return MBS_FMU_OK;
}

API(int, GetBooleanStatus)(mbs_fmu *f, const status_kind kind, int *value)
{
    if (kind != TERMINATED)
        return MBS_FMU_DISCARD;
    *value = f->now.stopped != 0;
    return MBS_FMU_OK;
}

#define NO_STATUS(name, type) \
    API(int, name)(mbs_fmu *f, const status_kind kind, type *value) \
    { \
        (void)f, (void)kind, (void)value; \
        return MBS_FMU_DISCARD; \
    }

NO_STATUS(GetStatus, int)
NO_STATUS(GetIntegerStatus, int)
NO_STATUS(GetStringStatus, const char *)
