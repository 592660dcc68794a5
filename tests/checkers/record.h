/* SPDX-License-Identifier: Apache-2.0
 * What posted C programs do, as lines of text for posted_programs_test:
 *   kind;motion;speed;share;signals;truth;numbers
 * Inputs are all what RECORD_INPUTS of the environment says, 0 or 1; a wait that never ends with
 * them ends with the other. truth: of a condition, for each of the inputs' values, "?" where this
 * run does not show it. */
#ifndef RMP_RECORD_H
#define RMP_RECORD_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define RECORD_MOST 4

static int record_is_other; /* inputs are the other for once: the wait did not end */
static int record_asked[RECORD_MOST], record_count; /* inputs of the condition that is asked */
static unsigned record_bits;                        /* their values while one of UNTIL is tried */
static int record_is_trying;

static inline int record_given(void) {
  const char* given = getenv("RECORD_INPUTS");
  return given != NULL && given[0] == '1';
}
static inline void record_numbers(const double* v, size_t count) {
  size_t k;
  for (k = 0; k < count; ++k) fprintf(stderr, "%s%.17g", k ? " " : "", v[k]);
  fprintf(stderr, "\n");
}
static inline void record_signals(void) {
  int k;
  for (k = 0; k < record_count; ++k) fprintf(stderr, "%s%d", k ? " " : "", record_asked[k]);
}
/* A wait goes on though the condition was asked: the inputs become the other, once. */
static inline void record_goes_on(void) {
  if (record_is_other) {
    fprintf(stderr, "a wait does not end, whatever the inputs are\n");
    exit(1);
  }
  record_is_other = 1;
}
static inline int record_input(int number) {
  int k = 0;
  while (k < record_count && record_asked[k] != number) ++k;
  if (k == record_count) {
    if (k == RECORD_MOST) {
      fprintf(stderr, "a condition of more than %d inputs\n", RECORD_MOST);
      exit(1);
    }
    record_asked[record_count++] = number;
  }
  return record_is_trying ? (int)(record_bits >> k & 1U) : record_given() != record_is_other;
}
/* A wait is over: whether the condition was false at first, and the TIMEOUT (-1 = none, -2 = this
 * run does not say). */
static inline void record_waited(int was_false, double timeout) {
  const unsigned all = 1U << record_count, at = record_given() ? all - 1 : 0;
  unsigned bits;
  fprintf(stderr, "condition;-;-;-;");
  record_signals();
  fprintf(stderr, ";");
  for (bits = 0; bits < all; ++bits)
    fprintf(stderr, "%c", bits != at ? '?' : was_false ? '0' : '1');
  fprintf(stderr, ";");
  record_numbers(&timeout, 1);
  record_count = 0;
  record_is_other = 0;
}
/* A motion; until NULL = none, else it is tried for all values of the inputs that it asks for. */
static inline void record_move(const char* kind, const char* motion, double speed, double share,
                               int (*until)(void), const double* v, size_t count) {
  fprintf(stderr, "%s;%s;", kind, motion);
  if (speed >= 0) fprintf(stderr, "%.17g;", speed);
  else fprintf(stderr, "-;");
  if (share >= 0) fprintf(stderr, "%.17g;", share);
  else fprintf(stderr, "-;");
  record_count = 0;
  if (until) {
    char truth[(1 << RECORD_MOST) + 1];
    int known;
    record_is_trying = 1;
    do {
      known = record_count;
      for (record_bits = 0; record_bits < 1U << known; ++record_bits)
        truth[record_bits] = until() ? '1' : '0';
      truth[record_bits] = '\0';
    } while (known != record_count);
    record_is_trying = 0;
    record_signals();
    fprintf(stderr, ";%s;", truth);
  } else {
    fprintf(stderr, ";;");
  }
  record_count = 0;
  record_numbers(v, count);
}
static inline void record_output(int number, double value) {
  fprintf(stderr, "output;-;-;-;%d;;", number);
  record_numbers(&value, 1);
}
static inline void record_wait(double seconds) {
  fprintf(stderr, "wait;-;-;-;;;");
  record_numbers(&seconds, 1);
}

#endif
