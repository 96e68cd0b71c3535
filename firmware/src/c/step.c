/* The functions of a header, renamed by model, so that a program can contain several headers. */
#include "stretch.h"

#define JOINED(model, name) c_##model##_##name
#define NAMED(model, name) JOINED(model, name)

extern const uint32_t NAMED(MODEL, bytes);
const uint32_t NAMED(MODEL, bytes) = sizeof(stretch_state);

void NAMED(MODEL, init)(stretch_state *state);
void NAMED(MODEL, init)(stretch_state *state)
{
    stretch_init(state);
}

/* A pointer to the function itself and not a wrapper, because its instructions are counted. */
typedef stretch_reading (*step_type)(stretch_state *state, SAMPLE sample);
extern const step_type NAMED(MODEL, step);
const step_type NAMED(MODEL, step) = stretch_step;

int NAMED(MODEL, self_test)(void);
int NAMED(MODEL, self_test)(void)
{
    return stretch_self_test();
}
