/* FMI 2.0 for model exchange and co-simulation: the functions of the standard over fmu.h. */
#include "fmu.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Linked statically, functions bear the name of the model in front. */
#ifdef FMI2_FUNCTION_PREFIX
#define API(type, name) type MBS_FMU_JOIN(FMI2_FUNCTION_PREFIX, name)
#else
#define API(type, name) MBS_FMU_EXPORTED type name
#endif

typedef void *fmi2Component, *fmi2FMUstate, *fmi2ComponentEnvironment;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer, fmi2Boolean;
typedef const char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef void (*fmi2Logger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);

typedef struct {
    fmi2Logger logger;
    void *(*allocateMemory)(size_t count, size_t size);
    void (*freeMemory)(void *memory);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment environment;
} fmi2CallbackFunctions;

typedef struct {
    fmi2Boolean newDiscreteStatesNeeded, terminateSimulation, nominalsOfContinuousStatesChanged;
    fmi2Boolean valuesOfContinuousStatesChanged, nextEventTimeDefined;
    fmi2Real nextEventTime;
} fmi2EventInfo;

static mbs_fmu *of(fmi2Component c)
{
    return c;
}

static void tell(const mbs_fmu *f, int status, const char *category, const char *text)
{
    const fmi2CallbackFunctions *callbacks = f->logger;
    if (callbacks && callbacks->logger && (status != MBS_FMU_OK || f->logging))
        callbacks->logger(f->environment, f->name, (fmi2Status)status, category, "%s", text);
}

/* ---- instances ---- */

API(const char *, fmi2GetTypesPlatform)(void) { return "default"; }

API(const char *, fmi2GetVersion)(void) { return "2.0"; }

API(fmi2Status, fmi2SetDebugLogging)(fmi2Component c, fmi2Boolean on, size_t count, const fmi2String *categories)
{
    (void)count, (void)categories;
    of(c)->logging = on;
    return fmi2OK;
}

API(fmi2Component, fmi2Instantiate)(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                    const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging)
{
    mbs_fmu *f = mbs_fmu_create(name);
    (void)type, (void)resources, (void)visible;
    if (!f)
        return NULL;
    f->tell = tell;
    f->logger = (void *)callbacks;
    f->environment = callbacks ? callbacks->environment : NULL;
    f->logging = logging;
    if (guid && strcmp(guid, MBS_FMU_TOKEN) == 0)
        return f;
    mbs_fmu_fail(f, "the guid is not that of this FMU, %s", MBS_FMU_TOKEN);
    mbs_fmu_free(f);
    return NULL;
}

API(void, fmi2FreeInstance)(fmi2Component c) { mbs_fmu_free(c); }

API(fmi2Status, fmi2SetupExperiment)(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
                                     fmi2Boolean has_stop, fmi2Real stop)
{
    (void)has_stop, (void)stop;
    return (fmi2Status)mbs_fmu_begin(of(c), start, has_tolerance, tolerance);
}

API(fmi2Status, fmi2EnterInitializationMode)(fmi2Component c)
{
    of(c)->now.phase = MBS_FMU_BEGINNING;
    return fmi2OK;
}

API(fmi2Status, fmi2ExitInitializationMode)(fmi2Component c) { return (fmi2Status)mbs_fmu_end_of_beginning(of(c)); }

API(fmi2Status, fmi2Terminate)(fmi2Component c)
{
    of(c)->now.phase = MBS_FMU_ENDED;
    return fmi2OK;
}

API(fmi2Status, fmi2Reset)(fmi2Component c)
{
    mbs_fmu_reset(of(c));
    return fmi2OK;
}

/* ---- values ---- */

typedef const fmi2ValueReference *References;

API(fmi2Status, fmi2GetReal)(fmi2Component c, References at, size_t count, fmi2Real *values)
{
    return (fmi2Status)mbs_fmu_get(of(c), at, count, values);
}

API(fmi2Status, fmi2SetReal)(fmi2Component c, References at, size_t count, const fmi2Real *values)
{
    return (fmi2Status)mbs_fmu_set(of(c), at, count, values);
}

static fmi2Status none(fmi2Component c, size_t count)
{
    return count == 0 ? fmi2OK : (fmi2Status)mbs_fmu_fail(of(c), "all variables of this FMU are real numbers");
}

#define NO_VALUES(kind) \
    API(fmi2Status, fmi2Get##kind)(fmi2Component c, References at, size_t count, fmi2##kind *values) \
    { \
        (void)at, (void)values; \
        return none(c, count); \
    } \
    API(fmi2Status, fmi2Set##kind)(fmi2Component c, References at, size_t count, const fmi2##kind *values) \
    { \
        (void)at, (void)values; \
        return none(c, count); \
    }

NO_VALUES(Integer)
NO_VALUES(Boolean)
NO_VALUES(String)

API(fmi2Status, fmi2GetDirectionalDerivative)(fmi2Component c, References unknowns, size_t rows, References knowns,
                                              size_t columns, const fmi2Real *seeds, fmi2Real *results)
{
    return (fmi2Status)mbs_fmu_slopes(of(c), unknowns, rows, knowns, columns, seeds, results, 0);
}

/* ---- saved states ---- */

API(fmi2Status, fmi2GetFMUstate)(fmi2Component c, fmi2FMUstate *state)
{
    return (fmi2Status)mbs_fmu_save(of(c), state);
}

API(fmi2Status, fmi2SetFMUstate)(fmi2Component c, fmi2FMUstate state)
{
    return (fmi2Status)mbs_fmu_restore(of(c), state, mbs_fmu_saved_size());
}

API(fmi2Status, fmi2FreeFMUstate)(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

API(fmi2Status, fmi2SerializedFMUstateSize)(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    (void)c, (void)state;
    *size = mbs_fmu_saved_size();
    return fmi2OK;
}

API(fmi2Status, fmi2SerializeFMUstate)(fmi2Component c, fmi2FMUstate state, fmi2Byte *bytes, size_t size)
{
    return (fmi2Status)mbs_fmu_serialize(of(c), state, bytes, size);
}

API(fmi2Status, fmi2DeSerializeFMUstate)(fmi2Component c, const fmi2Byte *bytes, size_t size, fmi2FMUstate *state)
{
    return (fmi2Status)mbs_fmu_deserialize(of(c), bytes, size, state);
}

/* ---- model exchange ---- */

API(fmi2Status, fmi2EnterEventMode)(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

API(fmi2Status, fmi2NewDiscreteStates)(fmi2Component c, fmi2EventInfo *info)
{
    int changed, stops, status;
    double next;
    status = mbs_fmu_event(of(c), &changed, &stops, &next);
    info->newDiscreteStatesNeeded = info->nominalsOfContinuousStatesChanged = 0;
    if (status != MBS_FMU_OK)
        return (fmi2Status)status;
    info->terminateSimulation = stops;
    info->valuesOfContinuousStatesChanged = changed;
    info->nextEventTimeDefined = next < HUGE_VAL;
    info->nextEventTime = next < HUGE_VAL ? next : 0.0;
    return fmi2OK;
}

API(fmi2Status, fmi2EnterContinuousTimeMode)(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

API(fmi2Status, fmi2CompletedIntegratorStep)(fmi2Component c, fmi2Boolean final, fmi2Boolean *event, fmi2Boolean *ends)
{
    (void)final;
    *ends = 0;
    return (fmi2Status)mbs_fmu_step_done(of(c), event);
}

API(fmi2Status, fmi2SetTime)(fmi2Component c, fmi2Real time)
{
    mbs_fmu_set_time(of(c), time);
    return fmi2OK;
}

API(fmi2Status, fmi2SetContinuousStates)(fmi2Component c, const fmi2Real *x, size_t count)
{
    return (fmi2Status)mbs_fmu_set_states(of(c), x, count);
}

API(fmi2Status, fmi2GetDerivatives)(fmi2Component c, fmi2Real *rates, size_t count)
{
    return (fmi2Status)mbs_fmu_rates(of(c), rates, count);
}

API(fmi2Status, fmi2GetEventIndicators)(fmi2Component c, fmi2Real *values, size_t count)
{
    return (fmi2Status)mbs_fmu_indicators(of(c), values, count);
}

API(fmi2Status, fmi2GetContinuousStates)(fmi2Component c, fmi2Real *x, size_t count)
{
    return (fmi2Status)mbs_fmu_get_states(of(c), x, count);
}

API(fmi2Status, fmi2GetNominalsOfContinuousStates)(fmi2Component c, fmi2Real *nominals, size_t count)
{
    (void)c;
    for (size_t k = 0; k < count; ++k)
        nominals[k] = 1.0;
    return fmi2OK;
}

/* ---- co-simulation ---- */

typedef const fmi2Integer *Orders;

API(fmi2Status, fmi2SetRealInputDerivatives)(fmi2Component c, References at, size_t count, Orders orders,
                                             const fmi2Real *values)
{
    (void)at, (void)orders, (void)values;
    return count == 0 ? fmi2OK : (fmi2Status)mbs_fmu_fail(of(c), "inputs are constant during a step");
}

API(fmi2Status, fmi2GetRealOutputDerivatives)(fmi2Component c, References at, size_t count, Orders orders,
                                              fmi2Real *values)
{
    (void)at, (void)orders, (void)values;
    return count == 0 ? fmi2OK : (fmi2Status)mbs_fmu_fail(of(c), "outputs have no derivatives by time");
}

API(fmi2Status, fmi2DoStep)(fmi2Component c, fmi2Real from, fmi2Real h, fmi2Boolean final)
{
    (void)final;
    return (fmi2Status)mbs_fmu_step(of(c), from, h);
}

API(fmi2Status, fmi2CancelStep)(fmi2Component c) { return (fmi2Status)mbs_fmu_fail(of(c), "no step is pending"); }

API(fmi2Status, fmi2GetStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Status *status)
{
    (void)c, (void)kind, (void)status;
    return fmi2Discard;
}

API(fmi2Status, fmi2GetRealStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    if (kind != fmi2LastSuccessfulTime)
        return fmi2Discard;
    *value = of(c)->now.time;
    return fmi2OK;
}

API(fmi2Status, fmi2GetIntegerStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}

API(fmi2Status, fmi2GetBooleanStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    if (kind != fmi2Terminated)
        return fmi2Discard;
    *value = of(c)->now.stopped != 0;
    return fmi2OK;
}

API(fmi2Status, fmi2GetStringStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}
