/* The rest of the board: memory for settings, a serial port that is always full, and a clock that
   counts the ticks of the stepper's timer. Called with the names of two files: lines that come in,
   and where positions go: for each tick with a step the clock (uint64, 1/16 µs), X Y Z in steps
   (int32), the PWM of the spindle and whether it is on. What grbl answers goes to stdout, before
   each answer the clock and where its parser stands, mm. */
#include "grbl.h"

#include <stdio.h>

#define DEFINE(name) volatile uint8_t name;
REGISTERS(DEFINE)
volatile uint16_t OCR1A, TCNT1;

system_t sys;
int32_t sys_position[N_AXIS], sys_probe_position[N_AXIS];
volatile uint8_t sys_probe_state, sys_rt_exec_state, sys_rt_exec_alarm;
volatile uint8_t sys_rt_exec_motion_override, sys_rt_exec_accessory_override;

void TIMER1_COMPA_vect(void);

static FILE *lines, *steps;
static uint64_t now, begun;
static uint8_t memory[1024];

static void record(void)
{
  uint64_t at = now - begun;
  int32_t words[5] = {sys_position[0], sys_position[1], sys_position[2], OCR2A,
                      (TCCR2A >> COM2A1) & 1};
  fwrite(&at, sizeof at, 1, steps);
  fwrite(words, sizeof words, 1, steps);
}

void board_wait(void)
{
  static bool ran;
  if (!(TIMSK1 & (1 << OCIE1A))) {
    ran = false;
    return;
  }
  static const uint16_t scales[8] = {1, 1, 8, 64, 256, 1024, 1, 1};
  int32_t before[N_AXIS];
  memcpy(before, sys_position, sizeof before);
  if (ran) { now += ((uint64_t)OCR1A + 1) * scales[TCCR1B & 7]; }
  ran = true; /* the timer runs on while its interrupt is off, so that its flag is up at first */
  TIMER1_COMPA_vect();
  if (memcmp(before, sys_position, sizeof before)) { record(); }
}

void board_resume(void)
{
  if (sys.suspend & SUSPEND_HOLD_COMPLETE) { sys_rt_exec_state |= EXEC_CYCLE_START; }
  else { board_wait(); }
}

void board_delay(float seconds) { now += (uint64_t)(16e6f * seconds + 0.5f); }

void serial_init(void) {}
void serial_reset_read_buffer(void) {}
uint8_t serial_get_rx_buffer_available(void) { return 128; }
uint8_t serial_get_rx_buffer_count(void) { return 0; }
uint8_t serial_get_tx_buffer_count(void) { return 0; }

void serial_write(uint8_t octet) { if (octet != '\r') { putchar(octet); } }

extern parser_state_t gc_state;

uint8_t serial_read(void)
{
  static bool fresh = true;
  int octet = getc(lines);
  if (fresh && (sys.state == STATE_JOG || octet == '$')) { protocol_buffer_synchronize(); }
  while (sys.state == STATE_JOG) {
    protocol_execute_realtime();
    board_wait();
  }
  if (fresh) {
    printf("at %llu %.9g %.9g %.9g\n", (unsigned long long)(now - begun), gc_state.position[0],
           gc_state.position[1], gc_state.position[2]);
  }
  if (octet == EOF) {
    protocol_buffer_synchronize();
    printf("end %llu\n", (unsigned long long)(now - begun));
    fclose(steps);
    exit(0);
  }
  fresh = octet == '\n';
  return (uint8_t)octet;
}

unsigned char eeprom_get_char(unsigned int at) { return memory[at]; }
void eeprom_put_char(unsigned int at, unsigned char value) { memory[at] = value; }

void memcpy_to_eeprom_with_checksum(unsigned int at, char *from, unsigned int size)
{
  memcpy(memory + at, from, size);
  memory[at + size] = 1;
}

int memcpy_from_eeprom_with_checksum(char *to, unsigned int at, unsigned int size)
{
  memcpy(to, memory + at, size);
  return memory[at + size] == 1;
}

int main(int count, char **names)
{
  if (count != 3 || !(lines = fopen(names[1], "rb")) || !(steps = fopen(names[2], "wb"))) {
    return 2;
  }
  memset(memory, 0xff, sizeof memory);
  PINB = PINC = PIND = 0xff; /* no switch is closed */
  settings_init();
  stepper_init();
  system_init();
  sys.state = STATE_IDLE;
  sys.f_override = DEFAULT_FEED_OVERRIDE;
  sys.r_override = DEFAULT_RAPID_OVERRIDE;
  sys.spindle_speed_ovr = DEFAULT_SPINDLE_SPEED_OVERRIDE;
  gc_init();
  spindle_init();
  coolant_init();
  limits_init();
  probe_init();
  plan_reset();
  st_reset();
  plan_sync_position();
  gc_sync_position();
  report_init_message();
  begun = now;
  protocol_main_loop();
  return 0;
}
