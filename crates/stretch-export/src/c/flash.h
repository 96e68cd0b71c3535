/* Tables. On AVR they stay in flash, because constants there are copied into its small RAM. */
#if defined(__AVR__)
#include <avr/pgmspace.h>
#define STRETCH_FLASH PROGMEM
#define STRETCH_FLOAT(x) pgm_read_float(&(x))
#define STRETCH_INT(x) ((int32_t)pgm_read_dword(&(x)))
#define STRETCH_BYTE(x) pgm_read_byte(&(x))
#define STRETCH_LOADED(room, row) (memcpy_P(&(room), &(row), sizeof(room)), &(room))
#else
#define STRETCH_FLASH
#define STRETCH_FLOAT(x) (x)
#define STRETCH_INT(x) (x)
#define STRETCH_BYTE(x) (x)
#define STRETCH_LOADED(room, row) ((void)sizeof(room), &(row))
#endif
