@if one
// Reads @SIGNALS@ on A0 and prints @REFERENCE@, one line per sample, at 115200 baud.
@end
@if array
// Reads @SIGNALS@ on A0 and the pins after it, and prints @REFERENCE@,
// one line per sample, at 115200 baud.
@end
#include <stretch_@NAME@.h>

// analogRead of these boards always returns 10 bits
#if defined(__AVR__) && STRETCH_ADC_BITS != 10
#error "the converter of this board has 10 bits: stretch export --adc 10,0,5 (a signal in volts) or 10,0,1023 (in counts)"
#endif

#if !defined(STRETCH_PERIOD_US)
#error "the period is below 1 us, which micros() cannot count: calibrate at a lower sample rate"
#endif

@if array
const uint8_t pins[STRETCH_CHANNELS] = {@PINS@};
const char *const signals[STRETCH_CHANNELS] = STRETCH_SIGNALS;

@end
stretch_state state;
uint32_t due_us;

void setup() {
  Serial.begin(115200);
#if !defined(__AVR__)
  analogReadResolution(STRETCH_ADC_BITS);
#endif
  int wrong = stretch_self_test();
  if (wrong) {
    Serial.print("this board computes differently from the host computer, from sample ");
    Serial.println(wrong);
    for (;;) {
    }
  }
  stretch_init(&state);
  due_us = micros();
}

void loop() {
  if ((int32_t)(micros() - due_us) < 0) {
    return;
  }
  // each period that was missed is a missing sample
  while ((int32_t)(micros() - due_us) >= STRETCH_PERIOD_US) {
    stretch_lost(&state);
    due_us += STRETCH_PERIOD_US;
  }
  due_us += STRETCH_PERIOD_US;
@if one
  int32_t code = analogRead(A0);
@if fixed
  // a code outside the calibrated range and its margin comes from a loose wire or another fault
  bool is_measured = code >= STRETCH_LOWEST_CODE && code <= STRETCH_HIGHEST_CODE;
  stretch_reading reading = is_measured ? stretch_step(&state, code) : stretch_lost(&state);
@end
@if pressure
  float pressure = 0.0f;  // insert your measurement here, in the unit of the calibration's pressure
  stretch_set_pressure(&state, pressure);
@end
@if float
  // the first and the last code also come from a loose wire or from a signal beyond the converter
  bool is_measured = code > 0 && code < (1L << STRETCH_ADC_BITS) - 1;
  float sample = STRETCH_ADC_ZERO + STRETCH_ADC_PER_CODE * (float)code;
  stretch_reading reading = is_measured ? stretch_step(&state, sample) : stretch_lost(&state);
@end
  if (reading.status != STRETCH_OK) {
    Serial.println(reading.status == STRETCH_WARMING ? "warming" : "missing");
    return;
  }
@if fixed
  Serial.print(reading.estimate / 1000.0, 3);
@end
@if float
  Serial.print(reading.estimate, 3);
@end
  Serial.print(" " STRETCH_UNIT);
  Serial.print(reading.branch == STRETCH_RISING ? " rising" : " falling");
  Serial.println(reading.domain == STRETCH_INSIDE ? "" : " outside the calibrated domain");
@end
@if array
  float samples[STRETCH_CHANNELS];
  for (int k = 0; k < STRETCH_CHANNELS; k++) {
    samples[k] = STRETCH_ADC_ZERO + STRETCH_ADC_PER_CODE * (float)analogRead(pins[k]);
  }
  stretch_reading reading = stretch_step(&state, samples);
  if (reading.status != STRETCH_OK) {
    bool all = reading.status == STRETCH_ALL_LOST;
    bool warming = reading.status == STRETCH_WARMING;
    Serial.println(all ? "every gauge is lost" : warming ? "warming" : "missing");
    return;
  }
  Serial.print(reading.estimate, 3);
  Serial.print(" " STRETCH_UNIT " +/- ");
  Serial.print(reading.sd, 3);
  // stretch_readmit(&state, k) uses gauge k again, after you have checked it
  for (int k = 0; k < STRETCH_CHANNELS; k++) {
    if (reading.lost & (1u << k)) {
      Serial.print(" without ");
      Serial.print(signals[k]);
    }
  }
  Serial.println(reading.clamped ? " outside the calibrated domain" : "");
@end
}
