/* The rest of the board: memory for settings, a clock that counts the ticks of the stepper's timer,
   and the other end of the serial line. The main program takes no time; time goes on where it waits.

   Called with two files it runs a program from a line that is always full: lines that come in, and
   where positions go: for each tick with a step the clock (uint64, 1/16 µs), X Y Z in steps (int32),
   the PWM of the spindle and whether it is on. What grbl answers goes to stdout, before each answer
   the clock and where its parser stands, mm.

   Called with four it plays a session: an image of the memory (made where there is none), a script,
   where the answers go, and where positions go: as above, and behind them the true position of the
   slides (3 int32), counted by the pulses of the step pins since the power came on. Lines of a script:

     switch PIN AXIS LEAST MOST   a switch at X, Y, Z (limits), P (probe): closed while the true
                                  position of an axis (0 to 2) is not between these, in steps
     w HEX                        bytes, when grbl stands and nothing more will happen by itself
     t TICKS HEX                  bytes, so long after the last byte before them
     p TICKS MASK                 buttons that are pressed from then on: 1 reset, 2 hold, 4 start

   Called with three it is told the time by its caller: an image as above, a script with switches
   alone, and where positions go. Lines come in, `TICKS HEX`: it runs to that time, and then these
   bytes come; each is answered by a line `X Y Z BUSY HEX`: the true position of the slides, whether
   anything will happen by itself, and what grbl has said meanwhile. At the end of its input it ends.

   A byte takes 10 bits at 115200 baud. Answers are lines `ENTRY TICKS HEX`: what was sent while this
   entry was the last, a line of text each, and when its first byte was. The last line is
   `end TICKS`. */
#include "grbl.h"

#include <stdio.h>
#undef main

#define DEFINE(name) volatile uint8_t name;
REGISTERS(DEFINE)
volatile uint16_t OCR1A, TCNT1;

void TIMER1_COMPA_vect(void);
void TIMER0_OVF_vect(void);
void USART_RX_vect(void);
void USART_UDRE_vect(void);
void PCINT0_vect(void);
void PCINT1_vect(void);
int grbl_main(void);
uint8_t serial_read_ring(void);

#define NEVER UINT64_MAX
#define BYTE_TICKS 1389
#define SPINS 6
#define MOST_TICKS (16000000ULL * 36000)
#define MOST_ENTRIES 20000

extern parser_state_t gc_state;

static FILE *lines, *steps, *answers;
static const char *image_name;
static uint64_t now, begun, tick_at = NEVER;
static uint8_t memory[1024];
static int32_t slides[N_AXIS];
static bool session, live, in_tick, in_delay;
static uint64_t limit; /* live: time goes on to here */

/* The script. */

typedef struct { char kind; uint64_t after; uint8_t *bytes; int count; } entry_t;
typedef struct { char pin; int axis; long least, most; } switch_t;
static entry_t entries[MOST_ENTRIES];
static switch_t switches[16];
static int entry_count, switch_count, current = -1, sent;
static uint64_t byte_at = NEVER, last_byte;

static char text[4096];
static int text_size;
static uint64_t text_at, sent_out;

static void flush_text(void)
{
  if (!text_size) { return; }
  fprintf(answers, "%d %llu ", current, (unsigned long long)text_at);
  for (int k = 0; k < text_size; k++) { fprintf(answers, "%02x", (uint8_t)text[k]); }
  fputc('\n', answers);
  text_size = 0;
}

static char said[1 << 16];
static int said_size;

static void heard_text(uint8_t octet)
{
  if (said_size + 2 < (int)sizeof said) { said_size += sprintf(said + said_size, "%02x", octet); }
}

void board_sent(void)
{
  while (UCSR0B & (1 << UDRIE0)) {
    USART_UDRE_vect();
    sent_out++;
    if (!session) {
      if (UDR0 != '\r') { putchar(UDR0); }
      continue;
    }
    if (live) {
      heard_text(UDR0);
      continue;
    }
    if (!text_size) { text_at = now; }
    text[text_size++] = UDR0;
    if (UDR0 == '\n' || text_size == sizeof text) { flush_text(); }
  }
}

static void over(void)
{
  if (live) { }
  else if (session) {
    flush_text();
    fprintf(answers, "end %llu\n", (unsigned long long)now);
    fclose(answers);
    FILE *image = fopen(image_name, "wb");
    fwrite(memory, sizeof memory, 1, image);
    fclose(image);
  }
  else { printf("end %llu\n", (unsigned long long)(now - begun)); }
  fclose(steps);
  exit(0);
}

/* Switches, by the true position of the slides. */

static void feel(void)
{
  uint8_t limits = 0xff, control = PINC | (1 << PROBE_BIT), before = PINB;
  for (int k = 0; k < switch_count; k++) {
    switch_t *it = &switches[k];
    if (slides[it->axis] > it->least && slides[it->axis] < it->most) { continue; }
    if (it->pin == 'P') { control &= ~(1 << PROBE_BIT); }
    else { limits &= ~(1 << (it->pin == 'X' ? X_LIMIT_BIT : it->pin == 'Y' ? Y_LIMIT_BIT : Z_LIMIT_BIT)); }
  }
  PINC = control;
  PINB = limits;
  if (((before ^ limits) & PCMSK0 & LIMIT_MASK) && (PCICR & (1 << PCIE0))) { PCINT0_vect(); }
}

static void press(uint8_t mask)
{
  uint8_t before = PINC;
  PINC = (before | 7) & ~(mask & 7);
  if (((before ^ PINC) & PCMSK1) && (PCICR & (1 << PCIE1))) { PCINT1_vect(); }
}

/* Interrupts. */

static void record(void)
{
  uint64_t at = now - begun;
  int32_t words[5] = {sys_position[0], sys_position[1], sys_position[2], OCR2A,
                      (TCCR2A >> COM2A1) & 1};
  fwrite(&at, sizeof at, 1, steps);
  fwrite(words, sizeof words, 1, steps);
  if (session) { fwrite(slides, sizeof slides, 1, steps); }
}

static void tick(void)
{
  static const uint16_t scales[8] = {1, 1, 8, 64, 256, 1024, 1, 1};
  int32_t before[N_AXIS], stood[N_AXIS];
  uint64_t at = now;
  memcpy(before, sys_position, sizeof before);
  memcpy(stood, slides, sizeof stood);
  in_tick = true;
  TIMER1_COMPA_vect();
  in_tick = false;
  uint8_t inverted = 0;
  for (int k = 0; k < N_AXIS; k++) {
    if (settings.step_invert_mask & (1 << k)) { inverted |= get_step_pin_mask(k); }
  }
  for (int k = 0; k < N_AXIS; k++) {
    if ((STEP_PORT ^ inverted) & get_step_pin_mask(k)) {
      slides[k] += DIRECTION_PORT & get_direction_pin_mask(k) ? -1 : 1;
    }
  }
  TIMER0_OVF_vect();
  bool on = TIMSK1 & (1 << OCIE1A);
  tick_at = on ? at + ((uint64_t)OCR1A + 1) * scales[TCCR1B & 7] : NEVER;
  bool moved = memcmp(stood, slides, sizeof stood);
  if (memcmp(before, sys_position, sizeof before) || (moved && session)) { record(); }
  if (moved) { feel(); }
}

static void take_byte(void)
{
  entry_t *entry = &entries[current];
  if (entry->kind == 'p') { press(entry->bytes[sent++]); }
  else {
    UDR0 = entry->bytes[sent++];
    USART_RX_vect();
  }
  last_byte = now;
  byte_at = sent < entry->count ? now + BYTE_TICKS : NEVER;
}

static void begin_entry(void)
{
  flush_text();
  current++;
  sent = 0;
  byte_at = now;
  if (!entries[current].count) { byte_at = NEVER; }
}

/* Whether there is something to come up to a time; if so it happens. */
static bool step_to(uint64_t until)
{
  if (!(TIMSK1 & (1 << OCIE1A))) { tick_at = NEVER; }
  else if (tick_at == NEVER) { tick_at = now; } /* its flag is up: the timer always runs */
  uint64_t due = in_tick ? NEVER : tick_at;
  uint64_t timed = NEVER;
  if (session && byte_at == NEVER && current + 1 < entry_count && entries[current + 1].kind != 'w') {
    timed = last_byte + entries[current + 1].after;
    if (timed < now) { timed = now; }
  }
  uint64_t line = byte_at < timed ? byte_at : timed;
  uint64_t next = due < line ? due : line;
  if (next == NEVER || next > until) { return false; }
  if (next > now) { now = next; }
  if (now > MOST_TICKS) { over(); }
  if (due <= line) { tick(); }
  else {
    if (byte_at == NEVER) { begin_entry(); }
    if (byte_at != NEVER) { take_byte(); }
  }
  return true;
}

static uint8_t *unhexed(const char *from, int *count)
{
  uint8_t *bytes = malloc(strlen(from) / 2 + 1);
  unsigned int octet;
  for (*count = 0; sscanf(from, "%2x", &octet) == 1; from += 2) { bytes[(*count)++] = octet; }
  return bytes;
}

/* Live: answer, and take the next order. */

static uint8_t *coming;
static int coming_count, came;

static void take_order(void)
{
  static char row[1 << 17], hex[1 << 17];
  unsigned long long ticks = 0;
  if (steps) { fflush(steps); }
  printf("%d %d %d %d %s\n", slides[0], slides[1], slides[2],
         (int)(in_delay || (TIMSK1 & (1 << OCIE1A)) || sys.state != STATE_IDLE), said_size ? said : "-");
  fflush(stdout);
  said_size = 0;
  said[0] = 0;
  hex[0] = 0;
  if (!fgets(row, sizeof row, stdin) || sscanf(row, "%llu %131000s", &ticks, hex) < 1) { over(); }
  if (ticks > limit) { limit = ticks; }
  free(coming);
  coming = unhexed(hex, &coming_count);
  came = 0;
}

/* Live: nothing more happens before the limit. */
static void reach_limit(void)
{
  if (now < limit) { now = limit; }
  if (came < coming_count) {
    UDR0 = coming[came++];
    USART_RX_vect();
    return;
  }
  take_order();
}

void board_wait(void)
{
  if (!session) {
    step_to(NEVER - 1);
    return;
  }
  static struct { system_t sys; uint8_t flags[4]; uint64_t sent_out, now; parser_state_t gc; } last, seen;
  static int spins;
  memset(&seen, 0, sizeof seen);
  seen.sys = sys;
  seen.gc = gc_state;
  seen.flags[0] = sys_rt_exec_state;
  seen.flags[1] = sys_rt_exec_alarm;
  seen.flags[2] = sys_rt_exec_motion_override;
  seen.flags[3] = sys_rt_exec_accessory_override;
  seen.sent_out = sent_out;
  seen.now = now;
  spins = memcmp(&seen, &last, sizeof seen) ? 0 : spins + 1;
  last = seen;
  if (spins < SPINS) { return; } /* it may do something yet without an interrupt */
  spins = 0;
  if (live) {
    if (!step_to(limit)) { reach_limit(); }
    return;
  }
  if (step_to(NEVER - 1)) { return; }
  if (current + 1 >= entry_count) { over(); }
  begin_entry();
}

void board_resume(void)
{
  if (!session) {
    if (sys.suspend & SUSPEND_HOLD_COMPLETE) { sys_rt_exec_state |= EXEC_CYCLE_START; }
    else { board_wait(); }
  }
}

void board_suspended(void) { if (session && sys.suspend) { board_wait(); } }

void board_delay(float seconds)
{
  uint64_t until = now + (uint64_t)(16e6f * seconds + 0.5f);
  if (live) {
    in_delay = true;
    while (now < until) {
      if (step_to(until < limit ? until : limit)) { continue; }
      if (until <= limit) { break; }
      reach_limit();
    }
    in_delay = false;
  }
  else if (session) { while (step_to(until)) { } }
  if (now < until) { now = until; }
}

/* The serial line of the first kind is always full; the second waits for the script. */

uint8_t serial_read(void)
{
  static bool fresh = true;
  if (session) {
    uint8_t octet = serial_read_ring();
    if (octet == SERIAL_NO_DATA) { board_wait(); }
    return octet;
  }
  int octet = getc(lines);
  if (fresh && (sys.state == STATE_JOG || octet == '$')) { protocol_buffer_synchronize(); }
  while (sys.state == STATE_JOG) {
    protocol_execute_realtime();
    board_wait();
  }
  if (fresh) {
    if (!begun) { begun = now; }
    printf("at %llu %.9g %.9g %.9g\n", (unsigned long long)(now - begun), gc_state.position[0],
           gc_state.position[1], gc_state.position[2]);
  }
  if (octet == EOF) {
    protocol_buffer_synchronize();
    over();
  }
  fresh = octet == '\n';
  return (uint8_t)octet;
}

unsigned char eeprom_get_char(unsigned int at) { return memory[at]; }
void eeprom_put_char(unsigned int at, unsigned char value) { memory[at] = value; }

static uint8_t checksum(const uint8_t *data, unsigned int size)
{
  uint8_t sum = 0;
  while (size--) { sum = (sum ? 1 : 0) + *data++; } /* (sum << 1) || (sum >> 7), as it stands there */
  return sum;
}

void memcpy_to_eeprom_with_checksum(unsigned int at, char *from, unsigned int size)
{
  memcpy(memory + at, from, size);
  memory[at + size] = checksum(memory + at, size);
}

int memcpy_from_eeprom_with_checksum(char *to, unsigned int at, unsigned int size)
{
  memcpy(to, memory + at, size);
  return memory[at + size] == checksum(memory + at, size);
}

static void read_script(const char *name)
{
  static char row[1 << 16], hex[1 << 16];
  FILE *file = fopen(name, "r");
  if (!file) { exit(2); }
  while (fgets(row, sizeof row, file)) {
    entry_t entry = {row[0], 0, NULL, 0};
    unsigned long long ticks = 0;
    hex[0] = 0;
    if (row[0] == 's') {
      switch_t *it = &switches[switch_count++];
      if (sscanf(row, "switch %c %d %ld %ld", &it->pin, &it->axis, &it->least, &it->most) != 4) { exit(2); }
      continue;
    }
    if (row[0] == 'w') { sscanf(row, "w %65000s", hex); }
    else if (sscanf(row, "%*c %llu %65000s", &ticks, hex) < 1) { exit(2); }
    entry.after = ticks;
    entry.bytes = unhexed(hex, &entry.count);
    if (entry_count == MOST_ENTRIES) { exit(2); }
    entries[entry_count++] = entry;
  }
  fclose(file);
}

int main(int count, char **names)
{
  memset(memory, 0xff, sizeof memory);
  PINB = PINC = PIND = 0xff; /* no switch is closed */
  UCSR0A = 1 << UDRE0;
  if (count == 3) {
    if (!(lines = fopen(names[1], "rb")) || !(steps = fopen(names[2], "wb"))) { return 2; }
    return grbl_main();
  }
  session = true;
  if (count == 4) {
    live = true;
    if (!(steps = fopen(names[3], "wb"))) { return 2; }
  }
  else if (count != 5 || !(answers = fopen(names[3], "w")) || !(steps = fopen(names[4], "wb"))) { return 2; }
  read_script(names[2]);
  image_name = names[1];
  FILE *image = fopen(image_name, "rb");
  if (image) {
    if (fread(memory, sizeof memory, 1, image) != 1) { return 2; }
    fclose(image);
  }
  feel();
  return grbl_main();
}
