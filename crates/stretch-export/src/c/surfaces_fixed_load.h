#ifdef STRETCH_CAN_LOAD
/* ---- a calibration that can be replaced while the program runs ---- */

#include <stddef.h>

/* Results of stretch_load. */
#define STRETCH_LOAD_OK 0
#define STRETCH_NO_RECORD 1     /* no binary calibration file, for example erased memory */
#define STRETCH_DAMAGED 2       /* the checksum does not match */
#define STRETCH_OTHER_VERSION 3 /* of an older or newer release */
#define STRETCH_OTHER_RECORD 4  /* for another model, rate, sample rate or resolution of the converter */

typedef struct stretch_calibration {
    uint32_t dead_band;
    uint32_t mirror;
    stretch_surface surfaces[STRETCH_SURFACE_COUNT];
} stretch_calibration;

/* The calibration in use: at first that of this header. */
static stretch_calibration stretch_in_use = {STRETCH_DEAD_BAND, STRETCH_MIRROR, STRETCH_SURFACES};
#undef STRETCH_DEAD_BAND
#undef STRETCH_MIRROR
#define STRETCH_DEAD_BAND stretch_in_use.dead_band
#define STRETCH_MIRROR stretch_in_use.mirror
#define STRETCH_SURFACE(room, row) ((void)sizeof(room), &stretch_in_use.surfaces[row])

typedef struct stretch_reader {
    const uint8_t *next;
    size_t left;
    uint8_t fails;
} stretch_reader;

static STRETCH_APART uint8_t stretch_read_byte(stretch_reader *r)
{
    if (r->left == 0) {
        r->fails = 1;
        return 0;
    }
    r->left--;
    return *r->next++;
}

/* Seven bits a byte, the lowest first; the highest bit of a byte says that another byte follows. */
static STRETCH_APART uint32_t stretch_read_u32(stretch_reader *r)
{
    uint32_t x = 0;
    int shift;
    for (shift = 0; shift < 35; shift += 7) {
        const uint8_t byte = stretch_read_byte(r);
        if (shift == 28 && byte > 15) {
            break;
        }
        x |= (uint32_t)(byte & 127u) << shift;
        if (byte < 128) {
            return x;
        }
    }
    r->fails = 1;
    return 0;
}

/* The sign is the lowest bit. */
static STRETCH_APART int32_t stretch_read_i32(stretch_reader *r)
{
    const uint32_t x = stretch_read_u32(r);
    return (int32_t)((x >> 1) ^ (0u - (x & 1u)));
}

/* Four bytes, the lowest first. */
static STRETCH_APART uint32_t stretch_read_word(stretch_reader *r)
{
    uint32_t x = 0;
    int shift;
    for (shift = 0; shift < 32; shift += 8) {
        x |= (uint32_t)stretch_read_byte(r) << shift;
    }
    return x;
}

/* CRC-32C */
static STRETCH_APART uint32_t stretch_checksum(const uint8_t *bytes, size_t count)
{
    uint32_t crc = 0xffffffffu;
    for (; count > 0; count--) {
        int k;
        crc ^= *bytes++;
        for (k = 0; k < 8; k++) {
            crc = (crc >> 1) ^ (0x82f63b78u & (0u - (crc & 1u)));
        }
    }
    return ~crc;
}

/* Both ends times the factor must fit 32 bits. */
static STRETCH_APART void stretch_read_span(stretch_reader *r, stretch_span *span)
{
    int64_t low, high;
    span->min = stretch_read_i32(r);
    span->width = stretch_read_u32(r);
    span->factor = stretch_read_i32(r);
    low = span->min;
    high = low + span->width;
    if (span->factor < 1 || high > INT32_MAX || low * span->factor < INT32_MIN ||
        low * span->factor > INT32_MAX || high * span->factor < INT32_MIN ||
        high * span->factor > INT32_MAX) {
        r->fails = 1;
    }
}

/* |c| + bound / 2, which must fit 32 bits: a step of Horner's rule for inputs in -1/2 .. 1/2 */
static STRETCH_APART uint32_t stretch_bound(stretch_reader *r, int32_t c, uint32_t bound)
{
    const uint32_t size = c < 0 ? 0u - (uint32_t)c : (uint32_t)c;
    bound = size + (bound + 1u) / 2u;
    if (bound > (uint32_t)INT32_MAX - 8u) {
        r->fails = 1;
        bound = 0;
    }
    return bound;
}

static STRETCH_APART void stretch_read_surface(stretch_reader *r, stretch_surface *to)
{
    uint32_t centre, bound;
@if static
    stretch_span rate;
@end
@if moving
    static const uint8_t order[7] = {3, 2, 6, 0, 4, 1, 5}; /* p00 p10 p01 p11 p02 p12 p03 */
    int32_t *const p = to->p;
    uint32_t by_rate;
    int k;
@end
    centre = stretch_read_u32(r);
    to->centre = (int32_t)(centre & 65535u);
    stretch_read_span(r, &to->signal);
@if static
    stretch_read_span(r, &rate);
    to->intercept = stretch_read_i32(r);
    to->slope = stretch_read_i32(r);
    bound = stretch_bound(r, to->slope, 0);
    (void)stretch_bound(r, to->intercept, bound);
@end
@if moving
    stretch_read_span(r, &to->rate);
    for (k = 0; k < 7; k++) {
        p[order[k]] = stretch_read_i32(r);
    }
    by_rate = stretch_bound(r, p[2], stretch_bound(r, p[0], stretch_bound(r, p[1], 0)));
    bound = stretch_bound(r, p[6], stretch_bound(r, p[4], stretch_bound(r, p[5], 0)));
    bound = stretch_bound(r, p[3], bound);
    (void)stretch_bound(r, (int32_t)bound, by_rate);
@end
    to->thousandths = stretch_read_i32(r);
    if (centre > 65535u || to->thousandths < 1) {
        r->fails = 1;
    }
}

/* Replaces the calibration by the one in a binary calibration file (stretch export --fixed) of this size. Call
 * stretch_init for every state after it. Unless the result is STRETCH_LOAD_OK, nothing is replaced.
 * stretch_self_test needs the calibration of the header: call it before. */
static STRETCH_APART uint8_t stretch_load(const uint8_t *record, size_t size)
{
    stretch_reader r;
    stretch_calibration loaded;
    uint32_t schema, differs, falls;
    int32_t dead_band;
    int k;
    r.next = record;
    r.left = size;
    r.fails = 0;
    schema = stretch_read_u32(&r);
    if (r.fails || size < 4) {
        return STRETCH_NO_RECORD;
    }
    if (schema == 1) {
        /* it has no checksum */
        return STRETCH_OTHER_VERSION;
    }
    /* bytes that are followed by their own checksum always have this checksum */
    if (stretch_checksum(record, size) != 0x48674bc7u) {
        return STRETCH_DAMAGED;
    }
    if (schema != STRETCH_SCHEMA) {
        return STRETCH_OTHER_VERSION;
    }
    r.left = r.left < 4 ? 0 : r.left - 4;
    differs = stretch_read_u32(&r) ^ STRETCH_WINDOW;
    differs |= (uint32_t)stretch_read_byte(&r) ^ STRETCH_DEGREE;
    differs |= stretch_read_u32(&r); /* the rate is that at the newest sample */
    differs |= (uint32_t)stretch_read_byte(&r) ^ STRETCH_ADC_BITS;
    differs |= stretch_read_word(&r) ^ STRETCH_RATE_LOW;
    differs |= stretch_read_word(&r) ^ STRETCH_RATE_HIGH;
    falls = stretch_read_byte(&r);
    dead_band = stretch_read_i32(&r);
    differs |= stretch_read_u32(&r) ^ (STRETCH_SURFACE_COUNT - 1u);
    for (k = 0; k < STRETCH_SURFACE_COUNT && differs == 0; k++) {
        stretch_read_surface(&r, &loaded.surfaces[k]);
    }
    if (differs != 0 || r.fails || r.left != 0 || falls > 1 || dead_band < 0) {
        return STRETCH_OTHER_RECORD;
    }
    loaded.dead_band = (uint32_t)dead_band;
    loaded.mirror = falls ? 0xffffffffu : 0u;
    stretch_in_use = loaded;
    return STRETCH_LOAD_OK;
}

#else
static const stretch_surface stretch_surfaces[STRETCH_SURFACE_COUNT] STRETCH_FLASH = STRETCH_SURFACES;
#define STRETCH_SURFACE(room, row) STRETCH_LOADED(room, stretch_surfaces[row])
#endif

STRETCH_INLINE int32_t stretch_at(const stretch_state *s, uint32_t sample, int32_t rate,
                                 uint8_t *outside)
{
    stretch_surface room;
@if static
    (void)s;
    return stretch_estimate(STRETCH_SURFACE(room, 0), sample, rate, outside);
@end
@if moving
    return stretch_estimate(STRETCH_SURFACE(room, s->branch), sample, rate, outside);
@end
}

