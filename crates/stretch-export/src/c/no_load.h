#ifdef STRETCH_CAN_LOAD
#error "STRETCH_CAN_LOAD: only headers in fixed of the models linear and poly13 can load a calibration"
#endif

