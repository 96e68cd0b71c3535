
/* ---- whether a gauge has shifted relative to the others ---- */

/* A separate state. After every stretch_step or stretch_lost, call
 *     if (stretch_shifts_step(&blocks, &state, &shifts)) { a block of some seconds has ended: read shifts }
 */
typedef struct stretch_shifts_state {
    float sums[STRETCH_CHANNELS];
    uint32_t values;
    uint32_t samples;
} stretch_shifts_state;

/* Result of a block of time for every gauge. */
typedef struct stretch_shifts {
    float off[STRETCH_CHANNELS]; /* difference from the estimate of the others, in STRETCH_UNIT */
    uint16_t shifted;            /* a bit for each gauge that may have shifted; 0 if none has */
} stretch_shifts;

static inline void stretch_shifts_init(stretch_shifts_state *b)
{
    int k;
    for (k = 0; k < STRETCH_CHANNELS; k++) {
        b->sums[k] = 0.0f;
    }
    b->values = 0u;
    b->samples = 0u;
}

/* The estimate of one channel alone minus that of all others. */
STRETCH_INLINE float stretch_difference(const stretch_state *s, int k)
{
    uint8_t clamped = 0;
    float own = stretch_add(&s->of[k], k, stretch_alone[k], STRETCH_FLOAT(stretch_alone_constant[k]),
                            &clamped);
    float others = STRETCH_FLOAT(stretch_without_constant[k]);
    int j;
    for (j = 0; j < STRETCH_CHANNELS; j++) {
        if (j != k) {
            const float *gains = stretch_without[k * STRETCH_CHANNELS + j];
            others = stretch_add(&s->of[j], j, gains, others, &clamped);
        }
    }
    return own - others;
}

/* The largest deviation, as a share of its limit, that a shift of gauge k does not explain. */
static STRETCH_APART float stretch_shift_left(const float *shares, int k)
{
    float size = 0.0f, left = 0.0f;
    int j;
    for (j = 0; j < STRETCH_CHANNELS; j++) {
        size = size + STRETCH_FLOAT(stretch_shift_along[k][j]) * shares[j];
    }
    for (j = 0; j < STRETCH_CHANNELS; j++) {
        float rest = shares[j] - size * STRETCH_FLOAT(stretch_shift_along[k][j]);
        rest = rest < 0.0f ? -rest : rest;
        left = rest > left ? rest : left;
    }
    return left;
}

/* Returns 1 at the end of a block. A block begins anew if a channel is left out or has no sample. */
static STRETCH_APART int stretch_shifts_step(stretch_shifts_state *b, const stretch_state *s,
                                             stretch_shifts *told)
{
    float shares[STRETCH_CHANNELS], left[STRETCH_CHANNELS], most = 0.0f;
    int exceeds = 0, k;
    b->samples += 1u;
    if (b->samples < STRETCH_SHIFT_SAMPLES) {
        return 0;
    }
    b->samples = 0u;
    for (k = 0; k < STRETCH_CHANNELS; k++) {
        if (s->of[k].loss != STRETCH_IN_USE || !s->of[k].begun) {
            stretch_shifts_init(b);
            return 0;
        }
    }
    for (k = 0; k < STRETCH_CHANNELS; k++) {
        b->sums[k] = b->sums[k] + stretch_difference(s, k);
    }
    b->values += 1u;
    if (b->values < STRETCH_SHIFT_VALUES) {
        return 0;
    }
    told->shifted = 0u;
    for (k = 0; k < STRETCH_CHANNELS; k++) {
        told->off[k] = b->sums[k] * STRETCH_SHIFT_PER_BLOCK - STRETCH_FLOAT(stretch_shift_usual[k]);
        shares[k] = told->off[k] / STRETCH_FLOAT(stretch_shift_limits[k]);
        exceeds |= shares[k] > 1.0f || shares[k] < -1.0f;
    }
    stretch_shifts_init(b);
    if (!exceeds) {
        return 1;
    }
    for (k = 0; k < STRETCH_CHANNELS; k++) {
        left[k] = stretch_shift_left(shares, k);
        most = k == 0 || left[k] < most ? left[k] : most;
    }
    most = most + most > 1.0f ? most + most : 1.0f;
    for (k = 0; k < STRETCH_CHANNELS; k++) {
        if (left[k] <= most) {
            told->shifted = (uint16_t)(told->shifted | (1u << k));
        }
    }
    return 1;
}
