/* For a stream known to begin on another branch than STRETCH_INFLATION: after stretch_init. */
static inline void stretch_start_on(stretch_state *s, uint8_t branch)
{
    s->branch = branch == STRETCH_INFLATION ? STRETCH_INFLATION : STRETCH_DEFLATION;
}

