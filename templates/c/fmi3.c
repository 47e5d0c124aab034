/* FMI 3.0 for model exchange and co-simulation: the functions that FMI 2.0 does not have, or has otherwise. */
#include "fmu.h"

#include <math.h>
#include <stdint.h>

typedef void (*callback)(void);

/* ---- instances ---- */

API(mbs_fmu *, InstantiateModelExchange)(const char *name, const char *token, const char *resources, bool visible,
                                         bool logging, void *environment, mbs_fmu_logger logger)
{
    (void)resources, (void)visible;
    return mbs_fmu_create(name, token, environment, logger, logging);
}

API(mbs_fmu *, InstantiateCoSimulation)(const char *name, const char *token, const char *resources, bool visible,
                                        bool logging, bool events, bool early, references needed, size_t count,
                                        void *environment, mbs_fmu_logger logger, callback update)
{
    (void)resources, (void)visible, (void)events, (void)early, (void)needed, (void)count, (void)update;
    return mbs_fmu_create(name, token, environment, logger, logging);
}

API(mbs_fmu *, InstantiateScheduledExecution)(const char *name, const char *token, const char *resources, bool visible,
                                              bool logging, void *environment, mbs_fmu_logger logger, callback update,
                                              callback lock, callback unlock)
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logging;
    (void)update, (void)lock, (void)unlock;
    if (logger)
        logger(environment, MBS_FMU_ERROR, "logStatusError", "this FMU has no scheduled execution");
    return NULL;
}

API(int, EnterInitializationMode)(mbs_fmu *f, bool has_tolerance, double tolerance, double start, bool has_stop, double stop)
{
    (void)has_stop, (void)stop;
    f->now.phase = MBS_FMU_BEGINNING;
    return mbs_fmu_begin(f, start, has_tolerance, tolerance);
}

/* ---- values ---- */

static int none(const mbs_fmu *f, size_t count, const char *why)
{
    return count == 0 ? MBS_FMU_OK : mbs_fmu_fail(f, "%s", why);
}

static int counted(const mbs_fmu *f, size_t variables, size_t values)
{
    if (variables == values)
        return MBS_FMU_OK;
    return mbs_fmu_fail(f, "there are %lu values for %lu variables, all of which are scalars", (unsigned long)values,
                        (unsigned long)variables);
}

API(int, GetFloat64)(mbs_fmu *f, references at, size_t count, double *values, size_t sizes)
{
    int status = counted(f, count, sizes);
    return status == MBS_FMU_OK ? mbs_fmu_get(f, at, count, values) : status;
}

API(int, SetFloat64)(mbs_fmu *f, references at, size_t count, const double *values, size_t sizes)
{
    int status = counted(f, count, sizes);
    return status == MBS_FMU_OK ? mbs_fmu_set(f, at, count, values) : status;
}

#define NUMBERS "all variables of this FMU are of the type Float64"
#define DEPENDENCIES "dependencies stand in modelDescription.xml, and do not change"
#define CLOCKS "this FMU has no clocks"

#define NO_VALUES(kind) \
    API(int, Get##kind)(mbs_fmu *f, references at, size_t count, void *values, size_t sizes) \
    { \
        (void)at, (void)values, (void)sizes; \
        return none(f, count, NUMBERS); \
    } \
    API(int, Set##kind)(mbs_fmu *f, references at, size_t count, const void *values, size_t sizes) \
    { \
        (void)at, (void)values, (void)sizes; \
        return none(f, count, NUMBERS); \
    }

NO_VALUES(Float32)
NO_VALUES(Int8)
NO_VALUES(UInt8)
NO_VALUES(Int16)
NO_VALUES(UInt16)
NO_VALUES(Int32)
NO_VALUES(UInt32)
NO_VALUES(Int64)
NO_VALUES(UInt64)
NO_VALUES(Boolean)
NO_VALUES(String)

API(int, GetBinary)(mbs_fmu *f, references at, size_t count, size_t *lengths, const void **values, size_t sizes)
{
    (void)at, (void)lengths, (void)values, (void)sizes;
    return none(f, count, NUMBERS);
}

API(int, SetBinary)(mbs_fmu *f, references at, size_t count, const size_t *lengths, const void *const *values, size_t sizes)
{
    (void)at, (void)lengths, (void)values, (void)sizes;
    return none(f, count, NUMBERS);
}

API(int, GetNumberOfVariableDependencies)(mbs_fmu *f, unsigned dependent, size_t *count)
{
    (void)dependent, (void)count;
    return none(f, 1, DEPENDENCIES);
}

API(int, GetVariableDependencies)(mbs_fmu *f, unsigned dependent, size_t *of_dependent, unsigned *independents,
                                  size_t *of_independents, int *kinds, size_t count)
{
    (void)dependent, (void)of_dependent, (void)independents, (void)of_independents, (void)kinds, (void)count;
    return none(f, 1, DEPENDENCIES);
}

#define DERIVATIVE(name, given, found, transposed) \
    API(int, name)(mbs_fmu *f, references unknowns, size_t rows, references knowns, size_t columns, const double *seeds, \
                   size_t seed_count, double *results, size_t result_count) \
    { \
        if (counted(f, given, seed_count) != MBS_FMU_OK || counted(f, found, result_count) != MBS_FMU_OK) \
            return MBS_FMU_ERROR; \
        return mbs_fmu_slopes(f, unknowns, rows, knowns, columns, seeds, results, transposed); \
    }

DERIVATIVE(GetDirectionalDerivative, columns, rows, 0)
DERIVATIVE(GetAdjointDerivative, rows, columns, 1)

/* ---- model exchange ---- */

#define NOTHING(name) \
    API(int, name)(mbs_fmu *f) \
    { \
        (void)f; \
        return MBS_FMU_OK; \
    }

NOTHING(EnterStepMode)
NOTHING(EvaluateDiscreteStates)
NOTHING(EnterConfigurationMode)
NOTHING(ExitConfigurationMode)

API(int, UpdateDiscreteStates)(mbs_fmu *f, bool *again, bool *terminate, bool *nominals, bool *states, bool *has_next,
                               double *next)
{
    int changed, stops, status;
    double time;
    status = mbs_fmu_event(f, &changed, &stops, &time);
    *again = *nominals = false;
    if (status != MBS_FMU_OK)
        return status;
    *terminate = stops;
    *states = changed;
    *has_next = time < HUGE_VAL;
    *next = time < HUGE_VAL ? time : 0.0;
    return MBS_FMU_OK;
}

#define COUNT(name, number) \
    API(int, name)(mbs_fmu *f, size_t *count) \
    { \
        (void)f; \
        *count = number; \
        return MBS_FMU_OK; \
    }

COUNT(GetNumberOfEventIndicators, MBS_FMU_NG)
COUNT(GetNumberOfContinuousStates, MBS_FMU_NX)

/* ---- co-simulation ---- */

API(int, DoStep)(mbs_fmu *f, double from, double h, bool final, bool *event, bool *terminate, bool *early, double *reached)
{
    int status = mbs_fmu_step(f, from, h);
    (void)final;
    *event = *early = false;
    *terminate = f->now.stopped != 0;
    *reached = f->now.time;
    return *terminate && status == MBS_FMU_DISCARD ? MBS_FMU_OK : status;
}

API(int, GetOutputDerivatives)(mbs_fmu *f, references at, size_t count, const int32_t *orders, double *values, size_t sizes)
{
    (void)at, (void)orders, (void)values, (void)sizes;
    return none(f, count, "outputs have no derivatives by time");
}

/* ---- clocks, of which there are none ---- */

#define NO_CLOCKS_1(name, type) \
    API(int, name)(mbs_fmu *f, references at, size_t count, type a) \
    { \
        (void)at, (void)a; \
        return none(f, count, CLOCKS); \
    }
#define NO_CLOCKS_2(name, first, second) \
    API(int, name)(mbs_fmu *f, references at, size_t count, first a, second b) \
    { \
        (void)at, (void)a, (void)b; \
        return none(f, count, CLOCKS); \
    }

NO_CLOCKS_1(GetClock, bool *)
NO_CLOCKS_1(SetClock, const bool *)
NO_CLOCKS_2(GetIntervalDecimal, double *, int *)
NO_CLOCKS_1(GetShiftDecimal, double *)
NO_CLOCKS_2(GetShiftFraction, uint64_t *, uint64_t *)
NO_CLOCKS_1(SetIntervalDecimal, const double *)
NO_CLOCKS_2(SetIntervalFraction, const uint64_t *, const uint64_t *)
NO_CLOCKS_1(SetShiftDecimal, const double *)
NO_CLOCKS_2(SetShiftFraction, const uint64_t *, const uint64_t *)

API(int, GetIntervalFraction)(mbs_fmu *f, references at, size_t count, uint64_t *counters, uint64_t *resolutions, int *kinds)
{
    (void)at, (void)counters, (void)resolutions, (void)kinds;
    return none(f, count, CLOCKS);
}

API(int, ActivateModelPartition)(mbs_fmu *f, unsigned clock, double time)
{
    (void)clock, (void)time;
    return none(f, 1, CLOCKS);
}
