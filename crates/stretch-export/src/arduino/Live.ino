// Length from the bridge's amplifier on A0, a line a sample, at 115200 baud.
#include <stretch.h>

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
  // a period that was missed is a sample that did not come
  while ((int32_t)(micros() - due_us) >= STRETCH_PERIOD_US) {
    stretch_lost(&state);
    due_us += STRETCH_PERIOD_US;
  }
  due_us += STRETCH_PERIOD_US;
@STEP@
  if (reading.status == STRETCH_WARMING) {
    Serial.println("warming");
    return;
  }
  Serial.print(@ESTIMATE@);
  Serial.print(" " STRETCH_UNIT);
  Serial.print(reading.branch == STRETCH_INFLATION ? " inflation" : " deflation");
  Serial.println(reading.domain == STRETCH_INSIDE ? "" : " outside the calibrated domain");
}
