/* FMI 2.0, model exchange and co-simulation, of the linear model x' = A x + B u, y = C x + D u.

   model.h, written with the FMU, has the matrices, rows one after the other: N_X states, N_U inputs, N_Y outputs.
   Value references count states, then their derivatives, inputs, outputs.

   Co-simulation has no step of its own. Over a communication step h the input is u + u' s, with the slope that
   fmi2SetRealInputDerivatives gives, else zero, and the step is exact to rounding:

       x(h) = E x + F B u + G B u',   E = exp(A h),   F = int_0^h exp(A s) ds,   G = int_0^h F(s) ds.

   E, F and G are computed when the step differs from theirs by more than first-order terms make up for.

   With SAMPLE_TIME in model.h it is x(k+1) = A x + B u of a controller, one such step at a time. */

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "model.h"

/* ---- what FMI 2.0 defines (Functional Mock-up Interface for Model Exchange and Co-Simulation, 2.0.4) ---- */

typedef void *fmi2Component, *fmi2ComponentEnvironment, *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer, fmi2Boolean;
typedef char fmi2Char, fmi2Byte;
typedef const fmi2Char *fmi2String;
enum { fmi2False, fmi2True };
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;

typedef struct {
  void (*logger)(fmi2ComponentEnvironment, fmi2String name, fmi2Status, fmi2String category, fmi2String message, ...);
  void *(*allocateMemory)(size_t, size_t);
  void (*freeMemory)(void *);
  void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
  fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

typedef struct {
  fmi2Boolean newDiscreteStatesNeeded, terminateSimulation, nominalsOfContinuousStatesChanged,
      valuesOfContinuousStatesChanged, nextEventTimeDefined;
  fmi2Real nextEventTime;
} fmi2EventInfo;

/* Linked into another program instead of loaded by it: define FMI2_FUNCTION_PREFIX as the model's identifier and _. */
#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)
#ifdef FMI2_FUNCTION_PREFIX
#define NAME(function) JOIN(FMI2_FUNCTION_PREFIX, function)
#else
#define NAME(function) function
#endif
#if defined _WIN32 || defined __CYGWIN__
#define EXPORT(type, function) __declspec(dllexport) type NAME(function)
#elif defined __GNUC__
#define EXPORT(type, function) __attribute__((visibility("default"))) type NAME(function)
#else
#define EXPORT(type, function) type NAME(function)
#endif
#define STATUS(function) EXPORT(fmi2Status, function)

/* ---- the model ---- */

typedef struct {
  double x[N_X], u[N_U], slope[N_U]; /* slope: u' within the next step of co-simulation, zero after it */
  double step, norm;                 /* step: which E, F and G are of, 0 before the first; norm: of balanced A */
  double E[N_X * N_X], F[N_X * N_X], G[N_X * N_X];
  const fmi2CallbackFunctions *callbacks;
  char name[256];
} Model;

static fmi2Status fail(const Model *m, const char *message) {
  if (m->callbacks && m->callbacks->logger)
    m->callbacks->logger(m->callbacks->componentEnvironment, m->name, fmi2Error, "logStatusError", message);
  return fmi2Error;
}

/* Row i of P x + Q u. */
static double row(const double *P, const double *Q, size_t i, const double *x, const double *u) {
  double sum = 0;
  for (size_t j = 0; j < N_X; ++j)
    sum += P[i * N_X + j] * x[j];
  for (size_t j = 0; j < N_U; ++j)
    sum += Q[i * N_U + j] * u[j];
  return sum;
}

/* Derivative or output r, linear in x and u; r counts derivatives, inputs, outputs. False where r is another. */
static int linear_value(fmi2ValueReference r, const double *x, const double *u, double *value) {
  if (r < N_X)
    *value = row(A, B, r, x, u);
  else if (r >= N_X + N_U && r < N_X + N_U + N_Y)
    *value = row(C, D, r - N_X - N_U, x, u);
  else
    return 0;
  return 1;
}

/* Where a state or input is kept; NULL for what is computed. */
static double *place(fmi2ValueReference r, double *x, double *u) {
  if (r < N_X)
    return x + r;
  return r >= 2 * N_X && r < 2 * N_X + N_U ? u + (r - 2 * N_X) : NULL;
}

/* ---- exp(A h) and its integrals ---- */

/* R = s P Q */
static void multiply(double s, const double *P, const double *Q, double *R) {
  memset(R, 0, N_X * N_X * sizeof(double));
  for (size_t i = 0; i < N_X; ++i)
    for (size_t k = 0; k < N_X; ++k)
      for (size_t j = 0; j < N_X; ++j)
        R[i * N_X + j] += s * P[i * N_X + k] * Q[k * N_X + j];
}

static void add_to_diagonal(double *P, double value) {
  for (size_t i = 0; i < N_X; ++i)
    P[i * N_X + i] += value;
}

/* P += s Q */
static void add(double *P, double s, const double *Q) {
  for (size_t i = 0; i < N_X * N_X; ++i)
    P[i] += s * Q[i];
}

/* A for states in units SCALE, in which rows and columns are about as large; returns its norm, the largest row sum. */
static double balance(double *P) {
  double norm = 0;
  for (size_t i = 0; i < N_X; ++i) {
    double sum = 0;
    for (size_t j = 0; j < N_X; ++j)
      sum += fabs(P[i * N_X + j] = A[i * N_X + j] * SCALE[j] / SCALE[i]);
    norm = fmax(norm, sum);
  }
  return norm;
}

static void undo_balance(double *P) {
  for (size_t i = 0; i < N_X; ++i)
    for (size_t j = 0; j < N_X; ++j)
      P[i * N_X + j] *= SCALE[i] / SCALE[j];
}

/* Taylor series at s = h / 2^k, at which the norm of A s is below 1/2 and what follows TERMS is less than rounding;
   then k doublings: G(2s) = G + s F + E G, F(2s) = F + E F, E(2s) = E E. False without memory. */
static int propagate(Model *m, double h) {
  enum { TERMS = 14, SIZE = N_X * N_X };
  double *E = m->E, *F = m->F, *G = m->G;
  double *P = malloc(2 * SIZE * sizeof(double)), *R = P + SIZE;
  if (!P)
    return 0;
  int k = 0;
  m->norm = balance(P);
  frexp(2 * h * m->norm, &k);
  k = k > 0 ? k : 0;
  double s = ldexp(h, -k);
  memset(G, 0, SIZE * sizeof(double));
  add_to_diagonal(G, s * s / 2);
  for (int j = TERMS; j >= 3; --j) { /* Horner: G = s^2/2 (I + A s/3 (I + A s/4 (I + ...))) */
    multiply(s / j, P, G, R);
    memcpy(G, R, SIZE * sizeof(double));
    add_to_diagonal(G, s * s / 2);
  }
  multiply(1, P, G, F); /* F = s I + A G */
  add_to_diagonal(F, s);
  multiply(1, P, F, E); /* E = I + A F */
  add_to_diagonal(E, 1);
  for (; k > 0; --k, s *= 2) {
    multiply(1, E, G, R);
    add(G, s, F);
    add(G, 1, R);
    multiply(1, E, F, R);
    add(F, 1, R);
    multiply(1, E, E, R);
    memcpy(E, R, SIZE * sizeof(double));
  }
  free(P);
  undo_balance(E), undo_balance(F), undo_balance(G);
  m->step = h;
  return 1;
}

/* One step; what h and m->step differ by, rounding of the caller's times, to first order: x += (h - step) x'. */
static void advance(Model *m, double h) {
  double x[N_X], force[N_X], growth[N_X], zero[N_X] = {0}; /* force: B u, growth: B u' */
  for (size_t i = 0; i < N_X; ++i) {
    force[i] = row(A, B, i, zero, m->u);
    growth[i] = row(A, B, i, zero, m->slope);
  }
  for (size_t i = 0; i < N_X; ++i) {
    x[i] = 0;
    for (size_t j = 0; j < N_X; ++j)
      x[i] += m->E[i * N_X + j] * m->x[j] + m->F[i * N_X + j] * force[j] + m->G[i * N_X + j] * growth[j];
  }
  for (size_t j = 0; j < N_U; ++j)
    m->u[j] += h * m->slope[j];
  for (size_t i = 0; i < N_X; ++i)
    m->x[i] = x[i] + (h - m->step) * row(A, B, i, x, m->u);
  memset(m->slope, 0, sizeof m->slope);
}

/* ---- life of an instance ---- */

EXPORT(const char *, fmi2GetTypesPlatform)(void) { return "default"; }
EXPORT(const char *, fmi2GetVersion)(void) { return "2.0"; }

EXPORT(fmi2Component, fmi2Instantiate)(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                       const fmi2CallbackFunctions *callbacks, fmi2Boolean visible,
                                       fmi2Boolean logging) {
  (void)type, (void)resources, (void)visible, (void)logging;
  Model *m = calloc(1, sizeof(Model));
  if (!m)
    return NULL;
  m->callbacks = callbacks;
  strncpy(m->name, name ? name : "", sizeof m->name - 1);
  if (guid && strcmp(guid, GUID) == 0)
    return m;
  fail(m, "expected the guid " GUID " of modelDescription.xml, found another: the binary is of another export");
  free(m);
  return NULL;
}

EXPORT(void, fmi2FreeInstance)(fmi2Component c) { free(c); }

STATUS(fmi2SetDebugLogging)(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
  (void)c, (void)on, (void)n, (void)categories;
  return fmi2OK;
}

STATUS(fmi2SetupExperiment)(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
                            fmi2Boolean has_stop, fmi2Real stop) {
  (void)c, (void)has_tolerance, (void)tolerance, (void)start, (void)has_stop, (void)stop;
  return fmi2OK;
}

STATUS(fmi2EnterInitializationMode)(fmi2Component c) { return c ? fmi2OK : fmi2Error; }
STATUS(fmi2ExitInitializationMode)(fmi2Component c) { return c ? fmi2OK : fmi2Error; }
STATUS(fmi2Terminate)(fmi2Component c) { return c ? fmi2OK : fmi2Error; }

STATUS(fmi2Reset)(fmi2Component c) {
  Model *m = c;
  memset(m->x, 0, sizeof m->x);
  memset(m->u, 0, sizeof m->u);
  memset(m->slope, 0, sizeof m->slope);
  return fmi2OK;
}

/* ---- values ---- */

STATUS(fmi2GetReal)(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real value[]) {
  Model *m = c;
  for (size_t i = 0; i < n; ++i) {
    const double *kept = place(r[i], m->x, m->u);
    if (kept)
      value[i] = *kept;
    else if (r[i] < N_X || !linear_value(r[i] - N_X, m->x, m->u, value + i))
      return fail(m, "fmi2GetReal: expected a value reference of modelDescription.xml, found another");
  }
  return fmi2OK;
}

STATUS(fmi2SetReal)(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real value[]) {
  Model *m = c;
  for (size_t i = 0; i < n; ++i) {
    double *kept = place(r[i], m->x, m->u);
    if (!kept)
      return fail(m, "fmi2SetReal: expected an input, or the start of a state, found another variable");
    *kept = value[i];
  }
  return fmi2OK;
}

/* There are real variables only. */
#define NONE_OF(type)                                                                                                  \
  STATUS(fmi2Get##type)(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2##type value[]) {                 \
    (void)r, (void)value;                                                                                              \
    return n ? fail(c, "expected real variables, found a reference to one of type " #type) : fmi2OK;                   \
  }                                                                                                                    \
  STATUS(fmi2Set##type)(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2##type value[]) {           \
    (void)r, (void)value;                                                                                              \
    return n ? fail(c, "expected real variables, found a reference to one of type " #type) : fmi2OK;                   \
  }
NONE_OF(Integer)
NONE_OF(Boolean)
NONE_OF(String)

/* The unknowns are linear in the knowns: their change is the unknown at x = dx, u = du. */
STATUS(fmi2GetDirectionalDerivative)(fmi2Component c, const fmi2ValueReference unknown[], size_t n_unknown,
                                     const fmi2ValueReference known[], size_t n_known, const fmi2Real change[],
                                     fmi2Real result[]) {
  double x[N_X] = {0}, u[N_U] = {0};
  for (size_t i = 0; i < n_known; ++i) {
    double *kept = place(known[i], x, u);
    if (!kept)
      return fail(c, "fmi2GetDirectionalDerivative: expected states and inputs as knowns, found another");
    *kept = change[i];
  }
  for (size_t i = 0; i < n_unknown; ++i)
    if (unknown[i] < N_X || !linear_value(unknown[i] - N_X, x, u, result + i))
      return fail(c, "fmi2GetDirectionalDerivative: expected derivatives and outputs as unknowns, found another");
  return fmi2OK;
}

/* ---- the whole instance, kept and brought back ---- */

STATUS(fmi2GetFMUstate)(fmi2Component c, fmi2FMUstate *state) {
  if (!*state && !(*state = malloc(sizeof(Model))))
    return fail(c, "fmi2GetFMUstate: not enough memory");
  memcpy(*state, c, sizeof(Model));
  return fmi2OK;
}

STATUS(fmi2SetFMUstate)(fmi2Component c, fmi2FMUstate state) {
  if (!state)
    return fail(c, "fmi2SetFMUstate: expected a state of fmi2GetFMUstate, found none");
  memcpy(c, state, sizeof(Model));
  return fmi2OK;
}

STATUS(fmi2FreeFMUstate)(fmi2Component c, fmi2FMUstate *state) {
  (void)c;
  free(*state);
  *state = NULL;
  return fmi2OK;
}

STATUS(fmi2SerializedFMUstateSize)(fmi2Component c, fmi2FMUstate state, size_t *size) {
  (void)state, (void)size;
  return fail(c, "fmi2SerializedFMUstateSize: states are not serialized");
}

STATUS(fmi2SerializeFMUstate)(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
  (void)state, (void)bytes, (void)size;
  return fail(c, "fmi2SerializeFMUstate: states are not serialized");
}

STATUS(fmi2DeSerializeFMUstate)(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
  (void)bytes, (void)size, (void)state;
  return fail(c, "fmi2DeSerializeFMUstate: states are not serialized");
}

/* ---- model exchange: no events ---- */

STATUS(fmi2EnterEventMode)(fmi2Component c) { return c ? fmi2OK : fmi2Error; }
STATUS(fmi2EnterContinuousTimeMode)(fmi2Component c) { return c ? fmi2OK : fmi2Error; }

STATUS(fmi2NewDiscreteStates)(fmi2Component c, fmi2EventInfo *info) {
  (void)c;
  memset(info, 0, sizeof *info);
  return fmi2OK;
}

STATUS(fmi2CompletedIntegratorStep)(fmi2Component c, fmi2Boolean no_set_state_prior, fmi2Boolean *enter_event_mode,
                                    fmi2Boolean *terminate) {
  (void)c, (void)no_set_state_prior;
  *enter_event_mode = *terminate = fmi2False;
  return fmi2OK;
}

STATUS(fmi2SetTime)(fmi2Component c, fmi2Real time) {
  (void)c, (void)time;
  return fmi2OK;
}

STATUS(fmi2SetContinuousStates)(fmi2Component c, const fmi2Real x[], size_t n) {
  Model *m = c;
  if (n != N_X)
    return fail(m, "fmi2SetContinuousStates: expected all states");
  memcpy(m->x, x, sizeof m->x);
  return fmi2OK;
}

STATUS(fmi2GetContinuousStates)(fmi2Component c, fmi2Real x[], size_t n) {
  Model *m = c;
  if (n != N_X)
    return fail(m, "fmi2GetContinuousStates: expected room for all states");
  memcpy(x, m->x, sizeof m->x);
  return fmi2OK;
}

STATUS(fmi2GetNominalsOfContinuousStates)(fmi2Component c, fmi2Real x[], size_t n) {
  (void)c;
  for (size_t i = 0; i < n; ++i)
    x[i] = 1;
  return fmi2OK;
}

STATUS(fmi2GetDerivatives)(fmi2Component c, fmi2Real rate[], size_t n) {
  Model *m = c;
  if (n != N_X)
    return fail(m, "fmi2GetDerivatives: expected room for the derivatives of all states");
  for (size_t i = 0; i < N_X; ++i)
    rate[i] = row(A, B, i, m->x, m->u);
  return fmi2OK;
}

STATUS(fmi2GetEventIndicators)(fmi2Component c, fmi2Real indicators[], size_t n) {
  (void)indicators;
  return n ? fail(c, "fmi2GetEventIndicators: there are none") : fmi2OK;
}

/* ---- co-simulation ---- */

STATUS(fmi2SetRealInputDerivatives)(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Integer order[],
                                    const fmi2Real value[]) {
  Model *m = c;
  for (size_t i = 0; i < n; ++i) {
    if (r[i] < 2 * N_X || r[i] >= 2 * N_X + N_U || order[i] != 1)
      return fail(m, "fmi2SetRealInputDerivatives: expected first derivatives of inputs, found another");
    m->slope[r[i] - 2 * N_X] = value[i];
  }
  return fmi2OK;
}

STATUS(fmi2GetRealOutputDerivatives)(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Integer order[],
                                     fmi2Real value[]) {
  (void)r, (void)order, (void)value;
  return n ? fail(c, "fmi2GetRealOutputDerivatives: outputs come without derivatives") : fmi2OK;
}

STATUS(fmi2DoStep)(fmi2Component c, fmi2Real time, fmi2Real h, fmi2Boolean no_set_state_prior) {
  (void)time, (void)no_set_state_prior;
  Model *m = c;
  if (!(h >= 0 && isfinite(h)))
    return fail(m, "fmi2DoStep: expected a step of zero or more seconds");
  if (h == 0)
    return fmi2OK;
#ifdef SAMPLE_TIME
  double next[N_X];
  if (fabs(h - SAMPLE_TIME) > 1e-6 * SAMPLE_TIME)
    return fail(m, "fmi2DoStep: expected steps of the sample time");
  for (size_t i = 0; i < N_X; ++i)
    next[i] = row(A, B, i, m->x, m->u);
  memcpy(m->x, next, sizeof next);
#else
  const double second_order = (h - m->step) * m->norm; /* squared, of the state */
  if ((m->step == 0 || fabs(second_order) > 1e-7) && !propagate(m, h))
    return fail(m, "fmi2DoStep: not enough memory");
  advance(m, h);
#endif
  for (size_t i = 0; i < N_X; ++i)
    if (!isfinite(m->x[i]))
      return fail(m, "fmi2DoStep: the state is no longer finite");
  return fmi2OK;
}

STATUS(fmi2CancelStep)(fmi2Component c) { return fail(c, "fmi2CancelStep: no step is left to finish later"); }

#define NO_STATUS(name, type)                                                                                          \
  STATUS(name)(fmi2Component c, const fmi2StatusKind kind, type *value) {                                              \
    (void)c, (void)kind, (void)value;                                                                                  \
    return fmi2Discard;                                                                                                \
  }
NO_STATUS(fmi2GetStatus, fmi2Status)
NO_STATUS(fmi2GetRealStatus, fmi2Real)
NO_STATUS(fmi2GetIntegerStatus, fmi2Integer)
NO_STATUS(fmi2GetBooleanStatus, fmi2Boolean)
NO_STATUS(fmi2GetStringStatus, fmi2String)
