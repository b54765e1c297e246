// Emberlock's strobe controller for a 16 MHz AVR with Arduino's core (Uno, Nano, Mega): ../PROTOCOL.md. The
// light, or a lamp's trigger input, is connected to OC1A: pin 9 of an Uno or Nano, pin 11 of a Mega. Timer 1
// sets and clears the pin in hardware, so interrupt latency doesn't move an edge; interrupts only prepare the
// next edge.
#include "flashes.h"
#include "protocol.h"

#if defined(__AVR_ATmega2560__)
constexpr uint8_t kLight = 11;
constexpr char kModel[] = "mega";
#else
constexpr uint8_t kLight = 9;
constexpr char kModel[] = "uno";
#endif
constexpr char kSerial[] = "1";  // change it: must be unique if several controllers are connected to one computer

constexpr uint8_t mask(uint8_t bit) { return static_cast<uint8_t>(1 << bit); }

constexpr uint32_t kTick = 500;            // ns: 16 MHz / 8
constexpr uint32_t kLead = 400;            // ticks, 200 us
constexpr uint32_t kShortestWidth = 20000;  // ns: duration of the interrupt at the start of a flash, doubled
constexpr uint16_t kFar = 0x7000, kHop = 0x4000;  // ticks: the timer has only 16 bits
constexpr uint8_t kSet = mask(COM1A1) | mask(COM1A0), kClear = mask(COM1A1);  // what a compare match does to the pin

using emberlock_controller::Controller;
using emberlock_controller::Flashes;
using emberlock_controller::Output;

Controller controller({kModel, kSerial, kTick, kShortestWidth});
Flashes flashes(kTick, kLead);

// Shared with the interrupt. `last` is the time of the next compare match, in ticks modulo 2^32.
Flashes::Edge edge;
uint32_t last = 0;
bool hopping = true, lit = false;
volatile uint32_t given = 0;

// Prepares the compare match for the next edge, or an intermediate one if the edge is far away.
void arm() {
  hopping = edge.at - last > kFar;
  const bool stays = hopping || edge.kind == Flashes::Kind::skip;
  TCCR1A = (stays ? lit : edge.kind == Flashes::Kind::on) ? kSet : kClear;
  last = hopping ? last + kHop : edge.at;
  OCR1A = static_cast<uint16_t>(last);
}
int16_t ticks_left() { return static_cast<int16_t>(static_cast<uint16_t>(last) - TCNT1); }

ISR(TIMER1_COMPA_vect) {
  for (;;) {
    if (!hopping) {
      lit = edge.kind == Flashes::Kind::on;
      if (lit) given = given + 1;
      edge = flashes.next([](uint16_t place) { return controller.flashes(place); });
    }
    arm();
    constexpr int16_t kNear = 4;
    if (ticks_left() > kNear) return;
    // Too near for the timer, which after a missed match would match only 33 ms later: handle the edge in
    // software.
    while (ticks_left() >= 0) {
    }
    TCCR1C = mask(FOC1A);
    TIFR1 = mask(OCF1A);
  }
}

// Applies new settings. A flash under way ends.
void obey() {
  noInterrupts();
  TIMSK1 = 0;
  TCCR1A = 0;
  const emberlock_controller::Settings& told = controller.settings();
  digitalWrite(kLight, told.output == Output::steady ? HIGH : LOW);
  if (told.output == Output::flash) {
    // Sets the output of the compare unit low too, before it takes over the pin.
    TCCR1A = kClear;
    TCCR1C = mask(FOC1A);
    lit = false;
    last -= static_cast<uint32_t>(static_cast<int32_t>(ticks_left()));  // the current time
    flashes.begin({told.period, told.phase, told.width, told.code_length}, last);
    edge = flashes.next([](uint16_t place) { return controller.flashes(place); });
    arm();
    TIFR1 = mask(OCF1A);
    TIMSK1 = mask(OCIE1A);
  } else {
    flashes.stop();
  }
  interrupts();
}

void setup() {
  pinMode(kLight, OUTPUT);
  digitalWrite(kLight, LOW);
  TCCR1A = 0;
  TCCR1B = mask(CS11);
  Serial.begin(115200);
}

void loop() {
  const uint8_t before = controller.changes();
  while (Serial.available() > 0) {
    noInterrupts();
    controller.set_flashes(given);
    interrupts();
    if (!controller.take(static_cast<char>(Serial.read()), millis())) continue;
    if (controller.changes() != before) obey();
    Serial.write(controller.reply());
    return;
  }
  if (controller.watch(millis())) obey();
}
