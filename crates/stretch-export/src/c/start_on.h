/* Call this after stretch_init if the stream is known to begin on STRETCH_DEFLATION. */
static inline void stretch_start_on(stretch_state *s, uint8_t branch)
{
    s->branch = branch == STRETCH_INFLATION ? STRETCH_INFLATION : STRETCH_DEFLATION;
}

