/* Call this after stretch_init if the direction of the reference at the beginning of the stream is known:
 * STRETCH_RISING or STRETCH_FALLING. */
static inline void stretch_start_on(stretch_state *s, uint8_t branch)
{
    s->branch = branch == STRETCH_TARGET_RISES ? STRETCH_TARGET_RISES : STRETCH_TARGET_FALLS;
}

