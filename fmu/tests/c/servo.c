/* A servo of first order with a brake as an FMU, FMI 2 or FMI 3 (-DFMI=2, -DFMI=3), co-simulation.
 *
 *     angle' = (gain u - brake - angle)/tau   by Euler's method with the communication step
 *
 * The parameter `trouble` selects a fault that occurs one second after the start. This file declares the types of the standard that
 * it needs. The functions at the end only return an error; the standard requires that a library exports them.
 */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EXPORT __attribute__((visibility("default")))

enum status { OK, WARNING, DISCARD, ERROR, FATAL };
enum variable { ANGLE, COMMAND, GAIN, TAU, BRAKE, TROUBLE, LOAD, PUSH, VARIABLES };
enum trouble { NONE, CRASH, HANG, NOT_A_NUMBER, DISCARDS, FAILS, FATALLY, PRINTS };

#ifdef LACKING /* the library has no function for a step */
#define fmi2DoStep not_a_step
#define fmi3DoStep not_a_step
#endif

#define TOKEN "{servo-with-a-brake}"

#if FMI == 2
typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} callbacks;
#else
typedef void (*log_message)(void *, int, const char *, const char *);
#endif

typedef struct {
    double values[VARIABLES];
    bool is_begun;
#if FMI == 2
    /* kept as it came, which many FMUs do */
    const callbacks *functions;
#else
    log_message log;
    void *environment;
#endif
} servo;

/* All instances of a loaded library share it: with an instance for every run there is never a second one. */
static int alive;

static void set_up(servo *s)
{
    memset(s->values, 0, sizeof s->values);
    s->values[GAIN] = 10.0;
    s->values[TAU] = 0.1;
    alive++;
}

static enum status set(servo *s, const uint32_t refs[], size_t n, const double values[])
{
    for (size_t i = 0; i < n; i++) {
        bool is_parameter = refs[i] >= GAIN && refs[i] <= TROUBLE;
        if (refs[i] >= VARIABLES || refs[i] == ANGLE || refs[i] == PUSH)
            return ERROR;
        if (is_parameter && s->is_begun)
            return ERROR; /* fixed: only before the initialization */
        s->values[refs[i]] = values[i];
    }
    return OK;
}

static enum status get(const servo *s, const uint32_t refs[], size_t n, double values[])
{
    for (size_t i = 0; i < n; i++) {
        if (refs[i] >= VARIABLES)
            return ERROR;
        values[i] = refs[i] == PUSH ? s->values[GAIN] * s->values[COMMAND] - s->values[ANGLE]
                                    : s->values[refs[i]];
    }
    return OK;
}

static void say(servo *s, enum status status, const char *text)
{
#if FMI == 2
    s->functions->logger(s->functions->environment, "servo", status, "step", "%s, angle %g", text, s->values[ANGLE]);
#else
    s->log(s->environment, status, "step", text);
#endif
}

static enum status step(servo *s, double time, double dt)
{
    double *v = s->values;
    if (time >= 1.0) {
        switch ((int)v[TROUBLE]) {
        case CRASH: abort();
        case HANG: for (volatile int i = 0;; i++) ;
        case NOT_A_NUMBER: v[ANGLE] = NAN; return OK;
        case DISCARDS: say(s, DISCARD, "the spring is out of its range"); return DISCARD;
        case FAILS: say(s, ERROR, "the solver does not converge"); return ERROR;
        case FATALLY: say(s, FATAL, "all is lost"); return FATAL;
        case PRINTS: printf("step at %g s\n", time); fflush(stdout); break;
        }
    }
    if (alive != 1)
        return ERROR;
    double push = v[GAIN] * v[COMMAND] - v[ANGLE];
    v[ANGLE] += dt / v[TAU] * (push - fmin(fmax(push, -v[BRAKE]), v[BRAKE]));
    return OK;
}

#if FMI == 2

EXPORT const char *fmi2GetVersion(void) { return "2.0"; }
EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }

EXPORT void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                             const callbacks *functions, int visible, int logging)
{
    (void)name, (void)resources, (void)visible, (void)logging;
    if (type != 1 || strcmp(guid, TOKEN) != 0)
        return NULL;
    servo *s = functions->allocate(1, sizeof *s);
    s->functions = functions;
    set_up(s);
    return s;
}

EXPORT void fmi2FreeInstance(void *c)
{
    servo *s = c;
    alive--;
    s->functions->release(s);
}

EXPORT int fmi2SetupExperiment(void *c, int t, double tolerance, double from, int u, double to)
{
    (void)c, (void)t, (void)tolerance, (void)u, (void)to;
    return from == 0.0 ? OK : ERROR;
}
EXPORT int fmi2EnterInitializationMode(void *c) { ((servo *)c)->is_begun = true; return OK; }
EXPORT int fmi2ExitInitializationMode(void *c) { (void)c; return OK; }
EXPORT int fmi2Terminate(void *c) { (void)c; return OK; }
EXPORT int fmi2SetReal(void *c, const uint32_t refs[], size_t n, const double x[]) { return set(c, refs, n, x); }
EXPORT int fmi2GetReal(void *c, const uint32_t refs[], size_t n, double x[]) { return get(c, refs, n, x); }
EXPORT int fmi2DoStep(void *c, double time, double dt, int is_final) { (void)is_final; return step(c, time, dt); }

#define REST(F) \
    F(SetDebugLogging) F(Reset) F(GetInteger) F(GetBoolean) F(GetString) F(SetInteger) F(SetBoolean) F(SetString) \
    F(GetFMUstate) F(SetFMUstate) F(FreeFMUstate) F(SerializedFMUstateSize) F(SerializeFMUstate) F(DeSerializeFMUstate) \
    F(GetDirectionalDerivative) F(SetRealInputDerivatives) F(GetRealOutputDerivatives) F(CancelStep) F(GetStatus) \
    F(GetRealStatus) F(GetIntegerStatus) F(GetBooleanStatus) F(GetStringStatus)
#define FAILING(name) EXPORT int fmi2##name(void) { return ERROR; }
REST(FAILING)

#else

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

EXPORT void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible,
                                         bool logging, bool events, bool early, const uint32_t required[], size_t n,
                                         void *environment, log_message log, void *update)
{
    (void)name, (void)resources, (void)visible, (void)logging, (void)early, (void)required, (void)n, (void)update;
    if (events || strcmp(token, TOKEN) != 0)
        return NULL;
    servo *s = calloc(1, sizeof *s);
    s->environment = environment;
    s->log = log;
    set_up(s);
    return s;
}

EXPORT void fmi3FreeInstance(void *c) { alive--; free(c); }
EXPORT int fmi3EnterInitializationMode(void *c, bool t, double tolerance, double from, bool u, double to)
{
    (void)t, (void)tolerance, (void)u, (void)to;
    ((servo *)c)->is_begun = true;
    return from == 0.0 ? OK : ERROR;
}
EXPORT int fmi3ExitInitializationMode(void *c) { (void)c; return OK; }
EXPORT int fmi3Terminate(void *c) { (void)c; return OK; }
EXPORT int fmi3SetFloat64(void *c, const uint32_t refs[], size_t n, const double x[], size_t m)
{
    return n == m ? set(c, refs, n, x) : ERROR;
}
EXPORT int fmi3GetFloat64(void *c, const uint32_t refs[], size_t n, double x[], size_t m)
{
    return n == m ? get(c, refs, n, x) : ERROR;
}
/* `trouble` is held in 32 bits */
EXPORT int fmi3SetFloat32(void *c, const uint32_t refs[], size_t n, const float x[], size_t m)
{
    double wide = x[0];
    return n == 1 && m == 1 && refs[0] == TROUBLE ? set(c, refs, 1, &wide) : ERROR;
}
EXPORT int fmi3GetFloat32(void *c, const uint32_t refs[], size_t n, float x[], size_t m)
{
    double wide[1] = {0.0};
    enum status status = n == 1 && m == 1 ? get(c, refs, 1, wide) : ERROR;
    x[0] = (float)wide[0];
    return status;
}
EXPORT int fmi3DoStep(void *c, double time, double dt, bool is_final, bool *event, bool *over, bool *early, double *last)
{
    (void)is_final;
    *event = *over = *early = false;
    *last = time + dt;
    return step(c, time, dt);
}

#define REST(F) \
    F(SetDebugLogging) F(InstantiateModelExchange) F(InstantiateScheduledExecution) F(EnterEventMode) F(Reset) \
    F(GetInt8) F(GetUInt8) F(GetInt16) F(GetUInt16) F(GetInt32) F(GetUInt32) F(GetInt64) F(GetUInt64) F(GetBoolean) \
    F(GetString) F(GetBinary) F(GetClock) F(SetInt8) F(SetUInt8) F(SetInt16) F(SetUInt16) F(SetInt32) F(SetUInt32) \
    F(SetInt64) F(SetUInt64) F(SetBoolean) F(SetString) F(SetBinary) F(SetClock) F(GetNumberOfVariableDependencies) \
    F(GetVariableDependencies) F(GetFMUState) F(SetFMUState) F(FreeFMUState) F(SerializedFMUStateSize) \
    F(SerializeFMUState) F(DeserializeFMUState) F(GetDirectionalDerivative) F(GetAdjointDerivative) \
    F(EnterConfigurationMode) F(ExitConfigurationMode) F(GetIntervalDecimal) F(GetIntervalFraction) F(GetShiftDecimal) \
    F(GetShiftFraction) F(SetIntervalDecimal) F(SetIntervalFraction) F(SetShiftDecimal) F(SetShiftFraction) \
    F(EvaluateDiscreteStates) F(UpdateDiscreteStates) F(EnterContinuousTimeMode) F(CompletedIntegratorStep) F(SetTime) \
    F(SetContinuousStates) F(GetContinuousStateDerivatives) F(GetEventIndicators) F(GetContinuousStates) \
    F(GetNominalsOfContinuousStates) F(GetNumberOfEventIndicators) F(GetNumberOfContinuousStates) F(EnterStepMode) \
    F(GetOutputDerivatives) F(ActivateModelPartition)
#define FAILING(name) EXPORT int fmi3##name(void) { return ERROR; }
REST(FAILING)

#endif
