/* SPDX-License-Identifier: Apache-2.0 */
/* The client of robomosp_client.h. Answers are read into one buffer, checked by a parser without
 * recursion, and kept as a flat list of values that point into that buffer. */
#ifndef _POSIX_C_SOURCE
#define _POSIX_C_SOURCE 200809L
#endif
#include "robomosp_client.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <locale.h>
#include <math.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/types.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#ifdef ROBOMOSP_TLS
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#endif

#ifndef MSG_NOSIGNAL
#define MSG_NOSIGNAL 0
#endif

#define NONE ((size_t)-1)
#define LONGEST_NUMBER 400 /* characters */
#define FEW 16             /* numbers that are sent as digits */

/* A value of an answer; those within it follow. In tables a text, the key, comes before each value. */
typedef struct node {
  size_t start, length; /* in the text; of texts without quotes */
  size_t extent;        /* nodes, itself included */
  size_t count;         /* entries of lists and tables */
  rmpc_type type;
} node;

typedef struct event {
  struct event *next;
  size_t length;
  char text[];
} event;

struct rmpc_client {
  int fd;
  int wants_tls;
  char trusted[512]; /* PEM file; "" = the authorities of the system */
#ifdef ROBOMOSP_TLS
  SSL_CTX *tls_context;
  SSL *tls; /* NULL = not spoken */
  char cipher[17408]; /* that is to be sent */
  size_t cipher_used, cipher_sent;
#endif
  pid_t child; /* 0 = none */
  double timeout;
  const volatile sig_atomic_t *stop;
  long long latest_id;
  int has_spoken; /* a line of the other end was read */
  char peer[160], closing[512];
  /* what comes in: the line that was read last, then what has come since */
  char *in;
  size_t in_room, in_used, in_line, in_scanned;
  /* the request */
  char *out;
  size_t out_room, out_used;
  rmpc_status out_fault;
  int is_first_piece, is_job;
  /* the answer or event */
  const char *text;
  node *nodes;
  size_t node_room, node_count, root;
  event *current, *first, *last;
  size_t event_bytes, left_out;
  char event_name[32];
  /* the latest fault */
  char message[1024], code[40], where[256], hint[512];
};

/* --- faults --- */

static void copy_text(char *to, size_t room, const char *from) {
  size_t n = from ? strlen(from) : 0;
  if (n >= room) {
    n = room - 1;
    while (n > 0 && ((unsigned char)from[n] & 0xC0u) == 0x80u) --n; /* no half characters */
  }
  if (n > 0) memcpy(to, from, n);
  to[n] = 0;
}

static rmpc_status fault(rmpc_client *c, rmpc_status status, const char *format, ...) {
  char text[sizeof c->message];
  va_list args;
  va_start(args, format);
  vsnprintf(text, sizeof text, format, args);
  va_end(args);
  copy_text(c->message, sizeof c->message, text);
  copy_text(c->code, sizeof c->code,
            status == RMPC_USAGE || status == RMPC_MISSING ? "invalid_argument"
            : status == RMPC_TIMEOUT || status == RMPC_STOPPED ? "cancelled"
            : status == RMPC_PROTOCOL ? "unsupported"
            : status == RMPC_MEMORY ? "internal" : "io");
  c->where[0] = c->hint[0] = 0;
  return status;
}

static rmpc_status over(rmpc_client *c, rmpc_status status) {
  rmpc_close(c);
  return status;
}

static rmpc_status no_memory(rmpc_client *c) {
  return over(c, fault(c, RMPC_MEMORY, "There is no memory for the message; the connection is closed."));
}

const char *rmpc_message(const rmpc_client *c) { return c->message; }
const char *rmpc_code(const rmpc_client *c) { return c->code; }
const char *rmpc_where(const rmpc_client *c) { return c->where; }
const char *rmpc_hint(const rmpc_client *c) { return c->hint; }

/* Bytes of a stranger as a short text on one line. */
static void shown(char *to, size_t room, const char *from, size_t length) {
  size_t n = 0, i;
  for (i = 0; i < length && n + 5 < room && n < 60; ++i)
    to[n++] = (from[i] >= 32 && from[i] < 127) ? from[i] : '.';
  if (i < length) n += (size_t)snprintf(to + n, room - n, "...");
  to[n] = 0;
}

/* --- time and memory --- */

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Room for `need` bytes; 0 when there is none, and the block is as it was. */
static int grow(void **block, size_t *room, size_t need, size_t item) {
  size_t wanted = *room ? *room : 256;
  void *made;
  if (need <= *room) return 1;
  while (wanted < need) {
    if (wanted > SIZE_MAX / 2 / item) return 0;
    wanted *= 2;
  }
  made = realloc(*block, wanted * item);
  if (!made) return 0;
  *block = made;
  *room = wanted;
  return 1;
}

static int grow_text(char **text, size_t *room, size_t need) {
  void *block = *text;
  const int done = grow(&block, room, need, 1);
  *text = block;
  return done;
}

/* --- UTF-8, numbers, base64 --- */

/* Bytes of the character at s, of which `left` are there; 0 when it is none. */
static size_t utf8_length(const unsigned char *s, size_t left) {
  if (left == 0) return 0;
  if (s[0] < 0x80) return 1;
  if (s[0] >= 0xC2 && s[0] < 0xE0) return left > 1 && (s[1] & 0xC0) == 0x80 ? 2 : 0;
  if ((s[0] & 0xF0) == 0xE0) {
    if (left < 3 || (s[1] & 0xC0) != 0x80 || (s[2] & 0xC0) != 0x80) return 0;
    if (s[0] == 0xE0 && s[1] < 0xA0) return 0;
    if (s[0] == 0xED && s[1] >= 0xA0) return 0;
    return 3;
  }
  if (s[0] >= 0xF0 && s[0] < 0xF5) {
    if (left < 4 || (s[1] & 0xC0) != 0x80 || (s[2] & 0xC0) != 0x80 || (s[3] & 0xC0) != 0x80) return 0;
    if (s[0] == 0xF0 && s[1] < 0x90) return 0;
    if (s[0] == 0xF4 && s[1] >= 0x90) return 0;
    return 4;
  }
  return 0;
}

static size_t put_utf8(char *to, unsigned long u) {
  if (u < 0x80) {
    to[0] = (char)u;
    return 1;
  }
  if (u < 0x800) {
    to[0] = (char)(0xC0 | (u >> 6));
    to[1] = (char)(0x80 | (u & 0x3F));
    return 2;
  }
  if (u < 0x10000) {
    to[0] = (char)(0xE0 | (u >> 12));
    to[1] = (char)(0x80 | ((u >> 6) & 0x3F));
    to[2] = (char)(0x80 | (u & 0x3F));
    return 3;
  }
  to[0] = (char)(0xF0 | (u >> 18));
  to[1] = (char)(0x80 | ((u >> 12) & 0x3F));
  to[2] = (char)(0x80 | ((u >> 6) & 0x3F));
  to[3] = (char)(0x80 | (u & 0x3F));
  return 4;
}

/* A number of JSON, whatever the locale. */
static double read_double(const char *s, size_t length) {
  const char *point = localeconv()->decimal_point;
  const size_t point_length = strlen(point);
  char digits[LONGEST_NUMBER + 32];
  size_t n = 0, i;
  if (length > LONGEST_NUMBER) length = LONGEST_NUMBER;
  for (i = 0; i < length; ++i) {
    if (s[i] == '.' && n + point_length < sizeof digits - 1) {
      memcpy(digits + n, point, point_length);
      n += point_length;
    } else if (n < sizeof digits - 1) {
      digits[n++] = s[i];
    }
  }
  digits[n] = 0;
  return strtod(digits, NULL);
}

static int value_of_base64(char ch) {
  if (ch >= 'A' && ch <= 'Z') return ch - 'A';
  if (ch >= 'a' && ch <= 'z') return ch - 'a' + 26;
  if (ch >= '0' && ch <= '9') return ch - '0' + 52;
  if (ch == '+') return 62;
  return ch == '/' ? 63 : -1;
}

/* Bytes that a text of base64 stands for; NONE when it is none. */
static size_t base64_size(const char *s, size_t length) {
  size_t i, pad = 0;
  if (length % 4 != 0) return NONE;
  if (length == 0) return 0;
  if (s[length - 1] == '=') pad = s[length - 2] == '=' ? 2 : 1;
  for (i = 0; i + pad < length; ++i)
    if (value_of_base64(s[i]) < 0) return NONE;
  return length / 4 * 3 - pad;
}

/* Of what base64_size() has looked at. */
static void base64_read(const char *s, size_t length, unsigned char *out) {
  size_t i, n = 0;
  const size_t size = base64_size(s, length);
  for (i = 0; i < length; i += 4) {
    unsigned long bits = 0;
    size_t k;
    for (k = 0; k < 4; ++k) bits = bits << 6 | (unsigned long)(s[i + k] == '=' ? 0 : value_of_base64(s[i + k]));
    for (k = 0; k < 3 && n < size; ++k) out[n++] = (unsigned char)(bits >> (16 - 8 * k) & 0xFF);
  }
}

/* The double of 8 bytes, the least first. */
static double double_at(const unsigned char *b) {
  uint64_t bits = 0;
  double x;
  int k;
  for (k = 7; k >= 0; --k) bits = bits << 8 | b[k];
  memcpy(&x, &bits, sizeof x);
  return x;
}

/* --- the parser --- */

static node *add_node(rmpc_client *c, rmpc_type type, size_t start) {
  void *block = c->nodes;
  node *made;
  if (c->node_count >= RMPC_MOST_VALUES || !grow(&block, &c->node_room, c->node_count + 1, sizeof(node)))
    return NULL;
  c->nodes = block;
  made = &c->nodes[c->node_count++];
  made->type = type;
  made->start = start;
  made->length = 0;
  made->extent = 1;
  made->count = 0;
  return made;
}

static int hex4(const char *s, unsigned long *out) {
  int k;
  *out = 0;
  for (k = 0; k < 4; ++k) {
    const char ch = s[k];
    *out <<= 4;
    if (ch >= '0' && ch <= '9') *out |= (unsigned long)(ch - '0');
    else if (ch >= 'a' && ch <= 'f') *out |= (unsigned long)(ch - 'a' + 10);
    else if (ch >= 'A' && ch <= 'F') *out |= (unsigned long)(ch - 'A' + 10);
    else return 0;
  }
  return 1;
}

/* Reads the text behind the quote at *at in place, puts a 0 behind it; *at is then behind its end. */
static int read_string(char *s, size_t length, size_t *at, size_t *start, size_t *size) {
  size_t i = *at + 1, to = i;
  *start = i;
  while (i < length) {
    const unsigned char ch = (unsigned char)s[i];
    if (ch == '"') {
      s[to] = 0; /* at the quote or before it */
      *size = to - *start;
      *at = i + 1;
      return 1;
    }
    if (ch < 0x20) return 0;
    if (ch == '\\') {
      unsigned long u, low;
      if (i + 1 >= length) return 0;
      switch (s[i + 1]) {
        case '"': s[to++] = '"'; break;
        case '\\': s[to++] = '\\'; break;
        case '/': s[to++] = '/'; break;
        case 'b': s[to++] = '\b'; break;
        case 'f': s[to++] = '\f'; break;
        case 'n': s[to++] = '\n'; break;
        case 'r': s[to++] = '\r'; break;
        case 't': s[to++] = '\t'; break;
        case 'u':
          if (length - i < 6 || !hex4(s + i + 2, &u)) return 0;
          i += 4;
          if (u >= 0xD800 && u < 0xDC00 && length - i >= 8 && s[i + 2] == '\\' && s[i + 3] == 'u' &&
              hex4(s + i + 4, &low) && low >= 0xDC00 && low < 0xE000) {
            u = 0x10000 + ((u - 0xD800) << 10) + (low - 0xDC00);
            i += 6;
          }
          if (u == 0 || (u >= 0xD800 && u < 0xE000)) u = 0xFFFD; /* no character, or the end of a text */
          to += put_utf8(s + to, u);
          break;
        default: return 0;
      }
      i += 2;
      continue;
    }
    {
      const size_t n = utf8_length((const unsigned char *)s + i, length - i);
      if (n == 0) return 0;
      memmove(s + to, s + i, n);
      to += n;
      i += n;
    }
  }
  return 0;
}

static size_t digits_at(const char *s, size_t length, size_t i) {
  size_t n = 0;
  while (i + n < length && s[i + n] >= '0' && s[i + n] <= '9') ++n;
  return n;
}

/* Characters of the number at `at`; 0 when there is none. */
static size_t number_length(const char *s, size_t length, size_t at) {
  size_t i = at, n;
  if (i < length && s[i] == '-') ++i;
  n = digits_at(s, length, i);
  if (n == 0 || (n > 1 && s[i] == '0')) return 0;
  i += n;
  if (i < length && s[i] == '.') {
    n = digits_at(s, length, i + 1);
    if (n == 0) return 0;
    i += 1 + n;
  }
  if (i < length && (s[i] == 'e' || s[i] == 'E')) {
    ++i;
    if (i < length && (s[i] == '+' || s[i] == '-')) ++i;
    n = digits_at(s, length, i);
    if (n == 0) return 0;
    i += n;
  }
  return i - at <= LONGEST_NUMBER ? i - at : 0;
}

static size_t behind_blanks(const char *s, size_t length, size_t i) {
  while (i < length && (s[i] == ' ' || s[i] == '\t' || s[i] == '\r' || s[i] == '\n')) ++i;
  return i;
}

/* Reads the line into nodes, texts in place. NULL, or what it is: "is not JSON". */
static const char *parse(rmpc_client *c, char *s, size_t length) {
  static const char *const kNot = "is not JSON";
  size_t stack[RMPC_DEEPEST]; /* nodes of lists and tables that are open */
  size_t depth = 0, i = 0;
  int wants_value = 1, may_end = 0; /* a value must come; the list or table may end here at once */
  c->node_count = 0;
  c->root = NONE;
  c->text = s;
  for (;;) {
    i = behind_blanks(s, length, i);
    if (wants_value) {
      const int in_table = depth > 0 && c->nodes[stack[depth - 1]].type == RMPC_TABLE;
      size_t start, size;
      node *made;
      if (i >= length) return kNot;
      if (may_end && s[i] == (in_table ? '}' : ']')) {
        wants_value = may_end = 0;
        continue;
      }
      may_end = 0;
      if (in_table) {
        if (s[i] != '"' || !read_string(s, length, &i, &start, &size)) return kNot;
        made = add_node(c, RMPC_TEXT, start);
        if (!made) return "has too many values";
        made->length = size;
        i = behind_blanks(s, length, i);
        if (i >= length || s[i] != ':') return kNot;
        i = behind_blanks(s, length, i + 1);
        if (i >= length) return kNot;
      }
      if (depth > 0) ++c->nodes[stack[depth - 1]].count;
      made = add_node(c, RMPC_NULL, i);
      if (!made) return "has too many values";
      wants_value = 0;
      if (s[i] == '{' || s[i] == '[') {
        if (depth >= RMPC_DEEPEST) return "is nested too deeply";
        made->type = s[i] == '{' ? RMPC_TABLE : RMPC_LIST;
        stack[depth++] = c->node_count - 1;
        ++i;
        wants_value = may_end = 1;
        continue;
      }
      if (s[i] == '"') {
        if (!read_string(s, length, &i, &start, &size)) return kNot;
        made->type = RMPC_TEXT;
        made->start = start;
        made->length = size;
      } else if (length - i >= 4 && memcmp(s + i, "true", 4) == 0) {
        made->type = RMPC_FLAG;
        made->length = 4;
        i += 4;
      } else if (length - i >= 5 && memcmp(s + i, "false", 5) == 0) {
        made->type = RMPC_FLAG;
        made->length = 5;
        i += 5;
      } else if (length - i >= 4 && memcmp(s + i, "null", 4) == 0) {
        i += 4;
      } else {
        made->type = RMPC_NUMBER;
        made->length = number_length(s, length, i);
        if (made->length == 0) return kNot;
        i += made->length;
      }
      continue;
    }
    if (depth == 0) return i >= length ? NULL : kNot;
    if (i >= length) return kNot;
    {
      node *open = &c->nodes[stack[depth - 1]];
      const char end = open->type == RMPC_TABLE ? '}' : ']';
      if (s[i] == end) {
        open->extent = c->node_count - stack[depth - 1];
        --depth;
      } else if (s[i] == ',') {
        wants_value = 1;
      } else {
        return kNot;
      }
      ++i;
    }
  }
}

/* --- values by path --- */

static int is_text(const rmpc_client *c, size_t n, const char *word, size_t length) {
  const node *x = &c->nodes[n];
  return x->type == RMPC_TEXT && x->length == length && memcmp(c->text + x->start, word, length) == 0;
}

/* The value of a key; NONE without one. */
static size_t member(const rmpc_client *c, size_t table, const char *key, size_t length) {
  size_t at, i;
  if (table == NONE || c->nodes[table].type != RMPC_TABLE) return NONE;
  for (at = table + 1, i = 0; i < c->nodes[table].count; ++i) {
    if (is_text(c, at, key, length)) return at + 1;
    at += 1 + c->nodes[at + 1].extent;
  }
  return NONE;
}

static size_t field(const rmpc_client *c, size_t table, const char *key) {
  return member(c, table, key, strlen(key));
}

static size_t item(const rmpc_client *c, size_t list, size_t index) {
  size_t at;
  if (list == NONE || c->nodes[list].type != RMPC_LIST || index >= c->nodes[list].count) return NONE;
  for (at = list + 1; index > 0; --index) at += c->nodes[at].extent;
  return at;
}

static size_t find(const rmpc_client *c, const char *path) {
  size_t at = c->root;
  const char *p = path ? path : "";
  if (at == NONE || c->node_count == 0) return NONE;
  while (*p && at != NONE) {
    if (*p == '[' && p[1] == '\'') {
      const char *end = strstr(p + 2, "']");
      if (!end) return NONE;
      at = member(c, at, p + 2, (size_t)(end - p - 2));
      p = end + 2;
    } else if (*p == '[') {
      size_t index = 0, n = 0;
      for (++p; *p >= '0' && *p <= '9' && n < 9; ++p, ++n) index = 10 * index + (size_t)(*p - '0');
      if (n == 0 || *p != ']') return NONE;
      ++p;
      at = item(c, at, index);
    } else {
      const size_t n = strcspn(p, ".[");
      if (n == 0) return NONE;
      at = member(c, at, p, n);
      p += n;
    }
    if (*p == '.') {
      ++p;
      if (*p == 0) return NONE;
    }
  }
  return at;
}

static rmpc_status missing(rmpc_client *c, const char *path, const char *what) {
  if (!path || !*path) return fault(c, RMPC_MISSING, "The answer is not %s.", what);
  return fault(c, RMPC_MISSING, "The answer has no %s that is %s.", path, what);
}

/* Bytes and shape of {"$array": {"shape": ..., "base64": ...}}; the text's node, or NONE. */
static size_t packed_array(const rmpc_client *c, size_t at, size_t *rows, size_t *columns) {
  size_t inner, shape, text, size, k;
  size_t sizes[2] = {0, 1};
  if (at == NONE || c->nodes[at].type != RMPC_TABLE || c->nodes[at].count != 1) return NONE;
  inner = field(c, at, "$array");
  shape = field(c, inner, "shape");
  text = field(c, inner, "base64");
  if (shape == NONE || text == NONE || c->nodes[shape].type != RMPC_LIST || c->nodes[text].type != RMPC_TEXT ||
      c->nodes[shape].count < 1 || c->nodes[shape].count > 2)
    return NONE;
  for (k = 0; k < c->nodes[shape].count; ++k) {
    const size_t n = item(c, shape, k);
    const double x = c->nodes[n].type == RMPC_NUMBER ? read_double(c->text + c->nodes[n].start, c->nodes[n].length) : -1;
    if (!(x >= 0 && x < 1e9) || x != (double)(size_t)x) return NONE;
    sizes[k] = (size_t)x;
  }
  size = base64_size(c->text + c->nodes[text].start, c->nodes[text].length);
  if (size == NONE || size % 8 != 0 || (sizes[1] == 0 && size != 0)) return NONE;
  if (sizes[1] != 0 && (size / 8 / sizes[1] != sizes[0] || size / 8 % sizes[1] != 0)) return NONE;
  *rows = sizes[0];
  *columns = sizes[1];
  return text;
}

rmpc_type rmpc_type_of(const rmpc_client *c, const char *path) {
  const size_t at = find(c, path);
  size_t rows, columns;
  if (at == NONE) return RMPC_NONE;
  if (packed_array(c, at, &rows, &columns) != NONE) return RMPC_LIST;
  return c->nodes[at].type;
}

size_t rmpc_count(const rmpc_client *c, const char *path) {
  const size_t at = find(c, path);
  size_t rows, columns;
  if (at == NONE) return 0;
  if (packed_array(c, at, &rows, &columns) != NONE) return rows;
  return c->nodes[at].count;
}

static int number_of(const rmpc_client *c, size_t at, double *out) {
  if (at == NONE) return 0;
  if (c->nodes[at].type == RMPC_NUMBER) {
    *out = read_double(c->text + c->nodes[at].start, c->nodes[at].length);
    return 1;
  }
  if (is_text(c, at, "inf", 3)) *out = (double)INFINITY;
  else if (is_text(c, at, "-inf", 4)) *out = -(double)INFINITY;
  else if (is_text(c, at, "nan", 3)) *out = (double)NAN;
  else return 0;
  return 1;
}

rmpc_status rmpc_get_number(rmpc_client *c, const char *path, double *out) {
  return number_of(c, find(c, path), out) ? RMPC_OK : missing(c, path, "a number");
}

rmpc_status rmpc_get_integer(rmpc_client *c, const char *path, long long *out) {
  const size_t at = find(c, path);
  char digits[32], *end;
  if (at == NONE || c->nodes[at].type != RMPC_NUMBER || c->nodes[at].length >= sizeof digits)
    return missing(c, path, "a whole number");
  memcpy(digits, c->text + c->nodes[at].start, c->nodes[at].length);
  digits[c->nodes[at].length] = 0;
  errno = 0;
  *out = strtoll(digits, &end, 10);
  if (*end || errno) return missing(c, path, "a whole number");
  return RMPC_OK;
}

rmpc_status rmpc_get_flag(rmpc_client *c, const char *path, int *out) {
  const size_t at = find(c, path);
  if (at == NONE || c->nodes[at].type != RMPC_FLAG) return missing(c, path, "true or false");
  *out = c->nodes[at].length == 4;
  return RMPC_OK;
}

rmpc_status rmpc_get_text(rmpc_client *c, const char *path, const char **out) {
  const size_t at = find(c, path);
  if (at == NONE || c->nodes[at].type != RMPC_TEXT) return missing(c, path, "a text");
  *out = c->text + c->nodes[at].start;
  return RMPC_OK;
}

rmpc_status rmpc_get_key(rmpc_client *c, const char *path, size_t i, const char **out) {
  size_t at = find(c, path);
  if (at == NONE || c->nodes[at].type != RMPC_TABLE || i >= c->nodes[at].count)
    return missing(c, path, "a table with so many entries");
  for (++at; i > 0; --i) at += 1 + c->nodes[at + 1].extent;
  *out = c->text + c->nodes[at].start;
  return RMPC_OK;
}

/* Rows and columns of a list of numbers or of rows; 0 when it is none. */
static int list_shape(const rmpc_client *c, size_t at, size_t *rows, size_t *columns) {
  size_t row, i, k;
  double x;
  if (at == NONE || c->nodes[at].type != RMPC_LIST) return 0;
  *rows = c->nodes[at].count;
  *columns = 1;
  if (*rows > 0 && c->nodes[at + 1].type == RMPC_LIST) *columns = c->nodes[at + 1].count;
  for (row = at + 1, i = 0; i < *rows; ++i, row += c->nodes[row].extent) {
    if (c->nodes[at + 1].type != RMPC_LIST) {
      if (!number_of(c, row, &x)) return 0;
      continue;
    }
    if (c->nodes[row].type != RMPC_LIST || c->nodes[row].count != *columns) return 0;
    for (k = 1; k <= *columns; ++k)
      if (c->nodes[row + k].type == RMPC_LIST || c->nodes[row + k].type == RMPC_TABLE || !number_of(c, row + k, &x))
        return 0;
  }
  return 1;
}

rmpc_status rmpc_get_shape(rmpc_client *c, const char *path, size_t *rows, size_t *columns) {
  const size_t at = find(c, path);
  if (packed_array(c, at, rows, columns) != NONE || list_shape(c, at, rows, columns)) return RMPC_OK;
  return missing(c, path, "a list or matrix of numbers");
}

rmpc_status rmpc_get_numbers(rmpc_client *c, const char *path, double *out, size_t most, size_t *count) {
  const size_t at = find(c, path);
  size_t rows, columns, i, text = packed_array(c, at, &rows, &columns);
  if (text == NONE && !list_shape(c, at, &rows, &columns)) return missing(c, path, "a list or matrix of numbers");
  *count = rows * columns;
  if (*count > most)
    return fault(c, RMPC_USAGE, "%s has %lu numbers, and there is room for %lu.", path && *path ? path : "The answer",
                 (unsigned long)*count, (unsigned long)most);
  if (text != NONE) {
    const char *s = c->text + c->nodes[text].start;
    for (i = 0; i < *count; ++i) { /* 8 bytes lie within at most 4 groups of 3 */
      unsigned char part[12];
      const size_t group = i * 8 / 3, left = c->nodes[text].length - 4 * group;
      base64_read(s + 4 * group, left < 16 ? left : 16, part);
      out[i] = double_at(part + (i * 8 - 3 * group));
    }
    return RMPC_OK;
  }
  {
    size_t n = at + 1;
    for (i = 0; i < *count; ++n)
      if (c->nodes[n].type != RMPC_LIST) number_of(c, n, &out[i++]);
  }
  return RMPC_OK;
}

static int handle_of(const rmpc_client *c, size_t at, rmpc_handle *out) {
  const size_t inner = field(c, at, "$handle");
  const size_t kind = field(c, inner, "kind"), number = field(c, inner, "number"), name = field(c, inner, "name");
  double x;
  if (kind == NONE || number == NONE || c->nodes[kind].type != RMPC_TEXT ||
      c->nodes[kind].length >= sizeof out->kind || c->nodes[number].type != RMPC_NUMBER)
    return 0;
  number_of(c, number, &x);
  if (!(x >= 0 && x < 9e15)) return 0;
  copy_text(out->kind, sizeof out->kind, c->text + c->nodes[kind].start);
  out->number = (long long)x;
  out->name[0] = 0;
  if (name != NONE && c->nodes[name].type == RMPC_TEXT && c->nodes[name].length < sizeof out->name)
    copy_text(out->name, sizeof out->name, c->text + c->nodes[name].start);
  return 1;
}

rmpc_status rmpc_get_handle(rmpc_client *c, const char *path, rmpc_handle *out) {
  return handle_of(c, find(c, path), out) ? RMPC_OK : missing(c, path, "a handle");
}

rmpc_status rmpc_get_bytes(rmpc_client *c, const char *path, unsigned char *out, size_t most, size_t *count) {
  const size_t at = find(c, path);
  const size_t size = at != NONE && c->nodes[at].type == RMPC_TEXT
                          ? base64_size(c->text + c->nodes[at].start, c->nodes[at].length)
                          : NONE;
  if (size == NONE) return missing(c, path, "base64");
  *count = size;
  if (size > most)
    return fault(c, RMPC_USAGE, "%s has %lu bytes, and there is room for %lu.", path && *path ? path : "The answer",
                 (unsigned long)size, (unsigned long)most);
  base64_read(c->text + c->nodes[at].start, c->nodes[at].length, out);
  return RMPC_OK;
}

/* --- the connection --- */

rmpc_client *rmpc_new(void) {
  rmpc_client *c = calloc(1, sizeof *c);
  if (!c) return NULL;
  c->fd = -1;
  c->timeout = 30;
  c->root = NONE;
  return c;
}

static void drop_events(rmpc_client *c) {
  event *e = c->first;
  while (e) {
    event *next = e->next;
    free(e);
    e = next;
  }
  c->first = c->last = NULL;
  c->event_bytes = 0;
}

/* --- TLS by OpenSSL, where it is wanted --- */

rmpc_status rmpc_set_tls(rmpc_client *c, const char *trusted) {
#ifdef ROBOMOSP_TLS
  c->wants_tls = trusted != NULL;
  if (trusted && strlen(trusted) >= sizeof c->trusted)
    return fault(c, RMPC_USAGE, "The path of the certificate is too long.");
  copy_text(c->trusted, sizeof c->trusted, trusted ? trusted : "");
  return RMPC_OK;
#else
  if (!trusted) return RMPC_OK;
  return fault(c, RMPC_USAGE, "This client was compiled without TLS. Compile it with -DROBOMOSP_TLS and link "
                              "libssl and libcrypto, or use a tunnel.");
#endif
}

#ifdef ROBOMOSP_TLS
static const char *tls_reason(void) {
  const unsigned long code = ERR_get_error();
  const char *text = code ? ERR_reason_error_string(code) : NULL;
  ERR_clear_error();
  return text ? text : "the connection was closed";
}

/* Sends what is encrypted, as far as it is taken: 1 = all, 0 = not yet, -1 = an error. By send() and not by
 * OpenSSL, which would raise SIGPIPE. */
static int tls_flush(rmpc_client *c) {
  for (;;) {
    ssize_t n;
    if (c->cipher_sent == c->cipher_used) {
      const int taken = BIO_read(SSL_get_wbio(c->tls), c->cipher, (int)sizeof c->cipher);
      c->cipher_sent = 0;
      c->cipher_used = taken > 0 ? (size_t)taken : 0;
      if (taken <= 0) return 1;
    }
    n = send(c->fd, c->cipher + c->cipher_sent, c->cipher_used - c->cipher_sent, MSG_NOSIGNAL);
    if (n > 0) c->cipher_sent += (size_t)n;
    else if (n < 0 && errno == EINTR) continue;
    else return n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK) ? 0 : -1;
  }
}

/* Takes in what the network has: > 0 = something, 0 = its end, -1 as recv(). */
static ssize_t tls_feed(rmpc_client *c) {
  char raw[16384];
  const ssize_t n = recv(c->fd, raw, sizeof raw, 0);
  if (n > 0 && BIO_write(SSL_get_rbio(c->tls), raw, (int)n) != (int)n) {
    errno = ENOMEM;
    return -1;
  }
  return n;
}

static void tls_end(rmpc_client *c) {
  if (c->tls && c->fd >= 0 && SSL_is_init_finished(c->tls)) {
    SSL_shutdown(c->tls);
    tls_flush(c);
  }
  SSL_free(c->tls);
  SSL_CTX_free(c->tls_context);
  c->tls = NULL;
  c->tls_context = NULL;
  c->cipher_used = c->cipher_sent = 0;
  ERR_clear_error();
}

/* Whether the server shows one of the trusted certificates itself, whatever its name. */
static int tls_is_pinned(const rmpc_client *c) {
  X509 *shown_one = SSL_get_peer_certificate(c->tls), *one;
  BIO *file = c->trusted[0] ? BIO_new_file(c->trusted, "r") : NULL;
  int found = 0;
  while (file && shown_one && !found && (one = PEM_read_bio_X509(file, NULL, NULL, NULL))) {
    found = X509_cmp(shown_one, one) == 0;
    X509_free(one);
  }
  BIO_free(file);
  X509_free(shown_one);
  ERR_clear_error();
  return found;
}

static rmpc_status wait_for(rmpc_client *c, short what, double until, short *got, int heeds_stop);

/* Begins TLS on the socket that is connected. */
static rmpc_status tls_begin(rmpc_client *c, const char *host) {
  const double until = c->timeout > 0 ? now() + c->timeout : 0;
  BIO *in, *out;
  long trust;
  c->tls_context = SSL_CTX_new(TLS_client_method());
  if (!c->tls_context || !SSL_CTX_set_min_proto_version(c->tls_context, TLS1_2_VERSION)) return no_memory(c);
#ifdef SSL_OP_IGNORE_UNEXPECTED_EOF
  SSL_CTX_set_options(c->tls_context, SSL_OP_IGNORE_UNEXPECTED_EOF);
#endif
  SSL_CTX_set_verify(c->tls_context, SSL_VERIFY_NONE, NULL); /* looked at below, before anything is sent */
  if (c->trusted[0] ? !SSL_CTX_load_verify_locations(c->tls_context, c->trusted, NULL)
                    : !SSL_CTX_set_default_verify_paths(c->tls_context))
    return over(c, fault(c, RMPC_USAGE, "%s cannot be read as certificates: %s.", c->trusted, tls_reason()));
  c->tls = SSL_new(c->tls_context);
  in = BIO_new(BIO_s_mem());
  out = BIO_new(BIO_s_mem());
  if (!c->tls || !in || !out) {
    BIO_free(in);
    BIO_free(out);
    return no_memory(c);
  }
  SSL_set_bio(c->tls, in, out);
  SSL_set_connect_state(c->tls);
  if (!X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(c->tls), host)) {
    SSL_set_tlsext_host_name(c->tls, host);
    SSL_set1_host(c->tls, host);
  }
  for (;;) {
    const int done = (ERR_clear_error(), SSL_do_handshake(c->tls));
    const int why = SSL_get_error(c->tls, done);
    short got = 0;
    rmpc_status waited;
    ssize_t n;
    int sent = tls_flush(c);
    if (done == 1 && sent != 0) break;
    if ((done != 1 && why != SSL_ERROR_WANT_READ && why != SSL_ERROR_WANT_WRITE) || sent < 0)
      return over(c, fault(c, RMPC_PROTOCOL, "%s does not speak TLS: %s. Connect without TLS if it serves without.",
                           c->peer, tls_reason()));
    waited = wait_for(c, (short)(sent ? POLLIN : POLLIN | POLLOUT), until, &got, 1);
    if (waited) return over(c, fault(c, waited, "%s did not begin TLS within %g s.", c->peer, c->timeout));
    if (!(got & (POLLIN | POLLERR | POLLHUP))) continue;
    n = tls_feed(c);
    if (n == 0 || (n < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR))
      return over(c, fault(c, RMPC_PROTOCOL, "%s does not speak TLS: it closed the connection. Connect without TLS "
                                             "if it serves without.", c->peer));
  }
  trust = SSL_get_verify_result(c->tls);
  if (trust != X509_V_OK && !tls_is_pinned(c))
    return over(c, fault(c, RMPC_LOST, "%s is not trusted: %s. Give the server's certificate to rmpc_set_tls().",
                         c->peer, X509_verify_cert_error_string(trust)));
  return RMPC_OK;
}
#endif

/* As recv() and send(). */
static ssize_t take_bytes(rmpc_client *c, char *to, size_t most) {
#ifdef ROBOMOSP_TLS
  while (c->tls) {
    const int n = (ERR_clear_error(), SSL_read(c->tls, to, (int)most));
    ssize_t more;
    if (n > 0) return n;
    if (SSL_get_error(c->tls, n) == SSL_ERROR_ZERO_RETURN) return 0;
    if (SSL_get_error(c->tls, n) != SSL_ERROR_WANT_READ) {
      errno = EPROTO;
      return -1;
    }
    tls_flush(c);
    more = tls_feed(c);
    if (more <= 0) return more;
  }
#endif
  return recv(c->fd, to, most, 0);
}

static ssize_t give_bytes(rmpc_client *c, const char *from, size_t count) {
#ifdef ROBOMOSP_TLS
  if (c->tls) {
    const int flushed = tls_flush(c);
    int n;
    if (flushed < 0) return -1;
    if (flushed == 0 || count == 0) {
      errno = EAGAIN;
      return flushed ? 0 : -1;
    }
    n = (ERR_clear_error(), SSL_write(c->tls, from, count > 16384 ? 16384 : (int)count));
    if (n <= 0) {
      errno = EPROTO;
      return -1;
    }
    tls_flush(c);
    return n;
  }
#endif
  return send(c->fd, from, count, MSG_NOSIGNAL);
}

static int has_tls(const rmpc_client *c) {
#ifdef ROBOMOSP_TLS
  return c->tls != NULL;
#else
  (void)c;
  return 0;
#endif
}

/* Whether bytes wait that were taken by give_bytes(). */
static int is_giving(rmpc_client *c) {
#ifdef ROBOMOSP_TLS
  return c->tls && (c->cipher_sent < c->cipher_used || BIO_ctrl_pending(SSL_get_wbio(c->tls)) > 0);
#else
  (void)c;
  return 0;
#endif
}

void rmpc_close(rmpc_client *c) {
#ifdef ROBOMOSP_TLS
  tls_end(c);
#endif
  if (c->fd >= 0) close(c->fd);
  c->fd = -1;
  c->in_used = c->in_line = c->in_scanned = 0;
  c->node_count = 0;
  c->root = NONE;
  drop_events(c);
  if (c->child > 0) {
    const double began = now();
    int sent = 0, status;
    for (;;) {
      const struct timespec nap = {0, 5000000};
      const pid_t done = waitpid(c->child, &status, WNOHANG);
      if (done == c->child || (done < 0 && errno != EINTR)) break;
      if (sent == 0 && now() - began > 3) {
        kill(c->child, SIGTERM);
        sent = 1;
      } else if (sent == 1 && now() - began > 6) {
        kill(c->child, SIGKILL);
        sent = 2;
      }
      nanosleep(&nap, NULL);
    }
    c->child = 0;
  }
}

void rmpc_free(rmpc_client *c) {
  if (!c) return;
  rmpc_close(c);
  free(c->current);
  free(c->in);
  free(c->out);
  free(c->nodes);
  free(c);
}

int rmpc_is_open(const rmpc_client *c) { return c->fd >= 0; }
void rmpc_set_timeout(rmpc_client *c, double seconds) { c->timeout = seconds > 0 ? seconds : 0; }
void rmpc_set_stop(rmpc_client *c, const volatile sig_atomic_t *flag) { c->stop = flag; }

/* Waits for the socket; RMPC_OK, RMPC_TIMEOUT or RMPC_STOPPED without words. until = 0: no end. */
static rmpc_status wait_for(rmpc_client *c, short what, double until, short *got, int heeds_stop) {
  for (;;) {
    struct pollfd p;
    double left = 3600;
    int n;
    if (heeds_stop && c->stop && *c->stop) return RMPC_STOPPED;
    if (until > 0) {
      left = until - now();
      if (left < 0) left = 0;
    }
    if (left > 3600) left = 3600;
    p.fd = c->fd;
    p.events = what;
    p.revents = 0;
    n = poll(&p, 1, heeds_stop && c->stop && left > 0.05 ? 50 : (int)(left * 1000 + 0.999));
    if (n > 0) {
      *got = p.revents;
      return RMPC_OK;
    }
    if (n < 0 && errno != EINTR) {
      *got = POLLERR;
      return RMPC_OK;
    }
    if (until > 0 && now() >= until) return RMPC_TIMEOUT;
  }
}

/* Why there is nothing more to read. */
static rmpc_status ended(rmpc_client *c) {
  const size_t rest = c->in_used - c->in_line;
  char said[80];
  shown(said, sizeof said, c->in ? c->in + c->in_line : "", rest);
  if (c->closing[0])
    return over(c, fault(c, RMPC_LOST, "%s closed the connection: %s", c->peer, c->closing));
  if (rest > 0 && !c->has_spoken)
    return over(c, fault(c, RMPC_PROTOCOL, "%s is not a ROBOMOSP server: it answered \"%s\".", c->peer, said));
  if (rest > 0)
    return over(c, fault(c, RMPC_LOST,
                         "%s closed the connection in the middle of an answer, of which %lu bytes came.", c->peer,
                         (unsigned long)rest));
  if (!c->has_spoken)
    return over(c, fault(c, RMPC_LOST, "%s closed the connection without an answer. Is it a ROBOMOSP server?", c->peer));
  return over(c, fault(c, RMPC_LOST, "%s closed the connection.", c->peer));
}

/* Takes in what is there. */
static rmpc_status receive(rmpc_client *c) {
  ssize_t n;
  do {
    if (c->in_used - c->in_line >= RMPC_LONGEST_ANSWER)
      return over(c, fault(c, RMPC_PROTOCOL, "%s sent an answer of more than %u MiB.", c->peer,
                           RMPC_LONGEST_ANSWER >> 20));
    if (!grow_text(&c->in, &c->in_room, c->in_used + 65536)) return no_memory(c);
    n = take_bytes(c, c->in + c->in_used, 65536);
    if (n > 0) c->in_used += (size_t)n;
    else if (n == 0 || (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR)) return ended(c);
  } while (n > 0 && has_tls(c)); /* poll() does not see what is decrypted already */
  return RMPC_OK;
}

/* Sends the request. What comes meanwhile is taken in, so that neither end waits for the other. */
static rmpc_status send_all(rmpc_client *c, const char *text, size_t length, double until) {
  size_t done = 0;
  while (done < length || is_giving(c)) {
    short got = 0;
    const rmpc_status waited = wait_for(c, POLLIN | POLLOUT, until, &got, 0);
    if (waited == RMPC_TIMEOUT)
      return over(c, fault(c, RMPC_TIMEOUT, "%s did not take the request in time; the connection is closed.", c->peer));
    if (got & POLLOUT) {
      const ssize_t n = give_bytes(c, text + done, length - done);
      if (n > 0) done += (size_t)n;
      else if (n < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) got |= POLLIN;
    }
    if (got & (POLLIN | POLLERR | POLLHUP)) {
      const rmpc_status status = receive(c);
      if (status) return status;
    }
  }
  return RMPC_OK;
}

static void keep_event(rmpc_client *c, const char *line, size_t length) {
  event *e;
  if (length > RMPC_EVENT_BYTES || !(e = malloc(sizeof *e + length + 1))) {
    ++c->left_out;
    return;
  }
  memcpy(e->text, line, length);
  e->text[length] = 0;
  e->length = length;
  e->next = NULL;
  if (c->last) c->last->next = e;
  else c->first = e;
  c->last = e;
  c->event_bytes += length + sizeof *e;
  while (c->event_bytes > RMPC_EVENT_BYTES && c->first != c->last) {
    event *old = c->first;
    c->first = old->next;
    c->event_bytes -= old->length + sizeof *old;
    free(old);
    ++c->left_out;
  }
}

static int has_word(const char *s, size_t length, const char *word) {
  const size_t n = strlen(word);
  const char *p = s;
  while ((size_t)(s + length - p) >= n && (p = memchr(p, word[0], (size_t)(s + length - p) - n + 1)) != NULL) {
    if (memcmp(p, word, n) == 0) return 1;
    ++p;
  }
  return 0;
}

static rmpc_status malformed(rmpc_client *c, const char *said, const char *why) {
  if (!c->has_spoken && strcmp(why, "is not JSON") == 0)
    return over(c, fault(c, RMPC_PROTOCOL, "%s is not a ROBOMOSP server: it answered \"%s\".", c->peer, said));
  return over(c, fault(c, RMPC_PROTOCOL, "%s sent an answer that %s: \"%s\".", c->peer, why, said));
}

/* Looks for a whole line; RMPC_OK with *length, or RMPC_TIMEOUT when there is none yet. */
static rmpc_status next_line(rmpc_client *c, char **line, size_t *length) {
  char *end;
  if (c->in_line > 0) { /* the one before is over */
    memmove(c->in, c->in + c->in_line, c->in_used - c->in_line);
    c->in_used -= c->in_line;
    c->in_line = 0;
    c->in_scanned = 0;
    c->root = NONE;
    c->node_count = 0;
  }
  end = c->in_used > c->in_scanned ? memchr(c->in + c->in_scanned, '\n', c->in_used - c->in_scanned) : NULL;
  c->in_scanned = c->in_used;
  if (!end) return RMPC_TIMEOUT;
  *line = c->in;
  *length = (size_t)(end - c->in);
  c->in_line = *length + 1;
  return RMPC_OK;
}

/* Reads one line that has come. *is_answer: it answers `id`; else it was kept or is of no interest. */
static rmpc_status take_line(rmpc_client *c, char *line, size_t length, long long id, int *is_answer) {
  char said[80], method_said[32];
  size_t method, of, error, result;
  const char *why;
  double x = -1;
  int is_notice;
  *is_answer = 0;
  if (behind_blanks(line, length, 0) == length) return RMPC_OK;
  shown(said, sizeof said, line, length);
  is_notice = length <= RMPC_EVENT_BYTES && has_word(line, length, "\"method\"");
  if (is_notice) keep_event(c, line, length); /* before texts are read in place */
  why = parse(c, line, length);
  if (why) return malformed(c, said, why);
  method = field(c, 0, "method");
  if (is_notice && (method == NONE || field(c, 0, "id") != NONE || c->nodes[method].type != RMPC_TEXT)) {
    event **at = &c->first, *before = NULL; /* it was none: take it back */
    while (*at && *at != c->last) {
      before = *at;
      at = &(*at)->next;
    }
    if (*at && (*at)->length == length) {
      c->event_bytes -= (*at)->length + sizeof **at;
      free(*at);
      *at = NULL;
      c->last = before;
    }
  }
  if (c->nodes[0].type != RMPC_TABLE) return malformed(c, said, "is no answer");
  if (method != NONE) {
    if (field(c, 0, "id") != NONE)
      return over(c, fault(c, RMPC_PROTOCOL, "%s is not a ROBOMOSP server: it sends requests itself.", c->peer));
    if (c->nodes[method].type == RMPC_TEXT) {
      copy_text(method_said, sizeof method_said, c->text + c->nodes[method].start);
      if (strcmp(method_said, "server.closing") == 0) {
        const size_t reason = field(c, field(c, 0, "params"), "reason");
        if (reason != NONE && c->nodes[reason].type == RMPC_TEXT)
          copy_text(c->closing, sizeof c->closing, c->text + c->nodes[reason].start);
      }
    }
    c->has_spoken = 1;
    return RMPC_OK;
  }
  of = field(c, 0, "id");
  error = field(c, 0, "error");
  result = field(c, 0, "result");
  if ((error == NONE) == (result == NONE) || (error != NONE && c->nodes[error].type != RMPC_TABLE))
    return malformed(c, said, "is no answer");
  c->has_spoken = 1;
  if (of != NONE && c->nodes[of].type == RMPC_NUMBER) {
    number_of(c, of, &x);
    if (x != (double)id) return RMPC_OK; /* of a request that nobody waits for any more */
  } else if (error == NONE) {
    return malformed(c, said, "is no answer");
  }
  *is_answer = 1;
  if (error != NONE) {
    const size_t words = field(c, error, "message"), data = field(c, error, "data");
    const char *texts[3] = {"code", "where", "hint"};
    char *places[3];
    const size_t rooms[3] = {sizeof c->code, sizeof c->where, sizeof c->hint};
    size_t k;
    fault(c, RMPC_REFUSED, "The program gave an error without words.");
    copy_text(c->code, sizeof c->code, "internal");
    places[0] = c->code;
    places[1] = c->where;
    places[2] = c->hint;
    if (words != NONE && c->nodes[words].type == RMPC_TEXT)
      copy_text(c->message, sizeof c->message, c->text + c->nodes[words].start);
    for (k = 0; k < 3; ++k) {
      const size_t n = field(c, data, texts[k]);
      if (n != NONE && c->nodes[n].type == RMPC_TEXT) copy_text(places[k], rooms[k], c->text + c->nodes[n].start);
    }
    if (data == NONE) {
      double number = 0;
      number_of(c, field(c, error, "code"), &number);
      copy_text(c->code, sizeof c->code, number == -32601 ? "unknown_name" : number == -32602 ? "invalid_argument" : "usage");
    }
    c->root = NONE;
    return RMPC_REFUSED;
  }
  c->root = result;
  return RMPC_OK;
}

/* Waits for the answer to `id`. */
static rmpc_status wait_answer(rmpc_client *c, long long id, double until, int heeds_stop) {
  for (;;) {
    char *line = NULL;
    size_t length = 0;
    short got = 0;
    rmpc_status status = next_line(c, &line, &length);
    if (status == RMPC_OK) {
      int is_answer = 0;
      status = take_line(c, line, length, id, &is_answer);
      if (status || is_answer) return status;
      continue;
    }
    status = wait_for(c, POLLIN, until, &got, heeds_stop);
    if (status) return status;
    status = receive(c);
    if (status) return status;
  }
}

/* --- requests --- */

static int is_out(rmpc_client *c, size_t more) {
  if (c->out_fault) return 0;
  if (more > (size_t)2 * RMPC_LONGEST_REQUEST || !grow_text(&c->out, &c->out_room, c->out_used + more + 64)) {
    c->out_fault = RMPC_MEMORY;
    return 0;
  }
  return 1;
}

static void out_bytes(rmpc_client *c, const char *s, size_t length) {
  if (!is_out(c, length)) return;
  if (length > 0) memcpy(c->out + c->out_used, s, length);
  c->out_used += length;
}

static void out_word(rmpc_client *c, const char *s) { out_bytes(c, s, strlen(s)); }

static void out_text(rmpc_client *c, const char *s) {
  size_t left = s ? strlen(s) : 0;
  out_bytes(c, "\"", 1);
  while (left > 0 && !c->out_fault) {
    const size_t n = utf8_length((const unsigned char *)s, left);
    if (n == 0) {
      c->out_fault = RMPC_USAGE;
      return;
    }
    if (n == 1 && (*s == '"' || *s == '\\')) {
      out_bytes(c, "\\", 1);
      out_bytes(c, s, 1);
    } else if (n == 1 && (unsigned char)*s < 0x20) {
      char escaped[8];
      snprintf(escaped, sizeof escaped, "\\u%04x", (unsigned)(unsigned char)*s);
      out_word(c, escaped);
    } else {
      out_bytes(c, s, n);
    }
    s += n;
    left -= n;
  }
  out_bytes(c, "\"", 1);
}

static void out_number(rmpc_client *c, double x) {
  char digits[64];
  const char *point = localeconv()->decimal_point;
  char *at;
  if (isnan(x)) {
    out_word(c, "\"nan\"");
    return;
  }
  if (isinf(x)) {
    out_word(c, x > 0 ? "\"inf\"" : "\"-inf\"");
    return;
  }
  snprintf(digits, sizeof digits, "%.17g", x);
  at = strstr(digits, point);
  if (at && strcmp(point, ".") != 0) {
    *at = '.';
    memmove(at + 1, at + strlen(point), strlen(at + strlen(point)) + 1);
  }
  out_word(c, digits);
}

static void out_integer(rmpc_client *c, long long i) {
  char digits[32];
  snprintf(digits, sizeof digits, "%lld", i);
  out_word(c, digits);
}

/* JSON that somebody else wrote, on one line. */
static void out_json(rmpc_client *c, const char *s) {
  const size_t length = s ? strlen(s) : 0;
  size_t i;
  if (length == 0) {
    out_word(c, "null");
    return;
  }
  if (!is_out(c, length)) return;
  for (i = 0; i < length; ++i) c->out[c->out_used++] = s[i] == '\n' || s[i] == '\r' ? ' ' : s[i];
}

static void out_handle(rmpc_client *c, const rmpc_handle *h) {
  out_word(c, "{\"$handle\":{\"kind\":");
  out_text(c, h->kind);
  out_word(c, ",\"number\":");
  out_integer(c, h->number);
  out_word(c, "}}");
}

/* columns = 0: a vector. */
static void out_array(rmpc_client *c, const double *x, size_t rows, size_t columns) {
  static const char kLetters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  size_t count, i, k;
  if (rows > (1u << 28) || columns > (1u << 28) || rows * (columns ? columns : 1) > (1u << 24)) {
    c->out_fault = RMPC_MEMORY;
    return;
  }
  count = rows * (columns ? columns : 1);
  if (count <= FEW) {
    out_word(c, "[");
    for (i = 0; i < rows; ++i) {
      if (i > 0) out_word(c, ",");
      if (!columns) {
        out_number(c, x[i]);
        continue;
      }
      out_word(c, "[");
      for (k = 0; k < columns; ++k) {
        if (k > 0) out_word(c, ",");
        out_number(c, x[i * columns + k]);
      }
      out_word(c, "]");
    }
    out_word(c, "]");
    return;
  }
  out_word(c, "{\"$array\":{\"shape\":[");
  out_integer(c, (long long)rows);
  if (columns) {
    out_word(c, ",");
    out_integer(c, (long long)columns);
  }
  out_word(c, "],\"base64\":\"");
  if (!is_out(c, (count * 8 + 2) / 3 * 4)) return;
  {
    unsigned long bits = 0;
    int held = 0; /* bytes in bits */
    for (i = 0; i < count * 8; ++i) {
      uint64_t raw;
      memcpy(&raw, &x[i / 8], sizeof raw);
      bits = bits << 8 | (unsigned long)(raw >> 8 * (i % 8) & 0xFF);
      if (++held == 3) {
        for (k = 0; k < 4; ++k) c->out[c->out_used++] = kLetters[bits >> (18 - 6 * k) & 63];
        bits = 0;
        held = 0;
      }
    }
    if (held > 0) {
      bits <<= 8 * (3 - held);
      for (k = 0; k < 4; ++k)
        c->out[c->out_used++] = (int)k <= held ? kLetters[bits >> (18 - 6 * k) & 63] : '=';
    }
  }
  out_word(c, "\"}}");
}

/* The beginning of a request, up to its params. */
static void begin_message(rmpc_client *c, const char *method) {
  c->out_used = 0;
  c->out_fault = RMPC_OK;
  c->is_job = 0;
  out_word(c, "{\"jsonrpc\":\"2.0\",\"id\":");
  out_integer(c, ++c->latest_id);
  out_word(c, ",\"method\":");
  out_text(c, method);
  out_word(c, ",\"arrays\":\"base64\",\"params\":");
}

static void cancel(rmpc_client *c, long long id) {
  char line[96];
  const int n = snprintf(line, sizeof line, "{\"jsonrpc\":\"2.0\",\"method\":\"rpc.cancel\",\"params\":{\"request\":%lld}}\n", id);
  if (c->fd >= 0 && n > 0) send_all(c, line, (size_t)n, now() + 1);
}

static rmpc_status finish(rmpc_client *c) {
  const long long id = c->latest_id;
  const double until = c->timeout > 0 ? now() + c->timeout : 0;
  rmpc_status status;
  if (c->is_job) out_word(c, ",\"job\":true,\"progress\":true");
  out_word(c, "}\n");
  c->root = NONE;
  free(c->current);
  c->current = NULL;
  if (c->out_fault == RMPC_USAGE) return fault(c, RMPC_USAGE, "A text of the request is not UTF-8.");
  if (c->out_fault || c->out_used > (size_t)RMPC_LONGEST_REQUEST)
    return fault(c, RMPC_USAGE, "The request takes more than %u MiB. Send it in parts.", RMPC_LONGEST_REQUEST >> 20);
  if (c->fd < 0) return fault(c, RMPC_LOST, "There is no connection.");
  status = send_all(c, c->out, c->out_used, until);
  if (status) return status;
  status = wait_answer(c, id, until, 1);
  if (status == RMPC_TIMEOUT) {
    cancel(c, id);
    if (c->fd < 0) return RMPC_LOST;
    return fault(c, RMPC_TIMEOUT, "No answer came within %g s; the request was cancelled.", c->timeout);
  }
  if (status == RMPC_STOPPED) {
    cancel(c, id);
    if (c->fd >= 0) wait_answer(c, id, now() + 5, 0);
    c->root = NONE;
    return fault(c, RMPC_STOPPED, "The request was cancelled.");
  }
  return status;
}

rmpc_status rmpc_call(rmpc_client *c, const char *method, const char *params) {
  begin_message(c, method);
  if (params && *params) out_json(c, params);
  else out_word(c, "{}");
  return finish(c);
}

rmpc_status rmpc_callf(rmpc_client *c, const char *method, const char *format, ...) {
  va_list args;
  const char *p;
  begin_message(c, method);
  va_start(args, format);
  for (p = format; *p && !c->out_fault; ++p) {
    if (*p == '\'') {
      out_bytes(c, "\"", 1);
      continue;
    }
    if (*p != '%') {
      out_bytes(c, *p == '\n' || *p == '\r' ? " " : p, 1);
      continue;
    }
    switch (*++p) {
      case 's': out_text(c, va_arg(args, const char *)); break;
      case 'd': out_integer(c, va_arg(args, int)); break;
      case 'D': out_integer(c, va_arg(args, long long)); break;
      case 'g': out_number(c, va_arg(args, double)); break;
      case 'b': out_word(c, va_arg(args, int) ? "true" : "false"); break;
      case 'h': out_handle(c, va_arg(args, const rmpc_handle *)); break;
      case 'j': out_json(c, va_arg(args, const char *)); break;
      case '%': out_bytes(c, "%", 1); break;
      case 'v': {
        const double *x = va_arg(args, const double *);
        out_array(c, x, va_arg(args, size_t), 0);
        break;
      }
      case 'm': {
        const double *x = va_arg(args, const double *);
        const size_t rows = va_arg(args, size_t), columns = va_arg(args, size_t);
        out_array(c, x, rows, columns);
        break;
      }
      default:
        va_end(args);
        return fault(c, RMPC_USAGE, "The format of %s has %%%c, which is none of s d D g b v m h j.", method,
                     *p ? *p : '?');
    }
  }
  va_end(args);
  return finish(c);
}

void rmpc_begin(rmpc_client *c, const char *method) {
  begin_message(c, method);
  out_word(c, "{");
  c->is_first_piece = 1;
}

static void out_name(rmpc_client *c, const char *name) {
  if (!c->is_first_piece) out_word(c, ",");
  c->is_first_piece = 0;
  out_text(c, name);
  out_word(c, ":");
}

void rmpc_put_text(rmpc_client *c, const char *name, const char *text) {
  out_name(c, name);
  out_text(c, text);
}
void rmpc_put_number(rmpc_client *c, const char *name, double x) {
  out_name(c, name);
  out_number(c, x);
}
void rmpc_put_integer(rmpc_client *c, const char *name, long long i) {
  out_name(c, name);
  out_integer(c, i);
}
void rmpc_put_flag(rmpc_client *c, const char *name, int flag) {
  out_name(c, name);
  out_word(c, flag ? "true" : "false");
}
void rmpc_put_numbers(rmpc_client *c, const char *name, const double *x, size_t count) {
  out_name(c, name);
  out_array(c, x, count, 0);
}
void rmpc_put_matrix(rmpc_client *c, const char *name, const double *rows_first, size_t rows, size_t columns) {
  out_name(c, name);
  out_array(c, rows_first, rows, columns);
}
void rmpc_put_handle(rmpc_client *c, const char *name, const rmpc_handle *h) {
  out_name(c, name);
  out_handle(c, h);
}
void rmpc_put_json(rmpc_client *c, const char *name, const char *json) {
  out_name(c, name);
  out_json(c, json);
}
void rmpc_as_job(rmpc_client *c) { c->is_job = 1; }

rmpc_status rmpc_send(rmpc_client *c) {
  out_word(c, "}");
  return finish(c);
}

/* --- beginning --- */

rmpc_status rmpc_open(rmpc_client *c, int fd, int is_served, const char *token) {
  const char *word = NULL;
  long long version = 0;
  int flags;
  rmpc_status status;
  if (c->fd >= 0 && c->fd != fd) rmpc_close(c);
  c->fd = fd;
  c->has_spoken = 0;
  c->closing[0] = 0;
  c->in_used = c->in_line = c->in_scanned = 0;
  if (!c->peer[0]) copy_text(c->peer, sizeof c->peer, "The other end");
  flags = fcntl(fd, F_GETFL);
  if (flags < 0 || fcntl(fd, F_SETFL, flags | O_NONBLOCK) < 0 || fcntl(fd, F_SETFD, FD_CLOEXEC) < 0)
    return over(c, fault(c, RMPC_LOST, "%s cannot be used: %s.", c->peer, strerror(errno)));
  if (!is_served) {
    status = rmpc_call(c, "version", NULL);
    if (!status && rmpc_get_text(c, "version", &word))
      status = over(c, fault(c, RMPC_PROTOCOL, "%s is not ROBOMOSP.", c->peer));
  } else {
    rmpc_begin(c, "server.hello");
    rmpc_put_integer(c, "protocol", RMPC_PROTOCOL_VERSION);
    rmpc_put_text(c, "client", "robomosp_client.c");
    if (token) rmpc_put_text(c, "token", token);
    status = rmpc_send(c);
    if (!status && (rmpc_get_text(c, "program", &word) || strcmp(word, "robomosp") != 0))
      status = over(c, fault(c, RMPC_PROTOCOL, "%s is not a ROBOMOSP server.", c->peer));
    else if (!status && (rmpc_get_integer(c, "protocol", &version) || version != RMPC_PROTOCOL_VERSION))
      status = over(c, fault(c, RMPC_PROTOCOL, "%s speaks version %lld of the protocol, and this client version %d.",
                             c->peer, version, RMPC_PROTOCOL_VERSION));
  }
  if (status == RMPC_TIMEOUT)
    return over(c, fault(c, RMPC_TIMEOUT, "%s did not answer within %g s. Is it a ROBOMOSP server?", c->peer, c->timeout));
  if (status == RMPC_REFUSED && strcmp(c->code, "unknown_name") == 0)
    return over(c, fault(c, RMPC_PROTOCOL, "%s is not a ROBOMOSP server.", c->peer));
  if (status) rmpc_close(c);
  return status;
}

/* Connects a socket within the time; 0, or what errno would be. */
static int connect_within(rmpc_client *c, int fd, const struct sockaddr *address, socklen_t length) {
  const int flags = fcntl(fd, F_GETFL);
  short got = 0;
  int why = 0;
  socklen_t size = sizeof why;
  if (flags < 0 || fcntl(fd, F_SETFL, flags | O_NONBLOCK) < 0) return errno;
  if (connect(fd, address, length) == 0) return 0;
  if (errno != EINPROGRESS && errno != EINTR) return errno;
  c->fd = fd;
  if (wait_for(c, POLLOUT, c->timeout > 0 ? now() + c->timeout : 0, &got, 1)) why = ETIMEDOUT;
  else if (getsockopt(fd, SOL_SOCKET, SO_ERROR, &why, &size) < 0) why = errno;
  c->fd = -1;
  return why;
}

static rmpc_status unreachable(rmpc_client *c, const char *why) {
  return fault(c, RMPC_LOST, "%s cannot be reached: %s. Is `robomosp serve` running there?", c->peer, why);
}

rmpc_status rmpc_connect(rmpc_client *c, const char *address, const char *token) {
  int fd = -1, why = 0;
  rmpc_close(c);
  if (c->wants_tls && address && strncmp(address, "unix:", 5) == 0)
    return fault(c, RMPC_USAGE, "A Unix socket has no TLS. Call rmpc_set_tls(c, NULL).");
  if (!address || !*address) return fault(c, RMPC_USAGE, "An address is needed, such as \"127.0.0.1:7007\".");
  copy_text(c->peer, sizeof c->peer, address);
  if (strncmp(address, "unix:", 5) == 0) {
    struct sockaddr_un at;
    memset(&at, 0, sizeof at);
    at.sun_family = AF_UNIX;
    if (!address[5] || strlen(address + 5) >= sizeof at.sun_path)
      return fault(c, RMPC_USAGE, "\"%s\" names no socket, or its path is too long.", address);
    strcpy(at.sun_path, address + 5);
    fd = socket(AF_UNIX, SOCK_STREAM, 0);
    why = fd < 0 ? errno : connect_within(c, fd, (const struct sockaddr *)&at, sizeof at);
    if (why) {
      if (fd >= 0) close(fd);
      return unreachable(c, strerror(why));
    }
  } else {
    char host[256], port[8] = "7007";
    const char *end = address[0] == '[' ? strchr(address, ']') : strchr(address, ':');
    const char *begin = address[0] == '[' ? address + 1 : address;
    const char *colon = address[0] == '[' && end ? end + 1 : end;
    struct addrinfo hints, *all = NULL, *one;
    size_t length = end ? (size_t)(end - begin) : strlen(begin);
    int looked;
    if ((address[0] == '[' && !end) || length == 0 || length >= sizeof host ||
        (colon && *colon && (*colon != ':' || colon[1] == 0 || strlen(colon + 1) > 5 ||
                             strspn(colon + 1, "0123456789") != strlen(colon + 1) || atoi(colon + 1) < 1 ||
                             atoi(colon + 1) > 65535)))
      return fault(c, RMPC_USAGE, "\"%s\" is no address. Give \"host:port\", \"[::1]:7007\" or \"unix:/path\".", address);
    memcpy(host, begin, length);
    host[length] = 0;
    if (colon && *colon) copy_text(port, sizeof port, colon + 1);
    memset(&hints, 0, sizeof hints);
    hints.ai_socktype = SOCK_STREAM;
    looked = getaddrinfo(host, port, &hints, &all);
    if (looked) return unreachable(c, gai_strerror(looked));
    why = ENOENT;
    for (one = all; one; one = one->ai_next) {
      fd = socket(one->ai_family, one->ai_socktype, one->ai_protocol);
      why = fd < 0 ? errno : connect_within(c, fd, one->ai_addr, one->ai_addrlen);
      if (!why) break;
      if (fd >= 0) close(fd);
    }
    freeaddrinfo(all);
    if (why) return unreachable(c, strerror(why));
    {
      const int on = 1;
      setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    }
#ifdef ROBOMOSP_TLS
    if (c->wants_tls) {
      rmpc_status status;
      c->fd = fd;
      status = tls_begin(c, host);
      if (status) return status;
    }
#endif
  }
  return rmpc_open(c, fd, 1, token);
}

rmpc_status rmpc_start(rmpc_client *c, const char *program) {
  int ends[2], told[2], why = 0;
  pid_t child;
  ssize_t n;
  if (!program) program = "robomosp";
  rmpc_close(c);
  copy_text(c->peer, sizeof c->peer, program);
  if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends) < 0) return fault(c, RMPC_LOST, "No socket: %s.", strerror(errno));
  if (pipe(told) < 0) {
    close(ends[0]);
    close(ends[1]);
    return fault(c, RMPC_LOST, "No pipe: %s.", strerror(errno));
  }
  fcntl(ends[0], F_SETFD, FD_CLOEXEC);
  fcntl(told[1], F_SETFD, FD_CLOEXEC);
  child = fork();
  if (child == 0) {
    setsid(); /* Ctrl-C is for us */
    close(told[0]);
    if (dup2(ends[1], 0) >= 0 && dup2(ends[1], 1) >= 0) {
      if (ends[1] > 1) close(ends[1]);
      execlp(program, program, "rpc", (char *)NULL);
    }
    why = errno;
    n = write(told[1], &why, sizeof why);
    _exit(n < 0 ? 126 : 127);
  }
  close(ends[1]);
  close(told[1]);
  if (child < 0) {
    why = errno;
  } else {
    do n = read(told[0], &why, sizeof why);
    while (n < 0 && errno == EINTR);
    if (n != (ssize_t)sizeof why) why = 0;
  }
  close(told[0]);
  if (why) {
    close(ends[0]);
    if (child > 0) waitpid(child, NULL, 0);
    return fault(c, RMPC_LOST, "The program \"%s\" cannot be started: %s.", program, strerror(why));
  }
  c->child = child;
  c->fd = ends[0];
  return rmpc_open(c, ends[0], 0, NULL);
}

/* --- events --- */

rmpc_status rmpc_subscribe(rmpc_client *c, const char *topics, long long *subscription) {
  const char *p = topics ? topics : "";
  rmpc_status status;
  int is_first = 1;
  begin_message(c, "server.subscribe");
  out_word(c, "{");
  p += strspn(p, " ");
  if (*p) {
    char word[32];
    out_word(c, "\"topics\":[");
    while (*p) {
      const size_t n = strcspn(p, " ");
      if (n >= sizeof word) return fault(c, RMPC_USAGE, "\"%s\" are no topics.", topics);
      memcpy(word, p, n);
      word[n] = 0;
      if (!is_first) out_word(c, ",");
      is_first = 0;
      out_text(c, word);
      p += n;
      p += strspn(p, " ");
    }
    out_word(c, "]");
  }
  out_word(c, "}");
  status = finish(c);
  if (status) return status;
  if (rmpc_type_of(c, "") == RMPC_TABLE) return rmpc_get_integer(c, "subscription", subscription);
  return rmpc_get_integer(c, "", subscription);
}

rmpc_status rmpc_poll_event(rmpc_client *c, double seconds) {
  const double until = now() + (seconds > 0 ? seconds : 0) + 1e-9;
  free(c->current);
  c->current = NULL;
  c->root = NONE;
  c->event_name[0] = 0;
  for (;;) {
    char *line = NULL;
    size_t length = 0;
    short got = 0;
    int is_answer;
    rmpc_status status;
    while (c->first) {
      event *e = c->first;
      size_t method;
      c->first = e->next;
      if (!c->first) c->last = NULL;
      c->event_bytes -= e->length + sizeof *e;
      c->current = e;
      if (!parse(c, e->text, e->length)) {
        method = field(c, 0, "method");
        if (method != NONE && c->nodes[method].type == RMPC_TEXT &&
            strcmp(c->text + c->nodes[method].start, "server.closing") != 0) {
          copy_text(c->event_name, sizeof c->event_name, c->text + c->nodes[method].start);
          c->root = field(c, 0, "params");
          return RMPC_OK;
        }
      }
      free(e);
      c->current = NULL;
      c->root = NONE;
    }
    if (c->fd < 0) return fault(c, RMPC_LOST, "There is no connection.");
    status = next_line(c, &line, &length);
    if (status == RMPC_OK) {
      status = take_line(c, line, length, -1, &is_answer);
      c->root = NONE;
      if (status && status != RMPC_REFUSED) return status;
      continue;
    }
    status = wait_for(c, POLLIN, until, &got, 1);
    if (status == RMPC_TIMEOUT) return fault(c, RMPC_TIMEOUT, "Nothing happened.");
    if (status) return fault(c, status, "The wait was stopped.");
    status = receive(c);
    if (status) return status;
  }
}

const char *rmpc_event_name(const rmpc_client *c) { return c->event_name; }

size_t rmpc_events_left_out(rmpc_client *c) {
  const size_t n = c->left_out;
  c->left_out = 0;
  return n;
}
