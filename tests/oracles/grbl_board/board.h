/* A board for grbl's sources on a computer: the registers of its processor are variables, and a
   double has 32 bits, as on the AVR. Included before each of its files. */
#ifndef board_h
#define board_h

#include <inttypes.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define F_CPU 16000000UL
#define double float
#define sqrt sqrtf
#define floor floorf
#define ceil ceilf
#define fabs fabsf
#define trunc truncf
#define round roundf
#define lround lroundf
#define atan2 atan2f
#define sin sinf
#define cos cosf

#define PROGMEM
#define __flash
#define PSTR(text) (text)
#define pgm_read_byte_near(at) (*(const uint8_t *)(at))
#define ISR(vector) void vector(void)
#define sei()
#define cli()

#define REGISTERS(each) \
  each(DDRB) each(DDRC) each(DDRD) each(PORTB) each(PORTC) each(PORTD) each(PINB) each(PINC) \
  each(PIND) each(PCICR) each(PCMSK0) each(PCMSK1) each(SREG) each(MCUSR) each(WDTCSR) \
  each(TCCR0A) each(TCCR0B) each(TCNT0) each(TIMSK0) each(OCR0A) each(TCCR1A) each(TCCR1B) \
  each(TIMSK1) each(TCCR2A) each(TCCR2B) each(OCR2A) each(UBRR0H) each(UBRR0L) each(UCSR0A) \
  each(UCSR0B) each(UDR0)
#define DECLARE(name) extern volatile uint8_t name;
REGISTERS(DECLARE)
extern volatile uint16_t OCR1A, TCNT1;

enum {
  PCIE0 = 0, PCIE1 = 1, WDP0 = 0, WDIE = 6, WDE = 3, WDCE = 4,
  TOIE0 = 0, OCIE0A = 1, OCIE0B = 2, OCIE1A = 1,
  CS00 = 0, CS01 = 1, CS10 = 0, CS11 = 1, CS12 = 2, CS20 = 0, CS21 = 1, CS22 = 2,
  WGM10 = 0, WGM11 = 1, WGM12 = 3, WGM13 = 4, WGM20 = 0, WGM21 = 1,
  U2X0 = 1, RXEN0 = 4, TXEN0 = 3, RXCIE0 = 7, UDRIE0 = 5, UDRE0 = 5,
  COM1A0 = 6, COM1A1 = 7, COM1B0 = 4, COM1B1 = 5, COM2A1 = 7,
};

void board_wait(void);    /* the main program waits: time goes on to the next interrupt */
void board_resume(void);  /* it is held: in a program from a file cycle start is pressed */
void board_suspended(void); /* it is held, or its door is open */
void board_sent(void);    /* it has something to send */
void board_delay(float seconds);
#define _delay_ms(ms) board_delay(1e-3f * (ms))
#define _delay_us(us) board_delay(1e-6f * (us))

#endif
