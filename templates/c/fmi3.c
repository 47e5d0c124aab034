/* FMI 3.0 for model exchange and co-simulation: the functions of the standard over fmu.h. */
#include "fmu.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Linked statically, functions bear the name of the model in front. */
#ifdef FMI3_FUNCTION_PREFIX
#define API(type, name) type MBS_FMU_JOIN(FMI3_FUNCTION_PREFIX, name)
#else
#define API(type, name) MBS_FMU_EXPORTED type name
#endif

typedef void *fmi3Instance, *fmi3FMUState, *fmi3InstanceEnvironment;
typedef uint32_t fmi3ValueReference;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef int8_t fmi3Int8;
typedef uint8_t fmi3UInt8, fmi3Byte;
typedef int16_t fmi3Int16;
typedef uint16_t fmi3UInt16;
typedef int32_t fmi3Int32;
typedef uint32_t fmi3UInt32;
typedef int64_t fmi3Int64;
typedef uint64_t fmi3UInt64;
typedef bool fmi3Boolean, fmi3Clock;
typedef const char *fmi3String;
typedef const fmi3Byte *fmi3Binary;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef int fmi3DependencyKind, fmi3IntervalQualifier;
typedef void (*fmi3Logger)(fmi3InstanceEnvironment, fmi3Status, fmi3String category, fmi3String message);
typedef void (*fmi3IntermediateUpdate)(void);
typedef const fmi3ValueReference *References;

static mbs_fmu *of(fmi3Instance c)
{
    return c;
}

/* A pointer to a function in a pointer to data, which need not hold one, goes by its bytes. */
static void tell(const mbs_fmu *f, int status, const char *category, const char *text)
{
    fmi3Logger logger;
    memcpy(&logger, &f->logger, sizeof logger);
    if (logger && (status != MBS_FMU_OK || f->logging))
        logger(f->environment, (fmi3Status)status, category, text);
}

/* ---- instances ---- */

API(const char *, fmi3GetVersion)(void) { return "3.0"; }

API(fmi3Status, fmi3SetDebugLogging)(fmi3Instance c, fmi3Boolean on, size_t count, const fmi3String *categories)
{
    (void)count, (void)categories;
    of(c)->logging = on;
    return fmi3OK;
}

static fmi3Instance created(fmi3String name, fmi3String token, fmi3Boolean logging, void *environment, fmi3Logger logger)
{
    mbs_fmu *f = mbs_fmu_create(name);
    if (!f)
        return NULL;
    f->tell = tell;
    memcpy(&f->logger, &logger, sizeof logger);
    f->environment = environment;
    f->logging = logging;
    if (token && strcmp(token, MBS_FMU_TOKEN) == 0)
        return f;
    mbs_fmu_fail(f, "the instantiation token is not that of this FMU, %s", MBS_FMU_TOKEN);
    mbs_fmu_free(f);
    return NULL;
}

API(fmi3Instance, fmi3InstantiateModelExchange)(fmi3String name, fmi3String token, fmi3String resources,
                                                fmi3Boolean visible, fmi3Boolean logging,
                                                fmi3InstanceEnvironment environment, fmi3Logger logger)
{
    (void)resources, (void)visible;
    return created(name, token, logging, environment, logger);
}

API(fmi3Instance, fmi3InstantiateCoSimulation)(fmi3String name, fmi3String token, fmi3String resources,
                                               fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean events,
                                               fmi3Boolean early, References needed, size_t count,
                                               fmi3InstanceEnvironment environment, fmi3Logger logger,
                                               fmi3IntermediateUpdate update)
{
    (void)resources, (void)visible, (void)events, (void)early, (void)needed, (void)count, (void)update;
    return created(name, token, logging, environment, logger);
}

API(fmi3Instance, fmi3InstantiateScheduledExecution)(fmi3String name, fmi3String token, fmi3String resources,
                                                     fmi3Boolean visible, fmi3Boolean logging,
                                                     fmi3InstanceEnvironment environment, fmi3Logger logger,
                                                     fmi3IntermediateUpdate update, fmi3IntermediateUpdate lock,
                                                     fmi3IntermediateUpdate unlock)
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logging;
    (void)update, (void)lock, (void)unlock;
    if (logger)
        logger(environment, fmi3Error, "logStatusError", "this FMU has no scheduled execution");
    return NULL;
}

API(void, fmi3FreeInstance)(fmi3Instance c) { mbs_fmu_free(c); }

API(fmi3Status, fmi3EnterInitializationMode)(fmi3Instance c, fmi3Boolean has_tolerance, fmi3Float64 tolerance,
                                             fmi3Float64 start, fmi3Boolean has_stop, fmi3Float64 stop)
{
    (void)has_stop, (void)stop;
    of(c)->now.phase = MBS_FMU_BEGINNING;
    return (fmi3Status)mbs_fmu_begin(of(c), start, has_tolerance, tolerance);
}

API(fmi3Status, fmi3ExitInitializationMode)(fmi3Instance c) { return (fmi3Status)mbs_fmu_end_of_beginning(of(c)); }

API(fmi3Status, fmi3Terminate)(fmi3Instance c)
{
    of(c)->now.phase = MBS_FMU_ENDED;
    return fmi3OK;
}

API(fmi3Status, fmi3Reset)(fmi3Instance c)
{
    mbs_fmu_reset(of(c));
    return fmi3OK;
}

/* ---- values ---- */

static fmi3Status none(fmi3Instance c, size_t count)
{
    return count == 0 ? fmi3OK : (fmi3Status)mbs_fmu_fail(of(c), "this FMU has no such variables");
}

static fmi3Status counted(fmi3Instance c, size_t references, size_t values)
{
    return references == values ? fmi3OK : (fmi3Status)mbs_fmu_fail(of(c), "all variables of this FMU are scalars");
}

API(fmi3Status, fmi3GetFloat64)(fmi3Instance c, References at, size_t count, fmi3Float64 *values, size_t sizes)
{
    fmi3Status status = counted(c, count, sizes);
    return status == fmi3OK ? (fmi3Status)mbs_fmu_get(of(c), at, count, values) : status;
}

API(fmi3Status, fmi3SetFloat64)(fmi3Instance c, References at, size_t count, const fmi3Float64 *values, size_t sizes)
{
    fmi3Status status = counted(c, count, sizes);
    return status == fmi3OK ? (fmi3Status)mbs_fmu_set(of(c), at, count, values) : status;
}

#define NO_VALUES(kind) \
    API(fmi3Status, fmi3Get##kind)(fmi3Instance c, References at, size_t count, fmi3##kind *values, size_t sizes) \
    { \
        (void)at, (void)values, (void)sizes; \
        return none(c, count); \
    } \
    API(fmi3Status, fmi3Set##kind)(fmi3Instance c, References at, size_t count, const fmi3##kind *values, size_t sizes) \
    { \
        (void)at, (void)values, (void)sizes; \
        return none(c, count); \
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

API(fmi3Status, fmi3GetBinary)(fmi3Instance c, References at, size_t count, size_t *lengths, fmi3Binary *values, size_t n)
{
    (void)at, (void)lengths, (void)values, (void)n;
    return none(c, count);
}

API(fmi3Status, fmi3SetBinary)(fmi3Instance c, References at, size_t count, const size_t *lengths,
                               const fmi3Binary *values, size_t n)
{
    (void)at, (void)lengths, (void)values, (void)n;
    return none(c, count);
}

API(fmi3Status, fmi3GetNumberOfVariableDependencies)(fmi3Instance c, fmi3ValueReference dependent, size_t *count)
{
    (void)dependent, (void)count;
    return none(c, 1);
}

API(fmi3Status, fmi3GetVariableDependencies)(fmi3Instance c, fmi3ValueReference dependent, size_t *of_dependent,
                                             fmi3ValueReference *independents, size_t *of_independents,
                                             fmi3DependencyKind *kinds, size_t count)
{
    (void)dependent, (void)of_dependent, (void)independents, (void)of_independents, (void)kinds, (void)count;
    return none(c, 1);
}

API(fmi3Status, fmi3GetDirectionalDerivative)(fmi3Instance c, References unknowns, size_t rows, References knowns,
                                              size_t columns, const fmi3Float64 *seeds, size_t seed_count,
                                              fmi3Float64 *results, size_t result_count)
{
    if (counted(c, columns, seed_count) != fmi3OK || counted(c, rows, result_count) != fmi3OK)
        return fmi3Error;
    return (fmi3Status)mbs_fmu_slopes(of(c), unknowns, rows, knowns, columns, seeds, results, 0);
}

API(fmi3Status, fmi3GetAdjointDerivative)(fmi3Instance c, References unknowns, size_t rows, References knowns,
                                          size_t columns, const fmi3Float64 *seeds, size_t seed_count,
                                          fmi3Float64 *results, size_t result_count)
{
    if (counted(c, rows, seed_count) != fmi3OK || counted(c, columns, result_count) != fmi3OK)
        return fmi3Error;
    return (fmi3Status)mbs_fmu_slopes(of(c), unknowns, rows, knowns, columns, seeds, results, 1);
}

/* ---- saved states ---- */

API(fmi3Status, fmi3GetFMUState)(fmi3Instance c, fmi3FMUState *state)
{
    return (fmi3Status)mbs_fmu_save(of(c), state);
}

API(fmi3Status, fmi3SetFMUState)(fmi3Instance c, fmi3FMUState state)
{
    return (fmi3Status)mbs_fmu_restore(of(c), state, mbs_fmu_saved_size());
}

API(fmi3Status, fmi3FreeFMUState)(fmi3Instance c, fmi3FMUState *state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return fmi3OK;
}

API(fmi3Status, fmi3SerializedFMUStateSize)(fmi3Instance c, fmi3FMUState state, size_t *size)
{
    (void)c, (void)state;
    *size = mbs_fmu_saved_size();
    return fmi3OK;
}

API(fmi3Status, fmi3SerializeFMUState)(fmi3Instance c, fmi3FMUState state, fmi3Byte *bytes, size_t size)
{
    return (fmi3Status)mbs_fmu_serialize(of(c), state, bytes, size);
}

API(fmi3Status, fmi3DeserializeFMUState)(fmi3Instance c, const fmi3Byte *bytes, size_t size, fmi3FMUState *state)
{
    return (fmi3Status)mbs_fmu_deserialize(of(c), bytes, size, state);
}

/* ---- model exchange ---- */

#define NOTHING(name) \
    API(fmi3Status, name)(fmi3Instance c) \
    { \
        (void)c; \
        return fmi3OK; \
    }

NOTHING(fmi3EnterEventMode)
NOTHING(fmi3EnterContinuousTimeMode)
NOTHING(fmi3EnterStepMode)
NOTHING(fmi3EvaluateDiscreteStates)
NOTHING(fmi3EnterConfigurationMode)
NOTHING(fmi3ExitConfigurationMode)

API(fmi3Status, fmi3UpdateDiscreteStates)(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate,
                                          fmi3Boolean *nominals, fmi3Boolean *states, fmi3Boolean *has_next,
                                          fmi3Float64 *next)
{
    int changed, stops, status;
    double time;
    status = mbs_fmu_event(of(c), &changed, &stops, &time);
    *again = *nominals = false;
    if (status != MBS_FMU_OK)
        return (fmi3Status)status;
    *terminate = stops;
    *states = changed;
    *has_next = time < HUGE_VAL;
    *next = time < HUGE_VAL ? time : 0.0;
    return fmi3OK;
}

API(fmi3Status, fmi3CompletedIntegratorStep)(fmi3Instance c, fmi3Boolean final, fmi3Boolean *event, fmi3Boolean *ends)
{
    int wanted = 0, status = mbs_fmu_step_done(of(c), &wanted);
    (void)final;
    *event = wanted;
    *ends = false;
    return (fmi3Status)status;
}

API(fmi3Status, fmi3SetTime)(fmi3Instance c, fmi3Float64 time)
{
    mbs_fmu_set_time(of(c), time);
    return fmi3OK;
}

API(fmi3Status, fmi3SetContinuousStates)(fmi3Instance c, const fmi3Float64 *x, size_t count)
{
    return (fmi3Status)mbs_fmu_set_states(of(c), x, count);
}

API(fmi3Status, fmi3GetContinuousStateDerivatives)(fmi3Instance c, fmi3Float64 *rates, size_t count)
{
    return (fmi3Status)mbs_fmu_rates(of(c), rates, count);
}

API(fmi3Status, fmi3GetEventIndicators)(fmi3Instance c, fmi3Float64 *values, size_t count)
{
    return (fmi3Status)mbs_fmu_indicators(of(c), values, count);
}

API(fmi3Status, fmi3GetContinuousStates)(fmi3Instance c, fmi3Float64 *x, size_t count)
{
    return (fmi3Status)mbs_fmu_get_states(of(c), x, count);
}

API(fmi3Status, fmi3GetNominalsOfContinuousStates)(fmi3Instance c, fmi3Float64 *nominals, size_t count)
{
    (void)c;
    for (size_t k = 0; k < count; ++k)
        nominals[k] = 1.0;
    return fmi3OK;
}

API(fmi3Status, fmi3GetNumberOfEventIndicators)(fmi3Instance c, size_t *count)
{
    (void)c;
    *count = MBS_FMU_NG;
    return fmi3OK;
}

API(fmi3Status, fmi3GetNumberOfContinuousStates)(fmi3Instance c, size_t *count)
{
    (void)c;
    *count = MBS_FMU_NX;
    return fmi3OK;
}

/* ---- co-simulation ---- */

API(fmi3Status, fmi3DoStep)(fmi3Instance c, fmi3Float64 from, fmi3Float64 h, fmi3Boolean final, fmi3Boolean *event,
                            fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *reached)
{
    int status = mbs_fmu_step(of(c), from, h);
    (void)final;
    *event = *early = false;
    *terminate = of(c)->now.stopped != 0;
    *reached = of(c)->now.time;
    return *terminate && status == MBS_FMU_DISCARD ? fmi3OK : (fmi3Status)status;
}

API(fmi3Status, fmi3GetOutputDerivatives)(fmi3Instance c, References at, size_t count, const fmi3Int32 *orders,
                                          fmi3Float64 *values, size_t sizes)
{
    (void)at, (void)orders, (void)values, (void)sizes;
    return none(c, count);
}

/* ---- clocks, of which there are none ---- */

#define NO_CLOCKS_1(name, type) \
    API(fmi3Status, name)(fmi3Instance c, References at, size_t count, type a) \
    { \
        (void)at, (void)a; \
        return none(c, count); \
    }
#define NO_CLOCKS_2(name, first, second) \
    API(fmi3Status, name)(fmi3Instance c, References at, size_t count, first a, second b) \
    { \
        (void)at, (void)a, (void)b; \
        return none(c, count); \
    }

NO_CLOCKS_1(fmi3GetClock, fmi3Clock *)
NO_CLOCKS_1(fmi3SetClock, const fmi3Clock *)
NO_CLOCKS_2(fmi3GetIntervalDecimal, fmi3Float64 *, fmi3IntervalQualifier *)
NO_CLOCKS_1(fmi3GetShiftDecimal, fmi3Float64 *)
NO_CLOCKS_2(fmi3GetShiftFraction, fmi3UInt64 *, fmi3UInt64 *)
NO_CLOCKS_1(fmi3SetIntervalDecimal, const fmi3Float64 *)
NO_CLOCKS_2(fmi3SetIntervalFraction, const fmi3UInt64 *, const fmi3UInt64 *)
NO_CLOCKS_1(fmi3SetShiftDecimal, const fmi3Float64 *)
NO_CLOCKS_2(fmi3SetShiftFraction, const fmi3UInt64 *, const fmi3UInt64 *)

API(fmi3Status, fmi3GetIntervalFraction)(fmi3Instance c, References at, size_t count, fmi3UInt64 *counters,
                                         fmi3UInt64 *resolutions, fmi3IntervalQualifier *qualifiers)
{
    (void)at, (void)counters, (void)resolutions, (void)qualifiers;
    return none(c, count);
}

API(fmi3Status, fmi3ActivateModelPartition)(fmi3Instance c, fmi3ValueReference clock, fmi3Float64 time)
{
    (void)clock, (void)time;
    return none(c, 1);
}
